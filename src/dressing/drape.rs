//! The first drape: extended position-based dynamics in small steps (Macklin et al. 2016, 2019) on a coarse mesh.
//!
//! Putting on is not dynamics: cloth starts centimetres from where it ends and may slide freely over the skin. Contact is
//! a projection out of a plane per vertex, so nothing sticks, and what the coarse mesh cannot show is added on the fine
//! one in a few steps more. The simulator that follows starts from cloth at rest.

use super::hood::Hood;
use super::plane::Plane;
use super::skin::Skin;
use crate::cloth::AnchorBinding;
use crate::cloth::Sheet;
use crate::cloth::repair::sleeve_rings::Sleeve;
use crate::cloth::repair::untangler::Untangler;
use crate::contact::{Part, SurfaceFrame, SurfaceModel};
use crate::garment::{GarmentError, GarmentMesh, Region};
use crate::math::{P3, V3, V3d};
use crate::mesh::distances;
use crate::par::Par;

/// One garment being draped.
#[derive(Debug)]
pub(super) struct Drape {
    /// Positions, world, metres.
    pub(super) x: Vec<V3d>,
    velocity: Vec<V3d>,
    inverse_mass: Vec<f64>,
    /// Ends, rest length, compliance.
    edges: Vec<([u32; 2], f64, f64)>,
    hinges: Vec<([u32; 4], [f64; 4], f64)>,
    own: Vec<u8>,
    sleeves: Vec<Sleeve>,
    /// Skin keeps it from sliding up: around the trunk, away from the sleeves.
    held_down: Vec<bool>,
    /// Nearest body vertex among the own parts, then among the others.
    pub(super) nearest: Vec<[u32; 2]>,
    planes: Vec<[Plane; 2]>,
    /// Nearest vertex of every garment further out, shape `[garments][vertices]`.
    nearest_cover: Vec<Vec<u32>>,
    /// Vertices that an outer garment covers, and the plane each stays under.
    covers: Vec<(u32, Plane)>,
    pinned: Vec<Option<V3d>>,
    before: Vec<V3d>,
    /// What skin gives way by, where cloth has no room between skins, metres.
    slack: Vec<f64>,
    /// Where the sheet is to be taken out of itself.
    sheet: Option<Untangler>,
    /// What is to be held off itself.
    hood: Option<Hood>,
    /// How often it passed through itself when that was last looked for.
    crossings: usize,
    /// It comes from a coarser drape of the same garment.
    fine: bool,
    /// It was ironed, and what came free is pressed together.
    pressed: bool,
    /// Substeps so far.
    pub(super) steps: usize,
}

/// Between what a garment is draped.
#[derive(Clone, Copy, Debug)]
pub(super) struct On<'a> {
    pub(super) skin: &'a Skin<'a>,
    /// Distance from the skin, metres.
    pub(super) offset: f64,
    /// Garments further out.
    over: &'a [Cover],
}

/// A garment that others are worn under.
#[derive(Debug)]
struct Cover {
    model: SurfaceModel,
    frame: SurfaceFrame,
}

/// Garments being draped together, innermost first: each is kept under those further out.
#[derive(Debug, Default)]
pub(super) struct Layers {
    pub(super) drapes: Vec<Drape>,
    covers: Vec<Cover>,
}

impl Layers {
    pub(super) fn new(meshes: &[GarmentMesh], drapes: Vec<Drape>) -> Result<Self, GarmentError> {
        let cover = |m: &GarmentMesh| {
            let parts = m.regions.iter().map(|r| r.decisive().0).collect();
            Ok(Cover {
                model: SurfaceModel::new(m.faces.clone(), m.topology()?, parts),
                frame: SurfaceFrame::default(),
            })
        };
        Ok(Self {
            covers: meshes
                .iter()
                .map(cover)
                .collect::<Result<_, GarmentError>>()?,
            drapes,
        })
    }
    /// Does the same to all garments, the outermost first; `offsets` from the skin, metres.
    pub(super) fn each(
        &mut self,
        skin: &Skin<'_>,
        offsets: &[f64],
        mut f: impl FnMut(usize, &mut Drape, &On<'_>),
    ) {
        for (k, drape) in self.drapes.iter_mut().enumerate().rev() {
            let (under, over) = self.covers.split_at_mut(k + 1);
            f(
                k,
                drape,
                &On {
                    skin,
                    offset: offsets[k],
                    over,
                },
            );
            under[k].frame.vertices = drape.positions();
            under[k]
                .model
                .update_normals(Par::Rayon, &mut under[k].frame);
        }
    }
}

/// Gravity, m/s².
const GRAVITY: f64 = 9.81;
/// Share of the membrane stiffness that an edge of a hexagonal lattice of springs carries (√3/2).
const LATTICE: f64 = 0.866;
/// Planes further away than this are left alone, metres.
const REACH: f64 = 0.10;
/// A plane says nothing about places further from its point than this, metres.
const PLANE_SIZE: f64 = 0.10;
/// Substeps between two searches for the nearest skin: cloth at 1 m/s moves 1.6 cm at 2 ms.
const LOOK_EVERY: usize = 8;
/// Substeps between two looks at how near a hood is to itself.
const HOOD_EVERY: usize = 4;
/// Speed of a fine sheet that was ironed at most, m/s: what was pressed together to come free springs back at 2 m/s, and
/// through itself.
const PRESSED_FASTEST: f64 = 0.3;
/// Passes over the edges a substep. With one, trousers of 40 rows hung a tenth too long.
const SWEEPS: usize = 4;
/// Further than this outside an outer garment a vertex has nothing to do with it, metres: a bell of a skirt stands out
/// less, the other side of the body lies further.
const COVER_REACH: f32 = 0.15;
/// An inner garment may stand out from under a hem as far as it is below it, up to this distance, metres: an edge
/// of the coarse mesh (at most 45 mm), whose triangles cross the hem.
const HEM: f32 = 0.05;
/// Distance that cloth keeps under an outer garment, metres: a little more than the 2.5 mm between two layers on the skin.
const UNDER: f64 = 0.003;
/// Rate at which draping takes speed away, 1/s: a skirt swings out in a quarter of a second.
const DAMPING: f64 = 5.0;
/// No cloth falls faster while it is put on, m/s.
const FASTEST: f64 = 2.0;
/// Skin nearer than this carries cloth along when the body moves, metres; it fades to nothing at twice that.
const CARRIED: f64 = 0.04;
/// The same for sleeves: of a wide one the arm slipped out when the elbow bent, and it hung empty.
const CARRIED_SLEEVE: f64 = 0.07;
/// Cloth slides freely down and around, for who puts it on pulls it there; upwards skin holds what goes around the trunk
/// with this coefficient of friction. Without, tight hems rolled up to the neck.
const HELD_DOWN: f64 = 0.5;
/// Not so near to a sleeve, metres of cloth: held there too, an arm that is lowered stretches it (p99 0.34 instead of 0.05
/// on a T-shirt that fits).
const SLEEVE: f64 = 0.15;
/// Nor so near to the shoulders, metres of cloth: armholes without a sleeve are within 24 cm.
const TOP: f64 = 0.34;
/// Parts that cloth around the trunk touches.
const AROUND: Region = Region::TRUNK.with(Region::LEFT_LEG).with(Region::RIGHT_LEG);
/// Most that one lift out of the body may move a vertex, metres: deeper ones come out over several substeps.
const LIFT: f64 = 0.01;

/// Skin that lies deeper than this in other skin holds no cloth, metres.
const CLOSED: f64 = 0.03;
/// Most that a round of untangling moves an edge against a triangle, metres. With a third of it what came in one body on the
/// way was not gone in the next.
const APART_STEP: f64 = 0.003;
/// Distance that vertices which were on the wrong side are put at, metres.
const APART_GAP: f64 = 0.001;
/// Skin gives way to cloth that passes through itself, by so much more a round and at most to the skin itself, metres: where
/// two layers press on each other their distance from the skin is the only room there is. Cloth that does not is let sink less by
/// this share a round.
const SLACK_STEP: f64 = 0.001;
const SLACK: f64 = 0.005;
const SLACK_KEPT: f64 = 0.98;
/// While it is untangled cloth takes its lengths and leaves the skin in every other round only, as both may cross it anew.
const RELAX_EVERY: usize = 2;
/// For so many rounds.
const RELAXED: usize = 10;
/// Rounds without fewer crossings after which it is ironed, and how often before no more are made. A hood folds over
/// itself in three layers, and none of them is on the wrong side.
const STUCK: usize = 16;
const IRONINGS: usize = 4;
/// In the others it may sink so deep into the skin, metres: deeper, and skin shows in the armpits of a heavy man.
const SUNK: f64 = 0.002;
/// At the end nothing is left deeper than this, metres: a millimetre more than it may sink while it is untangled.
const DEEP: f64 = 0.003;
/// And edges are only kept from this times their length: a hood in folds on the neck was not free before it was
/// stretched by 19 % (p99).
const TAUT: f64 = 1.07;
/// As if in a step of so many seconds.
const RELAX_STEP: f64 = 1e-3;

/// Cloth that belongs to arms alone: a sleeve.
fn on_arms(own: Part) -> bool {
    own & !Region::ARMS.0 == 0
}

impl Drape {
    pub(super) fn new(mesh: &GarmentMesh, sheet: &Sheet, x: Vec<P3>) -> Self {
        let n = x.len();
        let by_height = |v: &[u32; 2]| x[v[0] as usize].y + x[v[1] as usize].y;
        let mut order: Vec<usize> = (0..sheet.edges.len()).collect();
        // From top to bottom, so that one pass hands a pull down the whole garment.
        order.sort_by(|a, b| {
            by_height(&sheet.edges[*b].0)
                .total_cmp(&by_height(&sheet.edges[*a].0))
                .then(a.cmp(b))
        });
        let membrane = LATTICE * (mesh.material.stretch_warp * mesh.material.stretch_weft).sqrt();
        let edges = order
            .iter()
            .map(|k| (sheet.edges[*k].0, sheet.edges[*k].1, 1.0 / membrane))
            .collect();
        let own: Vec<u8> = mesh.regions.iter().map(|r| r.decisive().0).collect();
        let from_sleeve = distances(n, &sheet.edges, SLEEVE, |i| {
            mesh.regions[i].meets(Region::ARMS)
        });
        let soft = mesh
            .anchors
            .iter()
            .filter(|a| a.strength < 1.0)
            .flat_map(|a| &a.vertices);
        let tops: std::collections::BTreeSet<u32> = soft.copied().collect();
        let from_top = distances(n, &sheet.edges, TOP, |i| tops.contains(&(i as u32)));
        Self {
            held_down: (0..n)
                .map(|i| own[i] == AROUND.0 && from_sleeve[i] > SLEEVE && from_top[i] > TOP)
                .collect(),
            velocity: vec![V3d::zeros(); n],
            inverse_mass: sheet.mass.iter().map(|m| 1.0 / m).collect(),
            edges,
            hinges: sheet
                .hinges
                .iter()
                .filter(|h| h.w > 0.0)
                .map(|h| (h.v, h.c, 1.0 / h.w))
                .collect(),
            own,
            sleeves: Sleeve::find(mesh, &sheet.edges),
            nearest: vec![[u32::MAX; 2]; n],
            planes: vec![[Plane::default(); 2]; n],
            nearest_cover: Vec::new(),
            covers: Vec::new(),
            pinned: vec![None; n],
            before: Vec::new(),
            slack: vec![0.0; n],
            crossings: 0,
            fine: false,
            pressed: false,
            steps: 0,
            sheet: None,
            hood: None,
            x: x.iter().map(|p| p.coords.cast()).collect(),
        }
    }
    /// From now on the sheet is taken out of itself, and a hood held off it.
    pub(super) fn untangled(
        mut self,
        mesh: &GarmentMesh,
        sheet: &Sheet,
    ) -> Result<Self, GarmentError> {
        self.sheet = Some(Untangler::new(&mesh.faces, &self.x));
        self.hood = Hood::of(mesh, sheet)?;
        Ok(self)
    }
    /// Positions as f32.
    pub(super) fn positions(&self) -> Vec<P3> {
        self.x.iter().map(|p| P3::from(p.cast::<f32>())).collect()
    }
    /// First search: all body vertices.
    pub(super) fn find_all(&mut self, skin: &Skin<'_>) {
        let (points, other) = (
            self.positions(),
            self.own
                .iter()
                .map(|o| Region::ALL.0 & !o)
                .collect::<Vec<_>>(),
        );
        let of = |masks: &[u8]| {
            skin.model
                .nearest_vertices(Par::Rayon, skin.frame(), &points, masks.iter())
        };
        self.nearest = of(&self.own)
            .into_iter()
            .zip(of(&other))
            .map(|(own, other)| [own, other])
            .collect();
    }
    /// Starts from the nearest body vertices of a coarser drape of the same garment.
    pub(super) fn find_from(&mut self, skin: &Skin<'_>, coarse: &Self) {
        self.fine = true;
        for (i, near) in self.nearest.iter_mut().enumerate() {
            let d = |k: usize| (coarse.x[k] - self.x[i]).norm_squared();
            let k = (0..coarse.x.len())
                .min_by(|a, b| d(*a).total_cmp(&d(*b)))
                .unwrap_or(0);
            *near = coarse.nearest[k];
            // A walk may not leave its parts: where the coarse vertex belongs to others, all are looked at.
            for (slot, mask) in near
                .iter_mut()
                .zip([self.own[i], Region::ALL.0 & !self.own[i]])
            {
                if skin.model.part(*slot) & mask == 0 {
                    *slot = skin.model.nearest_vertex(
                        skin.frame(),
                        &P3::from(self.x[i].cast::<f32>()),
                        mask,
                    );
                }
            }
        }
    }
    /// Ties anchors to where they are on the body of `frame`.
    pub(super) fn pin(&mut self, anchors: &[AnchorBinding], frame: &SurfaceFrame) {
        self.pinned.iter_mut().for_each(|p| *p = None);
        for a in anchors.iter().filter(|a| a.strength >= 1.0) {
            let [p, q, r] = a.body.map(|v| frame.vertices[v as usize].coords);
            let on = p * a.weights[0] + q * a.weights[1] + r * a.weights[2];
            let normal = (q - p)
                .cross(&(r - p))
                .try_normalize(0.0)
                .unwrap_or_else(V3::zeros);
            self.pinned[a.vertex as usize] = Some((on + normal * a.height).cast());
        }
    }
    /// Moves cloth near the skin along with a body that goes from `from` to `to`.
    pub(super) fn carry(&mut self, from: &[P3], to: &[P3]) {
        for ((x, near), own) in self.x.iter_mut().zip(&self.nearest).zip(&self.own) {
            let v = near[0] as usize;
            let d = (from[v].coords.cast::<f64>() - *x).norm();
            let within = if on_arms(*own) {
                CARRIED_SLEEVE
            } else {
                CARRIED
            };
            let share = (2.0 - d / within).clamp(0.0, 1.0);
            *x += (to[v] - from[v]).cast::<f64>() * share;
        }
    }
    /// Puts rings of sleeves that lost their arm around it again.
    pub(super) fn put_back(&mut self, skin: &Skin<'_>) {
        let lines = skin.arm_lines();
        let at = |v: u32| P3::from(self.x[v as usize].cast::<f32>());
        let ways: Vec<(u32, P3)> = self
            .sleeves
            .iter()
            .flat_map(|s| s.lost_rings(&lines, at))
            .flat_map(|f| f.vertices.iter().map(move |v| (*v, f.recovery * at(*v))))
            .collect();
        for (v, to) in ways {
            let i = v as usize;
            self.x[i] = to.coords.cast();
            self.velocity[i] = V3d::zeros();
            self.nearest[i][0] = skin.model.nearest_vertex(skin.frame(), &to, self.own[i]);
        }
    }
    /// Takes all speed away.
    pub(super) fn stop(&mut self) {
        self.velocity.iter_mut().for_each(|v| *v = V3d::zeros());
    }
    /// `steps` substeps of `h` seconds on a body that stands still, `offset` metres off its skin and under the garments
    /// `over` it, which stand still too. `weight` scales gravity: the first steps of sewing close gaps before anything
    /// falls.
    pub(super) fn run(&mut self, on: &On<'_>, steps: usize, h: f64, weight: f64) {
        let keep = (-DAMPING * h).exp();
        let fall = V3d::new(0.0, -GRAVITY * weight * h * h, 0.0);
        self.steps += steps;
        for s in 0..steps {
            if s % LOOK_EVERY == 0 {
                self.look(on);
            }
            self.before.clone_from(&self.x);
            for i in 0..self.x.len() {
                match self.pinned[i] {
                    Some(p) => self.x[i] = p,
                    None => self.x[i] += self.velocity[i] * (h * keep) + fall,
                }
            }
            for sweep in 0..SWEEPS {
                self.stretch(h, (s + sweep) % 2 == 1);
            }
            self.bend(h);
            self.hold_hood(s % HOOD_EVERY == 0, h);
            if self.fine && self.pressed {
                self.slow_down(PRESSED_FASTEST * h);
            }
            self.lift(0.0);
            let anew = s % LOOK_EVERY == 0;
            if (weight >= 1.0 || self.hood.is_some()) && (anew || self.crossings > 0 && s % 2 == 0)
            {
                self.untangle(anew);
            }
            for i in 0..self.x.len() {
                let v = (self.x[i] - self.before[i]) / h;
                let speed = v.norm();
                self.velocity[i] = if speed > FASTEST {
                    v * (FASTEST / speed)
                } else {
                    v
                };
            }
        }
    }
    /// Holds a hood off itself; `anew` looks where it is near.
    fn hold_hood(&mut self, anew: bool, h: f64) {
        let Some(hood) = &mut self.hood else { return };
        if anew {
            let pushes = self.sheet.as_ref().map_or(&[][..], |s| &s.displacements);
            hood.look(&self.x, |v| {
                pushes.get(v as usize).is_some_and(|p| p.1 > 0.0)
            });
        }
        let (pinned, inverse) = (&self.pinned, &self.inverse_mass);
        let weight = |v: u32| {
            if pinned[v as usize].is_some() {
                0.0
            } else {
                inverse[v as usize]
            }
        };
        hood.hold(&mut self.x, &self.before, weight, h);
    }
    /// One round of taking the sheet out of itself, which gives no speed; `anew` looks everywhere, else where it crossed
    /// itself in the last rounds.
    fn untangle(&mut self, anew: bool) {
        let Some(sheet) = &mut self.sheet else { return };
        if anew {
            sheet.invalidate();
        }
        let (pinned, inverse) = (&self.pinned, &self.inverse_mass);
        let weight = |i: usize| if pinned[i].is_some() { 0.0 } else { inverse[i] };
        let r = sheet.iterate(Par::Rayon, &mut self.x, weight, APART_STEP, APART_GAP);
        self.crossings = r.intersections;
        for (i, (push, n)) in sheet.displacements.iter().enumerate() {
            self.before[i] += push;
            self.slack[i] = if *n > 0.0 {
                (self.slack[i] + SLACK_STEP).min(SLACK)
            } else {
                self.slack[i] * SLACK_KEPT
            };
        }
    }
    /// Nothing moves further than `most` in this substep, metres.
    fn slow_down(&mut self, most: f64) {
        for (x, before) in self.x.iter_mut().zip(&self.before) {
            *x = before + (*x - before).cap_magnitude(most);
        }
    }
    /// Takes the sheet out of itself in at most `most` rounds, on a body that stands still, and takes all speed away if it
    /// crossed itself. After [`RELAXED`] of them only edges that are about to tear and skin far above it move it. Where that
    /// leads no further it is ironed, each time in a wider circle. Says how often it passes through itself still.
    pub(super) fn clear(&mut self, on: &On<'_>, most: usize) -> usize {
        let (mut fewest, mut since, mut ironed) = (usize::MAX, 0, 0);
        for k in 0..most {
            self.before.clone_from(&self.x);
            self.untangle(k % LOOK_EVERY == 0);
            if self.crossings == 0 {
                break;
            }
            if self.crossings < fewest {
                (fewest, since) = (self.crossings, k);
            }
            if k - since > STUCK {
                if ironed == IRONINGS {
                    break;
                }
                (ironed, since) = (ironed + 1, k);
                self.pressed = true;
                if let Some(sheet) = &self.sheet {
                    // Ironed, a sleeve comes through the arm.
                    let (pinned, own) = (&self.pinned, &self.own);
                    let movable = |v: usize| pinned[v].is_none() && !on_arms(own[v]);
                    sheet.smooth_locally(
                        &mut self.x,
                        sheet.intersecting().collect(),
                        movable,
                        ironed,
                    );
                }
            }
            if k % LOOK_EVERY == 0 {
                self.look(on);
            }
            if k >= RELAXED {
                self.rein_in();
                self.lift(SUNK);
            } else if k % RELAX_EVERY == 0 {
                for backwards in [false, true] {
                    self.stretch(RELAX_STEP, backwards);
                }
                self.lift(0.0);
            }
            self.stop();
        }
        self.crossings
    }
    /// Cloth that is left deep under the skin goes to the skin. Between toes it is lifted from one into the next.
    pub(super) fn lift_deep(&mut self, skin: &Skin<'_>) {
        for i in 0..self.x.len() {
            let p = P3::from(self.x[i].cast::<f32>());
            let c = skin.closest(&p, self.nearest[i][0], self.own[i]);
            if f64::from(c.signed_distance) < -DEEP
                && !c.on_part_boundary
                && !skin.is_interior(&c)
                && self.pinned[i].is_none()
            {
                self.x[i] = c.point.coords.cast();
            }
        }
    }
    /// Where it passed through itself in the last round there is cloth that is on no arm.
    pub(super) fn crosses_off_arms(&self) -> bool {
        let crosses = |s: &Untangler| {
            s.displacements
                .iter()
                .zip(&self.own)
                .any(|((_, n), own)| *n > 0.0 && !on_arms(*own))
        };
        self.crossings > 0 && self.sheet.as_ref().is_some_and(crosses)
    }
    fn weight(&self, i: u32) -> f64 {
        if self.pinned[i as usize].is_some() {
            0.0
        } else {
            self.inverse_mass[i as usize]
        }
    }
    /// Edges keep their lengths; every other sweep runs backwards, so that no direction is preferred.
    fn stretch(&mut self, h: f64, backwards: bool) {
        let n = self.edges.len();
        for k in 0..n {
            let (ends, rest, compliance) = self.edges[if backwards { n - 1 - k } else { k }];
            self.bring_to(ends, rest, 0.0, compliance / (h * h));
        }
    }
    /// Edges that are stretched by more than [`TAUT`] are drawn together to that.
    fn rein_in(&mut self) {
        for k in 0..self.edges.len() {
            let (ends, rest, _) = self.edges[k];
            self.bring_to(ends, TAUT * rest, TAUT * rest, 0.0);
        }
    }
    /// Brings an edge that is longer than `least` towards a length; `give`: compliance over the square of the step, 1/kg.
    fn bring_to(&mut self, [a, b]: [u32; 2], to: f64, least: f64, give: f64) {
        let (wa, wb) = (self.weight(a), self.weight(b));
        let d = self.x[a as usize] - self.x[b as usize];
        let length = d.norm();
        let w = wa + wb;
        if w > 0.0 && length > least {
            let push = d * ((length - to) / (length * (w + give)));
            self.x[a as usize] -= push * wa;
            self.x[b as usize] += push * wb;
        }
    }
    /// Hinges flatten: the constraint is the vector Σ cₖ xₖ = 0 (quadratic bending).
    fn bend(&mut self, h: f64) {
        for k in 0..self.hinges.len() {
            let (v, c, compliance) = self.hinges[k];
            let q = (0..4).fold(V3d::zeros(), |s, k| s + self.x[v[k] as usize] * c[k]);
            let w = v.map(|i| self.weight(i));
            let sum: f64 = (0..4).map(|k| w[k] * c[k] * c[k]).sum();
            if sum == 0.0 {
                continue;
            }
            let push = q / (sum + compliance / (h * h));
            for k in 0..4 {
                self.x[v[k] as usize] -= push * (w[k] * c[k]);
            }
        }
    }
    /// Under the covers, then out of the body, whose planes of the vertex's own parts come last.
    /// Cloth that passed through itself may be `sunk` under the skin, metres.
    fn lift(&mut self, sunk: f64) {
        for k in 0..self.covers.len() {
            let (i, p) = self.covers[k];
            self.out_of(i as usize, &p, sunk);
        }
        for i in 0..self.x.len() {
            let [own, other] = self.planes[i];
            let pushed = self.out_of(i, &other, sunk) + self.out_of(i, &own, sunk);
            let up = self.x[i].y - self.before[i].y;
            if pushed > 0.0 && up > 0.0 && self.held_down[i] && self.pinned[i].is_none() {
                self.x[i].y -= up.min(HELD_DOWN * pushed);
            }
        }
    }
    /// Lifts a vertex above a plane, and says how far.
    fn out_of(&mut self, i: usize, p: &Plane, sunk: f64) -> f64 {
        let d = self.x[i] - p.point;
        let slack = self.slack[i];
        let height = p.height
            - if slack > 0.0 {
                (slack + sunk).min((p.height + sunk).max(0.0))
            } else {
                0.0
            };
        let gap = p.normal.dot(&d) - height;
        if p.near && gap < 0.0 && d.norm_squared() < PLANE_SIZE * PLANE_SIZE {
            let push = (-gap).min(LIFT);
            self.x[i] += p.normal * push;
            return push;
        }
        0.0
    }
    fn look(&mut self, on: &On<'_>) {
        let skin = on.skin;
        for i in 0..self.x.len() {
            let p = P3::from(self.x[i].cast::<f32>());
            let near = &mut self.nearest[i];
            let masks = [self.own[i], Region::ALL.0 & !self.own[i]];
            let mut found = [
                skin.model
                    .closest_across_parts(skin.frame(), &p, near[0], masks[0]),
                skin.model.closest(skin.frame(), &p, near[1], masks[1]),
            ];
            if self.fine {
                found = skin.nearer(&p, found, masks);
            }
            *near = found.map(|c| c.vertex);
            // Where the body closes on itself its own part decides, and skin inside the body holds nothing.
            let facing = found[0]
                .clearance_to(&found[1])
                .filter(|_| !found[1].on_part_boundary)
                .map(f64::from);
            let room = facing.unwrap_or(f64::INFINITY);
            for (plane, c) in self.planes[i].iter_mut().zip(&found) {
                *plane = Plane {
                    point: c.point.coords.cast(),
                    normal: c.normal.cast(),
                    height: on.offset,
                    near: room >= 0.0
                        && !c.on_part_boundary
                        && !skin.is_interior(c)
                        && f64::from(c.signed_distance) < REACH,
                };
            }
            let [own, other] = &mut self.planes[i];
            if self.fine
                && self.sheet.is_some()
                && (-CLOSED..0.0).contains(&room)
                && !found[0].on_part_boundary
            {
                // No deeper than half-way into skin that lies in other skin; coarse cloth needs its way out through it.
                let held = !skin.is_interior(&found[0]);
                (own.near, own.height) = (
                    held && f64::from(found[0].signed_distance) < REACH,
                    0.5 * room,
                );
            }
            let far = found.map(|c| f64::from(c.signed_distance));
            let halved = self.sheet.is_some() && facing.is_some() && own.near && other.near;
            let kept = halved && own.keep_half(other, &self.x[i], far, room);
            other.near &= kept || room >= 2.0 * on.offset;
        }
        self.look_up(on.over);
    }
    /// Which garments lie over which vertices.
    fn look_up(&mut self, over: &[Cover]) {
        self.covers.clear();
        for (k, cover) in over.iter().enumerate() {
            if self.nearest_cover.len() <= k {
                let nearest = |(x, own): (&V3d, &u8)| {
                    cover
                        .model
                        .nearest_vertex(&cover.frame, &P3::from(x.cast::<f32>()), *own)
                };
                self.nearest_cover
                    .push(self.x.iter().zip(&self.own).map(nearest).collect());
            }
            for (i, near) in self.nearest_cover[k].iter_mut().enumerate() {
                let p = P3::from(self.x[i].cast::<f32>());
                let c = cover.model.closest(&cover.frame, &p, *near, self.own[i]);
                *near = c.vertex;
                let Some(c) = cover.model.cover(&cover.frame, &p, &c, HEM) else {
                    continue;
                };
                if c.signed_distance < COVER_REACH
                    && -f64::from(c.signed_distance) < REACH
                    && self.pinned[i].is_none()
                {
                    let (point, normal) = (c.point.coords.cast(), -c.normal.cast::<f64>());
                    self.covers.push((
                        i as u32,
                        Plane {
                            point,
                            normal,
                            height: UNDER,
                            near: true,
                        },
                    ));
                }
            }
        }
    }
    /// Deepest vertex below its layer's height over the own parts, metres, and the stretch of the edges: 99th
    /// percentile and largest.
    pub(super) fn judge(&self, skin: &Skin<'_>) -> (f64, f64, f64) {
        let mut deepest = 0.0f64;
        for i in 0..self.x.len() {
            let p = P3::from(self.x[i].cast::<f32>());
            let c = skin.closest(&p, self.nearest[i][0], self.own[i]);
            if !c.on_part_boundary && !skin.is_interior(&c) {
                deepest = deepest.max(-f64::from(c.signed_distance));
            }
        }
        let mut strain: Vec<f64> = self
            .edges
            .iter()
            .map(|([a, b], l, _)| (self.x[*a as usize] - self.x[*b as usize]).norm() / l - 1.0)
            .collect();
        strain.sort_unstable_by(f64::total_cmp);
        let at = |q: f64| {
            strain
                .get(((strain.len() as f64 * q) as usize).min(strain.len().saturating_sub(1)))
                .copied()
        };
        (deepest, at(0.99).unwrap_or(0.0), at(1.0).unwrap_or(0.0))
    }
}

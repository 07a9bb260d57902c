//! The first drape: extended position-based dynamics in small steps (Macklin et al. 2016, 2019) on a coarse mesh.
//!
//! Putting on is not dynamics: cloth starts centimetres from where it ends and may slide freely over the skin. Contact is
//! a projection out of a plane per vertex, so nothing sticks, and what the coarse mesh cannot show is added on the fine
//! one in a few steps more. The simulator that follows starts from cloth at rest.

use crate::cloth::Sheet;
use crate::cloth::realtime::AnchorBinding;
use crate::contact::{Closest, SurfaceFrame, SurfaceModel};
use crate::garment::{GarmentMesh, Region};
use crate::math::{P3, V3, V3d};
use crate::mesh::Csr;

/// A plane a vertex stays above.
#[derive(Clone, Copy, Debug, Default)]
struct Plane {
    point: V3d,
    normal: V3d,
    height: f64,
    near: bool,
}

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
    /// Nearest body vertex among the own parts, then among the others.
    pub(super) nearest: Vec<[u32; 2]>,
    planes: Vec<[Plane; 2]>,
    pinned: Vec<Option<V3d>>,
    before: Vec<V3d>,
}

/// What cloth is draped on: the skin and how far each body vertex's outermost layer stands off it, metres.
#[derive(Debug)]
pub(super) struct Skin<'a> {
    pub(super) model: &'a SurfaceModel,
    pub(super) neighbours: &'a Csr,
    pub(super) frame: SurfaceFrame,
    /// Height over each body vertex that the next garment keeps, metres.
    pub(super) height: Vec<f32>,
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
/// Passes over the edges a substep. With one, trousers of 40 rows hung a tenth too long.
const SWEEPS: usize = 4;
/// Rate at which draping takes speed away, 1/s: a skirt swings out in a quarter of a second.
const DAMPING: f64 = 5.0;
/// No cloth falls faster while it is put on, m/s.
const FASTEST: f64 = 2.0;
/// Skin nearer than this carries cloth along when the body moves, metres; it fades to nothing at twice that.
const CARRIED: f64 = 0.04;
/// Most that one lift out of the body may move a vertex, metres: deeper ones come out over several substeps.
const LIFT: f64 = 0.01;

impl Drape {
    pub(super) fn new(mesh: &GarmentMesh, sheet: &Sheet, x: Vec<P3>) -> Self {
        let n = x.len();
        let by_height = |v: &[u32; 2]| x[v[0] as usize].y + x[v[1] as usize].y;
        let mut order: Vec<usize> = (0..sheet.edges.len()).collect();
        // From top to bottom, so that one pass hands a pull down the whole garment.
        order.sort_by(|a, b| by_height(&sheet.edges[*b].0).total_cmp(&by_height(&sheet.edges[*a].0)).then(a.cmp(b)));
        let membrane = LATTICE * (mesh.material.stretch_warp * mesh.material.stretch_weft).sqrt();
        let edges = order.iter().map(|k| (sheet.edges[*k].0, sheet.edges[*k].1, 1.0 / membrane)).collect();
        Self {
            velocity: vec![V3d::zeros(); n],
            inverse_mass: sheet.mass.iter().map(|m| 1.0 / m).collect(),
            edges,
            hinges: sheet.hinges.iter().filter(|h| h.w > 0.0).map(|h| (h.v, h.c, 1.0 / h.w)).collect(),
            own: mesh.regions.iter().map(|r| r.0).collect(),
            nearest: vec![[u32::MAX; 2]; n],
            planes: vec![[Plane::default(); 2]; n],
            pinned: vec![None; n],
            before: Vec::new(),
            x: x.iter().map(|p| p.coords.cast()).collect(),
        }
    }
    /// Positions as f32.
    pub(super) fn positions(&self) -> Vec<P3> {
        self.x.iter().map(|p| P3::from(p.cast::<f32>())).collect()
    }
    /// First search: all body vertices.
    pub(super) fn find_all(&mut self, skin: &Skin<'_>) {
        for (i, near) in self.nearest.iter_mut().enumerate() {
            let p = P3::from(self.x[i].cast::<f32>());
            *near = [self.own[i], Region::ALL.0 & !self.own[i]].map(|m| skin.model.nearest_vertex(&skin.frame, &p, m));
        }
    }
    /// Starts from the nearest body vertices of a coarser drape of the same garment.
    pub(super) fn find_from(&mut self, skin: &Skin<'_>, coarse: &Self) {
        for (i, near) in self.nearest.iter_mut().enumerate() {
            let d = |k: usize| (coarse.x[k] - self.x[i]).norm_squared();
            let k = (0..coarse.x.len()).min_by(|a, b| d(*a).total_cmp(&d(*b))).unwrap_or(0);
            *near = coarse.nearest[k];
            // A walk may not leave its parts: where the coarse vertex belongs to others, all are looked at.
            for (slot, mask) in near.iter_mut().zip([self.own[i], Region::ALL.0 & !self.own[i]]) {
                if skin.model.part(*slot) & mask == 0 {
                    *slot = skin.model.nearest_vertex(&skin.frame, &P3::from(self.x[i].cast::<f32>()), mask);
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
            let normal = (q - p).cross(&(r - p)).try_normalize(0.0).unwrap_or_else(V3::zeros);
            self.pinned[a.vertex as usize] = Some((on + normal * a.height).cast());
        }
    }
    /// Moves cloth near the skin along with a body that goes from `from` to `to`.
    pub(super) fn carry(&mut self, from: &[P3], to: &[P3]) {
        for (x, near) in self.x.iter_mut().zip(&self.nearest) {
            let v = near[0] as usize;
            let d = (from[v].coords.cast::<f64>() - *x).norm();
            let share = (2.0 - d / CARRIED).clamp(0.0, 1.0);
            *x += (to[v] - from[v]).cast::<f64>() * share;
        }
    }
    /// Takes all speed away.
    pub(super) fn stop(&mut self) {
        self.velocity.iter_mut().for_each(|v| *v = V3d::zeros());
    }
    /// `steps` substeps of `h` seconds on a body that stands still. `weight` scales gravity: the first steps of sewing
    /// close gaps before anything falls.
    pub(super) fn run(&mut self, skin: &Skin<'_>, steps: usize, h: f64, weight: f64) {
        let keep = (-DAMPING * h).exp();
        let fall = V3d::new(0.0, -GRAVITY * weight * h * h, 0.0);
        for s in 0..steps {
            if s % LOOK_EVERY == 0 {
                self.look(skin);
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
            self.lift();
            for i in 0..self.x.len() {
                let v = (self.x[i] - self.before[i]) / h;
                let speed = v.norm();
                self.velocity[i] = if speed > FASTEST { v * (FASTEST / speed) } else { v };
            }
        }
    }
    fn weight(&self, i: u32) -> f64 {
        if self.pinned[i as usize].is_some() { 0.0 } else { self.inverse_mass[i as usize] }
    }
    /// Edges keep their lengths; every other sweep runs backwards, so that no direction is preferred.
    fn stretch(&mut self, h: f64, backwards: bool) {
        let n = self.edges.len();
        for k in 0..n {
            let ([a, b], rest, compliance) = self.edges[if backwards { n - 1 - k } else { k }];
            let (wa, wb) = (self.weight(a), self.weight(b));
            let d = self.x[a as usize] - self.x[b as usize];
            let length = d.norm();
            let w = wa + wb;
            if w == 0.0 || length == 0.0 {
                continue;
            }
            let push = d * ((length - rest) / (length * (w + compliance / (h * h))));
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
    /// Out of the planes, those of the vertex's own parts last.
    fn lift(&mut self) {
        for i in 0..self.x.len() {
            for p in self.planes[i].iter().rev().filter(|p| p.near) {
                let d = self.x[i] - p.point;
                let gap = p.normal.dot(&d) - p.height;
                if gap < 0.0 && d.norm_squared() < PLANE_SIZE * PLANE_SIZE {
                    self.x[i] += p.normal * (-gap).min(LIFT);
                }
            }
        }
    }
    fn look(&mut self, skin: &Skin<'_>) {
        for i in 0..self.x.len() {
            let p = P3::from(self.x[i].cast::<f32>());
            for k in 0..2 {
                let mask = if k == 0 { self.own[i] } else { Region::ALL.0 & !self.own[i] };
                let mut c = skin.model.closest(&skin.frame, &p, self.nearest[i][k], mask);
                self.nearest[i][k] = c.vertex;
                if c.rim && k == 0 {
                    // In the armpit or the crotch, beyond the own parts: whatever is nearest.
                    c = skin.model.closest(&skin.frame, &p, c.vertex, Region::ALL.0);
                }
                self.planes[i][k] = Plane {
                    point: c.point.coords.cast(),
                    normal: c.normal.cast(),
                    height: skin.height_at(&c),
                    near: !c.rim && f64::from(c.signed) < REACH,
                };
            }
        }
    }
    /// Deepest vertex below its layer's height over the own parts, metres, and the stretch of the edges: 99th
    /// percentile and largest.
    pub(super) fn judge(&self, skin: &Skin<'_>) -> (f64, f64, f64) {
        let mut deepest = 0.0f64;
        for i in 0..self.x.len() {
            let p = P3::from(self.x[i].cast::<f32>());
            let c = skin.model.closest(&skin.frame, &p, self.nearest[i][0], self.own[i]);
            if !c.rim {
                deepest = deepest.max(-f64::from(c.signed));
            }
        }
        let mut strain: Vec<f64> = self
            .edges
            .iter()
            .map(|([a, b], l, _)| (self.x[*a as usize] - self.x[*b as usize]).norm() / l - 1.0)
            .collect();
        strain.sort_unstable_by(f64::total_cmp);
        let at = |q: f64| strain.get(((strain.len() as f64 * q) as usize).min(strain.len().saturating_sub(1))).copied();
        (deepest, at(0.99).unwrap_or(0.0), at(1.0).unwrap_or(0.0))
    }
}

impl Skin<'_> {
    fn height_at(&self, c: &Closest) -> f64 {
        let f = self.model.faces()[c.face as usize];
        (0..3).map(|k| f64::from(self.height[f[k] as usize] * c.weights[k])).sum()
    }
    /// Raises the height over the skin to that of a garment that lies there, plus `gap`.
    pub(super) fn cover(&mut self, drape: &Drape, gap: f32) {
        /// A layer further off the skin than this is left to the simulator, metres.
        const HIGHEST: f32 = 0.05;
        /// Rings of the body that a garment's vertex covers: its triangles are larger than the skin's.
        const RINGS: usize = 2;
        for i in 0..drape.x.len() {
            let p = P3::from(drape.x[i].cast::<f32>());
            let c = self.model.closest(&self.frame, &p, drape.nearest[i][0], drape.own[i]);
            if c.rim || c.signed > HIGHEST {
                continue;
            }
            let top = c.signed.max(0.0) + gap;
            let mut reached = vec![c.vertex];
            for _ in 0..RINGS {
                let outer: Vec<u32> =
                    reached.iter().flat_map(|v| self.neighbours.row(*v as usize).iter().copied()).collect();
                reached.extend(outer);
                reached.sort_unstable();
                reached.dedup();
            }
            for v in reached {
                let h = &mut self.height[v as usize];
                *h = h.max(top);
            }
        }
    }
}

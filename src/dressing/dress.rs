//! Putting garments on: place, drape, tie to the body, follow into the tracked pose.

use super::canonical::{between, canonical_pose, upright_root};
use super::drape::{Drape, Layers};
use super::figure::Figure;
use super::mesh_wear::{CARRIED, MeshWear};
use super::place::place;
use super::refine::prolong;
use super::skin::Skin;
use super::suggest::{Misfit, wearable};
use super::waistband::spread;
use crate::body::measure::measure;
use crate::body::{BoneTransforms, Pose, RestBody, Template, skin};
use crate::cloth::{AnchorBinding, Config, Model, Outfit, State};
use crate::cloth::{ClothError, Sheet};
use crate::contact::{SurfaceFrame, SurfaceModel};
use crate::garment::{GarmentError, GarmentMesh, Pattern, Region, Triangulation};
use crate::math::{P3, World};
use crate::par::Par;
use crate::spatial::intersections;
use std::time::Instant;

/// Why a garment could not be put on.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DressError {
    /// Nothing to put on.
    #[error("garments: the list is empty")]
    NoGarments,
    /// The pattern is at fault.
    #[error(transparent)]
    Garment(#[from] GarmentError),
    /// The body or the simulation is at fault.
    #[error(transparent)]
    Cloth(#[from] ClothError),
    /// A size that cannot be worn by this body.
    #[error(transparent)]
    Misfit(#[from] Misfit),
    /// The pose has a value that is not finite or the wrong number of angles.
    #[error("pose: {0}")]
    Pose(String),
}

/// How to dress.
#[derive(Clone, Debug, PartialEq)]
pub struct DressOptions {
    /// How finely to triangulate the garments.
    pub triangulation: Triangulation,
    /// How to simulate afterwards.
    pub config: Config,
    /// Put on what does not fit too: panels are stretched or slide, which shows as crumpled cloth.
    pub any_size: bool,
    /// Take garments out of themselves, so that no edge passes through a triangle of the same garment. Without, shirts are
    /// put on in about two thirds of the time, and sleeves and trunks pass through each other in the armpits.
    pub untangle: bool,
}

impl Default for DressOptions {
    fn default() -> Self {
        Self {
            triangulation: Triangulation::default(),
            config: Config::default(),
            any_size: false,
            untangle: true,
        }
    }
}

/// A dressed body, ready for [`crate::cloth::step`].
#[derive(Debug)]
pub struct Dressed {
    /// Immutable part; wrap it in an `Arc` to share it.
    pub model: Model,
    /// Garments draped on the body in the given pose.
    pub state: State,
    /// How it went.
    pub report: DressReport,
}

/// How dressing went.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DressReport {
    /// Substeps of the first drape and on the way to the tracked pose, all garments.
    pub steps: usize,
    /// Deepest garment vertex under the skin at the end, metres.
    pub penetration: f64,
    /// Edges that pass through triangles of the same garment at the end.
    pub crossings: usize,
    /// 99th percentile of the stretch at the end, worst garment.
    pub p99_strain: f64,
    /// Milliseconds by stage.
    pub stages_ms: DressMs,
    /// Milliseconds in all.
    pub ms: f64,
}

/// Milliseconds of dressing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DressMs {
    /// Triangulating and sewing.
    pub sew: f64,
    /// Measuring the body and wrapping the panels around it.
    pub place: f64,
    /// Draping on the coarse mesh, canonical pose, then on the way to the tracked one.
    pub coarse: f64,
    /// Draping on the fine mesh.
    pub fine: f64,
    /// Preparing the simulator.
    pub model: f64,
}

/// Edge length of the mesh that is draped first, over that of the garment. Four times fewer vertices.
const COARSER: f64 = 2.0;
/// The same for hoods. From edges of 28 instead of 31 mm they had a fifth more crossings when worn (docs/benchmarks.md).
const HOOD_COARSER: f64 = 2.2;
/// Longest edge of that mesh, metres: longer ones lose sleeves.
const COARSEST: f64 = 0.045;
/// Substep on the coarse mesh, s.
const COARSE_STEP: f64 = 2e-3;
/// Substeps that close seams and gaps before gravity acts fully.
const CLOSING: usize = 60;
/// Substeps of the first drape: 0.5 s, until cloth that started 2 cm off the body hangs.
const DRAPING: usize = 260;
/// Bodies on the way from the canonical to the tracked pose: at most 8° apart for a half-turn of the arm.
const FOLLOW_BODIES: usize = 16;
/// The same, and substeps on each, where garments are taken out of themselves: what an arm carries passes into other cloth by the
/// way from one body to the next.
const UNTANGLED_BODIES: [usize; 2] = [24, 8];
/// Substeps on each of them.
const FOLLOWING: usize = 12;
/// Rounds of untangling on each of them.
const CLEARING: usize = 6;
/// Rounds of untangling on the coarse mesh at the end, on the fine one at first, and at its end: most garments need none.
const CLEARED: usize = 120;
/// Substeps in the tracked pose.
const SETTLING: usize = 80;
/// Substep on the fine mesh, s.
const FINE_STEP: f64 = 1e-3;
/// Substeps on the fine mesh: wrinkles that the coarse one lacks. Half of them again where rounds of untangling leave
/// something.
const FINISHING: usize = 90;
/// So often a coarse garment settles, until the fine one that is made from it is free of itself on the trunk: a hood on a
/// thick neck may come to lie in folds that nothing takes apart. The crook of a bent elbow always does.
const TRIES: usize = 4;

/// Something to put on.
#[derive(Clone, Copy, Debug)]
pub enum Wear<'a> {
    /// Cut from a pattern.
    Pattern(&'a Pattern),
    /// A mesh made on another body.
    Mesh(&'a MeshWear),
}

impl Wear<'_> {
    fn layer(&self) -> u8 {
        match self {
            Self::Pattern(p) => p.layer,
            Self::Mesh(m) => m.layer(),
        }
    }
}

/// One sheet of cloth on its way onto the body.
struct Sheeted {
    fine: GarmentMesh,
    /// What is draped first; `None` where that is the garment's own mesh.
    coarse: Option<GarmentMesh>,
    /// Start positions of what is draped first, frame of the canonical body, metres.
    placed: Vec<P3>,
}

impl Sheeted {
    fn first(&self) -> &GarmentMesh {
        self.coarse.as_ref().unwrap_or(&self.fine)
    }
}

/// Puts garments on a body in a pose (world frame, y up). Patterns are worn in the order of their `layer`; the outfit
/// of the result has them in that order.
///
/// # Errors
/// Faults of the patterns (panel, edge, seam named) or of the pose.
pub fn dress(
    template: &Template,
    rest: &RestBody,
    pose: &Pose<World>,
    patterns: &[Pattern],
    options: &DressOptions,
) -> Result<Dressed, DressError> {
    let wear: Vec<Wear<'_>> = patterns.iter().map(Wear::Pattern).collect();
    dress_all(template, rest, pose, &wear, options)
}

/// As [`dress`], for patterns and meshes together. A mesh becomes as many garments of the outfit as it has pieces of
/// cloth.
///
/// # Errors
/// As [`dress`].
pub fn dress_all(
    template: &Template,
    rest: &RestBody,
    pose: &Pose<World>,
    wear: &[Wear<'_>],
    options: &DressOptions,
) -> Result<Dressed, DressError> {
    let started = Instant::now();
    if wear.is_empty() {
        return Err(DressError::NoGarments);
    }
    if !pose.is_finite() || pose.angles.len() != template.skeleton().dofs() {
        return Err(DressError::Pose(format!(
            "{} angles for {} degrees of freedom, all must be finite",
            pose.angles.len(),
            template.skeleton().dofs()
        )));
    }
    let mut report = DressReport::default();
    let mut order: Vec<&Wear<'_>> = wear.iter().collect();
    order.sort_by_key(|w| w.layer());
    let timer = Instant::now();
    let measures = measure(template, rest).ok();
    let figure = Figure::new(template, rest, measures.as_ref());
    report.stages_ms.place = ms(timer);
    let timer = Instant::now();
    let fine = options.triangulation;
    // The coarse mesh may have slimmer triangles: nothing is simulated on it later.
    let length = (fine.edge_length * COARSER)
        .min(COARSEST)
        .max(fine.edge_length);
    let coarse = Triangulation {
        edge_length: length,
        hood_length: fine.hood_length * HOOD_COARSER,
        min_angle: 0.0,
    };
    let mut sheets: Vec<Sheeted> = Vec::new();
    for w in order {
        match w {
            Wear::Pattern(p) => {
                if let Some(m) = measures.as_ref().filter(|_| !options.any_size) {
                    wearable(p, m)?;
                }
                let rough = GarmentMesh::sew(p, &coarse)?;
                let placed = place(template, &figure, p, &rough);
                sheets.push(Sheeted {
                    fine: GarmentMesh::sew(p, &fine)?,
                    coarse: Some(rough),
                    placed,
                });
            }
            Wear::Mesh(m) => sheets.extend(m.put_on(template, &figure).into_iter().map(
                |(fine, placed)| Sheeted {
                    fine,
                    coarse: None,
                    placed,
                },
            )),
        }
    }
    // Hats and shoes press nothing: cloth goes over them.
    let is_carried = |s: &Sheeted| s.fine.anchors.iter().any(|a| a.name == CARRIED);
    sheets.sort_by_key(|s| !is_carried(s));
    report.stages_ms.sew = ms(timer);

    let root = upright_root(rest, &pose.root);
    let start = Pose {
        root,
        angles: canonical_pose(template, rest).angles,
    };
    let coarse: Vec<GarmentMesh> = sheets.iter().map(|s| s.first().clone()).collect();
    let own: Vec<bool> = sheets.iter().map(|s| s.coarse.is_none()).collect();
    let (mut meshes, mut placed) = (Vec::new(), Vec::new());
    for s in sheets {
        let mut world = Vec::new();
        root.points_f32(&s.placed, &mut world);
        placed.push(world);
        meshes.push(s.fine);
    }

    let timer = Instant::now();
    let outfit = Outfit {
        anchors: vec![Vec::new(); meshes.len()],
        garments: meshes,
    };
    let mut model = Model::new(template, outfit, options.config.clone())?;
    report.stages_ms.model = ms(timer);

    let timer = Instant::now();
    let [follow, following] = if options.untangle {
        UNTANGLED_BODIES
    } else {
        [FOLLOW_BODIES, FOLLOWING]
    };
    let bodies: Vec<Vec<P3>> = (0..=follow)
        .map(|i| {
            let t = i as f64 / follow as f64;
            let mut body = Vec::new();
            pose_body(
                template,
                rest,
                &between(template, rest, &start, pose, t * t * (3.0 - 2.0 * t)),
                &mut body,
            );
            body
        })
        .collect();
    let mut skin = Skin::of(&model);
    skin.place(&bodies[0]).map_err(ClothError::from)?;
    let offsets: Vec<f64> = (0..coarse.len()).map(|k| model.offset(k)).collect();
    let mut ties = Vec::new();
    let mut drapes = Vec::new();
    for ((mesh, placed), offset) in coarse.iter().zip(placed).zip(&offsets) {
        let sheet = Sheet::of_garment(mesh)?;
        let mut d = Drape::new(mesh, &sheet, placed);
        d.find_all(&skin);
        ties.push(fasten(&skin, mesh, &d, *offset)?);
        drapes.push(if options.untangle {
            d.untangled(mesh, &sheet)?
        } else {
            d
        });
    }
    let mut rough = Layers::new(&coarse, drapes)?;
    rough.each(&skin, &offsets, |k, d, on| {
        d.pin(&ties[k], skin.frame());
        d.run(on, CLOSING, COARSE_STEP, 0.1);
        d.stop();
        d.run(on, DRAPING, COARSE_STEP, 1.0);
    });
    for w in bodies.windows(2) {
        skin.place(&w[1]).map_err(ClothError::from)?;
        rough.each(&skin, &offsets, |k, d, on| {
            d.carry(&w[0], &w[1]);
            d.put_back(&skin);
            d.pin(&ties[k], skin.frame());
            d.run(on, following, COARSE_STEP, 1.0);
            d.clear(on, CLEARING);
        });
    }
    report.stages_ms.coarse = ms(timer);
    let mut fine = Layers::default();
    for _ in 0..TRIES {
        let timer = Instant::now();
        rough.each(&skin, &offsets, |_, d, on| {
            d.put_back(&skin);
            d.run(on, SETTLING, COARSE_STEP, 1.0);
            d.clear(on, CLEARED);
        });
        report.stages_ms.coarse += ms(timer);
        let timer = Instant::now();
        fine = refine(
            &model,
            &coarse,
            &rough,
            &own,
            &skin,
            &offsets,
            options.untangle,
        )?;
        report.stages_ms.fine += ms(timer);
        report.steps += fine.drapes.iter().map(|d| d.steps).sum::<usize>();
        if !fine.drapes.iter().any(Drape::crosses_off_arms) {
            break;
        }
    }
    let timer = Instant::now();
    report.steps += rough.drapes.iter().map(|d| d.steps).sum::<usize>();
    let (mut positions, mut anchors) = (Vec::new(), Vec::new());
    for (k, (mesh, d)) in model.outfit.garments.iter().zip(&fine.drapes).enumerate() {
        let (deepest, p99, _) = d.judge(&skin);
        report.penetration = report.penetration.max(deepest);
        report.p99_strain = report.p99_strain.max(p99);
        report.crossings += intersections(&mesh.faces, &d.positions()).len();
        anchors.push(bind(
            skin.model,
            skin.frame(),
            mesh,
            &d.positions(),
            offsets[k],
            false,
        ));
        positions.push(d.positions());
    }
    report.stages_ms.fine += ms(timer);

    let timer = Instant::now();
    let body = skin.into_body();
    model.set_anchors(anchors);
    let state = State::on_body(&model, positions, body)?;
    report.stages_ms.model += ms(timer);
    report.ms = ms(started);
    Ok(Dressed {
        model,
        state,
        report,
    })
}

/// Drapes the garments of `model` from coarse ones; those that are their `own` coarse ones start from where those are.
fn refine(
    model: &Model,
    coarse: &[GarmentMesh],
    rough: &Layers,
    own: &[bool],
    skin: &Skin<'_>,
    offsets: &[f64],
    untangle: bool,
) -> Result<Layers, DressError> {
    let mut drapes = Vec::new();
    for (k, mesh) in model.outfit.garments.iter().enumerate() {
        let x = if own[k] {
            rough.drapes[k].x.clone()
        } else {
            prolong(&coarse[k], mesh, &rough.drapes[k].x)
        };
        let sheet = Sheet::of_garment(mesh)?;
        let mut d = Drape::new(
            mesh,
            &sheet,
            x.iter().map(|p| P3::from(p.cast::<f32>())).collect(),
        );
        d.find_from(skin, &rough.drapes[k]);
        d.pin(&fasten(skin, mesh, &d, offsets[k])?, skin.frame());
        drapes.push(if untangle {
            d.untangled(mesh, &sheet)?
        } else {
            d
        });
    }
    let mut fine = Layers::new(&model.outfit.garments, drapes)?;
    fine.each(skin, offsets, |_, d, on| {
        d.put_back(skin);
        d.clear(on, CLEARED);
        d.run(on, FINISHING, FINE_STEP, 1.0);
        if d.clear(on, CLEARED) > 0 {
            // Ironed cloth is pressed together, and finds room.
            d.run(on, FINISHING / 2, FINE_STEP, 1.0);
            d.clear(on, CLEARED);
        }
        d.lift_deep(skin);
    });
    Ok(fine)
}

fn ms(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}

fn pose_body(template: &Template, rest: &RestBody, pose: &Pose<World>, out: &mut Vec<P3>) {
    let mut bones = BoneTransforms::default();
    pose.bones(template.skeleton(), rest, &mut bones);
    skin(Par::Rayon, &rest.vertices, template.weights(), &bones, out);
}

/// Ties the anchors of a garment to the skin, `offset` metres off, waistbands evenly stretched.
fn fasten(
    skin: &Skin<'_>,
    mesh: &GarmentMesh,
    drape: &Drape,
    offset: f64,
) -> Result<Vec<AnchorBinding>, DressError> {
    let mut positions = drape.positions();
    spread(
        mesh,
        &Sheet::of_garment(mesh)?.edges,
        skin.model,
        skin.frame(),
        offset,
        &mut positions,
    );
    Ok(bind(
        skin.model,
        skin.frame(),
        mesh,
        &positions,
        offset,
        true,
    ))
}

/// Ties the anchors of a garment to the body below them; `hug` puts them at `offset` metres from the skin instead of
/// where they are.
fn bind(
    surface: &SurfaceModel,
    frame: &SurfaceFrame,
    mesh: &GarmentMesh,
    positions: &[P3],
    offset: f64,
    hug: bool,
) -> Vec<AnchorBinding> {
    let mut out = Vec::new();
    for set in &mesh.anchors {
        for &vertex in &set.vertices {
            let p = positions[vertex as usize];
            let near = surface.nearest_vertex(frame, &p, Region::ALL.0);
            let c = surface.closest_around(frame, &p, near, Region::ALL.0);
            if set.name == CARRIED {
                out.push(exactly(vertex, &p, surface.faces()[c.face as usize], frame));
                continue;
            }
            out.push(AnchorBinding {
                vertex,
                body: surface.faces()[c.face as usize],
                weights: c.weights,
                height: if hug {
                    offset as f32
                } else {
                    c.signed_distance.max(offset as f32)
                },
                strength: set.strength,
            });
        }
    }
    out
}

/// Ties a vertex to a triangle exactly where it is: weights of where it stands over the triangle's plane, and its height.
fn exactly(vertex: u32, at: &P3, body: [u32; 3], frame: &SurfaceFrame) -> AnchorBinding {
    let [p, q, r] = body.map(|v| frame.vertices[v as usize]);
    let (u, v, d) = (q - p, r - p, at - p);
    let normal = u.cross(&v);
    let square = normal.norm_squared().max(f32::MIN_POSITIVE);
    let (b, c) = (
        d.cross(&v).dot(&normal) / square,
        u.cross(&d).dot(&normal) / square,
    );
    AnchorBinding {
        vertex,
        body,
        weights: [1.0 - b - c, b, c],
        height: d.dot(&normal) / square.sqrt(),
        strength: 1.0,
    }
}

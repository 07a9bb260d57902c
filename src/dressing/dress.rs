//! Putting garments on: place, drape, tie to the body, follow into the tracked pose.

use super::canonical::{between, canonical_pose, upright_root};
use super::measure::Figure;
use super::place::place;
use crate::body::{BoneTransforms, Pose, RestBody, Template, skin};
use crate::cloth::ClothError;
use crate::cloth::realtime::{AnchorBinding, Config, Input, Model, Outfit, State, Workspace, step};
use crate::contact::SurfaceFrame;
use crate::garment::{BodyMeasures, GarmentError, GarmentMesh, Pattern, Region, Triangulation};
use crate::math::{P3, World};
use crate::par::Par;

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
    /// The pose has a value that is not finite or the wrong number of angles.
    #[error("pose: {0}")]
    Pose(String),
}

/// How to dress.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DressOptions {
    /// How finely to triangulate the garments.
    pub triangulation: Triangulation,
    /// How to simulate afterwards.
    pub config: Config,
}

/// A dressed body, ready for [`crate::cloth::realtime::step`].
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
    /// Girths of the body, metres.
    pub measures: BodyMeasures,
    /// Steps of the first drape and on the way to the tracked pose.
    pub steps: usize,
    /// Deepest garment vertex under the skin at the end, metres.
    pub penetration: f64,
    /// 99th percentile of the stretch at the end.
    pub p99_strain: f64,
    /// Milliseconds in all.
    pub ms: f64,
}

/// Time step of dressing, s.
const DT: f64 = 1.0 / 30.0;
/// Steps of the first drape, until cloth that started 2 cm off the body hangs.
const DRAPE_STEPS: usize = 24;
/// Steps on the way from the canonical to the tracked pose: at most 8° a step for a half-turn of the arm.
const FOLLOW_STEPS: usize = 16;
/// Steps in the tracked pose before the first picture.
const SETTLE_STEPS: usize = 6;

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
    let started = std::time::Instant::now();
    if patterns.is_empty() {
        return Err(DressError::NoGarments);
    }
    if !pose.is_finite() || pose.angles.len() != template.skeleton().dofs() {
        return Err(DressError::Pose(format!(
            "{} angles for {} degrees of freedom, all must be finite",
            pose.angles.len(),
            template.skeleton().dofs()
        )));
    }
    let mut order: Vec<&Pattern> = patterns.iter().collect();
    order.sort_by_key(|p| p.layer);
    let meshes = order.iter().map(|p| GarmentMesh::sew(p, &options.triangulation)).collect::<Result<Vec<_>, _>>()?;
    let figure = Figure::new(template, rest);
    let root = upright_root(rest, &pose.root);
    let start = Pose { root, angles: canonical_pose(template, rest).angles };
    let mut positions = Vec::new();
    for (p, m) in order.iter().zip(&meshes) {
        let mut world = Vec::new();
        root.points_f32(&place(template, &figure, p, m), &mut world);
        positions.push(world);
    }
    let mut body = Vec::new();
    pose_body(template, rest, &start, &mut body);
    let outfit = Outfit { anchors: vec![Vec::new(); meshes.len()], garments: meshes };
    // Folds that placing leaves behind must be able to open.
    let config = Config { sleep: false, self_collision: false, teleport: f64::MAX, ..options.config.clone() };
    let mut model = Model::new(template, outfit, config)?;
    let mut frame = SurfaceFrame { vertices: body.clone(), normals: Vec::new() };
    model.surface().update_normals(Par::Rayon, &mut frame);
    // Waistbands and shoulder seams are held from the start, at their layer's distance from the skin.
    model.set_anchors(bind(&model, &frame, &positions, true));
    let mut state = State::new(&model, positions, &body)?;
    let mut work = Workspace::default();
    let mut report = DressReport { measures: figure.measures, ..DressReport::default() };
    let mut run = |model: &Model, state: &mut State, body: &[P3]| -> Result<(), DressError> {
        let r = step(model, state, &Input { body, dt: DT }, &mut work)?;
        report.steps += 1;
        report.penetration = r.penetration_left;
        report.p99_strain = r.p99_strain;
        Ok(())
    };
    for i in 0..DRAPE_STEPS {
        run(&model, &mut state, &body)?;
        // The first steps close large gaps: take the speed out, or sleeves swing around the arm.
        if i < DRAPE_STEPS / 2 {
            for g in &mut state.garments {
                g.velocities.iter_mut().for_each(|v| *v *= 0.3);
            }
        }
    }
    let draped: Vec<Vec<P3>> = state.garments.iter().map(|g| g.positions.clone()).collect();
    model.set_anchors(bind(&model, &frame, &draped, false));
    for i in 1..=FOLLOW_STEPS + SETTLE_STEPS {
        let t = (i as f64 / FOLLOW_STEPS as f64).min(1.0);
        let t = t * t * (3.0 - 2.0 * t);
        pose_body(template, rest, &between(template, rest, &start, pose, t), &mut body);
        run(&model, &mut state, &body)?;
    }
    *model.config_mut() = options.config.clone();
    state.frames = 0;
    report.ms = started.elapsed().as_secs_f64() * 1e3;
    Ok(Dressed { model, state, report })
}

fn pose_body(template: &Template, rest: &RestBody, pose: &Pose<World>, out: &mut Vec<P3>) {
    let mut bones = BoneTransforms::default();
    pose.bones(template.skeleton(), rest, &mut bones);
    skin(Par::Rayon, &rest.vertices, template.weights(), &bones, out);
}

/// Ties the anchors to the body below them; `hug` puts them at the layer's distance instead of where they are.
fn bind(model: &Model, frame: &SurfaceFrame, positions: &[Vec<P3>], hug: bool) -> Vec<Vec<AnchorBinding>> {
    let surface = model.surface();
    model
        .outfit
        .garments
        .iter()
        .enumerate()
        .map(|(k, g)| {
            let mut out = Vec::new();
            for set in &g.anchors {
                for &vertex in &set.vertices {
                    let p = positions[k][vertex as usize];
                    let near = surface.nearest_vertex(frame, &p, Region::ALL.0);
                    let c = surface.closest_around(frame, &p, near, Region::ALL.0);
                    let offset = model.offset(k) as f32;
                    out.push(AnchorBinding {
                        vertex,
                        body: surface.faces()[c.face as usize],
                        weights: c.weights,
                        height: if hug { offset } else { c.signed.max(offset) },
                        strength: set.strength,
                    });
                }
            }
            out
        })
        .collect()
}

//! Dressing: sew and place, drape in the tracked pose, prepare the simulator meanwhile.

use super::body_sections::BodySections;
use super::error::DressError;
use super::options::{DressOptions, DressReport, ms};
use super::outfit_drape::{Wearer, drape_outfit};
use super::settings::SettlingSettings;
use super::sew::{GarmentSource, Sewing};
use std::time::Instant;
use tryon_body::measure::measure;
use tryon_body::{Pose, RestBody, Template};
use tryon_cloth::{ClothError, Config, Input, Model, Outfit, State, Workspace, step};
use tryon_garment::{GarmentMesh, Pattern, joined_faces};
use tryon_geometry::math::{V3d, World};
use tryon_geometry::par::{Par, join};
use tryon_geometry::spatial::SelfIntersections;

/// A dressed body, ready for [`tryon_cloth::step`].
#[derive(Debug)]
pub struct Dressed {
    /// Immutable part; wrap it in an `Arc` to share it.
    pub model: Model,
    /// Garments draped on the body in the given pose.
    pub state: State,
    /// Outcome of dressing.
    pub report: DressReport,
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
    let garments: Vec<GarmentSource<'_>> = patterns.iter().map(GarmentSource::Pattern).collect();
    dress_all(template, rest, pose, &garments, options)
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
    garments: &[GarmentSource<'_>],
    options: &DressOptions,
) -> Result<Dressed, DressError> {
    let started = Instant::now();
    if garments.is_empty() {
        return Err(DressError::NoGarments);
    }
    check_pose(template, pose)?;
    options.config.check()?;
    let mut report = DressReport::default();

    let timer = Instant::now();
    let measures = measure(template, rest).ok();
    let sections = BodySections::new(template, rest, measures.as_ref(), &options.stages.sections);
    report.stages_ms.place = ms(timer);

    let timer = Instant::now();
    let sewing = Sewing {
        template,
        sections: &sections,
        measures: measures.as_ref(),
        options,
    };
    let sheets = sewing.sew(garments)?;
    report.stages_ms.sew = ms(timer);

    // The simulator is prepared while the garments are draped.
    let meshes = sheets.iter().map(|s| s.garment.clone()).collect();
    let config = &options.config;
    let wearer = Wearer {
        template,
        rest,
        pose,
    };
    let (model, draped) = join(
        config.par,
        || simulator(template, meshes, config),
        || drape_outfit(&wearer, sheets, options, &mut report),
    );
    let (mut model, prepared) = model?;
    let draped = draped?;

    let timer = Instant::now();
    model.set_anchors(draped.anchors);
    let mut state = State::on_body(&model, draped.positions, draped.body)?;
    report.stages_ms.model = prepared + ms(timer);

    let timer = Instant::now();
    let mut finder = CrossingFinder::new(&model, &state);
    if options.untangle {
        settle(
            &mut model,
            &mut state,
            &mut finder,
            &options.stages.settling,
        )?;
    }
    report.crossings = finder.count(&state);
    report.stages_ms.settle = ms(timer);
    report.ms = ms(started);
    Ok(Dressed {
        model,
        state,
        report,
    })
}

/// The model of garments that are not tied to the body yet, and the milliseconds that it took.
fn simulator(
    template: &Template,
    garments: Vec<GarmentMesh>,
    config: &Config,
) -> Result<(Model, f64), ClothError> {
    let timer = Instant::now();
    let anchors = vec![Vec::new(); garments.len()];
    let outfit = Outfit { garments, anchors };
    let model = Model::new(template, outfit, *config)?;
    Ok((model, ms(timer)))
}

/// Lets cloth come to rest in the simulator, on a body that stands still: slowly, as it starts strained, and until no cloth
/// passes through cloth. Leaves the state with the fewest crossings.
fn settle(
    model: &mut Model,
    state: &mut State,
    finder: &mut CrossingFinder,
    settings: &SettlingSettings,
) -> Result<(), ClothError> {
    let gentle = Config {
        max_speed: settings.max_speed,
        untangle: settings.step,
        sleep: false,
        ..*model.config()
    };
    let config = model.replace_config(gentle);
    let body = state.collision_body().vertices().to_vec();
    let mut work = Workspace::default();
    let input = Input {
        body: &body,
        dt: settings.step,
    };
    let [least, most] = settings.steps;
    let mut best = (usize::MAX, State::default());
    for k in 0..most {
        step(model, state, &input, &mut work)?;
        if k < least {
            continue;
        }
        let crossings = finder.count(state);
        if crossings < best.0 {
            best = (crossings, state.clone());
        }
        if crossings == 0 {
            break;
        }
    }
    *state = best.1;
    model.replace_config(config);
    Ok(())
}

/// Finds edges that pass through triangles, of one garment or of two.
struct CrossingFinder {
    outfit: SelfIntersections,
    x: Vec<V3d>,
}

impl CrossingFinder {
    fn new(model: &Model, state: &State) -> Self {
        let faces = joined_faces(&model.outfit.garments);
        let x: Vec<V3d> = Self::positions(state).collect();
        Self {
            outfit: SelfIntersections::new(&faces, &x),
            x,
        }
    }
    fn positions(state: &State) -> impl Iterator<Item = V3d> {
        let garments = state.garments.iter();
        garments.flat_map(|g| g.positions.iter().map(|p| p.coords.cast()))
    }
    fn count(&mut self, state: &State) -> usize {
        self.x.clear();
        self.x.extend(Self::positions(state));
        self.outfit.find(Par::Rayon, &self.x).len()
    }
}

fn check_pose(template: &Template, pose: &Pose<World>) -> Result<(), DressError> {
    let dofs = template.skeleton().dofs();
    if pose.is_finite() && pose.angles.len() == dofs {
        return Ok(());
    }
    Err(DressError::Pose(format!(
        "{} angles for {dofs} degrees of freedom, all must be finite",
        pose.angles.len()
    )))
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_body::{BodyShape, embedded};
    use tryon_garment::{Size, library};
    use tryon_geometry::math::Rigid;

    #[test]
    fn empty_lists_and_faulty_poses_are_refused() {
        let t = embedded::template();
        let rest = t.personalise(&BodyShape::default());
        let options = DressOptions::default();
        let mut pose = Pose::rest(t.skeleton(), Rigid::identity());
        let none = dress(&t, &rest, &pose, &[], &options);
        assert_eq!(none.err(), Some(DressError::NoGarments));
        let tank = [library::pattern("tank", Size::M).expect("pattern")];
        pose.angles[0] = f64::NAN;
        let e = dress(&t, &rest, &pose, &tank, &options);
        assert!(matches!(e, Err(DressError::Pose(_))));
        pose.angles = vec![0.0; 3];
        let e = dress(&t, &rest, &pose, &tank, &options);
        assert!(matches!(e, Err(DressError::Pose(_))));
    }
}

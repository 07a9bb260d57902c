//! Dressing: sew and place, prepare the simulator, drape in it.

use super::body_sections::BodySections;
use super::drape::{OutfitDrape, Wearer};
use super::error::DressError;
use super::options::{DressOptions, DressReport, ms};
use super::sew::{GarmentSource, PlacedSheet, Sewing};
use std::time::Instant;
use tryon_body::measure::measure;
use tryon_body::{Pose, RestBody, Template};
use tryon_cloth::{ClothError, Config, Model, Outfit, State};
use tryon_garment::{GarmentMesh, Pattern};
use tryon_geometry::math::{P3, World};

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

    let timer = Instant::now();
    let wearer = Wearer {
        template,
        rest,
        pose,
    };
    let drape_settings = options.stages.drape;
    let canonical = wearer.canonical(&options.stages.sections.canonical);
    let bodies = wearer.bodies_from(&canonical, drape_settings.following);
    let (garments, positions) = in_world(sheets, &canonical);
    let model = simulator(template, garments, &options.config)?;
    report.stages_ms.model = ms(timer);

    let timer = Instant::now();
    let mut drape = OutfitDrape::new(model, positions, &bodies[0], drape_settings)?;
    drape.hang_and_follow(&bodies)?;
    report.stages_ms.drape = ms(timer);

    let timer = Instant::now();
    drape.tie(&bodies[drape_settings.following])?;
    report.crossings = drape.settle()?;
    report.stages_ms.settle = ms(timer);

    report.steps = drape.steps;
    report.penetration = drape.last.penetration_left;
    report.p99_strain = drape.last.p99_strain;
    report.ms = ms(started);
    Ok(Dressed {
        model: drape.model,
        state: drape.state,
        report,
    })
}

/// Meshes of sheets, and their start positions around a body in a pose, world, metres.
fn in_world(sheets: Vec<PlacedSheet>, pose: &Pose<World>) -> (Vec<GarmentMesh>, Vec<Vec<P3>>) {
    let place = |s: PlacedSheet| {
        let mut positions = Vec::new();
        pose.root.points_f32(&s.positions, &mut positions);
        (s.garment, positions)
    };
    sheets.into_iter().map(place).unzip()
}

/// The model of garments that are not tied to the body yet.
fn simulator(
    template: &Template,
    garments: Vec<GarmentMesh>,
    config: &Config,
) -> Result<Model, ClothError> {
    let anchors = vec![Vec::new(); garments.len()];
    Model::new(template, Outfit { garments, anchors }, *config)
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

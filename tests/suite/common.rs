//! Shared data, standing bodies and single cloth steps for the tests of this binary.

use std::path::PathBuf;
use tryon::body::{BoneTransforms, Pose, RestBody, Template, skin};
use tryon::cloth::ClothError;
use tryon::cloth::{Input, Model, State, StepReport, Workspace, step};
use tryon::evaluate::rest::lower_arms;
use tryon::math::{Body, P3, Rigid, World};
use tryon::par::Par;

/// A path below `../shared/data` (or `$TRYON_SHARED/data`). When it is missing the test says so loudly and skips;
/// with `TRYON_REQUIRE_ALL=1` it fails.
pub(crate) fn shared(path: &str) -> Option<PathBuf> {
    let root = std::env::var_os("TRYON_SHARED").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared"),
        PathBuf::from,
    );
    let full = root.join("data").join(path);
    if full.exists() {
        return Some(full);
    }
    assert!(
        std::env::var_os("TRYON_REQUIRE_ALL").is_none(),
        "{} is missing",
        full.display()
    );
    eprintln!("SKIPPED: {} is missing", full.display());
    None
}

/// Standing with the arms hanging down.
pub(crate) fn arms_down(template: &Template, rest: &RestBody) -> Pose<World> {
    let mut p = Pose::rest(template.skeleton(), Rigid::<World, Body>::identity());
    lower_arms(template, rest, 1.3, &mut p);
    p
}

/// Time of a step (s).
pub(crate) const DT: f64 = 1.0 / 30.0;

/// One step of cloth on a body of these vertices (m), [`DT`] long.
pub(crate) fn step_on(
    model: &Model,
    state: &mut State,
    body: &[P3],
    workspace: &mut Workspace,
) -> Result<StepReport, ClothError> {
    step(model, state, &Input { body, dt: DT }, workspace)
}

/// Skin of a body in a pose (m).
pub(crate) fn posed(template: &Template, rest: &RestBody, pose: &Pose<World>) -> Vec<P3> {
    let (mut bones, mut body) = (BoneTransforms::default(), Vec::new());
    pose.bones(template.skeleton(), rest, &mut bones);
    skin(
        Par::Rayon,
        &rest.vertices,
        template.weights(),
        &bones,
        &mut body,
    );
    body
}

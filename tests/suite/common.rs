//! Shared data, standing bodies and single cloth steps for the tests of this binary.

use tryon::body::{BoneTransforms, Pose, RestBody, Template};
use tryon::cloth::ClothError;
use tryon::cloth::{Input, Model, State, StepReport, Workspace, step};
use tryon::geometry::math::{Body, P3, Rigid, World};

/// Standing with the arms hanging down.
pub(crate) fn arms_down(template: &Template, rest: &RestBody) -> Pose<World> {
    let mut p = Pose::rest(template.skeleton(), Rigid::<World, Body>::identity());
    p.lower_arms(template.skeleton(), rest, 1.3);
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
    template.skin_pose(rest, pose, &mut bones, &mut body);
    body
}

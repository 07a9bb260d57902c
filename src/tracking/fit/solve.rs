//! Damped Gauss–Newton iterations of the pose, and the cost by which poses of one frame compare.

use super::equations::{PoseSums, assemble, for_each_point, pair};
use super::extrapolation::LEVER;
use super::scratch::{FitContext, FitScratch};
use crate::registration::{PairingStats, apply};
use crate::settings::{FitSettings, Schedule};
use tryon_body::Pose;

/// Result of a fit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct FitReport {
    pub iterations: usize,
    pub converged: bool,
    /// Mean distance of pairs along the normal, metres, weighted by the kernel.
    pub residual: f64,
    /// Robust cost per point, m²; comparable between poses of one frame.
    pub cost: f64,
    /// Share of readings that the model explains, 0 to 1.
    pub explained: f64,
    /// Share of visible model points that found a reading, 0 to 1.
    pub matched: f64,
    pub pairs: PairingStats,
}

impl FitReport {
    fn new(pairs: PairingStats, sums: PoseSums, settings: &FitSettings) -> Self {
        let judged = pairs.visible - pairs.unknown;
        let missing = (pairs.readings - pairs.explained) + (judged - pairs.from_model);
        let all = (pairs.readings + judged).max(1) as f64;
        Self {
            iterations: 0,
            converged: false,
            residual: if sums.weight > 0.0 {
                sums.distance / sums.weight
            } else {
                0.0
            },
            cost: (sums.cost + missing as f64 * settings.unexplained * settings.unexplained) / all,
            explained: pairs.explained as f64 / pairs.readings.max(1) as f64,
            matched: pairs.from_model as f64 / judged.max(1) as f64,
            pairs,
        }
    }
}

/// Evaluates a pose as it is, with pairs up to `distance` metres.
pub(crate) fn evaluate(
    context: &FitContext<'_>,
    pose: &Pose,
    distance: f32,
    scratch: &mut FitScratch,
) -> FitReport {
    let settings = &context.model.config.fit;
    let stats = pair(context, pose, distance, 0.0, scratch);
    let point_to_point = context.model.config.point_to_point;
    let sums = for_each_point(
        context,
        scratch,
        settings.compared_sigma,
        point_to_point,
        |_| {},
    );
    FitReport::new(stats, sums, settings)
}

/// Fits `pose` to the readings: Gauss–Newton with damping, joint limits and a weak pull to the rest pose.
pub(crate) fn fit_pose(
    context: &FitContext<'_>,
    pose: &mut Pose,
    schedule: &Schedule,
    scratch: &mut FitScratch,
) -> FitReport {
    let model = context.model;
    let settings = &model.config.fit;
    let mut report = FitReport::default();
    for iteration in 0..schedule.iterations {
        let t = ((iteration + schedule.ahead) as f64 / settings.anneal as f64).min(1.0);
        let sigma = schedule.sigma[0] + (schedule.sigma[1] - schedule.sigma[0]) * t;
        let distance =
            schedule.distance[0] + (schedule.distance[1] - schedule.distance[0]) * t as f32;
        let pull = if t < 1.0 { schedule.pull } else { 0.0 };
        let stats = pair(context, pose, distance, pull, scratch);
        let sums = assemble(context, pose, sigma, model.config.point_to_point, scratch);
        report = FitReport::new(stats, sums, settings);
        report.iterations = iteration + 1;
        if sums.weight < 1.0 {
            break;
        }
        let damping = vec![model.config.damping; scratch.dofs.len()];
        let Some(x) = scratch.equations.solve_damped(&damping) else {
            break;
        };
        apply(model.template.skeleton(), pose, &scratch.centre(), &x);
        pose.clamp_to_limits(model.template.skeleton());
        let step = x
            .iter()
            .enumerate()
            .map(|(k, v)| if k < 3 { v.abs() } else { v.abs() * LEVER })
            .fold(0.0, f64::max);
        if t >= 1.0 && step < model.config.converged {
            report.converged = true;
            break;
        }
    }
    report
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::terms::FitTerms;
    use crate::test_scene::{DepthScan, TestScene};
    use nalgebra::{Translation3, Vector3};
    use tryon_geometry::camera::DepthImage;
    use tryon_geometry::math::Rigid;

    /// Side of a cell of the grid at the subject's distance, metres.
    const CELL: f64 = 0.015;

    /// A tracked body with bent limbs, so that the rest pose isn't the truth.
    fn bent_scene() -> TestScene {
        let mut scene = TestScene::new(1000, 480);
        let skeleton = scene.model.template.skeleton();
        for (joint, angles) in [
            ("left_elbow", vec![0.8]),
            ("right_shoulder", vec![0.0, 0.0, -0.4]),
            ("right_knee", vec![0.3]),
        ] {
            scene.pose.set(skeleton, joint, &angles);
        }
        scene
    }

    fn fit(scene: &TestScene, image: &DepthImage, pose: &mut Pose) -> FitReport {
        let scan = DepthScan::new(&scene.model, image);
        let (body, observation) = (scene.body(), scan.observation());
        let context = scene.context(&body, &observation);
        let mut scratch = FitScratch {
            terms: FitTerms::tracking(&scene.model.config),
            ..FitScratch::default()
        };
        fit_pose(&context, pose, &scene.model.config.fit.track, &mut scratch)
    }

    #[test]
    fn a_fit_stays_at_the_truth_and_returns_to_it() {
        let scene = bent_scene();
        let (truth, image) = (&scene.pose, scene.depth(&scene.pose));
        for (shift, allowed) in [(0.0, 0.5 * CELL), (0.04, CELL)] {
            let start = Translation3::from(Vector3::new(shift, 0.0, -0.5 * shift));
            let mut pose = Pose {
                root: Rigid::new(start * truth.root.iso()),
                ..truth.clone()
            };
            let report = fit(&scene, &image, &mut pose);
            let off = scene.distance(&pose, truth);
            assert!(
                off < allowed,
                "from {shift} m beside it: {off} m, {report:?}"
            );
            assert!(
                report.explained > 0.95 && report.residual < 2e-3,
                "from {shift} m beside it: {report:?}"
            );
        }
    }

    #[test]
    fn a_pose_without_a_pair_keeps_its_bits() {
        let scene = bent_scene();
        let camera = scene.model.calibration.depth;
        let empty = DepthImage::empty(camera.width, camera.height);
        let mut pose = scene.pose.clone();
        let report = fit(&scene, &empty, &mut pose);
        assert_eq!(pose, scene.pose, "no reading");
        assert!(!report.converged && report.iterations == 1 && report.residual == 0.0);

        let mut away = scene.pose.clone();
        away.root = Rigid::new(Translation3::new(0.0, 0.0, -9.0) * away.root.iso());
        let behind = away.clone();
        fit(&scene, &scene.depth(&scene.pose), &mut away);
        assert_eq!(away, behind, "a body behind the camera");
    }
}

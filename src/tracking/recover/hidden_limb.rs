//! Hidden limbs: one in measured free space that no reading holds, while all readings are covered, is behind the subject.
//!
//! Nothing keeps such a limb from drifting out of the subject's outline as the body turns. Its points in free
//! space are drawn to the nearest readings of the subject, and behind them, by Gauss–Newton on the angles of the limb.

use crate::fit::FitContext;
use crate::model::Limb;
use nalgebra::{Point3, SMatrix, SVector, Vector3};
use tryon_body::{BoneTransforms, Pose};
use tryon_geometry::math::P3;
use tryon_geometry::spatial::Label;

/// Points of a limb: middle of the upper bone, hinge, middle of the lower bone, end, hand or foot.
const POINTS: usize = 5;
/// Angles of a limb: a ball and a hinge.
const ANGLES: usize = 4;
/// Residual vector of all points, metres.
type Residual = SVector<f64, { 3 * POINTS }>;

/// A limb that no reading shows.
pub(crate) struct HiddenLimb<'a> {
    pub context: FitContext<'a>,
    pub limb: &'a Limb,
}

impl HiddenLimb<'_> {
    /// The pose with the limb behind the subject's readings; `None` where it is there already.
    pub(crate) fn behind_readings(&self, pose: &Pose, bones: &mut BoneTransforms) -> Option<Pose> {
        let settings = &self.context.model.config.recover.hidden;
        let mut pose = pose.clone();
        let mut is_moved = false;
        for _ in 0..settings.iterations {
            let points = self.points(&pose, bones);
            let targets = points.map(|p| self.target(&p));
            if targets.iter().all(Option::is_none) {
                break;
            }
            is_moved = true;
            self.step(&mut pose, &points, &targets, bones);
        }
        is_moved.then_some(pose)
    }

    /// One damped Gauss–Newton step of the limb's angles towards the targets.
    fn step(
        &self,
        pose: &mut Pose,
        points: &[Point3<f64>; POINTS],
        targets: &[Option<Vector3<f64>>; POINTS],
        bones: &mut BoneTransforms,
    ) {
        let settings = &self.context.model.config.recover.hidden;
        let mut residual = Residual::zeros();
        for (k, target) in targets.iter().enumerate() {
            let off = target.map_or_else(Vector3::zeros, |t| t - points[k].coords);
            residual.fixed_rows_mut::<3>(3 * k).copy_from(&off);
        }
        let mut jacobian = SMatrix::<f64, { 3 * POINTS }, ANGLES>::zeros();
        for (column, &angle) in self.limb.angles.iter().enumerate().take(ANGLES) {
            pose.angles[angle] += settings.difference;
            let moved = self.points(pose, bones);
            pose.angles[angle] -= settings.difference;
            for (k, target) in targets.iter().enumerate() {
                if target.is_some() {
                    let d = (moved[k] - points[k]) / settings.difference;
                    jacobian.fixed_view_mut::<3, 1>(3 * k, column).copy_from(&d);
                }
            }
        }

        let mut normal = jacobian.transpose() * jacobian;
        for k in 0..ANGLES {
            normal[(k, k)] += settings.damping;
        }
        let Some(factor) = normal.cholesky() else {
            return;
        };
        let change = factor.solve(&(jacobian.transpose() * residual));
        for (&angle, step) in self.limb.angles.iter().zip(change.iter()) {
            pose.angles[angle] += step.clamp(-settings.most_step, settings.most_step);
        }
        pose.clamp_to_limits(self.context.model.template.skeleton());
    }

    fn points(&self, pose: &Pose, bones: &mut BoneTransforms) -> [Point3<f64>; POINTS] {
        let context = &self.context;
        pose.bones(context.model.template.skeleton(), &context.body.rest, bones);
        let [hinge, lower, end, hand] = self.limb.lower_points(bones);
        let upper = nalgebra::center(&bones.joints[self.limb.root], &hinge);
        [upper, hinge, lower, end, hand]
    }

    /// Place behind the subject's readings for a point in measured free space, camera frame, metres; `None` for others.
    fn target(&self, p: &Point3<f64>) -> Option<Vector3<f64>> {
        let settings = &self.context.model.config.recover.hidden;
        let grid = self.context.observation.grid;
        let p: P3 = p.cast();
        let at = grid.project(&p)?;
        let (column, row) = grid.cell_of(&p)?;
        let cell = grid.cell(column, row)?;
        let (label, depth) = (grid.labels[cell], grid.depth[cell]);
        let is_before = depth > 0.0 && p.z < depth - self.context.model.config.assess.apart;
        let is_free = match label {
            Label::Unknown => false,
            Label::Background if depth == 0.0 => true,
            _ => is_before,
        };
        if !is_free {
            return None;
        }

        let columns = grid.size().0;
        let distance = |c: &u32| {
            let (u, v) = (*c as usize % columns, *c as usize / columns);
            (u as f32 - at[0]).powi(2) + (v as f32 - at[1]).powi(2)
        };
        let shown = self.context.observation.cells.iter();
        let shown = shown.filter(|c| grid.depth[**c as usize] > 0.0);
        let near = *shown.min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
        let z = p.z.max(grid.depth[near as usize] + settings.inset);
        let (u, v) = (near as usize % columns, near as usize / columns);
        let [du, dv] = [u as f32 - at[0], v as f32 - at[1]];
        let far = du.hypot(dv);
        let inset = settings.inset * grid.focal()[0] / z;
        let share = if label == Label::Person || far <= 0.0 {
            1.0
        } else {
            (far + inset) / far
        };
        let target = grid.unproject(at[0] + du * share, at[1] + dv * share, z);
        Some(target.coords.cast())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_scene::{DepthScan, TestScene};

    /// Points of the left arm in free space before and after, of a body with its arm raised by `raised` radians over
    /// readings of one with its arm turned behind the trunk.
    fn points_in_air(raised: f64) -> [usize; 2] {
        let scene = TestScene::new(300, 480);
        let skeleton = scene.model.template.skeleton();
        let mut behind = scene.pose.clone();
        behind.set(skeleton, "left_shoulder", &[0.0, 1.1, -1.2]);
        let scan = DepthScan::new(&scene.model, &scene.depth(&behind)).background_removed();
        let (body, observation) = (scene.body(), scan.observation());
        let context = scene.context(&body, &observation);
        let limb = scene.model.arms[0].as_ref().expect("an arm");
        let hidden = HiddenLimb { context, limb };

        let mut pose = behind.clone();
        pose.set(skeleton, "left_shoulder", &[0.0, 0.0, raised]);
        let mut bones = BoneTransforms::default();
        let mut count = |pose: &Pose| {
            let points = hidden.points(pose, &mut bones);
            points.iter().filter(|p| hidden.target(p).is_some()).count()
        };
        let before = count(&pose);
        let mut scratch = BoneTransforms::default();
        let moved = hidden.behind_readings(&pose, &mut scratch);
        assert_eq!(moved.is_some(), before > 0);
        let after = moved.unwrap_or(pose);
        assert!(after.is_finite());
        [before, count(&after)]
    }

    #[test]
    fn an_arm_in_the_air_comes_behind_the_readings() {
        // Half a metre off the trunk. A horizontal arm stays: its nearest readings, at the side of the trunk, don't turn it.
        let [before, after] = points_in_air(0.2);
        assert!(before >= 3, "{before} points in the air");
        assert!(after <= 1, "{after} of {before} points");
    }

    #[test]
    fn an_arm_that_readings_show_stays() {
        let scene = TestScene::new(300, 480);
        let scan = DepthScan::new(&scene.model, &scene.depth(&scene.pose)).background_removed();
        let (body, observation) = (scene.body(), scan.observation());
        let context = scene.context(&body, &observation);
        let mut bones = BoneTransforms::default();
        for limb in scene.model.arms.iter().flatten() {
            let hidden = HiddenLimb { context, limb };
            assert_eq!(hidden.behind_readings(&scene.pose, &mut bones), None);
        }
    }
}

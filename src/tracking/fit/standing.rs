//! Hidden feet on the floor: memory of where they stood, planted feet, an estimated floor, and knees bent to reach it.

use crate::model::{Leg, TrackerModel};
use crate::registration::residual::{FloorPlane, is_in_view};
use crate::settings::StandingSettings;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use tryon_body::{BoneTransforms, Pose, RestBody};
use tryon_geometry::math::P3d;
use tryon_geometry::spatial::OrganisedCloud;

/// Floor and remembered feet of the subject.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FloorStance {
    /// Floor, camera frame.
    pub floor: FloorPlane,
    /// Feet of earlier frames.
    pub feet: Option<FootMemory>,
}

/// Ankle and ball of each foot of [`TrackerModel::standing`], camera frame, metres; zero for a joint that the template
/// does not have.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct FootMemory(pub [[Vector3<f64>; 2]; 2]);

impl FootMemory {
    /// Feet of a posed body.
    pub(crate) fn of(model: &TrackerModel, joints: &[P3d]) -> Self {
        let mut out = [[Vector3::zeros(); 2]; 2];
        for (side, leg) in out.iter_mut().zip(&model.standing) {
            let soles = leg.foot.soles.iter();
            for (at, p) in side
                .iter_mut()
                .zip(soles.filter_map(|&(j, _)| joints.get(j)))
            {
                *at = p.coords;
            }
        }
        Self(out)
    }
    /// Memory after one more frame.
    pub(crate) fn updated(self, now: Self, settings: &StandingSettings) -> Self {
        let mut out = self;
        for (kept, (was, is)) in out.0.iter_mut().zip(self.0.iter().zip(&now.0)) {
            let ankle = was[0] + (is[0] - was[0]) * settings.memory_gain[0];
            let (before, after) = (was[1] - was[0], is[1] - is[0]);
            *kept = [
                ankle,
                ankle + before + (after - before) * settings.memory_gain[1],
            ];
        }
        out
    }
}

/// Remembered ankle and ball of each foot that is planted: out of view while half its thigh projects into the image.
/// With less of a leg in view, no reading shows a step, and the foot stays under the hips instead.
pub(crate) fn planted(
    model: &TrackerModel,
    grid: &OrganisedCloud,
    standing: Option<&FloorStance>,
    joints: &[P3d],
) -> [Option<[Vector3<f64>; 2]>; 2] {
    let Some(feet) = standing.and_then(|s| s.feet) else {
        return [None; 2];
    };
    let projects = |at: P3d| {
        grid.cell_of(&at.cast())
            .and_then(|(u, v)| grid.cell(u, v))
            .is_some()
    };
    let mut out = feet.0.map(Some);
    for (kept, leg) in out.iter_mut().zip(&model.standing) {
        let ankle = leg.foot.soles.first();
        let hidden = ankle.is_some_and(|&(ankle, _)| !projects(joints[ankle]));
        let thigh = |knee| projects(nalgebra::center(&joints[leg.hip], &joints[knee]));
        *kept = kept.filter(|_| hidden && leg.knee.is_some_and(thigh));
    }
    out
}

/// Knees without readings over a floor, at the pose of the last normal equations.
#[derive(Clone, Copy)]
pub(crate) struct HiddenKnees<'a> {
    pub model: &'a TrackerModel,
    pub rest: &'a RestBody,
    pub grid: &'a OrganisedCloud,
    pub floor: &'a FloorPlane,
    pub joints: &'a [P3d],
    /// Share of each angle without readings, 0 to 1.
    pub unseen: &'a [f64],
}

impl HiddenKnees<'_> {
    /// Bends the knees whose feet are below the floor by the least angle that lifts them onto it.
    pub(crate) fn bend(&self, pose: &mut Pose) {
        let settings = &self.model.config.fit.standing;
        let (skeleton, floor) = (self.model.template.skeleton(), self.floor);
        let mut bones = BoneTransforms::default();
        for leg in &self.model.standing {
            let (Some((knee, limits)), Some(&(ankle, height))) =
                (leg.knee_angle, leg.foot.soles.first())
            else {
                continue;
            };
            let is_free = self
                .unseen
                .get(knee)
                .is_some_and(|share| *share >= settings.free);
            if !is_free || is_in_view(self.grid, &self.joints[ankle]) {
                continue;
            }
            let mut below = |pose: &Pose| {
                pose.bones(skeleton, self.rest, &mut bones);
                floor.height + height - floor.up.dot(&bones.joints[ankle].coords)
            };
            if below(pose) < settings.below {
                continue;
            }
            let mut bent = pose.clone();
            while bent.angles[knee] + settings.bend_step < limits[1] {
                bent.angles[knee] += settings.bend_step;
                if below(&bent) < 0.0 {
                    *pose = bent;
                    break;
                }
            }
        }
    }
}

/// Greatest height of the lower hip along `up` so far, metres; `known` rises by a share towards a greater one.
pub(crate) fn highest_hips(
    model: &TrackerModel,
    up: &Vector3<f64>,
    known: Option<f64>,
    joints: &[P3d],
) -> Option<f64> {
    let settings = &model.config.fit.standing;
    let hips = model.standing.iter().filter_map(|leg| joints.get(leg.hip));
    let height = hips
        .map(|p| up.dot(&p.coords))
        .fold(None, |a: Option<f64>, b| Some(a.map_or(b, |a| a.min(b))))?;
    Some(known.map_or(height, |k| k + settings.rise * (height - k).max(0.0)))
}

/// Height of an unseen floor along the upright, metres: the length of straight legs below the highest hips.
pub(crate) fn floor_below(model: &TrackerModel, rest: &RestBody, hips: f64) -> Option<f64> {
    let length = |leg: &Leg| {
        let &(ankle, height) = leg.foot.soles.first()?;
        Some(rest.joints.get(leg.hip)?.y - rest.joints.get(ankle)?.y + height)
    };
    let longest = model.standing.iter().filter_map(length).fold(0.0, f64::max);
    (longest > 0.0).then_some(hips - longest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::equations::FloorLegs;
    use crate::registration::{NormalEquations, apply, linearise};
    use crate::test_scene::TestScene;
    use nalgebra::{DMatrix, DVector, Translation3, UnitQuaternion};
    use tryon_geometry::math::Rigid;

    /// A camera of 200 rows, whose lower rim cuts the legs.
    fn cut_scene() -> (TestScene, Vector3<f64>) {
        let scene = TestScene::new(50, 200);
        let up = scene.pose.root.iso().rotation * Vector3::y();
        (scene, up)
    }

    fn floor_under(scene: &TestScene, up: Vector3<f64>) -> FloorPlane {
        let joints = scene.joints(&scene.pose);
        let hips = highest_hips(&scene.model, &up, None, &joints).expect("hips");
        let height = floor_below(&scene.model, &scene.rest, hips).expect("legs");
        FloorPlane { up, height }
    }

    #[test]
    fn straight_legs_reach_the_soles() {
        let (scene, up) = cut_scene();
        let floor = floor_under(&scene, up).height;
        let lowest = (scene.rest.vertices.iter())
            .map(|v| up.dot(&scene.pose.root.point(&v.cast()).coords))
            .fold(f64::INFINITY, f64::min);
        assert!((floor - lowest).abs() < 0.02, "{floor} against {lowest}");
        let joints = scene.joints(&scene.pose);
        let next = |known| highest_hips(&scene.model, &up, known, &joints);
        let hips = next(None).expect("hips");
        assert_eq!(next(Some(hips + 0.1)), Some(hips + 0.1), "a bent knee");
        assert!(next(Some(hips - 0.1)).expect("hips") > hips - 0.1);
    }

    #[test]
    fn foot_memory_converges_at_its_gains() {
        let x = |a: f64, b: f64| FootMemory([[Vector3::x() * a, Vector3::x() * (a + b)]; 2]);
        let (mut kept, settings) = (x(0.0, 0.1), StandingSettings::default());
        assert_eq!(kept.updated(kept, &settings), kept);
        for _ in 0..10 {
            kept = kept.updated(x(1.0, 0.2), &settings);
        }
        let [place, direction] = settings.memory_gain.map(|f| (1.0 - f).powi(10));
        let [ankle, ball] = kept.0[0];
        assert!((ankle.x - (1.0 - place)).abs() < 1e-12, "{ankle}");
        assert!(
            (ball.x - ankle.x - (0.2 - 0.1 * direction)).abs() < 1e-12,
            "{ball}"
        );
    }

    /// Normal equations of the floor residual alone at `pose`; returns which feet are planted.
    fn equations_of_feet(
        scene: &TestScene,
        pose: &Pose,
        standing: &FloorStance,
    ) -> (NormalEquations, Vector3<f64>, [bool; 2]) {
        let model = &scene.model;
        let bones = scene.bones(pose);
        let centre = bones.joints[0].coords;
        let mut dofs = Vec::new();
        linearise(model.template.skeleton(), &bones, pose, &centre, &mut dofs);
        let mut equations = NormalEquations {
            hessian: DMatrix::zeros(dofs.len(), dofs.len()),
            gradient: DVector::zeros(dofs.len()),
            ..NormalEquations::default()
        };
        let grid = OrganisedCloud::new(&model.calibration.depth, None);
        let feet = planted(model, &grid, Some(standing), &bones.joints);
        let unseen = vec![1.0; pose.angles.len()];
        let legs = FloorLegs {
            model,
            grid: &grid,
            floor: &standing.floor,
            feet,
            joints: &bones.joints,
            dofs: &dofs,
            unseen: &unseen,
        };
        legs.add_to(&mut equations);
        (equations, centre, feet.map(|f| f.is_some()))
    }

    fn shifted(standing: &FloorStance, by: Vector3<f64>) -> FloorStance {
        let up = standing.floor.up;
        FloorStance {
            floor: FloorPlane {
                up,
                height: standing.floor.height + up.dot(&by),
            },
            feet: standing
                .feet
                .map(|f| FootMemory(f.0.map(|s| s.map(|v| v + by)))),
        }
    }

    #[test]
    fn hidden_feet_stay_when_the_pelvis_moves() {
        let (scene, up) = cut_scene();
        let (model, skeleton) = (&scene.model, scene.model.template.skeleton());
        let standing = FloorStance {
            floor: floor_under(&scene, up),
            feet: Some(FootMemory::of(model, &scene.joints(&scene.pose))),
        };
        let moved_by = |by: f64| Pose {
            root: Rigid::new(Translation3::from(up * by) * scene.pose.root.iso()),
            ..scene.pose.clone()
        };
        let height = (0..60).map(|k| -0.6 + 0.02 * f64::from(k)).find(|&by| {
            equations_of_feet(&scene, &moved_by(by), &shifted(&standing, up * by)).2 == [true; 2]
        });
        let by = height.expect("a height at which the picture ends between thigh and foot");
        let standing = shifted(&standing, up * by);
        // A turn by 20° and a displacement of 5 cm of the root; only the legs may follow.
        let mut moved = moved_by(by);
        let turn = UnitQuaternion::from_scaled_axis(up * 0.35);
        let pelvis = (moved.root.iso() * skeleton.joints()[0].rest).coords;
        let shift = Translation3::from(pelvis + Vector3::x() * 0.05);
        moved.root = Rigid::new(shift * turn * Translation3::from(-pelvis) * moved.root.iso());
        let off = |pose: &Pose| {
            let now = FootMemory::of(model, &scene.joints(pose)).0;
            let kept = standing.feet.expect("feet").0;
            let turned = |s: usize| (now[s][1] - now[s][0]) - (kept[s][1] - kept[s][0]);
            let of = |s: usize| turned(s).norm().max((now[s][0] - kept[s][0]).norm());
            of(0).max(of(1))
        };
        let before = off(&moved);
        for _ in 0..20 {
            let (equations, centre, _) = equations_of_feet(&scene, &moved, &standing);
            let mut damping = vec![1e-5; equations.gradient.len()];
            damping[..6].fill(1e9);
            let x = equations.solve_damped(&damping).expect("damped");
            apply(skeleton, &mut moved, &centre, &x);
        }
        let after = off(&moved);
        assert!(before > 0.05 && after < 0.01, "{before} to {after}");
        let fresh = FloorStance {
            feet: None,
            ..standing
        };
        assert_eq!(
            equations_of_feet(&scene, &moved, &fresh).2,
            [false; 2],
            "a subject just found"
        );
    }

    #[test]
    fn a_foot_below_the_floor_bends_its_hidden_knee() {
        let (scene, up) = cut_scene();
        let (model, pose) = (&scene.model, &scene.pose);
        let straight = floor_under(&scene, up);
        let grid = OrganisedCloud::new(&model.calibration.depth, None);
        let joints = scene.joints(pose);
        let bend = |height: f64, unseen: f64| {
            let floor = FloorPlane {
                up,
                height: straight.height + height,
            };
            let unseen = vec![unseen; pose.angles.len()];
            let mut bent = pose.clone();
            let knees = HiddenKnees {
                model,
                rest: &scene.rest,
                grid: &grid,
                floor: &floor,
                joints: &joints,
                unseen: &unseen,
            };
            knees.bend(&mut bent);
            bent
        };
        assert_eq!(&bend(0.12, 0.0), pose, "a knee with readings");
        assert_eq!(&bend(2.0, 1.0), pose, "a floor above the knees");
        let bent = bend(0.12, 1.0);
        let (knee, limits) = model.standing[0].knee_angle.expect("a hinge");
        let angle = bent.angles[knee];
        assert!(angle > 0.3 && angle < limits[1], "{angle}");
        let (ankle, height) = model.standing[0].foot.soles[0];
        let at = up.dot(&scene.joints(&bent)[ankle].coords);
        let off = straight.height + 0.12 + height - at;
        assert!((-0.03..=0.0).contains(&off), "{off}");
    }
}

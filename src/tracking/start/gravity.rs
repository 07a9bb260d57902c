//! Direction of gravity where no floor is known: the camera's roll in quarter turns, by the certainty of the part network.
//!
//! Cameras are mounted upright, on either side or upside down. The network's window is upright, so that its classes are
//! surest for the right roll.

use super::body_proposals::person_cells;
use crate::model::TrackerModel;
use crate::registration::Observation;
use crate::segment::part_network::PersonParts;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use tryon_geometry::math::{Camera, Rigid, World};

/// Directions against gravity, camera frame: upright, on either side, upside down.
const UPS: [[f64; 3]; 4] = [
    [0.0, -1.0, 0.0],
    [1.0, 0.0, 0.0],
    [-1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
];

/// Pose of a level camera at the assumed height above the floor, at the roll in which the subject's cells are surest.
pub(crate) fn rolled_camera(
    model: &TrackerModel,
    observation: &Observation<'_>,
    parts: &mut PersonParts,
) -> Rigid<World, Camera> {
    let settings = &model.config.start;
    let mut certainty = |up: &Vector3<f64>| {
        let person = person_cells(observation, up);
        model.part_network.infer(&person, parts);
        let map = &parts.map;
        let most = (0..map.len()).map(|i| map.shares(i).iter().copied().fold(0.0, f32::max));
        most.sum::<f32>()
    };
    let [upright, others @ ..] = UPS.map(Vector3::from);
    let least = settings.surer * certainty(&upright);
    let rated = others.map(|up| (certainty(&up), up));
    let surest = rated.into_iter().filter(|r| r.0 > least);
    let up = surest.max_by(|a, b| a.0.total_cmp(&b.0));
    level_camera(&up.map_or(upright, |r| r.1), settings.assumed_height)
}

/// Pose of a camera with a level view for its direction against gravity.
fn level_camera(up: &Vector3<f64>, height: f64) -> Rigid<World, Camera> {
    let back = -Vector3::z();
    let right = up.cross(&back);
    let rows = Matrix3::from_rows(&[right.transpose(), up.transpose(), back.transpose()]);
    let rotation = Rotation3::from_matrix_unchecked(rows);
    let rotation = UnitQuaternion::from_rotation_matrix(&rotation);
    Rigid::from_parts(Vector3::new(0.0, height, 0.0), rotation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_scene::{DepthScan, TestScene};
    use tryon_geometry::camera::DepthImage;

    /// Upward direction found for the image.
    fn up_in(scene: &TestScene, image: &DepthImage) -> Vector3<f64> {
        let scan = DepthScan::new(&scene.model, image).background_removed();
        let parts = &mut PersonParts::default();
        let camera = rolled_camera(&scene.model, &scan.observation(), parts);
        camera.inverse().vector(&Vector3::y())
    }

    #[test]
    fn a_body_upside_down_turns_the_camera_and_an_upright_one_does_not() {
        let scene = TestScene::new(300, 480);
        let upright = scene.depth(&scene.pose);
        let mut turned = upright.clone();
        turned.data_mut().reverse();
        assert!((up_in(&scene, &upright) + Vector3::y()).norm() < 1e-6);
        assert!((up_in(&scene, &turned) - Vector3::y()).norm() < 1e-6);
    }

    #[test]
    fn nothing_in_view_is_seen_by_an_upright_camera() {
        let scene = TestScene::new(50, 240);
        let up = up_in(&scene, &DepthImage::empty(640, 240));
        assert!((up + Vector3::y()).norm() < 1e-6);
    }
}

//! A skeleton for a bare standing body, found by tracking the embedded template onto a rendered depth image of it.

use nalgebra::{UnitQuaternion, Vector3};
use tryon_body::{BoneTransforms, RestBody, Template, embedded, rig};
use tryon_geometry::camera::{Calibration, Intrinsics};
use tryon_geometry::math::{Rigid, V3d};
use tryon_geometry::mesh::TriMesh;
use tryon_geometry::spatial::PointTree;
use tryon_tracking::TrackerConfig;
use tryon_tracking::still::{StillSteps, VirtualCamera, find_still_person};

/// Steps of the tracker: enough to find the body and to calibrate its proportions.
const STEPS: StillSteps = StillSteps {
    count: 45,
    interval_ns: 33_333_333,
};
/// Image height over the body's height, and height over arm span that still fits. From the distance of
/// [`VirtualCamera::around`] joints are found 0.5 mm worse.
const MARGINS: [f64; 2] = [1.1, 0.8];
/// Distance that stands for skin without a fitted vertex near it, metres.
const UNFITTED: f64 = 1.0;

/// Finds a skeleton and skinning weights for a bare standing body that faces +z (metres, y up).
///
/// Returns the template and the mean distance of the fitted embedded template from the body's vertices, metres.
///
/// # Errors
/// Why no person is found in the mesh.
pub fn rig_standing(mesh: TriMesh) -> Result<(Template, f64), String> {
    let camera = camera_facing(&mesh).ok_or("the body has no vertices")?;
    let depth = camera.depth(&camera.view(mesh.vertices()), mesh.faces());
    let t = embedded::template();
    let config = TrackerConfig::default();
    let person = find_still_person(&t, &camera, &camera.frame(&depth), config, STEPS)
        .map_err(|e| e.to_string())?
        .ok_or("the tracker does not find a person in the mesh")?;
    let mut bones = BoneTransforms::default();
    let mut fitted = RestBody::default();
    let rest = t.personalise(&person.shape);
    t.skin_pose(&rest, &person.pose, &mut bones, &mut fitted.vertices);

    let tree = PointTree::new(&fitted.vertices);
    let distance = |p| {
        let nearest = tree.nearest(p, UNFITTED as f32);
        nearest.map_or(UNFITTED, |n| f64::from(n.1).sqrt())
    };
    let sum: f64 = mesh.vertices().iter().map(distance).sum();
    let residual = sum / mesh.vertices().len() as f64;
    let rigged = rig("body", mesh, &t, &bones, &fitted).map_err(|e| e.to_string())?;
    Ok((rigged, residual))
}

/// A camera in front of the body, at half its height, far enough for all of it; y down, z towards the body.
fn camera_facing(mesh: &TriMesh) -> Option<VirtualCamera> {
    let depth = Intrinsics::KINECT_V1;
    let (low, high) = mesh.bounds()?;
    let extent = (high.y - low.y).max(MARGINS[1] as f32 * (high.x - low.x));
    let away = MARGINS[0] * f64::from(extent) * depth.fy / f64::from(depth.height);
    let half_turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let eye = V3d::new(
        0.0,
        0.5 * f64::from(low.y + high.y),
        f64::from(high.z) + away,
    );
    Some(VirtualCamera {
        calibration: Calibration::registered(depth),
        world_from_camera: Rigid::from_parts(eye, half_turn),
    })
}

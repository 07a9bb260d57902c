//! A skeleton for a bare standing body, found by tracking the embedded template onto a rendered depth image of it.

use nalgebra::{UnitQuaternion, Vector3};
use tryon_body::{BoneTransforms, Pose, RestBody, Template, embedded, rig, skin};
use tryon_geometry::camera::{Calibration, DepthImage, Intrinsics, NoiseModel, RgbdFrame};
use tryon_geometry::math::{Camera, Rigid, V3d, World};
use tryon_geometry::mesh::TriMesh;
use tryon_geometry::par::Par;
use tryon_geometry::raster::{View, VisibilityBuffer, rasterise};
use tryon_geometry::spatial::PointTree;
use tryon_tracking::{TrackerConfig, TrackerModel, TrackerState, Workspace, step};

/// Frames that the tracker gets of the standing body: enough to find it and to calibrate its proportions.
const FRAMES: u64 = 45;
/// Time between them, ns.
const FRAME_TIME: u64 = 33_333_333;
/// Image height over the body's height, and height over arm span that still fits.
const MARGINS: [f64; 2] = [1.1, 0.8];
/// Near plane of the camera, metres.
const NEAR: f32 = 0.1;
/// Distance that stands for skin without a fitted vertex near it, metres.
const UNFITTED: f64 = 1.0;

/// Finds a skeleton and skinning weights for a bare standing body that faces +z (metres, y up).
///
/// Returns the template and the mean distance of the fitted embedded template from the body's vertices, metres.
///
/// # Errors
/// Why no person is found in the mesh.
pub fn rig_standing(mesh: TriMesh) -> Result<(Template, f64), String> {
    let camera = Intrinsics::KINECT_V1;
    let world_from_camera = camera_facing(&mesh, &camera)?;
    let depth = render(&mesh, camera, &world_from_camera.inverse());
    let model = TrackerModel::new(
        embedded::template(),
        Calibration::registered(camera),
        TrackerConfig::default(),
    );
    let state = track_still(&model, &depth)?;

    let t = model.template();
    let person = t.personalise(&state.shape);
    let pose: Pose<World> = Pose {
        root: world_from_camera * state.pose.root,
        angles: state.pose.angles.clone(),
    };
    let mut bones = BoneTransforms::default();
    pose.bones(t.skeleton(), &person, &mut bones);
    let mut fitted = RestBody::default();
    skin(
        Par::Seq,
        &person.vertices,
        t.weights(),
        &bones,
        &mut fitted.vertices,
    );

    let tree = PointTree::new(&fitted.vertices);
    let distance = |p| {
        let nearest = tree.nearest(p, UNFITTED as f32);
        nearest.map_or(UNFITTED, |n| f64::from(n.1).sqrt())
    };
    let sum: f64 = mesh.vertices().iter().map(distance).sum();
    let residual = sum / mesh.vertices().len() as f64;
    let rigged = rig("body", mesh, t, &bones, &fitted).map_err(|e| e.to_string())?;
    Ok((rigged, residual))
}

/// A camera in front of the body, at half its height, far enough for all of it; y down, z towards the body.
fn camera_facing(mesh: &TriMesh, camera: &Intrinsics) -> Result<Rigid<World, Camera>, String> {
    let (low, high) = mesh.bounds().ok_or("the body has no vertices")?;
    let extent = (high.y - low.y).max(MARGINS[1] as f32 * (high.x - low.x));
    let away = MARGINS[0] * f64::from(extent) * camera.fy / f64::from(camera.height);
    let half_turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let eye = V3d::new(
        0.0,
        0.5 * f64::from(low.y + high.y),
        f64::from(high.z) + away,
    );
    Ok(Rigid::from_parts(eye, half_turn))
}

fn render(
    mesh: &TriMesh,
    camera: Intrinsics,
    camera_from_world: &Rigid<Camera, World>,
) -> DepthImage {
    let mut vertices = Vec::new();
    camera_from_world.points_f32(mesh.vertices(), &mut vertices);
    let mut buffer = VisibilityBuffer::default();
    let view = View::Perspective { camera, near: NEAR };
    rasterise(&view, &vertices, mesh.faces(), &mut buffer);
    NoiseModel::None.apply(&camera, &buffer.depth, 0, 0)
}

fn track_still(model: &TrackerModel, depth: &DepthImage) -> Result<TrackerState, String> {
    let (mut state, mut work) = (TrackerState::new(model), Workspace::default());
    for sequence in 0..FRAMES {
        let frame = RgbdFrame {
            sequence,
            time_ns: sequence * FRAME_TIME,
            depth: depth.clone(),
            color: None,
        };
        step(model, &mut state, &frame, &mut work).map_err(|e| e.to_string())?;
    }
    if state.status.is_live() {
        Ok(state)
    } else {
        Err(format!(
            "the tracker does not find a person in the mesh: {:?}",
            state.status
        ))
    }
}

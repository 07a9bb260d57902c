//! Rows `shared` and `uva`: recordings with published or known truth.

use super::bars::{Bar, greatest, quantile};
use super::session::{FRAME_NS, TrackedSession};
use crate::tracking::{follow, mean};
use crate::{DepthScene, EvaluateError, scenes};
use nalgebra::{Matrix3, Rotation3};
use std::path::Path;
use std::sync::Arc;
use tryon_body::{Template, embedded};
use tryon_geometry::math::V3d;
use tryon_tracking::TrackerConfig;

/// Folders below the data that the rows read.
pub(super) const SHARED: &str = "sequences";
pub(super) const TURN: &str = "rgbd/uva_turn";

/// Mean joint error of each shared sequence, tracked with the template of its bodies.
pub(super) fn shared(data: &Path, frames: usize) -> Result<Vec<Bar>, EvaluateError> {
    let template = scenes::subject(data, "template")?;
    let mut bars = Vec::new();
    for (name, _) in scenes::SHARED {
        let mut scene = scenes::scene(data, name)?;
        scene.frames.truncate(frames);
        let config = TrackerConfig::default();
        let outcome = follow(&template, &config, &scene, |_, _, _, _, _| {});
        let joints = scene.joint_names.iter().cloned();
        let bar = Bar::new(
            format!("{name}, mean joint error [mm]"),
            mean(&outcome.joints_mm),
            outcome.joints_mm.len(),
        );
        bars.push(bar.worst(greatest(joints.zip(outcome.per_joint_mm).collect(), " mm")));
    }
    Ok(bars)
}

#[derive(serde::Deserialize)]
struct PosesFile {
    /// Camera in the person's frame, rows of the rotation.
    #[serde(rename = "R")]
    rotations: Vec<[[f64; 3]; 3]>,
}

/// Heading of the front of a body that has turned by `turn` since it faced the camera, about the camera's vertical,
/// radians.
fn heading(turn: &Matrix3<f64>) -> f64 {
    let front = turn * -V3d::z();
    front.x.atan2(-front.z)
}

/// Angle brought into −π to π.
fn wrapped(angle: f64) -> f64 {
    angle.sin().atan2(angle.cos())
}

/// First live frame and yaw error of the torso of a man who turns about himself, at 15 and at 30 frames a second.
pub(super) fn turn(data: &Path) -> Result<Vec<Bar>, EvaluateError> {
    let folder = data.join(TURN);
    let fault = |why: String| EvaluateError::new(TURN, why);
    let scene = DepthScene::open(&folder)?;
    let text =
        std::fs::read_to_string(folder.join("poses.json")).map_err(|e| fault(e.to_string()))?;
    let poses: PosesFile = serde_json::from_str(&text).map_err(|e| fault(e.to_string()))?;
    if poses.rotations.len() != scene.frames.len() {
        let (n, m) = (poses.rotations.len(), scene.frames.len());
        return Err(fault(format!("poses.json: {n} poses for {m} frames")));
    }
    let turns: Vec<Matrix3<f64>> = poses
        .rotations
        .iter()
        .map(|rows| Matrix3::from_fn(|r, c| rows[r][c]).transpose())
        .collect();
    let template = embedded::template();
    let mut bars = Vec::new();
    for (rate, interval) in [(15, 2 * FRAME_NS), (30, FRAME_NS)] {
        bars.extend(turn_at(&scene, &turns, &template, rate, interval));
    }
    Ok(bars)
}

/// The bars at one rate: frames a second and nanoseconds between them.
fn turn_at(
    scene: &DepthScene,
    turns: &[Matrix3<f64>],
    template: &Arc<Template>,
    rate: u32,
    interval: u64,
) -> Vec<Bar> {
    let mut session = TrackedSession::new(template, &scene.calibration).with_interval(interval);
    let mut first: Option<(usize, Rotation3<f64>)> = None;
    let (mut errors, mut named, mut lost) = (Vec::new(), Vec::new(), 0);
    for (k, frame) in scene.frames.iter().enumerate() {
        if !session.advance(frame.depth.clone()) {
            lost += usize::from(first.is_some());
            continue;
        }
        let chest = session.chest_turn();
        let (start, at_start) = *first.get_or_insert((k, chest));
        let tracked = (chest * at_start.inverse()).into_inner();
        let truth = turns[k] * turns[start].transpose();
        let off = wrapped(heading(&tracked) - heading(&truth))
            .abs()
            .to_degrees();
        errors.push(off);
        named.push((format!("frame {k}"), off));
    }
    let found = first.map_or(f64::NAN, |f| f.0 as f64);
    let n = scene.frames.len();
    vec![
        Bar::new(format!("first live frame at {rate}/s"), found, n),
        Bar::new(
            format!("torso yaw error at {rate}/s, p95 [°]"),
            quantile(&errors, 0.95),
            errors.len(),
        )
        .worst(greatest(named, "°")),
        Bar::new(
            format!("frames lost after the first live one at {rate}/s"),
            lost as f64,
            n,
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quarter_turn_to_the_right_of_the_picture_is_a_heading_of_a_right_angle() {
        let turn = Rotation3::from_axis_angle(&V3d::y_axis(), -std::f64::consts::FRAC_PI_2);
        assert!((heading(turn.matrix()) - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        assert!(heading(&Matrix3::identity()).abs() < 1e-12);
        assert!((wrapped(3.5 * std::f64::consts::PI) + std::f64::consts::FRAC_PI_2).abs() < 1e-9);
    }
}

//! Validation of a skinned scene before it is written. A fault names the array and the entry.

use super::scene::{GlbJoint, GlbJointMotion, SkinnedGlb, SkinnedMesh};
use crate::FormatError;
use std::path::Path;
use tryon_geometry::math::V3;

/// Largest deviation of a sum of skinning weights from one, and of a rotation's norm.
/// Far above f32 rounding; normalising such weights moves a vertex by 0.1 mm per metre from the origin.
const TOLERANCE: f64 = 1e-4;
/// Most joints that `JOINTS_0` of bytes can index.
const MAX_JOINTS: usize = 256;

/// Checks joints, motion and meshes.
pub(super) fn check(scene: &SkinnedGlb<'_>, origin: &Path) -> Result<(), FormatError> {
    let joints = scene.joints.len();
    check_joints(scene.joints).map_err(|why| FormatError::field(origin, "joints", why))?;
    if let Some(motion) = &scene.motion {
        check_motion(motion, joints).map_err(|why| FormatError::field(origin, "motion", why))?;
    }
    if scene.meshes.is_empty() {
        return Err(FormatError::field(origin, "meshes", "none"));
    }

    for m in scene.meshes {
        m.surface.check(origin)?;
        let found = [
            ("colors", check_colors(m)),
            ("weights", check_weights(m, joints)),
            ("targets", check_targets(m)),
            ("target_motion", check_target_motion(m)),
        ];
        for (field, result) in found {
            let field = format!("mesh `{}`.{field}", m.surface.name);
            result.map_err(|why| FormatError::field(origin, field, why))?;
        }
    }
    Ok(())
}

fn check_joints(joints: &[GlbJoint<'_>]) -> Result<(), String> {
    if joints.is_empty() || joints.len() > MAX_JOINTS {
        return Err(format!("{}, expected 1 to {MAX_JOINTS}", joints.len()));
    }
    for (i, joint) in joints.iter().enumerate() {
        let name = joint.name;
        if joint.parent.is_none() != (i == 0) || joint.parent.is_some_and(|p| p >= i) {
            return Err(format!("`{name}`: its parent must come before it"));
        }
        if !joint.rest.iter().all(|c| c.is_finite()) {
            return Err(format!("`{name}`: its rest position is not finite"));
        }
    }
    Ok(())
}

fn check_motion(motion: &GlbJointMotion<'_>, joints: usize) -> Result<(), String> {
    let times = motion.seconds.len();
    check_times(motion.seconds)?;
    check_length("positions of the root", motion.roots.len(), times)?;
    check_length("rows of rotations", motion.rotations.len(), times)?;
    for (t, (root, row)) in motion.roots.iter().zip(motion.rotations).enumerate() {
        if !root.iter().all(|c| c.is_finite()) {
            return Err(format!("time {t}: the position of the root is not finite"));
        }
        check_length("rotations", row.len(), joints).map_err(|why| format!("time {t}: {why}"))?;
        let is_unit = |norm: f64| (norm - 1.0).abs() <= TOLERANCE;
        if let Some(j) = row.iter().position(|q| !is_unit(q.coords.norm())) {
            return Err(format!("time {t}: the rotation of joint {j} is no unit"));
        }
    }
    Ok(())
}

fn check_colors(m: &SkinnedMesh<'_>) -> Result<(), String> {
    match m.colors.len() {
        0 => Ok(()),
        n => check_length("colours", n, m.surface.vertices.len()),
    }
}

fn check_weights(m: &SkinnedMesh<'_>, joints: usize) -> Result<(), String> {
    let vertices = m.surface.vertices.len();
    check_length("rows of joints", m.joints.len(), vertices)?;
    check_length("rows of weights", m.weights.len(), vertices)?;
    for (i, (row, weights)) in m.joints.iter().zip(m.weights).enumerate() {
        if let Some(j) = row.iter().find(|j| usize::from(**j) >= joints) {
            return Err(format!("vertex {i}: joint {j} is out of range ({joints})"));
        }
        let sum: f64 = weights.iter().map(|w| f64::from(*w)).sum();
        if !weights.iter().all(|w| *w >= 0.0) || !((sum - 1.0).abs() <= TOLERANCE) {
            let why = "weights must be non-negative with sum one";
            return Err(format!("vertex {i}: {weights:?}: {why}"));
        }
    }
    Ok(())
}

fn check_targets(m: &SkinnedMesh<'_>) -> Result<(), String> {
    for target in m.targets {
        let fault = |why: String| format!("`{}`: {why}", target.name);
        check_length("deltas", target.deltas.len(), m.surface.vertices.len()).map_err(fault)?;
        let is_finite = |d: &V3| d.iter().all(|c| c.is_finite());
        if let Some(i) = target.deltas.iter().position(|d| !is_finite(d)) {
            return Err(fault(format!("vertex {i}: its delta is not finite")));
        }
    }
    if !m.target_weights.is_empty() {
        check_length("weights", m.target_weights.len(), m.targets.len())?;
    }
    let is_finite = m.target_weights.iter().all(|w| w.is_finite());
    check_that(is_finite, || "a weight is not finite".into())
}

fn check_target_motion(m: &SkinnedMesh<'_>) -> Result<(), String> {
    let Some(motion) = &m.target_motion else {
        return Ok(());
    };
    if m.targets.is_empty() {
        return Err("there are no targets to move".into());
    }
    check_times(motion.seconds)?;
    check_length(
        "rows of weights",
        motion.weights.len(),
        motion.seconds.len(),
    )?;
    for (t, row) in motion.weights.iter().enumerate() {
        let fault = |why: String| format!("time {t}: {why}");
        check_length("weights", row.len(), m.targets.len()).map_err(fault)?;
        if !row.iter().all(|w| w.is_finite()) {
            return Err(fault("a weight is not finite".into()));
        }
    }
    Ok(())
}

/// Checks that times ascend in single precision, as they are stored.
fn check_times(seconds: &[f64]) -> Result<(), String> {
    let stored: Vec<f32> = seconds.iter().map(|s| *s as f32).collect();
    let ascends = stored.windows(2).all(|s| s[0] < s[1]);
    let is_valid = stored.iter().all(|s| s.is_finite() && *s >= 0.0);
    check_that(!stored.is_empty() && ascends && is_valid, || {
        "times must ascend from zero or later".into()
    })
}

fn check_length(noun: &str, found: usize, expected: usize) -> Result<(), String> {
    check_that(found == expected, || {
        format!("{found} {noun}, expected {expected}")
    })
}

fn check_that(is_valid: bool, why: impl FnOnce() -> String) -> Result<(), String> {
    is_valid.then_some(()).ok_or_else(why)
}

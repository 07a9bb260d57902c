//! Input of the solver, checked before use: settings and targets come from files.

use super::error::OfflineError;
use super::targets::FrameTargets;
use tryon_geometry::math::V3d;

/// Most halvings of a step: a frame's grid of 2⁴⁰ steps is far below rounding.
const MOST_HALVINGS: u32 = 40;

fn fault(field: &'static str, why: String) -> OfflineError {
    OfflineError::Input { field, why }
}

/// Checks an array of positions or velocities.
pub(super) fn check_vectors(
    field: &'static str,
    values: &[V3d],
    expected: usize,
) -> Result<(), OfflineError> {
    if values.len() != expected {
        let why = format!("{} for {expected} vertices", values.len());
        return Err(fault(field, why));
    }
    match values.iter().position(|p| !p.iter().all(|c| c.is_finite())) {
        Some(v) => Err(fault(field, format!("vertex {v} is not finite"))),
        None => Ok(()),
    }
}

fn check_positive(field: &'static str, value: f64) -> Result<(), OfflineError> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(fault(field, format!("{value} is not positive and finite")))
}

/// Checks the lengths of steps.
pub(super) fn check_steps(longest_step: f64, halvings: u32) -> Result<(), OfflineError> {
    check_positive("longest_step", longest_step)?;
    if halvings > MOST_HALVINGS {
        let why = format!("{halvings} exceed {MOST_HALVINGS}");
        return Err(fault("halvings", why));
    }
    Ok(())
}

/// Checks a frame's duration (s) and targets, for cloth and obstacle of `vertices`.
pub(super) fn check_frame(
    duration: f64,
    targets: &FrameTargets<'_>,
    vertices: [usize; 2],
) -> Result<(), OfflineError> {
    check_positive("duration", duration)?;
    check_targets(targets, vertices)
}

/// Checks targets; an obstacle without targets stays.
pub(super) fn check_targets(
    targets: &FrameTargets<'_>,
    [cloth, obstacle]: [usize; 2],
) -> Result<(), OfflineError> {
    if let Some(pin) = targets.pins.iter().find(|p| p.vertex as usize >= cloth) {
        let why = format!("vertex {} of {cloth}", pin.vertex);
        return Err(fault("pins", why));
    }
    if targets.obstacle.is_empty() {
        return Ok(());
    }
    check_vectors("obstacle targets", targets.obstacle, obstacle)
}

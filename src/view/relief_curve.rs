//! Curves from which the relief of edges and trims is made.

/// Smooth step from 0 to 1 about `x = 0`, `width` wide.
pub(super) fn step(x: f32, width: f32) -> f32 {
    let t = (x / width + 0.5).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Bump of height 1 at 0, of deviation `width`.
pub(super) fn bump(x: f32, width: f32) -> f32 {
    (-0.5 * (x / width).powi(2)).exp()
}

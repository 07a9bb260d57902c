//! Corners on the pixel grid: 24.8 fixed point, so that edge functions are exact.

use super::View;
use crate::math::P3;

/// Sub-pixel bits. 1/256 px moves a silhouette by up to 8 µm at 2 m for a Kinect; 4 bits show as crawling edges.
pub(super) const SUB_BITS: u32 = 8;
/// One pixel in sub-pixel units.
pub(super) const ONE: i32 = 1 << SUB_BITS;
/// Corners farther out than this many pixels are clipped first. Above the largest image side (16,384), and small
/// enough that products of two differences (2²⁵ each) stay exact in i64 and f64.
pub(super) const GUARD: f32 = 32_768.0;

/// A corner on the pixel grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Corner {
    /// Column · 256; [`Corner::OUTSIDE`] when the corner has to be clipped.
    pub(super) x: i32,
    /// Row · 256.
    pub(super) y: i32,
    /// Quantity that is affine over the picture: 1/z in a perspective view, z in a parallel one.
    pub(super) q: f32,
}

impl Corner {
    /// Corner behind the near plane, beyond the guard band or not finite.
    pub(super) const OUTSIDE: Self = Self {
        x: i32::MIN,
        y: 0,
        q: 0.0,
    };

    /// Snaps image coordinates (pixels).
    pub(super) fn snap(x: f32, y: f32, q: f32) -> Self {
        // NaN fails both comparisons.
        if x.abs() <= GUARD && y.abs() <= GUARD && q.is_finite() {
            let s = ONE as f32;
            Self {
                x: (x * s + 0.5).floor() as i32,
                y: (y * s + 0.5).floor() as i32,
                q,
            }
        } else {
            Self::OUTSIDE
        }
    }
    /// The same corner `by` metres farther.
    #[inline(always)]
    pub(super) fn farther<const PERSPECTIVE: bool>(self, by: f32) -> Self {
        Self {
            q: if PERSPECTIVE {
                self.q / (1.0 + by * self.q)
            } else {
                self.q + by
            },
            ..self
        }
    }
    pub(super) fn is_outside(&self) -> bool {
        self.x == i32::MIN
    }
}

/// A view unpacked for the inner loop: column = x·scale/w + offset with w = z or 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Projector {
    pub(super) perspective: bool,
    pub(super) scale: [f32; 2],
    pub(super) offset: [f32; 2],
    pub(super) near: f32,
}

impl Projector {
    pub(super) fn new(view: &View) -> Self {
        match *view {
            View::Perspective { camera, near } => Self {
                perspective: true,
                scale: [camera.fx as f32, camera.fy as f32],
                offset: [camera.cx as f32, camera.cy as f32],
                near: near.max(f32::MIN_POSITIVE),
            },
            View::Orthographic {
                left,
                top,
                pixels_per_metre: s,
                ..
            } => Self {
                perspective: false,
                scale: [s, s],
                offset: [-left * s, -top * s],
                near: f32::NEG_INFINITY,
            },
        }
    }
    /// A point of the view's frame on the pixel grid.
    #[inline(always)]
    pub(super) fn corner(&self, p: &P3) -> Corner {
        if self.perspective {
            if p.z >= self.near {
                let q = 1.0 / p.z;
                return Corner::snap(
                    p.x * q * self.scale[0] + self.offset[0],
                    p.y * q * self.scale[1] + self.offset[1],
                    q,
                );
            }
            Corner::OUTSIDE
        } else {
            Corner::snap(
                p.x * self.scale[0] + self.offset[0],
                p.y * self.scale[1] + self.offset[1],
                p.z,
            )
        }
    }
    /// Depth from the affine quantity.
    pub(super) fn depth(&self, q: f64) -> f64 {
        if self.perspective { 1.0 / q } else { q }
    }
}

//! Inverse of a lens's distortion, and the rays that have one: Newton's method inside the radius of growth.

use super::{Distortion, Lens};

/// Rays further than this from the axis (r² = (x / z)² + (y / z)², 89.4°) are not searched for a fold.
const MAX_RADIUS_SQUARED: f64 = 1e4;
/// Newton steps until a ray counts as not found; eight are common, tens next to the fold.
const NEWTON_STEPS: usize = 60;
/// Halvings of a step that leaves the valid radius or does not shrink the error.
const HALVINGS: usize = 40;
/// Squared error at which a ray counts as found, of unit depth: 1e-12, a billionth of a pixel.
const TOLERANCE_SQUARED: f64 = 1e-24;
/// Share of the valid radius at which Newton starts at the latest: at the radius the derivative vanishes.
const START: f64 = 0.9;

impl Distortion {
    /// Radius of rays √((x/z)² + (y/z)²) up to which the drawn radius r f(r²) grows, at most [`Distortion::limit`];
    /// infinite without either.
    ///
    /// Rays beyond are drawn over others by the formula, but by no glass. With f = N / D, the derivative of the drawn
    /// radius has the sign of Σ nᵢ dⱼ (1 + 2(i − j)) sⁱ⁺ʲ, s = r², up to the pole D = 0.
    pub fn valid_radius(&self) -> f64 {
        let [k1, k2, k3, k4, k5, k6] = self.radial;
        let (n, d) = ([1.0, k1, k2, k3], [1.0, k4, k5, k6]);
        let mut growth = [0.0; 7];
        for i in 0..4 {
            for j in 0..4 {
                growth[i + j] += n[i] * d[j] * (1.0 + 2.0 * (i as f64 - j as f64));
            }
        }
        let first = |p: &[f64]| roots(p, MAX_RADIUS_SQUARED).first().copied();
        let fold = first(&growth).unwrap_or(f64::INFINITY);
        let pole = first(&d).unwrap_or(f64::INFINITY);
        let limit = self.limit.unwrap_or(f64::INFINITY);
        fold.min(pole).sqrt().min(limit)
    }

    /// Ray of unit depth (x / z, y / z) that is drawn at `drawn`: the inverse of [`Distortion::distort`].
    ///
    /// `None` when no ray within the valid radius is drawn there.
    pub fn undistort(&self, drawn: [f64; 2]) -> Option<[f64; 2]> {
        self.undistort_within(self.valid_radius(), drawn)
    }

    /// As [`Distortion::undistort`], with the valid radius known.
    pub(super) fn undistort_within(&self, radius: f64, drawn: [f64; 2]) -> Option<[f64; 2]> {
        if self.is_none() {
            return drawn.iter().all(|c| c.is_finite()).then_some(drawn);
        }
        let share = (START * radius / drawn[0].hypot(drawn[1])).min(1.0);
        let mut ray = drawn.map(|c| c * share);
        let mut error = self.error(ray, drawn);
        let enough = TOLERANCE_SQUARED * (1.0 + square(drawn));
        for _ in 0..NEWTON_STEPS {
            if square(error) <= enough {
                return self.is_drawn(radius, ray).then_some(ray);
            }
            (ray, error) = self.newton(radius, ray, drawn)?;
        }
        None
    }

    /// True if the lens draws a ray, and no other ray at the same place: inside the valid radius, not mirrored.
    pub(super) fn is_drawn(&self, radius: f64, ray: [f64; 2]) -> bool {
        let [xx, xy, yy] = self.jacobian(ray);
        square(ray) < radius * radius && xx * yy - xy * xy > 0.0
    }

    /// The next ray and its error; `None` when no part of the Newton step is better.
    fn newton(&self, radius: f64, ray: [f64; 2], drawn: [f64; 2]) -> Option<([f64; 2], [f64; 2])> {
        let [xx, xy, yy] = self.jacobian(ray);
        let det = xx * yy - xy * xy;
        let before = self.error(ray, drawn);
        let step = [
            (yy * before[0] - xy * before[1]) / det,
            (xx * before[1] - xy * before[0]) / det,
        ];
        let mut share = 1.0;
        for _ in 0..HALVINGS {
            let next = [ray[0] - share * step[0], ray[1] - share * step[1]];
            let error = self.error(next, drawn);
            if square(next) < radius * radius && square(error) < square(before) {
                return Some((next, error));
            }
            share *= 0.5;
        }
        None
    }

    /// Difference of where a ray is drawn and where it should be.
    fn error(&self, ray: [f64; 2], drawn: [f64; 2]) -> [f64; 2] {
        let [x, y] = self.distort(ray);
        [x - drawn[0], y - drawn[1]]
    }

    /// Derivative of [`Distortion::distort`], which is symmetric: ∂x/∂x, ∂x/∂y, ∂y/∂y.
    fn jacobian(&self, [x, y]: [f64; 2]) -> [f64; 3] {
        let ([k1, k2, k3, k4, k5, k6], [p1, p2]) = (self.radial, self.tangential);
        let s = x * x + y * y;
        let n = 1.0 + s * (k1 + s * (k2 + s * k3));
        let d = 1.0 + s * (k4 + s * (k5 + s * k6));
        let dn = k1 + s * (2.0 * k2 + 3.0 * k3 * s);
        let dd = k4 + s * (2.0 * k5 + 3.0 * k6 * s);
        let (f, df) = (n / d, 2.0 * (dn * d - n * dd) / (d * d));
        [
            f + x * x * df + 2.0 * p1 * y + 6.0 * p2 * x,
            x * y * df + 2.0 * p1 * x + 2.0 * p2 * y,
            f + y * y * df + 6.0 * p1 * y + 2.0 * p2 * x,
        ]
    }
}

/// Lens with its valid radius, between pixels and rays of unit depth.
pub(super) struct LensRays {
    lens: Lens,
    radius: f64,
}

impl LensRays {
    pub(super) fn new(lens: Lens) -> Self {
        Self {
            lens,
            radius: lens.distortion.valid_radius(),
        }
    }

    /// Ray that the lens draws at a pixel.
    pub(super) fn ray(&self, [u, v]: [f64; 2]) -> Option<[f64; 2]> {
        let k = &self.lens.intrinsics;
        let drawn = [(u - k.cx) / k.fx, (v - k.cy) / k.fy];
        self.lens.distortion.undistort_within(self.radius, drawn)
    }

    /// Place on the lens's image [pixels] of the ray that the pinhole draws at a pixel.
    pub(super) fn source(&self, [u, v]: [f64; 2]) -> Option<[f64; 2]> {
        let k = &self.lens.intrinsics;
        let ray = [(u - k.cx) / k.fx, (v - k.cy) / k.fy];
        if !self.lens.distortion.is_drawn(self.radius, ray) {
            return None;
        }
        let [x, y] = self.lens.distortion.distort(ray);
        Some([x * k.fx + k.cx, y * k.fy + k.cy])
    }
}

fn square([x, y]: [f64; 2]) -> f64 {
    x * x + y * y
}

/// Roots in (0, `end`) at which a polynomial (constant first) changes sign, ascending: at most one between neighbouring
/// roots of its derivative.
fn roots(p: &[f64], end: f64) -> Vec<f64> {
    if p.len() < 2 {
        return Vec::new();
    }
    let derivative: Vec<f64> = (1..p.len()).map(|i| i as f64 * p[i]).collect();
    let mut bounds = vec![0.0];
    bounds.extend(roots(&derivative, end));
    bounds.push(end);
    bounds
        .windows(2)
        .filter_map(|w| bisect(p, w[0], w[1]))
        .collect()
}

/// Sign change of a polynomial between `low` and `high`, to the last bit.
fn bisect(p: &[f64], mut low: f64, mut high: f64) -> Option<f64> {
    let is_positive = |s: f64| p.iter().rev().fold(0.0, |sum, c| sum * s + c) > 0.0;
    let at_low = is_positive(low);
    if at_low == is_positive(high) {
        return None;
    }
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return Some(low);
        }
        if is_positive(middle) == at_low {
            low = middle;
        } else {
            high = middle;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Intrinsics;
    use proptest::prelude::*;

    /// k1, k2, p1, p2, k3 of a common colour camera, and the same eight of a depth camera of wide view.
    const FIVE: &[f64] = &[0.09, -0.21, 0.0006, -0.0004, 0.08];
    const EIGHT: &[f64] = &[5.2, 3.4, -0.0002, 0.0001, 0.17, 5.55, 5.4, 0.88];

    fn distortion(coefficients: &[f64]) -> Distortion {
        Distortion::from_opencv(coefficients).expect("finite")
    }
    fn pixel(ray: [f64; 2]) -> [f64; 2] {
        [600.0 * ray[0] + 640.0, 605.0 * ray[1] + 360.0]
    }
    fn unit(pixel: [f64; 2]) -> [f64; 2] {
        [(pixel[0] - 640.0) / 600.0, (pixel[1] - 360.0) / 605.0]
    }
    fn assert_near(got: [f64; 2], want: [f64; 2], tolerance: f64) {
        let error = (got[0] - want[0]).hypot(got[1] - want[1]);
        assert!(error < tolerance, "{got:?} against {want:?}");
    }

    /// cv2.projectPoints of OpenCV 5.0.0, K = [600 0 640; 0 605 360], points at z = 1.
    #[test]
    fn points_are_drawn_where_opencv_draws_them() {
        let rays = [[0.3, -0.2], [-0.75, 0.4], [0.05, 0.6]];
        let five = [
            [821.3812168, 238.09773204],
            [195.8315580625, 599.0329344975],
            [670.1986140625, 726.58751765625],
        ];
        let eight = [
            [812.012484291495, 244.35889889293952],
            [276.4631011223385, 555.4379557853201],
            [666.6388367578572, 682.0228872700725],
        ];
        for (coefficients, want) in [(FIVE, five), (EIGHT, eight)] {
            for (ray, want) in rays.into_iter().zip(want) {
                assert_near(pixel(distortion(coefficients).distort(ray)), want, 1e-9);
            }
        }
    }

    /// cv2.undistortPoints of OpenCV 5.0.0 (500 iterations, 1e-15), pixels (100, 50), (1200, 700), (640, 10).
    #[test]
    fn pixels_have_the_rays_of_opencv() {
        let pixels = [[100.0, 50.0], [1200.0, 700.0], [640.0, 10.0]];
        let five = [
            [-0.953226243381265, -0.5437563392595309],
            [0.9985295701214847, 0.6000196597530294],
            [0.000130393072572794, -0.5735242285573822],
        ];
        let eight = [
            [-1.671674904982022, -0.9499705332373551],
            [1.921816627703244, 1.1598753128676824],
            [-5.1298130016999875e-5, -0.6669845911762813],
        ];
        for (coefficients, want) in [(FIVE, five), (EIGHT, eight)] {
            for (pixel, want) in pixels.into_iter().zip(want) {
                let ray = distortion(coefficients).undistort(unit(pixel));
                assert_near(ray.expect("drawn"), want, 1e-9);
            }
        }
    }

    /// cv2.initUndistortRectifyMap of OpenCV 5.0.0 (CV_32FC1), pixels (0, 0), (1279, 719), (200, 600), (640, 360).
    #[test]
    fn sources_are_those_of_opencv() {
        let pixels = [[0.0, 0.0], [1279.0, 719.0], [200.0, 600.0], [640.0, 360.0]];
        let five = [
            [42.746468, 24.78783],
            [1235.4391, 695.26678],
            [204.66382, 597.61743],
            [640.0, 360.0],
        ];
        let eight = [
            [193.78613, 108.77383],
            [1086.0608, 610.37384],
            [282.26074, 555.06915],
            [640.0, 360.0],
        ];
        for (coefficients, want) in [(FIVE, five), (EIGHT, eight)] {
            let rays = LensRays::new(Lens {
                intrinsics: Intrinsics {
                    width: 1280,
                    height: 720,
                    fx: 600.0,
                    fy: 605.0,
                    cx: 640.0,
                    cy: 360.0,
                },
                distortion: distortion(coefficients),
            });
            for (pixel, want) in pixels.into_iter().zip(want) {
                assert_near(rays.source(pixel).expect("drawn"), want, 1e-4);
            }
        }
    }

    /// Brown with k1 < 0: r (1 + k1 r²) grows up to r = 1/√(−3 k1). OpenCV returns rays beyond.
    #[test]
    fn a_lens_that_folds_draws_no_ray_beyond() {
        let folding = distortion(&[-0.3, 0.0, 0.0, 0.0]);
        let radius = (1.0f64 / 0.9).sqrt();
        assert!((folding.valid_radius() - radius).abs() < 1e-12);
        let largest = folding.distort([radius, 0.0])[0];
        assert!(folding.undistort([largest * 1.001, 0.0]).is_none());
        let ray = folding.undistort([largest * 0.999, 0.0]).expect("inside");
        assert!(ray[0] < radius);
        assert!(folding.undistort([f64::NAN, 0.0]).is_none());
        assert!(folding.undistort([f64::INFINITY, 0.0]).is_none());
    }

    #[test]
    fn valid_radii_end_at_folds_and_poles() {
        assert!(Distortion::default().valid_radius().is_infinite());
        assert!(
            distortion(&[0.1, 0.0, 0.0, 0.0])
                .valid_radius()
                .is_infinite()
        );
        let pole = distortion(&[0.0, 0.0, 0.0, 0.0, 0.0, -0.25, 0.0, 0.0]);
        assert!((pole.valid_radius() - 2.0).abs() < 1e-9);
    }

    #[test]
    fn jacobians_are_derivatives() {
        let (d, h) = (distortion(EIGHT), 1e-6);
        let [x, y] = [0.4, -0.3];
        let [xx, xy, yy] = d.jacobian([x, y]);
        let by = |a: [f64; 2], b: [f64; 2]| [(b[0] - a[0]) / (2.0 * h), (b[1] - a[1]) / (2.0 * h)];
        let dx = by(d.distort([x - h, y]), d.distort([x + h, y]));
        let dy = by(d.distort([x, y - h]), d.distort([x, y + h]));
        assert_near([xx, xy], dx, 1e-8);
        assert_near([xy, yy], dy, 1e-8);
    }

    proptest! {
        /// Lenses of up to 45 % radial and 1 % tangential distortion.
        #[test]
        fn undistort_inverts_distort(
            k in prop::array::uniform6(-0.15f64..0.15),
            p in prop::array::uniform2(-0.01f64..0.01),
            angle in 0.0f64..std::f64::consts::TAU,
            share in 0.0f64..0.9,
        ) {
            let d = Distortion { radial: k, tangential: p, limit: None };
            let r = share * d.valid_radius().min(1.5);
            let ray = [r * angle.cos(), r * angle.sin()];
            prop_assume!(d.is_drawn(d.valid_radius(), ray));
            let back = d.undistort(d.distort(ray));
            prop_assert!(back.is_some(), "{ray:?}");
            let [x, y] = back.expect("some");
            prop_assert!((x - ray[0]).hypot(y - ray[1]) < 1e-8, "{ray:?}: {x} {y}");
        }

        /// Nothing but finite rays that the lens draws at the place asked for.
        #[test]
        fn rays_found_are_drawn_where_asked(
            k in prop::array::uniform6(-2.0f64..2.0),
            drawn in prop::array::uniform2(-2.0f64..2.0),
        ) {
            let d = Distortion { radial: k, tangential: [0.001, -0.002], limit: None };
            if let Some(ray) = d.undistort(drawn) {
                let [x, y] = d.distort(ray);
                prop_assert!((x - drawn[0]).hypot(y - drawn[1]) < 1e-11);
                prop_assert!(ray[0].hypot(ray[1]) < d.valid_radius());
            }
        }
    }
}

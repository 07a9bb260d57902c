//! Time until which four linearly moving points stay out of one plane: a certificate that turns with the pair.
//!
//! The points are coplanar where `(e₁ × e₂) · q`, cubic in time, vanishes (Provot 1997). The cubic is kept in Bernstein
//! form, whose values lie in the convex hull of its coefficients. So an error bound of the coefficients bounds the
//! error of the values, and the first crossing of the hull's lower boundary precedes the first root (Bézier clipping,
//! Sederberg and Nishita 1990).

use super::arithmetic::{Arithmetic, UNDERFLOW, Vector, cross, dot, magnitudes, map2, mix, scaled};
use tryon_geometry::math::V3d;

/// Clips in one call; each is safe to stop after. Simple roots take three to five from both calls of a crossing.
const CLIPS: usize = 4;
/// Roundings of a coefficient (12) and of five subdivisions (9 each), in units of the arithmetic, of the permanent.
const ROUNDINGS: f64 = 64.0;
/// Roundings of a clip's quotient, doubled.
const QUOTIENT_ROUNDINGS: f64 = 8.0;

/// Coplanarity of a pair over [0, 1].
#[derive(Clone, Copy, Debug)]
pub(super) struct Coplanarity<S> {
    /// Bernstein coefficients of the triple product, m³.
    cubic: [S; 4],
    /// Bernstein coefficients of the normal, m².
    normal: [Vector<S>; 3],
    /// Magnitude below which the points may be coplanar or closer than the separation, m³.
    threshold: f64,
}

impl<S: Arithmetic> Coplanarity<S> {
    /// From two sides and a corner at times 0 and 1 ([`super::pair_motion::PairMotion::frames`]).
    pub(super) fn new([start, end]: &[[Vector<S>; 3]; 2], separation: f64) -> Self {
        let ([a, b, q], [c, d, r]) = (start, end);
        let (ab, cd) = (cross(a, b), cross(c, d));
        let twice = map2(&cross(a, d), &cross(c, b), |x, y| x + y);
        let third = |x: S| x / S::of(3.0);
        let cubic = [
            dot(&ab, q),
            third(dot(&ab, r) + dot(&twice, q)),
            third(dot(&cd, q) + dot(&twice, r)),
            dot(&cd, r),
        ];
        let normal = [ab, scaled(&twice, S::of(0.5)), cd];
        let kept = if separation > 0.0 {
            let longest = normal.iter().map(|n| magnitudes(n).norm_squared());
            separation * longest.fold(0.0, f64::max).sqrt() * (1.0 + 32.0 * f64::EPSILON)
        } else {
            0.0
        };
        Self {
            cubic,
            normal,
            threshold: kept + permanent(start, end) * (ROUNDINGS * S::UNIT) + UNDERFLOW,
        }
    }

    /// Normal of the polygon at time `t`, rounded, m².
    pub(super) fn normal_at(&self, t: S) -> Vector<S> {
        let [a, b, c] = &self.normal;
        std::array::from_fn(|k| mix(mix(a[k], b[k], t), mix(b[k], c[k], t), t))
    }

    /// Sign of the triple product at time `t`, 0 where rounding or the separation hides it.
    pub(super) fn side_at(&self, t: S) -> i8 {
        let value = tail(&self.cubic, t)[0].to_f64();
        i8::from(value > self.threshold) - i8::from(value < -self.threshold)
    }

    /// A time, at least `t`, until which the plane through the pair keeps the separation; `t` where it doesn't at `t`.
    pub(super) fn clear_until(&self, t: S) -> S {
        let (zero, one) = (S::of(0.0), S::of(1.0));
        let shortened = one - S::of(QUOTIENT_ROUNDINGS * S::UNIT);
        let mut rest = tail(&self.cubic, t);
        let is_negative = rest[0] < zero;
        let mut time = t;
        for _ in 0..CLIPS {
            let threshold = S::of(self.threshold);
            let above = rest.map(|d| (if is_negative { -d } else { d }) - threshold);
            if !(above[0] > zero) {
                return time;
            }
            let Some(crossing) = first_crossing(&above) else {
                return one;
            };
            let fraction = crossing * shortened;
            time = time + fraction * (one - time) * shortened;
            rest = tail(&rest, fraction);
        }
        time
    }
}

/// Position in [0, 1] at which the convex hull of the control points (k/3, `d[k]`) reaches 0 first; `None` if never.
fn first_crossing<S: Arithmetic>(d: &[S; 4]) -> Option<S> {
    let mut first: Option<S> = None;
    for k in (1..4).filter(|k| !(d[*k] > S::of(0.0))) {
        for j in (0..k).filter(|j| d[*j] > S::of(0.0)) {
            let along = d[j] / (d[j] - d[k]) * S::of((k - j) as f64);
            let at = (S::of(j as f64) + along) / S::of(3.0);
            first = Some(first.map_or(at, |f| if at < f { at } else { f }));
        }
    }
    first
}

/// Bernstein coefficients over [t, 1] (de Casteljau).
fn tail<S: Arithmetic>(d: &[S; 4], t: S) -> [S; 4] {
    let (a, b, c) = (mix(d[0], d[1], t), mix(d[1], d[2], t), mix(d[2], d[3], t));
    let (e, f) = (mix(a, b, t), mix(b, c, t));
    [mix(e, f, t), f, c, d[3]]
}

/// Permanent of the magnitudes: bounds every partial result of the triple product at any time.
fn permanent<S: Arithmetic>(start: &[Vector<S>; 3], end: &[Vector<S>; 3]) -> f64 {
    let largest = |i: usize| magnitudes(&start[i]).sup(&magnitudes(&end[i]));
    let [a, b, q]: [V3d; 3] = std::array::from_fn(largest);
    let minor = |i: usize, j: usize| a[i] * b[j] + a[j] * b[i];
    (minor(1, 2) * q.x + minor(2, 0) * q.y + minor(0, 1) * q.z) * (1.0 + 16.0 * f64::EPSILON)
}

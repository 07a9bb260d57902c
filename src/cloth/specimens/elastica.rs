//! Heavy elastica: a clamped strip under its own weight (Bickley 1934, Peirce 1930).

/// Moment of a strip by its curvature, in units of the weight and overhang: M = c³ κ + f κ/√(κ² + κ₀²).
#[derive(Clone, Copy, Debug)]
pub(crate) struct MomentCurve {
    /// c³: rigidity, the cube of the bending length over the overhang.
    pub(crate) rigidity: f64,
    /// f: moment of friction over that of the weight.
    pub(crate) friction: f64,
    /// κ₀: curvature from which friction is full, in turns of the overhang.
    pub(crate) onset: f64,
}

impl MomentCurve {
    /// Linear, of a bending length over the overhang.
    pub(crate) fn linear(c: f64) -> Self {
        Self {
            rigidity: c.powi(3),
            friction: 0.0,
            onset: 1.0,
        }
    }
    /// Curvature of a moment. Newton's method from the linear answer, which is too large.
    fn curvature(&self, moment: f64) -> f64 {
        /// Steps to rounding.
        const STEPS: usize = 30;
        if self.friction == 0.0 {
            return moment / self.rigidity;
        }
        let (mut low, mut high) = (0.0, moment.abs() / self.rigidity);
        let of = |k: f64| self.rigidity * k + self.friction * k / k.hypot(self.onset);
        for _ in 0..STEPS {
            let middle = 0.5 * (low + high);
            if of(middle) > moment.abs() {
                high = middle;
            } else {
                low = middle;
            }
        }
        (0.5 * (low + high)).copysign(moment)
    }
}

/// Tip of a clamped elastica of unit length under its own weight, horizontal at the clamp: (forward, down).
///
/// With θ down from the horizontal and the moment M of the weight beyond: θ′ = κ(M), M′ = −(1 − s) cos θ, M(1) = 0.
/// Integrated by Runge–Kutta from the tip, whose angle is found by bisection: that at the clamp is zero.
pub(crate) fn elastica_tip(curve: &MomentCurve) -> [f64; 2] {
    const STEPS: usize = 500;
    /// Least angle of a tip from the vertical (rad), of a strip 14 times its bending length, and growth of a trial.
    const NEAREST: f64 = 1e-15;
    const GROWTH: f64 = 1.5;
    // Angle, moment, forward and down by the distance r from the tip.
    let slope = |r: f64, y: [f64; 4]| {
        [
            -curve.curvature(y[1]),
            r * y[0].cos(),
            y[0].cos(),
            y[0].sin(),
        ]
    };
    let add = |y: [f64; 4], k: [f64; 4], h: f64| std::array::from_fn(|d| y[d] + h * k[d]);
    let integrate = |tip: f64| {
        let h = 1.0 / STEPS as f64;
        (0..STEPS).fold([tip, 0.0, 0.0, 0.0], |y, i| {
            let r = i as f64 * h;
            let k1 = slope(r, y);
            let k2 = slope(r + 0.5 * h, add(y, k1, 0.5 * h));
            let k3 = slope(r + 0.5 * h, add(y, k2, 0.5 * h));
            let k4 = slope(r + h, add(y, k3, h));
            std::array::from_fn(|d| y[d] + h / 6.0 * (k1[d] + 2.0 * (k2[d] + k3[d]) + k4[d]))
        })
    };
    // From the vertical: steeper at the clamp than at the tip is a strip that coils, a later root.
    let tip = |aside: f64| std::f64::consts::FRAC_PI_2 - aside;
    let mut far = NEAREST;
    while integrate(tip(far))[0] > 0.0 && far < std::f64::consts::FRAC_PI_2 {
        far *= GROWTH;
    }
    let mut near = far / GROWTH;
    for _ in 0..40 {
        let middle = 0.5 * (near + far);
        if integrate(tip(middle))[0] > 0.0 {
            near = middle;
        } else {
            far = middle;
        }
    }
    let y = integrate(tip(far));
    [y[2], y[3]]
}

/// Bending length over the overhang whose elastica has this droop, down over forward.
pub(crate) fn bending_length_of(droop: f64) -> f64 {
    let (mut low, mut high) = (0.1f64, 2.0f64);
    for _ in 0..24 {
        let middle = 0.5 * (low + high);
        let [x, y] = elastica_tip(&MomentCurve::linear(middle));
        if y / x > droop {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elastica_has_the_limits_of_a_beam() {
        // A stiff beam: w L⁴/(8 B) = 1/(8 c³).
        let [x, y] = elastica_tip(&MomentCurve::linear(5.0));
        assert!((y / (1.0 / (8.0 * 125.0)) - 1.0).abs() < 1e-3 && (x - 1.0).abs() < 1e-5);
        // Peirce 1930: the bending length is half the overhang at 41.5°.
        let [x, y] = elastica_tip(&MomentCurve::linear(0.5));
        assert!((y.atan2(x).to_degrees() - 41.5).abs() < 0.7);
    }
}

//! Proportions of the figure by shape parameters, and its joints.

use tryon_geometry::math::P3d;

/// Shape of the figure at the mean stature, standard deviations from the mean of both sexes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Figure {
    /// −1 the mean woman, +1 the mean man.
    pub sex: f64,
    /// Body mass at equal stature.
    pub girth: f64,
    pub shoulder: f64,
    pub chest: f64,
    pub waist: f64,
    pub hip: f64,
    /// Depth of the abdomen at equal girth of chest and hip: 25 mm a unit, no published deviation.
    pub belly: f64,
}

/// Joint positions of the left half, metres.
#[derive(Clone, Copy, Debug)]
pub(super) struct Joints {
    pub pelvis: P3d,
    pub spine: [P3d; 3],
    pub neck: P3d,
    pub head: P3d,
    pub head_end: P3d,
    pub hip: P3d,
    pub knee: P3d,
    pub ankle: P3d,
    pub foot: P3d,
    pub foot_end: P3d,
    pub collar: P3d,
    pub shoulder: P3d,
    pub elbow: P3d,
    pub wrist: P3d,
    pub hand_end: P3d,
}

/// Mean stature of both sexes (ANSUR II), the stature of the figure, metres.
pub(super) const STATURE: f64 = 1.692;

impl Figure {
    /// Size of the hands, relative (hand length of men and women at equal stature, ANSUR II: ±1.5 %; breadth ±4 %).
    pub(super) fn hand(&self) -> f64 {
        1.0 + 0.022 * self.sex
    }
    /// Size of the feet, relative.
    pub(super) fn foot(&self) -> f64 {
        1.0 + 0.015 * self.sex
    }
    /// Joints in the A-pose: arms 45° down, legs 5° apart.
    pub(super) fn joints(&self) -> Joints {
        let p = P3d::new;
        // Biacromial breadth moves the whole arm; hip breadth the legs, half as much.
        let out = 0.0048 * self.sex + 0.0080 * self.shoulder;
        let leg = -0.003 * self.sex + 0.005 * self.girth + 0.003 * self.hip;
        let shoulder = p(0.170 + out, 1.348, -0.016);
        let elbow = shoulder + (p(0.205, -0.197, -0.004) - P3d::origin());
        let wrist = elbow + (p(0.1715, -0.173, 0.048) - P3d::origin());
        let hand_end = wrist + (p(0.126, -0.127, 0.032) - P3d::origin());
        Joints {
            pelvis: p(0.0, 0.915, -0.012),
            spine: [
                p(0.0, 1.000, -0.035),
                p(0.0, 1.110, -0.040),
                p(0.0, 1.225, -0.045),
            ],
            neck: p(0.0, 1.432, -0.030),
            head: p(0.0, 1.530, -0.004),
            head_end: p(0.0, STATURE, -0.004),
            hip: p(0.090 + leg, 0.885, -0.006),
            knee: p(0.126 + leg, 0.478, -0.002),
            ankle: p(0.152 + leg, 0.074, -0.026),
            foot: p(0.164 + leg, 0.020, 0.092),
            foot_end: p(0.170 + leg, 0.014, 0.172),
            collar: p(0.026, 1.378, -0.010),
            shoulder,
            elbow,
            wrist,
            hand_end,
        }
    }
}

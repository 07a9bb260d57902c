//! Head and face.

use super::field::{Field, Frame, Loft, Solid, Station};
use super::figure::Figure;
use crate::math::{P3d, V3d};

/// Face: height, half width, front, back, squareness; sex adds to the half width.
const FACE: [[f64; 6]; 9] = [
    [1.474, 0.022, 0.076, 0.020, 0.1, 0.0025],
    [1.486, 0.034, 0.084, 0.004, 0.15, 0.0030],
    [1.505, 0.045, 0.084, -0.012, 0.1, 0.0035],
    [1.525, 0.053, 0.085, -0.025, 0.05, 0.0030],
    [1.548, 0.060, 0.086, -0.035, 0.0, 0.0020],
    [1.570, 0.0655, 0.086, -0.045, 0.0, 0.0015],
    [1.592, 0.0680, 0.087, -0.050, 0.0, 0.0010],
    [1.615, 0.0680, 0.088, -0.050, 0.0, 0.0010],
    [1.640, 0.0640, 0.078, -0.050, 0.0, 0.0010],
];

pub(super) fn head(f: &mut Field, fig: &Figure) {
    let s = fig.sex;
    // Skull.
    f.ellipsoid([0.0, 1.604, -0.012], [0.0755 + 0.001 * s, 0.088, 0.098 + 0.0015 * s], 0.02);
    let stations = FACE
        .iter()
        .map(|r| {
            let hw = r[1] + s * r[5] + 0.0015 * fig.girth;
            let (cz, rz) = (0.5 * (r[2] + r[3]), 0.5 * (r[2] - r[3]));
            Station { t: r[0], c: [0.0, cz, hw, hw, rz, rz, r[4]] }
        })
        .collect();
    f.add(Solid::Loft(Loft { frame: Frame::upright(P3d::origin()), stations, caps: [0.008, 0.02] }), 0.02);
    // Nose: bridge, tip, wings.
    let p = P3d::new;
    f.cone(p(0.0, 1.590, 0.080), p(0.0, 1.556, 0.100), 0.0075, 0.0095, 0.012);
    f.cone(p(0.0, 1.556, 0.100), p(0.0, 1.551, 0.101), 0.0090, 0.0085, 0.006);
    f.ellipsoid(p(0.0105, 1.549, 0.090), [0.0065, 0.0065, 0.010], 0.008);
    // Eye sockets and eyes.
    f.bump(p(0.030, 1.582, 0.082), [0.024, 0.018, 0.030], -0.011);
    f.ellipsoid(p(0.031, 1.580, 0.0655), [0.0135, 0.0120, 0.0125], 0.004);
    // Brow.
    f.bump(p(0.026, 1.603, 0.085), [0.032, 0.014, 0.030], 0.004 + 0.002 * s);
    // Cheekbone, hollow of the cheek.
    f.bump(p(0.046, 1.560, 0.062), [0.030, 0.024, 0.035], 0.0045);
    f.bump(p(0.048, 1.525, 0.050), [0.026, 0.030, 0.035], -0.003 + 0.0015 * fig.girth);
    // Mouth: lips, the line between, the groove below.
    f.bump(p(0.0, 1.5275, 0.086), [0.025, 0.0085, 0.022], 0.0055);
    f.bump(p(0.0, 1.5145, 0.086), [0.022, 0.0085, 0.022], 0.0055);
    f.bump(p(0.0, 1.5210, 0.092), [0.028, 0.0045, 0.015], -0.0045);
    f.bump(p(0.0, 1.502, 0.086), [0.022, 0.009, 0.02], -0.003);
    // Chin.
    f.bump(p(0.0, 1.486, 0.086), [0.024, 0.018, 0.025], 0.005 + 0.0015 * s);
    // Ear: a tilted shell, hollowed.
    let a = V3d::new(0.10, 0.96, -0.26).normalize();
    let w = V3d::new(0.45, 0.20, 0.87);
    let w = (w - a * w.dot(&a)).normalize();
    let ear = Frame { origin: p(0.0785, 1.574, -0.012), u: a.cross(&w), w, a };
    f.add(Solid::Ellipsoid(ear, V3d::new(0.0065, 0.0175, 0.0310)), 0.008);
    f.bump_in(Frame { origin: ear.origin + V3d::new(0.009, 0.002, 0.002), ..ear }, [0.012, 0.012, 0.020], -0.006);
}

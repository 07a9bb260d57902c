//! Head and face.

use super::field::{Field, FieldPrimitive, Frame, Loft, Station};
use super::figure::Figure;
use tryon_geometry::math::{P3d, V3d};

/// Sections of the face: height, half width, front, back (metres), squareness, half width per unit of sex (metres).
const FACE: [[f64; 6]; 10] = [
    [1.474, 0.022, 0.076, 0.020, 0.1, 0.0025],
    [1.486, 0.034, 0.084, 0.004, 0.15, 0.0030],
    [1.505, 0.045, 0.084, -0.012, 0.1, 0.0035],
    [1.525, 0.053, 0.085, -0.025, 0.05, 0.0030],
    [1.548, 0.060, 0.086, -0.035, 0.0, 0.0020],
    [1.570, 0.0655, 0.086, -0.045, 0.0, 0.0015],
    [1.592, 0.0680, 0.087, -0.050, 0.0, 0.0010],
    [1.615, 0.0670, 0.084, -0.050, 0.0, 0.0010],
    [1.635, 0.0610, 0.073, -0.050, 0.0, 0.0010],
    [1.655, 0.0480, 0.054, -0.050, 0.0, 0.0010],
];

/// Adds head and face.
pub(super) fn head(f: &mut Field, fig: &Figure) {
    skull(f, fig);
    nose(f);
    eyes(f);
    cheeks(f, fig);
    mouth_and_chin(f, fig);
    ear(f);
}

fn skull(f: &mut Field, fig: &Figure) {
    let s = fig.sex;
    f.ellipsoid(
        [0.0, 1.604, -0.012],
        [0.0755 + 0.001 * s, 0.088, 0.098 + 0.0015 * s],
        0.02,
    );
    let stations = FACE
        .iter()
        .map(|r| {
            let hw = r[1] + s * r[5] + 0.0015 * fig.girth;
            let (cz, rz) = (0.5 * (r[2] + r[3]), 0.5 * (r[2] - r[3]));
            Station {
                t: r[0],
                c: [0.0, cz, hw, hw, rz, rz, r[4]],
            }
        })
        .collect();
    f.add(
        FieldPrimitive::Loft(Loft::new(
            Frame::upright(P3d::origin()),
            stations,
            [0.008, 0.02],
        )),
        0.02,
    );
}

/// Bridge, tip and wings.
fn nose(f: &mut Field) {
    let p = P3d::new;
    let [root, tip] = [p(0.0, 1.594, 0.0800), p(0.0, 1.562, 0.0960)];
    f.cone(root, tip, 0.0070, 0.0090, 0.018);
    f.cone(tip, p(0.0, 1.5545, 0.0990), 0.0085, 0.0085, 0.008);
    f.ellipsoid(p(0.0105, 1.5525, 0.0890), [0.0068, 0.0060, 0.0090], 0.012);
}

/// Sockets and eyeballs.
fn eyes(f: &mut Field) {
    let p = P3d::new;
    f.bump(p(0.031, 1.584, 0.080), [0.024, 0.017, 0.034], -0.0070);
    f.bump(p(0.014, 1.586, 0.080), [0.011, 0.014, 0.030], -0.0035);
    f.bump(p(0.0315, 1.5750, 0.080), [0.018, 0.006, 0.025], -0.0010);
    f.ellipsoid(p(0.0315, 1.5815, 0.0628), [0.0140, 0.0100, 0.0150], 0.003);
}

/// Brow and temple, cheekbone, hollow of the cheek, corner of the jaw.
fn cheeks(f: &mut Field, fig: &Figure) {
    let (s, p) = (fig.sex, P3d::new);
    let brow = 0.003 + 0.002 * s;
    f.bump(p(0.024, 1.602, 0.086), [0.030, 0.013, 0.030], brow);
    f.bump(p(0.066, 1.602, 0.045), [0.020, 0.030, 0.035], -0.003);
    f.bump(p(0.048, 1.562, 0.060), [0.030, 0.022, 0.035], 0.0045);
    let hollow = -0.003 + 0.0015 * fig.girth;
    f.bump(p(0.046, 1.528, 0.050), [0.024, 0.028, 0.035], hollow);
    f.bump(p(0.052, 1.500, 0.000), [0.020, 0.024, 0.030], brow);
}

/// The round of the teeth, lips, the line between, the groove below, chin.
fn mouth_and_chin(f: &mut Field, fig: &Figure) {
    let p = P3d::new;
    f.bump(p(0.0, 1.522, 0.084), [0.046, 0.034, 0.038], 0.0040);
    f.bump(p(0.0, 1.5275, 0.088), [0.030, 0.0080, 0.024], 0.0022);
    f.bump(p(0.0, 1.5150, 0.087), [0.027, 0.0090, 0.024], 0.0028);
    f.bump(p(0.0, 1.5213, 0.090), [0.034, 0.0055, 0.030], -0.0034);
    f.bump(p(0.0, 1.503, 0.086), [0.026, 0.009, 0.02], -0.0025);
    let chin = 0.005 + 0.0015 * fig.sex;
    f.bump(p(0.0, 1.486, 0.085), [0.026, 0.018, 0.025], chin);
}

/// A tilted shell, hollowed.
fn ear(f: &mut Field) {
    let a = V3d::new(0.10, 0.96, -0.26).normalize();
    let w = V3d::new(0.45, 0.20, 0.87);
    let w = (w - a * w.dot(&a)).normalize();
    let ear = Frame {
        origin: P3d::new(0.0785, 1.574, -0.012),
        u: a.cross(&w),
        w,
        a,
    };
    f.add(
        FieldPrimitive::Ellipsoid(ear, V3d::new(0.0065, 0.0175, 0.0310)),
        0.008,
    );
    let hollow = Frame {
        origin: ear.origin + V3d::new(0.009, 0.002, 0.002),
        ..ear
    };
    f.bump_in(hollow, [0.012, 0.012, 0.020], -0.006);
}

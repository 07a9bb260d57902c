//! Trunk and neck.

use super::field::{Field, FieldPrimitive, Frame, Loft, Station};
use super::figure::{Figure, Joints};
use tryon_geometry::math::{P3d, V3d};

/// Outline of the trunk, metres: height, half width, front, back, squareness; then what one unit of sex (+ male)
/// and of girth add to half width, front and back.
#[rustfmt::skip]
const TRUNK: [[f64; 11]; 18] = [
    [0.852, 0.070, 0.044, -0.066, 0.0, -0.002, 0.000, 0.000, 0.004, 0.002, -0.003],
    [0.868, 0.118, 0.068, -0.092, 0.1, -0.005, 0.000, 0.001, 0.007, 0.004, -0.005],
    [0.890, 0.160, 0.086, -0.110, 0.2, -0.009, 0.000, 0.003, 0.009, 0.008, -0.008],
    [0.915, 0.175, 0.096, -0.116, 0.2, -0.010, 0.000, 0.003, 0.011, 0.011, -0.009],
    [0.940, 0.181, 0.105, -0.112, 0.2, -0.009, 0.000, 0.002, 0.012, 0.014, -0.009],
    [0.975, 0.179, 0.111, -0.103, 0.25, -0.007, 0.002, -0.001, 0.014, 0.018, -0.009],
    [1.010, 0.171, 0.115, -0.099, 0.3, 0.000, 0.003, -0.003, 0.015, 0.021, -0.009],
    [1.050, 0.160, 0.114, -0.093, 0.3, 0.007, 0.003, -0.004, 0.015, 0.021, -0.009],
    [1.090, 0.151, 0.111, -0.092, 0.3, 0.010, 0.002, -0.004, 0.014, 0.019, -0.009],
    [1.140, 0.152, 0.111, -0.099, 0.3, 0.010, 0.003, -0.004, 0.013, 0.016, -0.009],
    [1.190, 0.163, 0.118, -0.110, 0.3, 0.010, 0.004, -0.004, 0.012, 0.013, -0.009],
    [1.240, 0.175, 0.122, -0.122, 0.3, 0.010, 0.005, -0.005, 0.011, 0.011, -0.009],
    [1.290, 0.174, 0.108, -0.124, 0.3, 0.009, 0.005, -0.005, 0.010, 0.009, -0.009],
    [1.330, 0.158, 0.089, -0.120, 0.25, 0.008, 0.004, -0.004, 0.008, 0.006, -0.008],
    [1.365, 0.130, 0.067, -0.110, 0.15, 0.007, 0.003, -0.003, 0.006, 0.004, -0.006],
    [1.395, 0.096, 0.043, -0.097, 0.05, 0.004, 0.002, -0.003, 0.005, 0.003, -0.004],
    [1.420, 0.070, 0.024, -0.084, 0.0, 0.003, 0.001, -0.002, 0.004, 0.003, -0.003],
    [1.435, 0.056, 0.016, -0.076, 0.0, 0.003, 0.001, -0.002, 0.004, 0.003, -0.003],
];

/// A hump of reach `r` around `c`: 1 at c, 0 beyond.
fn hump(y: f64, c: f64, r: f64) -> f64 {
    let q = 1.0 - ((y - c) / r) * ((y - c) / r);
    if q > 0.0 { q * q } else { 0.0 }
}

/// Adds trunk, neck, shoulders and buttocks.
pub(super) fn trunk(f: &mut Field, fig: &Figure, j: &Joints) {
    outline(f, fig);
    neck(f, fig);
    shoulder(f, fig, j);
    buttock(f, fig);
    relief(f, fig);
}

/// The trunk as one loft.
fn outline(f: &mut Field, fig: &Figure) {
    let (s, g) = (fig.sex, fig.girth);
    let stations = TRUNK
        .iter()
        .map(|r| {
            let y = r[0];
            // Chest, waist and hip grow the outline around their own height.
            let local = 0.008 * fig.chest * hump(y, 1.25, 0.16)
                + 0.008 * fig.waist * hump(y, 1.05, 0.16)
                + 0.007 * fig.hip * hump(y, 0.89, 0.17);
            let hw = r[1] + s * r[5] + g * r[8] + local;
            let belly = 0.025 * fig.belly * hump(y, 1.04, 0.22);
            let zf = r[2] + s * r[6] + g * r[9] + local + belly;
            let zb = r[3] + s * r[7] + g * r[10] - local;
            let (cz, rz) = (0.5 * (zf + zb), 0.5 * (zf - zb));
            Station {
                t: y,
                c: [0.0, cz, hw, hw, rz, rz, r[4]],
            }
        })
        .collect();
    let frame = Frame::upright(P3d::origin());
    f.add(
        FieldPrimitive::Loft(Loft::new(frame, stations, [0.035, 0.03])),
        0.02,
    );
}

/// A loft that leans forward, from between the shoulders into the skull.
fn neck(f: &mut Field, fig: &Figure) {
    let (s, g) = (fig.sex, fig.girth);
    let base = P3d::new(0.0, 1.395, -0.042);
    let axis = Frame::along(base, P3d::new(0.0, 1.560, -0.004), V3d::z());
    let r = |r: f64| r + 0.0047 * s + 0.0027 * g;
    let st = |t, u: f64, w: f64| Station::ellipse(t, 0.0, 0.0, r(u), r(w));
    let stations = vec![
        st(0.0, 0.067, 0.058),
        st(0.04, 0.059, 0.058),
        st(0.08, 0.055, 0.058),
        st(0.15, 0.056, 0.061),
    ];
    f.add(
        FieldPrimitive::Loft(Loft::new(axis, stations, [0.02, 0.02])),
        0.03,
    );
}

/// Shoulder girdle, deltoid and the muscles around the armpit.
fn shoulder(f: &mut Field, fig: &Figure, j: &Joints) {
    let s = fig.sex;
    // Trapezius and shoulder girdle: from the neck to the acromion.
    let at = |x, y, z| j.shoulder + V3d::new(x, y, z);
    let acromion = at(0.002, 0.006, -0.002);
    let [inner, outer] = [0.049 + 0.002 * s, 0.044 + 0.002 * s];
    f.cone(
        P3d::new(0.030, 1.412, -0.052),
        acromion,
        inner,
        outer,
        0.045,
    );
    // Shoulder blade's upper edge: fills the back between spine and shoulder.
    let behind = acromion + V3d::new(-0.012, -0.014, -0.010);
    f.cone(P3d::new(0.055, 1.335, -0.062), behind, 0.054, 0.044, 0.045);
    // Deltoid.
    f.ellipsoid(
        j.shoulder + V3d::new(0.022, -0.010, 0.002),
        [0.048 + 0.002 * s, 0.052 + 0.002 * s, 0.056 + 0.002 * s],
        0.03,
    );
    // Latissimus and the fold in front of the armpit.
    let [front, back] = [at(-0.005, -0.012, 0.01), at(-0.008, -0.012, -0.015)];
    f.cone(P3d::new(0.100, 1.310, 0.022), front, 0.050, 0.036, 0.03);
    f.cone(P3d::new(0.105, 1.265, -0.055), back, 0.048, 0.036, 0.03);
}

/// Buttock and the fold below it.
fn buttock(f: &mut Field, fig: &Figure) {
    let seat = 0.006 * fig.girth - 0.005 * fig.sex + 0.006 * fig.hip;
    f.ellipsoid(
        [0.074, 0.893, -0.058],
        [0.080 + seat, 0.098 + seat, 0.076 + seat],
        0.045,
    );
    f.bump([0.085, 0.806, -0.105], [0.075, 0.036, 0.055], -0.0045);
}

/// Muscle and fat under the skin.
fn relief(f: &mut Field, fig: &Figure) {
    let (s, g) = (fig.sex, fig.girth);
    // Breast (fades with sex +1) and pectoral.
    let breast = 0.0165 - 0.0165 * s + 0.002 * g + 0.003 * fig.chest * (0.5 - 0.5 * s);
    f.bump([0.078, 1.228, 0.100], [0.075, 0.078, 0.085], breast);
    let pectoral = 0.007 + 0.006 * s;
    f.bump([0.075, 1.262, 0.095], [0.095, 0.075, 0.080], pectoral);
    // Spine furrow, sternum, navel.
    f.bump([0.0, 1.14, -0.085], [0.030, 0.24, 0.05], -0.008 + 0.002 * g);
    f.bump([0.0, 1.255, 0.110], [0.026, 0.11, 0.05], -0.004);
    f.bump([0.0, 1.022, 0.104], [0.012, 0.014, 0.03], -0.007);
    // Shoulder blade.
    f.bump([0.085, 1.295, -0.105], [0.065, 0.10, 0.05], 0.007);
    // Collar bone.
    let collar = 0.005 - 0.001 * g;
    f.bump([0.085, 1.392, 0.030], [0.080, 0.016, 0.035], collar);
    f.bump([0.0, 1.392, 0.040], [0.02, 0.02, 0.03], -0.006);
    // Cleft between the buttocks.
    f.bump([0.0, 0.865, -0.125], [0.024, 0.085, 0.055], -0.022);
    // Pubic mound.
    f.bump([0.0, 0.858, 0.066], [0.050, 0.044, 0.050], 0.003);
    // Crest of the hip bone, front.
    f.bump([0.125, 0.975, 0.060], [0.04, 0.035, 0.05], 0.004);
}

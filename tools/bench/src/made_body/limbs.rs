//! Arms and legs as lofts along their bones.

use super::field::{Field, FieldPrimitive, Frame, Loft, Station};
use super::figure::{Figure, Joints};
use tryon_geometry::math::{P3d, V3d};

/// Shape of one limb segment.
struct Segment<const N: usize> {
    /// Position along the bone (share), centre (u, w), radii (u, w), radius per unit of girth; metres.
    sections: [[f64; 6]; N],
    /// Relative growth of the radii per unit of sex.
    muscle: f64,
    /// Growth of the radii at the hip per unit of hip, metres.
    hip: f64,
    /// Heights of the caps, metres.
    caps: [f64; 2],
    /// Blend radius, metres.
    blend: f64,
}

/// Upper arm; u lies in the plane of the arms (outside of the elbow's bend), w is forward.
const UPPER_ARM: Segment<8> = Segment {
    sections: [
        [-0.08, 0.002, 0.000, 0.0445, 0.0488, 0.0035],
        [0.06, 0.005, 0.001, 0.0488, 0.0562, 0.0040],
        [0.20, 0.007, 0.002, 0.0509, 0.0594, 0.0045],
        [0.38, 0.002, 0.002, 0.0477, 0.0541, 0.0045],
        [0.55, 0.000, 0.003, 0.0456, 0.0519, 0.0045],
        [0.72, 0.000, 0.002, 0.0424, 0.0477, 0.0040],
        [0.88, 0.000, -0.001, 0.0385, 0.0400, 0.0030],
        [1.02, 0.000, -0.003, 0.0360, 0.0365, 0.0020],
    ],
    muscle: 0.055,
    hip: 0.0,
    caps: [0.03, 0.03],
    blend: 0.022,
};
/// Elbow to wrist, as the upper arm.
const FOREARM: Segment<8> = Segment {
    sections: [
        [-0.05, 0.000, -0.003, 0.034, 0.035, 0.0020],
        [0.08, 0.001, 0.000, 0.037, 0.040, 0.0025],
        [0.22, 0.002, 0.003, 0.041, 0.045, 0.0030],
        [0.38, 0.001, 0.002, 0.037, 0.041, 0.0028],
        [0.56, 0.000, 0.001, 0.031, 0.036, 0.0020],
        [0.75, 0.000, 0.000, 0.025, 0.031, 0.0012],
        [0.90, 0.000, 0.000, 0.021, 0.028, 0.0008],
        [1.03, 0.000, 0.000, 0.020, 0.028, 0.0005],
    ],
    muscle: 0.065,
    hip: 0.0,
    caps: [0.03, 0.015],
    blend: 0.03,
};
/// Thigh; u outward, w forward.
const THIGH: Segment<9> = Segment {
    sections: [
        [-0.14, 0.004, -0.004, 0.0700, 0.0800, 0.0070],
        [-0.04, 0.004, -0.005, 0.0815, 0.0920, 0.0080],
        [0.07, 0.001, -0.004, 0.0870, 0.1000, 0.0085],
        [0.18, -0.001, -0.002, 0.0890, 0.1060, 0.0085],
        [0.34, -0.002, 0.002, 0.0860, 0.1000, 0.0078],
        [0.55, -0.003, 0.004, 0.0765, 0.0850, 0.0060],
        [0.75, -0.003, 0.004, 0.0630, 0.0685, 0.0042],
        [0.90, -0.002, 0.001, 0.0515, 0.0560, 0.0032],
        [1.02, 0.000, -0.001, 0.0445, 0.0500, 0.0028],
    ],
    muscle: -0.012,
    hip: 0.006,
    caps: [0.04, 0.03],
    blend: 0.04,
};
/// Knee to ankle; u outward, w forward.
const SHANK: Segment<9> = Segment {
    sections: [
        [-0.04, 0.000, 0.000, 0.0435, 0.0480, 0.0028],
        [0.07, 0.001, -0.004, 0.0475, 0.0510, 0.0030],
        [0.18, 0.003, -0.011, 0.0561, 0.0592, 0.0035],
        [0.30, 0.003, -0.014, 0.0581, 0.0622, 0.0038],
        [0.44, 0.001, -0.012, 0.0520, 0.0571, 0.0034],
        [0.60, 0.000, -0.007, 0.0428, 0.0469, 0.0025],
        [0.76, 0.000, -0.003, 0.0337, 0.0367, 0.0018],
        [0.90, 0.000, -0.003, 0.0316, 0.0367, 0.0012],
        [1.03, 0.000, 0.000, 0.0337, 0.0428, 0.0010],
    ],
    muscle: 0.012,
    hip: 0.0,
    caps: [0.03, 0.02],
    blend: 0.038,
};

/// Adds the tube of one segment from `bone[0]` to `bone[1]`.
fn add_tube<const N: usize>(f: &mut Field, fig: &Figure, bone: [P3d; 2], segment: &Segment<N>) {
    let length = (bone[1] - bone[0]).norm();
    let station = |s: &[f64; 6]| {
        let grow = 1.0 + segment.muscle * fig.sex;
        // Hips reach down to the middle of the thigh; a woman's thigh starts farther out.
        let high = segment.hip * (1.0 - 2.0 * s[0].max(0.0)).max(0.0);
        let add = s[5] * fig.girth + high * fig.hip;
        Station::ellipse(
            s[0] * length,
            s[1] - 0.8 * high * fig.sex,
            s[2],
            s[3] * grow + add,
            s[4] * grow + add,
        )
    };
    let stations = segment.sections.iter().map(station).collect();
    let frame = Frame::along(bone[0], bone[1], V3d::z());
    let loft = Loft::new(frame, stations, segment.caps);
    f.add(FieldPrimitive::Loft(loft), segment.blend);
}

/// Adds upper arm and forearm.
pub(super) fn arm(f: &mut Field, fig: &Figure, j: &Joints) {
    add_tube(f, fig, [j.shoulder, j.elbow], &UPPER_ARM);
    add_tube(f, fig, [j.elbow, j.wrist], &FOREARM);
    // Olecranon: the point of the elbow, behind.
    f.bump(j.elbow + V3d::new(0.006, 0.0, -0.036), [0.030; 3], 0.005);
}

/// Adds thigh and shank.
pub(super) fn leg(f: &mut Field, fig: &Figure, j: &Joints) {
    add_tube(f, fig, [j.hip, j.knee], &THIGH);
    add_tube(f, fig, [j.knee, j.ankle], &SHANK);
    // Kneecap and the hollow of the knee.
    let at = |x, y, z| j.knee + V3d::new(x, y, z);
    f.bump(at(0.0, 0.012, 0.056), [0.032, 0.042, 0.035], 0.004);
    f.bump(at(0.0, 0.0, -0.058), [0.034, 0.055, 0.035], -0.005);
    // Vastus medialis above the knee, inside.
    f.bump(at(-0.036, 0.070, 0.036), [0.035, 0.060, 0.045], 0.005);
}

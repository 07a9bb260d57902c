//! Hands and feet.

use super::field::{Field, FieldPrimitive, Frame, Loft, Station};
use super::figure::{Figure, Joints};
use tryon_geometry::math::{P3d, V3d};

/// A finger of the mean hand, metres.
struct Finger {
    /// Its root: towards the thumb, to the back of the hand, along the hand, from the wrist.
    root: [f64; 3],
    /// Lengths of its segments.
    segments: [f64; 3],
    /// Radius at the root and at the tip.
    radii: [f64; 2],
    /// Spread towards the thumb, tangent.
    spread: f64,
    /// Curl per joint, tangent.
    curl: f64,
}

/// Index to little finger.
#[rustfmt::skip]
const FINGERS: [Finger; 4] = [
    Finger { root: [0.0285, 0.000, 0.088], segments: [0.042, 0.024, 0.017], radii: [0.0096, 0.0074], spread: 0.16, curl: 0.16 },
    Finger { root: [0.0085, 0.001, 0.092], segments: [0.046, 0.028, 0.018], radii: [0.0098, 0.0076], spread: 0.03, curl: 0.18 },
    Finger { root: [-0.0110, 0.000, 0.088], segments: [0.042, 0.026, 0.018], radii: [0.0093, 0.0072], spread: -0.09, curl: 0.20 },
    Finger { root: [-0.0290, -0.002, 0.080], segments: [0.033, 0.020, 0.016], radii: [0.0083, 0.0065], spread: -0.24, curl: 0.22 },
];

/// Sections of the palm along the hand: u to its back, w towards the thumb, metres.
#[rustfmt::skip]
const PALM: [Station; 5] = [
    Station { t: -0.005, c: [0.000, 0.000, 0.0195, 0.0195, 0.0275, 0.0275, 0.1] },
    Station { t: 0.020, c: [0.000, 0.000, 0.0180, 0.0190, 0.0310, 0.0290, 0.3] },
    Station { t: 0.050, c: [0.000, 0.000, 0.0150, 0.0170, 0.0370, 0.0360, 0.4] },
    Station { t: 0.075, c: [0.000, 0.000, 0.0125, 0.0140, 0.0390, 0.0385, 0.4] },
    Station { t: 0.092, c: [0.000, -0.001, 0.0100, 0.0110, 0.0375, 0.0375, 0.4] },
];

/// Segments of the thumb: length, radii at both ends, blend, metres.
const THUMB: [[f64; 4]; 3] = [
    [0.042, 0.0165, 0.0125, 0.014],
    [0.032, 0.0122, 0.0105, 0.005],
    [0.024, 0.0106, 0.0082, 0.004],
];

/// Frame of a hand: a along it, w towards the thumb (forward), u to its back; sizes relative to the mean hand.
struct Hand {
    frame: Frame,
    size: f64,
}

/// Adds a hand.
pub(super) fn hand(f: &mut Field, fig: &Figure, j: &Joints) {
    let hand = Hand {
        frame: Frame::along(j.wrist, j.hand_end, V3d::z()),
        size: fig.hand(),
    };
    hand.palm(f);
    FINGERS.iter().for_each(|finger| hand.finger(f, finger));
    hand.thumb(f);
    hand.relief(f);
}

impl Hand {
    /// A point `w` towards the thumb, `u` to the back and `t` along the mean hand, metres.
    fn at(&self, w: f64, u: f64, t: f64) -> P3d {
        self.frame
            .point(u * self.size, w * self.size, t * self.size)
    }
    fn palm(&self, f: &mut Field) {
        let size = self.size;
        let palm = PALM.map(|s| Station {
            t: s.t * size,
            c: std::array::from_fn(|k| if k < 6 { s.c[k] * size } else { s.c[k] }),
        });
        let loft = Loft::new(self.frame, palm.to_vec(), [0.02, 0.012]);
        f.add(FieldPrimitive::Loft(loft), 0.012);
    }
    fn finger(&self, f: &mut Field, finger: &Finger) {
        let Frame { a, u, w, .. } = self.frame;
        let size = self.size;
        // The first segment begins inside the palm.
        let mut p = self.at(finger.root[0] * 0.9, finger.root[1], finger.root[2] - 0.012);
        let mut dir = (a + w * finger.spread - u * 0.05).normalize();
        let total: f64 = finger.segments.iter().sum();
        let mut done = 0.0;
        let radius =
            |d: f64| size * (finger.radii[0] + (finger.radii[1] - finger.radii[0]) * d / total);
        for (k, &l) in finger.segments.iter().enumerate() {
            let l = if k == 0 { l + 0.010 } else { l };
            let q = p + dir * (l * size);
            let end = (done + l).min(total);
            f.cone(p, q, radius(done), radius(end), 0.004);
            dir = (dir - u * finger.curl).normalize();
            done = end;
            p = q;
        }
    }
    /// From the root of the hand, forward and towards the palm.
    fn thumb(&self, f: &mut Field) {
        let Frame { a, u, w, .. } = self.frame;
        let mut p = self.at(0.020, -0.006, 0.018);
        let mut dir = (a * 0.72 + w * 0.66 - u * 0.30).normalize();
        for [l, r0, r1, blend] in THUMB {
            let q = p + dir * (l * self.size);
            f.cone(p, q, r0 * self.size, r1 * self.size, blend);
            dir = (dir + a * 0.14).normalize();
            p = q;
        }
    }
    /// Heel of the hand on the side of the little finger, knuckles, head of the ulna.
    fn relief(&self, f: &mut Field) {
        let size = self.size;
        let frame_at = |origin| Frame {
            origin,
            ..self.frame
        };
        let heel = frame_at(self.at(-0.024, -0.016, 0.035));
        f.bump_in(heel, [0.02 * size, 0.022 * size, 0.04 * size], 0.004);
        for finger in &FINGERS {
            let knuckle = self.at(finger.root[0] * 0.95, 0.011, finger.root[2] - 0.006);
            f.bump_in(frame_at(knuckle), [0.010, 0.010, 0.014], 0.0025);
        }
        let ulna = frame_at(self.at(-0.022, 0.014, -0.014));
        f.bump_in(ulna, [0.014, 0.014, 0.016], 0.004);
    }
}

/// Foot sections: z from the ankle, half width, top, x offset, metres; the sole lies on y = 0.
const FOOT: [[f64; 4]; 8] = [
    [-0.032, 0.0290, 0.064, 0.000],
    [-0.016, 0.0320, 0.084, 0.000],
    [0.005, 0.0330, 0.092, 0.001],
    [0.035, 0.0335, 0.086, 0.003],
    [0.065, 0.0360, 0.069, 0.006],
    [0.095, 0.0415, 0.052, 0.009],
    [0.122, 0.0450, 0.038, 0.011],
    [0.145, 0.0445, 0.028, 0.011],
];

/// Toes: x from the foot's middle towards the body (big toe first), length beyond the ball, radius.
const TOES: [[f64; 3]; 5] = [
    [-0.028, 0.070, 0.0135],
    [-0.007, 0.068, 0.0100],
    [0.009, 0.060, 0.0093],
    [0.023, 0.050, 0.0088],
    [0.035, 0.038, 0.0085],
];

/// Adds a foot.
pub(super) fn foot(f: &mut Field, fig: &Figure, j: &Joints) {
    let size = fig.foot();
    let stations = FOOT
        .iter()
        .map(|r| {
            let (hw, top, x) = (r[1] * size, r[2] * size, r[3] * size);
            // u = x outward, w = up; the section's middle is low, so the foot is wide at the sole.
            let mid = 0.38 * top;
            Station {
                t: r[0] * size,
                c: [x, mid, hw, hw, top - mid, mid, 0.35],
            }
        })
        .collect();
    let frame = Frame {
        origin: P3d::new(j.ankle.x, 0.0, j.ankle.z),
        u: V3d::x(),
        w: V3d::y(),
        a: V3d::z(),
    };
    f.add(
        FieldPrimitive::Loft(Loft::new(frame, stations, [0.020, 0.012])),
        0.022,
    );
    for t in TOES {
        let x = j.ankle.x + (0.011 + t[0]) * size;
        let r = t[2] * size;
        let z = j.ankle.z + 0.128 * size;
        let turn = 0.05 * t[1];
        f.cone(
            P3d::new(x, r + 0.002, z),
            P3d::new(x + turn, r * 0.95, z + t[1] * size - r),
            r * 1.02,
            r * 0.92,
            0.006,
        );
    }
    // Malleoli, Achilles tendon hollows, arch.
    let at = |x, y, z| j.ankle + V3d::new(x, y, z);
    f.bump(at(-0.034, 0.010, 0.006), [0.018, 0.020, 0.020], 0.006);
    f.bump(at(0.034, -0.002, -0.004), [0.018, 0.020, 0.020], 0.006);
    for x in [-0.026, 0.026] {
        f.bump(at(x, 0.006, -0.032), [0.020, 0.045, 0.020], -0.005);
    }
    let arch = P3d::new(j.ankle.x - 0.030, 0.008, j.ankle.z + 0.050);
    f.bump(arch, [0.026, 0.022, 0.050], -0.008);
}

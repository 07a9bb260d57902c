//! Which vertices of the body are forearms, hands, face and trunk, and where the arms are now.

use crate::body::Template;
use crate::math::{P3, V3};

/// Parts of a template by vertex, for [`super::BodyView`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Limbs {
    pub(super) arms: [Arm; 2],
    /// Front of the face, without brow and chin.
    pub(super) face: Vec<u32>,
    /// Trunk, hips and thighs.
    pub(super) trunk: Vec<u32>,
    /// Upper arm, forearm or hand, shape `[vertices]`.
    is_arm: Vec<bool>,
}

/// Vertices of one arm.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Arm {
    pub(super) forearm: Vec<u32>,
    pub(super) hand: Vec<u32>,
    /// Rings whose middles are the elbow, the wrist and the finger tips.
    rings: [Vec<u32>; 3],
}

/// Where an arm is: the bones of forearm and hand, metres, in the frame of the vertices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bones {
    pub(super) elbow: P3,
    pub(super) wrist: P3,
    pub(super) tip: P3,
}

/// A place near an arm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    /// Along the bones: 0 elbow, 1 wrist, 2 finger tips.
    pub(super) along: f32,
    /// From the bone, metres.
    pub(super) away: f32,
}

/// Half the length of the rings at elbow, wrist and tips, as a share of the bone.
const RING: f64 = 0.08;
/// The face, as shares of the head's extent: upwards from the chin, and how much of the front.
const FACE: [f32; 2] = [0.2, 0.6];
const FACE_FRONT: f32 = 0.75;

impl Limbs {
    /// Of a template whose joints have SMPL's names; empty for others, and then colour decides nothing.
    pub fn of(template: &Template) -> Self {
        let joints = template.skeleton().joints();
        let index = |name: String| template.skeleton().index(&name);
        let below = |mut j: usize, top: usize| loop {
            if j == top {
                return true;
            }
            match joints[j].parent {
                Some(p) => j = p,
                None => return false,
            }
        };
        let rest = template.mesh().vertices();
        let owner = |v: usize| template.weights().dominant(v);
        let mut out = Self {
            is_arm: vec![false; rest.len()],
            ..Self::default()
        };
        for (side, arm) in ["left", "right"].into_iter().zip(&mut out.arms) {
            let [shoulder, elbow, wrist] =
                ["shoulder", "elbow", "wrist"].map(|n| index(format!("{side}_{n}")));
            let (Some(shoulder), Some(elbow), Some(wrist)) = (shoulder, elbow, wrist) else {
                return Self::default();
            };
            let mut along = Vec::new();
            let mut reach: f64 = 0.0;
            let (e, w) = (joints[elbow].rest, joints[wrist].rest);
            let axis = w - e;
            for v in 0..rest.len() {
                out.is_arm[v] |= below(owner(v), shoulder);
                if !below(owner(v), elbow) {
                    continue;
                }
                let t = (rest[v].cast::<f64>() - e).dot(&axis) / axis.norm_squared();
                reach = reach.max(t);
                along.push((v as u32, t));
                let part = if below(owner(v), wrist) {
                    &mut arm.hand
                } else {
                    &mut arm.forearm
                };
                part.push(v as u32);
            }
            for (ring, at) in arm.rings.iter_mut().zip([0.0, 1.0, reach]) {
                ring.extend(
                    along
                        .iter()
                        .filter(|(_, t)| (t - at).abs() < RING)
                        .map(|(v, _)| *v),
                );
            }
        }
        let head: Vec<u32> = match index("head".into()) {
            Some(head) => (0..rest.len())
                .filter(|&v| below(owner(v), head))
                .map(|v| v as u32)
                .collect(),
            None => Vec::new(),
        };
        let extent = |axis: usize| {
            head.iter()
                .map(|&v| rest[v as usize][axis])
                .fold([f32::INFINITY, f32::NEG_INFINITY], |[lo, hi], x| {
                    [lo.min(x), hi.max(x)]
                })
        };
        let ([y0, y1], [z0, z1]) = (extent(1), extent(2));
        out.face.extend(head.iter().copied().filter(|&v| {
            let p = rest[v as usize];
            let up = (p.y - y0) / (y1 - y0);
            (FACE[0]..FACE[1]).contains(&up) && p.z - z0 > FACE_FRONT * (z1 - z0)
        }));
        let trunk = [
            "pelvis",
            "spine1",
            "spine2",
            "spine3",
            "left_hip",
            "right_hip",
        ]
        .map(|n| index(n.into()));
        out.trunk.extend(
            (0..rest.len())
                .filter(|&v| trunk.contains(&Some(owner(v))))
                .map(|v| v as u32),
        );
        out
    }

    /// Belongs to an arm.
    pub(super) fn is_arm(&self, vertex: u32) -> bool {
        self.is_arm.get(vertex as usize) == Some(&true)
    }

    /// Made for a body of so many vertices.
    pub(super) fn fit(&self, vertices: usize) -> bool {
        vertices > 0 && self.is_arm.len() == vertices
    }
}

#[cfg(test)]
impl Limbs {
    pub(super) fn new(arms: [Arm; 2], face: Vec<u32>, trunk: Vec<u32>, is_arm: Vec<bool>) -> Self {
        Self {
            arms,
            face,
            trunk,
            is_arm,
        }
    }
}

#[cfg(test)]
impl Arm {
    pub(super) fn new(forearm: Vec<u32>, hand: Vec<u32>, rings: [Vec<u32>; 3]) -> Self {
        Self {
            forearm,
            hand,
            rings,
        }
    }
}

impl Arm {
    /// Where it is on a posed body; `None` when it has no vertices or they are not finite.
    pub(super) fn bones(&self, body: &[P3]) -> Option<Bones> {
        let middle = |ring: &[u32]| {
            let sum: V3 = ring.iter().map(|&v| body[v as usize].coords).sum();
            let p = P3::from(sum / ring.len() as f32);
            p.iter().all(|c| c.is_finite()).then_some(p)
        };
        let [elbow, wrist, tip] = self.rings.each_ref().map(|r| middle(r));
        Some(Bones {
            elbow: elbow?,
            wrist: wrist?,
            tip: tip?,
        })
    }
}

impl Bones {
    /// The nearest place on the bones; beyond the tips the hand goes on.
    #[inline]
    pub(super) fn place(&self, p: &P3) -> Place {
        let along = |a: &P3, b: &P3, last: f32| {
            let d = b - a;
            let t = ((p - a).dot(&d) / d.norm_squared().max(f32::MIN_POSITIVE)).clamp(0.0, last);
            (t, (p - (a + d * t)).norm_squared())
        };
        let (s, ds) = along(&self.elbow, &self.wrist, 1.0);
        let (t, dt) = along(&self.wrist, &self.tip, 1.0);
        if dt <= ds {
            Place {
                along: 1.0 + t,
                away: dt.sqrt(),
            }
        } else {
            Place {
                along: s,
                away: ds.sqrt(),
            }
        }
    }

    /// From where on the arm is bare: 0 the whole forearm, 1 the hand only. A sleeve goes round the arm; a shirt that
    /// an arm lies on is on one side of it.
    pub(super) fn bare_from(&self, garments: &[P3]) -> f32 {
        let axis = (self.wrist - self.elbow).normalize();
        let side = axis
            .cross(&if axis.x.abs() < 0.6 { V3::x() } else { V3::y() })
            .normalize();
        let other = axis.cross(&side);
        let mut seen = [0u8; SLICES];
        for p in garments {
            let d = p - self.elbow;
            let t = d.dot(&axis) / (self.wrist - self.elbow).norm();
            let (x, y) = (d.dot(&side), d.dot(&other));
            if (0.0..1.0).contains(&t) && x * x + y * y < SLEEVE * SLEEVE {
                let octant = usize::from(x < 0.0) * 4
                    + usize::from(y < 0.0) * 2
                    + usize::from(x.abs() < y.abs());
                seen[(t * SLICES as f32) as usize] |= 1 << octant;
            }
        }
        // From the elbow on: at the wrist a shirt may hang round a hand that rests on it.
        let bare = seen.iter().position(|s| s.count_ones() < AROUND);
        bare.map_or(1.0, |k| k as f32 / SLICES as f32)
    }
}

/// Slices of the forearm that are asked for a sleeve: about five centimetres, more than a garment's edges.
const SLICES: usize = 5;
/// Octants in which a sleeve must be found.
const AROUND: u32 = 6;
/// A sleeve is at most this far from the bone, metres.
const SLEEVE: f32 = 0.10;

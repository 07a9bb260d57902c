//! Room for cloth inside bent elbows and knees.
//!
//! Flesh gives way where a limb is folded; a skinned surface does not, it lies in itself. Cloth in there is held by two skins
//! that each push it into the other: a long sleeve tore, and the elbow came through. So cloth meets skin that ends half-way
//! between the limbs, as [`Apart`](super::Apart) does between parts of the body.

use super::SurfaceModel;
use crate::math::{P3, V3};

/// A joint between two limbs.
#[derive(Clone, Debug)]
pub struct Crease {
    /// Vertices that move with the upper limb and with the lower one.
    limbs: [Vec<u32>; 2],
    /// Those where they meet.
    ring: Vec<u32>,
}

/// Cosines of the angles between limbs from which on there is some room, 110°, and all of it, 80°.
const BENT: [f32; 2] = [-0.34, 0.17];
/// All of it is made so far in front of the joint's middle, metres.
const FRONT: f32 = 0.03;
/// Thickness of a slice in which limbs are compared, metres, and how many there are.
const SLICE: f32 = 0.02;
const SLICES: usize = 12;
/// Where limbs just touch, there is at most so much room, metres; all of it where they lie in each other: cloth that has room
/// lies below the skin as it is measured, by up to half of it.
const TOUCHING: f32 = 0.007;
/// On which side of the plane between them the limbs lie.
const SIDES: [f32; 2] = [-1.0, 1.0];

/// How a joint is bent.
struct Bend {
    /// Middle of the joint, metres.
    joint: V3,
    /// Unit vector in front of it, between the limbs, and the one from the upper limb to the lower one.
    front: V3,
    across: V3,
    /// Share of the room that is made at this angle.
    share: f32,
}

impl Bend {
    /// Slices from the joint to `p`, and how far it is on the lower limb's side, metres.
    fn place(&self, p: &P3) -> (f32, f32) {
        let d = p.coords - self.joint;
        (d.dot(&self.front) / SLICE, d.dot(&self.across))
    }
}

/// How far a limb reaches towards the other one in each slice, metres; nothing where it is not.
struct Reach([Option<f32>; SLICES]);

impl Reach {
    /// Between the middles of two slices.
    fn at(&self, slice: f32) -> Option<f32> {
        let from = (slice - 0.5).max(0.0);
        let low = self.0.get(from as usize).copied().flatten()?;
        let high = self
            .0
            .get(from as usize + 1)
            .copied()
            .flatten()
            .unwrap_or(low);
        Some(low + (high - low) * from.fract())
    }
}

impl Crease {
    /// From the vertices of both limbs; `None` where they do not meet.
    pub fn new(surface: &SurfaceModel, upper: Vec<u32>, lower: Vec<u32>) -> Option<Self> {
        let mut of = vec![0u8; surface.vertices()];
        upper.iter().for_each(|v| of[*v as usize] = 1);
        lower.iter().for_each(|v| of[*v as usize] = 2);
        let meets = |v: &&u32| {
            surface
                .neighbours(**v)
                .iter()
                .any(|w| of[*w as usize] + of[**v as usize] == 3)
        };
        let ring: Vec<u32> = upper.iter().chain(&lower).filter(meets).copied().collect();
        (!ring.is_empty()).then_some(Self {
            limbs: [upper, lower],
            ring,
        })
    }
    /// Moves skin of a body back until `room` metres are left between the limbs in front of the joint, half of what is lacking
    /// on either side. Vertices in any frame, metres.
    pub fn make_room(&self, body: &mut [P3], room: f32) {
        let Some(bend) = self.bend(body) else { return };
        let reach = [self.reach(body, &bend, 0), self.reach(body, &bend, 1)];
        for (limb, side) in self.limbs.iter().zip(SIDES) {
            for p in limb.iter().map(|v| *v as usize) {
                let (slice, across) = bend.place(&body[p]);
                let share = bend.share * (slice * SLICE / FRONT).clamp(0.0, 1.0);
                let (true, Some(upper), Some(lower)) =
                    (share > 0.0, reach[0].at(slice), reach[1].at(slice))
                else {
                    continue;
                };
                let room = room.min(TOUCHING + (upper + lower).max(0.0));
                let lacking = room + upper + lower;
                let own = if side < 0.0 { upper } else { lower };
                let over = -side * across - (own - 0.5 * lacking);
                if lacking > 0.0 && over > 0.0 {
                    body[p] += bend.across * (side * share * over);
                }
            }
        }
    }
    /// How it is bent; `None` where it is not, or has no direction.
    fn bend(&self, body: &[P3]) -> Option<Bend> {
        let middle = |of: &[u32]| {
            of.iter()
                .fold(V3::zeros(), |s, v| s + body[*v as usize].coords)
                / of.len().max(1) as f32
        };
        let joint = middle(&self.ring);
        let [upper, lower] = self
            .limbs
            .each_ref()
            .map(|limb| (middle(limb) - joint).try_normalize(0.0));
        let (upper, lower) = (upper?, lower?);
        let share = ((upper.dot(&lower) - BENT[0]) / (BENT[1] - BENT[0])).clamp(0.0, 1.0);
        let (front, across) = (
            (upper + lower).try_normalize(0.0)?,
            (lower - upper).try_normalize(0.0)?,
        );
        (share > 0.0).then_some(Bend {
            joint,
            front,
            across,
            share,
        })
    }
    fn reach(&self, body: &[P3], bend: &Bend, limb: usize) -> Reach {
        let mut reach = [None; SLICES];
        for v in &self.limbs[limb] {
            let (slice, across) = bend.place(&body[*v as usize]);
            if let Some(r) = reach.get_mut(slice as usize).filter(|_| slice >= 0.0) {
                let far = -SIDES[limb] * across;
                *r = Some(r.map_or(far, |r: f32| r.max(far)));
            }
        }
        Reach(reach)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Topology, TriMesh};
    use nalgebra::{Rotation3, Vector3};

    const ALONG: usize = 60;
    const AROUND: usize = 24;

    /// A tube of 4 cm radius and 60 cm length along x, bent in its middle by an angle about z, skinned over 6 cm.
    fn arm(angle: f32) -> (Vec<P3>, Crease) {
        let (mut vertices, mut faces) = (Vec::new(), Vec::new());
        for i in 0..=ALONG {
            let x = 0.6 * (i as f32 / ALONG as f32 - 0.5);
            let share = (x / 0.06 + 0.5).clamp(0.0, 1.0);
            for j in 0..AROUND {
                let turn = std::f32::consts::TAU * j as f32 / AROUND as f32;
                let p = P3::new(x, 0.04 * turn.cos(), 0.04 * turn.sin());
                let bent = Rotation3::from_axis_angle(&Vector3::z_axis(), angle) * p;
                vertices.push(P3::from(p.coords * (1.0 - share) + bent.coords * share));
                if i < ALONG {
                    let at = |i: usize, j: usize| (i * AROUND + j % AROUND) as u32;
                    faces.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
                    faces.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
                }
            }
        }
        let mesh = TriMesh::new(vertices.clone(), faces.clone()).expect("a tube");
        let model = SurfaceModel::new(
            faces,
            Topology::new(&mesh).expect("topology"),
            vec![1; vertices.len()],
        );
        let half = (ALONG / 2 * AROUND) as u32;
        let crease = Crease::new(
            &model,
            (0..half).collect(),
            (half..vertices.len() as u32).collect(),
        );
        assert!(
            Crease::new(&model, vec![0], vec![half * 2]).is_none(),
            "they are far apart"
        );
        (vertices, crease.expect("they meet"))
    }
    /// Least distance of the limbs along the way from one to the other, in front of the joint, m.
    fn gap(crease: &Crease, body: &[P3]) -> f32 {
        let bend = crease.bend(body).expect("bent");
        let place = |v: &u32| {
            (
                body[*v as usize].coords - bend.joint,
                bend.place(&body[*v as usize]),
            )
        };
        let mut least = f32::INFINITY;
        for (a, (slice, upper)) in crease.limbs[0].iter().map(place) {
            for (b, (other, lower)) in crease.limbs[1].iter().map(place) {
                let front = FRONT / SLICE;
                let beside = (slice - other).abs() * SLICE < 0.005 && (a.z - b.z).abs() < 0.005;
                if beside && slice > front && other > front {
                    least = least.min(lower - upper);
                }
            }
        }
        least
    }

    #[test]
    fn a_folded_arm_has_room_for_two_layers_and_its_outside_stays() {
        const ROOM: f32 = 0.013;
        for angle in [1.9, 2.2, 2.5f32] {
            let (before, crease) = arm(angle);
            let mut body = before.clone();
            crease.make_room(&mut body, ROOM);
            let (was, is) = (gap(&crease, &before), gap(&crease, &body));
            assert!(was < 0.0, "bent by {angle} it lies in itself: {was}");
            assert!(is > 0.99 * TOUCHING && is < ROOM, "bent by {angle}: {is} m");
            let bend = crease.bend(&before).expect("bent");
            let moved = |v: &usize| before[*v] != body[*v];
            assert!(
                (0..body.len())
                    .filter(moved)
                    .all(|v| bend.place(&before[v]).0 > 0.0),
                "only in front"
            );
            assert!((0..body.len()).filter(moved).count() < body.len() / 3);
            // Elsewhere and otherwise turned it is the same.
            let there = |p: &P3| {
                P3::from(
                    Rotation3::from_euler_angles(0.4, -1.0, 2.0) * p.coords
                        + V3::new(1.0, 2.0, 3.0),
                )
            };
            let mut turned: Vec<P3> = before.iter().map(there).collect();
            crease.make_room(&mut turned, ROOM);
            assert!(
                turned
                    .iter()
                    .zip(&body)
                    .all(|(a, b)| (a - there(b)).norm() < 1e-4)
            );
        }
    }

    #[test]
    fn a_straight_arm_and_one_that_is_bent_a_little_stay_as_they_are() {
        for angle in [0.0, 0.6, 1.1f32] {
            let (before, crease) = arm(angle);
            let mut body = before.clone();
            crease.make_room(&mut body, 0.013);
            assert_eq!(body, before, "{angle}");
        }
        // A point has no limbs.
        let (before, crease) = arm(2.0);
        let mut body = vec![P3::origin(); before.len()];
        crease.make_room(&mut body, 0.013);
        assert!(body.iter().all(|p| *p == P3::origin()));
    }
}

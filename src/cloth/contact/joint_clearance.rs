//! Separation of the segments of bent elbows and knees, so that cloth fits into the crook.
//!
//! Flesh in the crook deforms; skinned segments penetrate each other and would push cloth into one another. The segments
//! are compared slice by slice in front of the joint, as [`part_clearance`](super::part_clearance) compares parts.

use super::SurfaceModel;
use crate::settings::{CollisionConfig, JointClearanceSettings};
use tryon_geometry::math::{P3, V3};

/// A hinge joint between two segments of a limb.
#[derive(Clone, Debug)]
pub(super) struct JointClearance {
    /// Vertices of the upper and of the lower segment.
    segments: [Vec<u32>; 2],
    /// Vertices where they meet.
    ring: Vec<u32>,
}

/// Number of slices.
const SLICES: usize = 12;
/// Sides of the bisecting plane on which the upper and the lower segment lie.
const SIDES: [f32; 2] = [-1.0, 1.0];

/// Frame of a bent joint.
struct Bend {
    /// Centre of the ring, metres.
    joint: V3,
    /// Unit vector into the crook, and the one from the upper to the lower segment.
    front: V3,
    across: V3,
    /// Share of the separation at this angle.
    share: f32,
    /// Thickness of a slice, metres.
    slice: f32,
}

impl Bend {
    /// Slices in front of the joint, and distance towards the lower segment, metres.
    fn coordinates(&self, p: &P3) -> (f32, f32) {
        let d = p.coords - self.joint;
        (d.dot(&self.front) / self.slice, d.dot(&self.across))
    }
}

/// LimbExtent of a segment towards the other one in each slice, metres; `None` in empty slices.
struct LimbExtent([Option<f32>; SLICES]);

impl LimbExtent {
    /// Interpolated between the centres of two slices.
    fn at(&self, slice: f32) -> Option<f32> {
        let from = (slice - 0.5).max(0.0);
        let of = |k: usize| self.0.get(k).copied().flatten();
        let low = of(from as usize)?;
        let high = of(from as usize + 1).unwrap_or(low);
        Some(low + (high - low) * from.fract())
    }
}

impl JointClearance {
    /// Takes the vertices of both segments; `None` where they do not meet.
    pub(super) fn new(surface: &SurfaceModel, [upper, lower]: [Vec<u32>; 2]) -> Option<Self> {
        let mut of = vec![0u8; surface.vertices()];
        upper.iter().for_each(|v| of[*v as usize] = 1);
        lower.iter().for_each(|v| of[*v as usize] = 2);
        let meets = |v: &&u32| {
            let mut around = surface.neighbours(**v).iter();
            around.any(|w| of[*w as usize] + of[**v as usize] == 3)
        };
        let ring: Vec<u32> = upper.iter().chain(&lower).filter(meets).copied().collect();
        (!ring.is_empty()).then_some(Self {
            segments: [upper, lower],
            ring,
        })
    }

    /// Displaces vertices until the clearance is left between the segments, half of what is missing on either side. Any
    /// frame, metres.
    pub(super) fn apply(&self, config: &CollisionConfig, body: &mut [P3]) {
        let settings = &config.joints;
        let Some(bend) = self.bend(settings, body) else {
            return;
        };
        let extents = [self.extent(body, &bend, 0), self.extent(body, &bend, 1)];
        for (segment, side) in self.segments.iter().zip(SIDES) {
            for p in segment.iter().map(|v| *v as usize) {
                let (slice, across) = bend.coordinates(&body[p]);
                let share = bend.share * (slice * settings.slice / settings.front).clamp(0.0, 1.0);
                let (true, Some(upper), Some(lower)) =
                    (share > 0.0, extents[0].at(slice), extents[1].at(slice))
                else {
                    continue;
                };
                let wanted = config
                    .clearance
                    .min(settings.touching + (upper + lower).max(0.0));
                let missing = wanted + upper + lower;
                let own = if side < 0.0 { upper } else { lower };
                let beyond = -side * across - (own - 0.5 * missing);
                if missing > 0.0 && beyond > 0.0 {
                    body[p] += bend.across * (side * share * beyond);
                }
            }
        }
    }

    /// `None` for a joint that is straight or has no direction.
    fn bend(&self, settings: &JointClearanceSettings, body: &[P3]) -> Option<Bend> {
        let centre = |of: &[u32]| {
            let at = of.iter().map(|v| body[*v as usize].coords);
            at.fold(V3::zeros(), |s, p| s + p) / of.len().max(1) as f32
        };
        let joint = centre(&self.ring);
        let [upper, lower] = self
            .segments
            .each_ref()
            .map(|segment| (centre(segment) - joint).try_normalize(0.0));
        let (upper, lower) = (upper?, lower?);
        let [begin, full] = settings.bent;
        let share = ((upper.dot(&lower) - begin) / (full - begin)).clamp(0.0, 1.0);
        let (front, across) = (
            (upper + lower).try_normalize(0.0)?,
            (lower - upper).try_normalize(0.0)?,
        );
        (share > 0.0).then_some(Bend {
            joint,
            front,
            across,
            share,
            slice: settings.slice,
        })
    }

    fn extent(&self, body: &[P3], bend: &Bend, segment: usize) -> LimbExtent {
        let mut extent = [None; SLICES];
        for v in &self.segments[segment] {
            let (slice, across) = bend.coordinates(&body[*v as usize]);
            if let Some(e) = extent.get_mut(slice as usize).filter(|_| slice >= 0.0) {
                let far = -SIDES[segment] * across;
                *e = Some(e.map_or(far, |e: f32| e.max(far)));
            }
        }
        LimbExtent(extent)
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_shapes::surface;
    use super::*;
    use nalgebra::{Rotation3, Vector3};
    use tryon_geometry::mesh::TriMesh;

    const ALONG: usize = 60;
    const AROUND: usize = 24;

    /// A tube of 4 cm radius and 60 cm length along x, bent in its middle by an angle about z, skinned over 6 cm.
    fn arm(angle: f32) -> (Vec<P3>, JointClearance) {
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
        let mesh = TriMesh::new(vertices.clone(), faces).expect("a tube");
        let (model, _) = surface(&mesh, vec![1; vertices.len()]);
        let half = (ALONG / 2 * AROUND) as u32;
        let joint = JointClearance::new(
            &model,
            [(0..half).collect(), (half..vertices.len() as u32).collect()],
        );
        assert!(
            JointClearance::new(&model, [vec![0], vec![half * 2]]).is_none(),
            "they are far apart"
        );
        (vertices, joint.expect("they meet"))
    }
    /// Least distance of the segments across the crook, in front of the joint, metres.
    fn gap(joint: &JointClearance, body: &[P3]) -> f32 {
        let settings = JointClearanceSettings::default();
        let bend = joint.bend(&settings, body).expect("bent");
        let at = |v: &u32| {
            (
                body[*v as usize].coords - bend.joint,
                bend.coordinates(&body[*v as usize]),
            )
        };
        let mut least = f32::INFINITY;
        for (a, (slice, upper)) in joint.segments[0].iter().map(at) {
            for (b, (other, lower)) in joint.segments[1].iter().map(at) {
                let front = settings.front / settings.slice;
                let beside =
                    (slice - other).abs() * settings.slice < 0.005 && (a.z - b.z).abs() < 0.005;
                if beside && slice > front && other > front {
                    least = least.min(lower - upper);
                }
            }
        }
        least
    }

    #[test]
    fn folded_arm_gets_clearance_in_the_crook_only_in_any_frame() {
        let config = CollisionConfig::default();
        for angle in [1.9, 2.2, 2.5f32] {
            let (before, joint) = arm(angle);
            let mut body = before.clone();
            joint.apply(&config, &mut body);
            let (was, is) = (gap(&joint, &before), gap(&joint, &body));
            assert!(was < 0.0, "bent by {angle} it lies in itself: {was}");
            assert!(
                is > 0.99 * config.joints.touching && is < config.clearance,
                "bent by {angle}: {is} m"
            );
            let bend = joint.bend(&config.joints, &before).expect("bent");
            let moved = |v: &usize| before[*v] != body[*v];
            assert!(
                (0..body.len())
                    .filter(moved)
                    .all(|v| bend.coordinates(&before[v]).0 > 0.0),
                "only in front"
            );
            assert!((0..body.len()).filter(moved).count() < body.len() / 3);
            // Equivariant under rigid motion.
            let moved_to = |p: &P3| {
                P3::from(
                    Rotation3::from_euler_angles(0.4, -1.0, 2.0) * p.coords
                        + V3::new(1.0, 2.0, 3.0),
                )
            };
            let mut turned: Vec<P3> = before.iter().map(moved_to).collect();
            joint.apply(&config, &mut turned);
            assert!(
                turned
                    .iter()
                    .zip(&body)
                    .all(|(a, b)| (a - moved_to(b)).norm() < 1e-4)
            );
        }
    }

    #[test]
    fn straight_and_slightly_bent_arms_stay() {
        for angle in [0.0, 0.6, 1.1f32] {
            let (before, joint) = arm(angle);
            let mut body = before.clone();
            joint.apply(&CollisionConfig::default(), &mut body);
            assert_eq!(body, before, "{angle}");
        }
        // Degenerate: all vertices in one point.
        let (before, joint) = arm(2.0);
        let mut body = vec![P3::origin(); before.len()];
        joint.apply(&CollisionConfig::default(), &mut body);
        assert!(body.iter().all(|p| *p == P3::origin()));
    }
}

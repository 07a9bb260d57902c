//! Reskinning: cloth of a body that teleported moves with the rigid motions of its joints, blended like skin.

use nalgebra::{
    Isometry3, Matrix3, Matrix3x4, Point3, Rotation3, Translation3, UnitQuaternion, Vector3,
};
use tryon_body::SkinWeights;
use tryon_geometry::math::{P3, polar_rotation_3};

/// Smoothing iterations of skin weights over cloth neighbours, a hand's width: else edges between two limbs tear.
const SMOOTHING: usize = 6;

/// Moments of the vertices of one joint in two poses.
#[derive(Clone, Copy)]
struct Moments {
    count: f64,
    from: Vector3<f64>,
    to: Vector3<f64>,
    product: Matrix3<f64>,
}

impl Moments {
    const ZERO: Self = Self {
        count: 0.0,
        from: Vector3::new(0.0, 0.0, 0.0),
        to: Vector3::new(0.0, 0.0, 0.0),
        product: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    };
    fn plus(&self, o: &Self) -> Self {
        Self {
            count: self.count + o.count,
            from: self.from + o.from,
            to: self.to + o.to,
            product: self.product + o.product,
        }
    }
    /// Rigid motion that fits best (Kabsch).
    fn motion(&self) -> Isometry3<f64> {
        let (from, to) = (self.from / self.count, self.to / self.count);
        let r = polar_rotation_3(&(self.product - to * from.transpose() * self.count));
        let q = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(r));
        Isometry3::from_parts(Translation3::from(to - q * from), q)
    }
}

/// Rigid motion of each joint's dominant vertices between two poses, metres.
fn joint_motions(body: &Teleport<'_>) -> Vec<Isometry3<f64>> {
    let mut moments = vec![Moments::ZERO; body.joints];
    for (i, (a, b)) in body.from.iter().zip(body.to).enumerate() {
        let (a, b) = (a.coords.cast::<f64>(), b.coords.cast::<f64>());
        let m = &mut moments[body.weights.dominant(i)];
        m.count += 1.0;
        m.from += a;
        m.to += b;
        m.product += b * a.transpose();
    }
    let all = moments.iter().fold(Moments::ZERO, |sum, m| sum.plus(m));
    let whole = if all.count >= 1.0 {
        all.motion()
    } else {
        Isometry3::identity()
    };
    let motion = |m: &Moments| {
        if m.count >= body.joint_vertices {
            m.motion()
        } else {
            whole
        }
    };
    moments.iter().map(motion).collect()
}

/// Body in two poses, metres, and how its vertices follow the joints.
pub(in crate::live) struct Teleport<'a> {
    /// Vertices that determine a rotation.
    pub(in crate::live) joint_vertices: f64,
    pub(in crate::live) weights: &'a SkinWeights,
    pub(in crate::live) joints: usize,
    pub(in crate::live) from: &'a [P3],
    pub(in crate::live) to: &'a [P3],
}

impl Teleport<'_> {
    /// Moves cloth as skin bound to the body at `nearest` (first vertex of each pair), weights smoothed over `edges`.
    pub(in crate::live) fn reskin(
        &self,
        edges: &[([u32; 2], f64)],
        nearest: &[[u32; 2]],
        positions: &mut [P3],
    ) {
        let motions = self.motions();
        let weights = self.cloth_weights(edges, nearest);
        for (p, w) in positions.iter_mut().zip(weights.chunks(self.joints)) {
            *p = blend(&motions, w, p);
        }
    }

    /// Rigid motion of each joint.
    pub(super) fn motions(&self) -> Vec<Matrix3x4<f64>> {
        joint_motions(self)
            .iter()
            .map(|m| m.to_homogeneous().fixed_view::<3, 4>(0, 0).into_owned())
            .collect()
    }

    /// Smoothed skin weights of cloth, shape `[vertices][joints]`.
    pub(super) fn cloth_weights(
        &self,
        edges: &[([u32; 2], f64)],
        nearest: &[[u32; 2]],
    ) -> Vec<f64> {
        let (n, j, skin) = (nearest.len(), self.joints, self.weights);
        let mut weights = vec![0.0f64; n * j];
        for (i, near) in nearest.iter().enumerate() {
            let v = near[0] as usize;
            for k in 0..4 {
                let joint = usize::from(skin.joints[v][k]);
                weights[i * j + joint] += f64::from(skin.weights[v][k]);
            }
        }
        let mut count = vec![1.0f64; n];
        for (ends, _) in edges {
            ends.iter().for_each(|v| count[*v as usize] += 1.0);
        }
        for _ in 0..SMOOTHING {
            let mut next = weights.clone();
            for (ends, _) in edges {
                let [a, b] = ends.map(|v| v as usize);
                for k in 0..j {
                    next[a * j + k] += weights[b * j + k];
                    next[b * j + k] += weights[a * j + k];
                }
            }
            for (w, c) in next.chunks_mut(j).zip(&count) {
                w.iter_mut().for_each(|w| *w /= c);
            }
            weights = next;
        }
        weights
    }
}

/// A point moved by the weighted mean of the joints' motions.
pub(super) fn blend(motions: &[Matrix3x4<f64>], weights: &[f64], p: &P3) -> P3 {
    let bound = motions.iter().zip(weights).filter(|(_, w)| **w > 0.0);
    let m = bound.fold(Matrix3x4::zeros(), |s, (m, w)| s + m * *w);
    let q: Point3<f64> = Point3::from(m * p.cast::<f64>().to_homogeneous());
    q.cast()
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_geometry::math::V3;

    #[test]
    fn reskin_by_a_rigid_motion_preserves_edge_lengths_and_a_body_without_skin_moves_nothing() {
        // A patch of skin bound to two joints, both too small to be fitted alone.
        let skin: Vec<P3> = (0..16)
            .map(|i| P3::new(0.1 * (i % 4) as f32, 0.1 * (i / 4) as f32, 0.0))
            .collect();
        let weights = SkinWeights {
            joints: (0..16)
                .map(|i| [(i / 8) as u8, 0, 0, 0].map(Into::into))
                .collect(),
            weights: vec![[1.0, 0.0, 0.0, 0.0]; 16],
        };
        let motion = Isometry3::new(V3::new(0.5, -1.0, 2.0), V3::new(0.3, 1.2, -0.7));
        let moved: Vec<P3> = skin.iter().map(|p| motion * p).collect();
        let cloth: Vec<P3> = skin.iter().map(|p| p + V3::z() * 0.01).collect();
        let nearest: Vec<[u32; 2]> = (0..16).map(|i| [i, i]).collect();
        let edges: Vec<([u32; 2], f64)> = (1..16).map(|i| ([i - 1, i], 0.1)).collect();
        let teleport = Teleport {
            joint_vertices: 12.0,
            weights: &weights,
            joints: 2,
            from: &skin,
            to: &moved,
        };
        let mut positions = cloth.clone();
        teleport.reskin(&edges, &nearest, &mut positions);
        for (p, q) in positions.iter().zip(&cloth) {
            assert!((p - motion * q).norm() < 1e-5, "{p} {q}");
        }
        let none = joint_motions(&Teleport {
            from: &[],
            to: &[],
            ..teleport
        });
        assert_eq!(none, [Isometry3::identity(); 2]);
    }
}

//! Linear blend skinning with at most four joints a vertex (eq. 4).

use super::{BoneTransforms, Pose, RestBody, SkinWeights, Template};
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::vertex_normals;
use tryon_geometry::par::{self, Par};

impl Template {
    /// Unit vertex normals of the skin with vertices elsewhere, shape `[vertices]`.
    pub fn normals(&self, vertices: &[P3]) -> Vec<V3> {
        let (faces, around) = (self.mesh().faces(), self.topology().vertex_faces());
        let mut out = Vec::new();
        vertex_normals(Par::Rayon, vertices, faces, around, &mut out);
        out
    }

    /// Skins a `rest` body in a pose, frame of the pose, metres, shape `[vertices]`; `bones` become those of the pose.
    pub fn skin_pose<F>(
        &self,
        rest: &RestBody,
        pose: &Pose<F>,
        bones: &mut BoneTransforms,
        out: &mut Vec<P3>,
    ) {
        pose.bones(self.skeleton(), rest, bones);
        skin(Par::Rayon, &rest.vertices, self.weights(), bones, out);
    }
}

/// Poses `rest` vertices: `out[i] = Σ wᵢⱼ · boneⱼ · rest[i]`. Shapes `[vertices]`.
pub fn skin(
    par: Par,
    rest: &[P3],
    weights: &SkinWeights,
    bones: &BoneTransforms,
    out: &mut Vec<P3>,
) {
    let rest = MovedRest {
        vertices: rest,
        offsets: &[],
    };
    skin_moved(par, rest, weights, bones, out);
}

/// Rest vertices and what they are moved by before skinning (m). Shapes `[vertices]`; missing offsets count as zero.
#[derive(Clone, Copy, Debug)]
pub struct MovedRest<'a> {
    /// Rest vertices.
    pub vertices: &'a [P3],
    /// Their offsets.
    pub offsets: &'a [V3],
}

/// [`skin`] of moved rest vertices.
pub fn skin_moved(
    par: Par,
    rest: MovedRest<'_>,
    weights: &SkinWeights,
    bones: &BoneTransforms,
    out: &mut Vec<P3>,
) {
    // Columns of four lanes (the fourth is padding), so that a vertex is sixteen vector operations.
    let m: Vec<[[f32; 4]; 4]> = bones
        .bones
        .iter()
        .map(|b| {
            let h = b.to_homogeneous().cast::<f32>();
            std::array::from_fn(|c| [h[(0, c)], h[(1, c)], h[(2, c)], 0.0])
        })
        .collect();
    let MovedRest {
        vertices: rest,
        offsets,
    } = rest;
    par::map_into(par, rest.len(), 1024, out, |i| {
        let (j, w) = (&weights.joints[i], &weights.weights[i]);
        let p = offsets.get(i).map_or(rest[i], |o| rest[i] + o);
        let mut a = [[0.0f32; 4]; 4];
        for k in 0..4 {
            if w[k] > 0.0 {
                let b = &m[usize::from(j[k])];
                for c in 0..4 {
                    for r in 0..4 {
                        a[c][r] += b[c][r] * w[k];
                    }
                }
            }
        }
        let mut q = a[3];
        for r in 0..4 {
            q[r] += a[0][r] * p.x + a[1][r] * p.y + a[2][r] * p.z;
        }
        P3::new(q[0], q[1], q[2])
    });
}

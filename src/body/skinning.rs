//! Linear blend skinning with at most four joints a vertex (eq. 4).

use super::{BodyError, BoneTransforms};
use crate::math::P3;
use crate::par::{self, Par};
use serde::{Deserialize, Serialize};

/// Joint indices and weights of every vertex; the weights of a vertex sum to one, largest first.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SkinWeights {
    /// Joints, shape `[vertices]`.
    pub joints: Vec<[u8; 4]>,
    /// Weights, shape `[vertices]`; unused entries are zero.
    pub weights: Vec<[f32; 4]>,
}

impl SkinWeights {
    /// Keeps the four largest weights of every vertex and normalises them.
    ///
    /// # Errors
    /// Names the vertex without a usable weight.
    pub fn from_rows(rows: impl Iterator<Item = Vec<(usize, f64)>>) -> Result<Self, BodyError> {
        let mut out = Self::default();
        for (vertex, mut row) in rows.enumerate() {
            row.retain(|(j, w)| w.is_finite() && *w > 0.0 && *j <= u8::MAX as usize);
            row.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
            row.truncate(4);
            let sum: f64 = row.iter().map(|(_, w)| w).sum();
            if sum <= 0.0 {
                return Err(BodyError::Vertex {
                    vertex,
                    why: "it has no positive skinning weight".into(),
                });
            }
            let (mut joints, mut weights) = ([0u8; 4], [0f32; 4]);
            for (k, (j, w)) in row.into_iter().enumerate() {
                joints[k] = j as u8;
                weights[k] = (w / sum) as f32;
            }
            out.joints.push(joints);
            out.weights.push(weights);
        }
        Ok(out)
    }
    /// The joint with the largest weight, b(i) of the paper.
    pub fn dominant(&self, vertex: usize) -> usize {
        usize::from(self.joints[vertex][0])
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
    // Columns of four lanes (the fourth is padding), so that a vertex is sixteen vector operations.
    let m: Vec<[[f32; 4]; 4]> = bones
        .bones
        .iter()
        .map(|b| {
            let h = b.to_homogeneous().cast::<f32>();
            std::array::from_fn(|c| [h[(0, c)], h[(1, c)], h[(2, c)], 0.0])
        })
        .collect();
    par::map_into(par, rest.len(), 1024, out, |i| {
        let (j, w, p) = (&weights.joints[i], &weights.weights[i], &rest[i]);
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

//! Skinning weights: at most four joints a vertex.

use super::BodyError;
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
    /// Weights of all of so many joints at a vertex.
    pub fn row(&self, vertex: usize, joints: usize) -> Vec<f32> {
        let mut row = vec![0.0; joints];
        for (j, w) in self.joints[vertex].iter().zip(self.weights[vertex]) {
            row[usize::from(*j)] += w;
        }
        row
    }
    /// The joint with the largest weight, b(i) of the paper.
    pub fn dominant(&self, vertex: usize) -> usize {
        usize::from(self.joints[vertex][0])
    }
}

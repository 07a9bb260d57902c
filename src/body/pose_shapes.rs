//! Pose blend shapes of a model (Loper et al. 2015, eq. 9; Bₚ of Pons-Moll et al. 2017, eq. 1): vertex offsets, linear in
//! the entries of the joints' rotation matrices.

use super::BodyError;

/// Entries of a rotation matrix.
pub(super) const ENTRIES: usize = 9;

/// Linear directions of pose: vertex offsets per entry of R(θ) − I of each joint but the root.
#[derive(Clone, Debug, PartialEq)]
pub struct PoseShapes {
    /// Entries of all joints but the root.
    features: usize,
    /// Metres, row-major, shape `[vertices][3][features]`.
    directions: Vec<f32>,
}

impl PoseShapes {
    /// Directions as SMPL's `posedirs` has them: metres, row-major, shape `[vertices][3][9 (joints − 1)]`, entries of each
    /// rotation matrix row by row.
    ///
    /// # Errors
    /// Another number of values, or one that is not finite.
    pub fn new(vertices: usize, joints: usize, directions: Vec<f32>) -> Result<Self, BodyError> {
        let fault = |why: String| BodyError::Array {
            array: "posedirs".into(),
            why,
        };
        let features = ENTRIES * joints.saturating_sub(1);
        if directions.len() != vertices * 3 * features {
            return Err(fault(format!(
                "{} values for {vertices} vertices and {joints} joints",
                directions.len()
            )));
        }
        match directions.iter().position(|d| !d.is_finite()) {
            Some(i) => Err(fault(format!("value {i} is not finite"))),
            None => Ok(Self {
                features,
                directions,
            }),
        }
    }

    /// The same with vertices between others, each between two ends at a share of the way from first to second.
    pub fn extended(&self, between: impl Iterator<Item = ([u32; 2], f32)>) -> Self {
        let mut out = self.clone();
        for (ends, share) in between {
            let [a, b] = ends.map(|v| self.rows(v as usize));
            let rows = a.iter().zip(b).map(|(p, q)| p + (q - p) * share);
            out.directions.extend(rows);
        }
        out
    }

    /// Offsets of a vertex, shape `[3][features]`.
    pub(super) fn rows(&self, vertex: usize) -> &[f32] {
        let length = 3 * self.features;
        &self.directions[vertex * length..(vertex + 1) * length]
    }

    /// Number of vertices; 0 without directions.
    pub(super) fn vertices(&self) -> usize {
        self.directions.len() / (3 * self.features).max(1)
    }

    /// Number of entries of all joints but the root.
    pub(super) fn features(&self) -> usize {
        self.features
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_that_do_not_fit_are_refused() {
        assert!(PoseShapes::new(2, 3, vec![0.0; 5]).is_err());
        assert!(PoseShapes::new(1, 2, vec![f32::NAN; 27]).is_err());
        let shapes = PoseShapes::new(1, 2, vec![0.0; 27]).expect("sizes fit");
        assert_eq!((shapes.vertices(), shapes.features()), (1, 9));
    }

    #[test]
    fn vertices_between_others_get_their_share() {
        let rows = (0..54).map(|k| if k < 27 { 1.0 } else { 3.0 });
        let shapes = PoseShapes::new(2, 2, rows.collect()).expect("sizes fit");
        let more = shapes.extended([([0, 1], 0.25)].into_iter());
        assert_eq!(more.vertices(), 3);
        assert!(more.rows(2).iter().all(|v| *v == 1.5));
    }
}

//! Pose blend shapes of a model (Loper et al. 2015, eq. 9; Osman et al. 2020; Bₚ of Pons-Moll et al. 2017, eq. 1):
//! vertex offsets, linear in features of the joints' rotations.

use super::BodyError;
use tryon_formats::PoseFeature;

/// Linear directions of pose: vertex offsets per feature of each joint but the root.
#[derive(Clone, Debug, PartialEq)]
pub struct PoseShapes {
    feature: PoseFeature,
    /// Features of all joints but the root.
    features: usize,
    /// Metres, row-major, shape `[vertices][3][features]`.
    directions: Vec<f32>,
}

impl PoseShapes {
    /// Directions as `posedirs` has them: metres, row-major, shape `[vertices][3][feature.count() · (joints − 1)]`, for a
    /// body of shape `[vertices, joints]`.
    ///
    /// # Errors
    /// Another number of values, or one that is not finite.
    pub fn new(
        [vertices, joints]: [usize; 2],
        feature: PoseFeature,
        directions: Vec<f32>,
    ) -> Result<Self, BodyError> {
        let fault = |why: String| BodyError::Array {
            array: "posedirs".into(),
            why,
        };
        let features = feature.count() * joints.saturating_sub(1);
        if directions.len() != vertices * 3 * features {
            return Err(fault(format!(
                "{} values for {vertices} vertices and {joints} joints",
                directions.len()
            )));
        }
        match directions.iter().position(|d| !d.is_finite()) {
            Some(i) => Err(fault(format!("value {i} is not finite"))),
            None => Ok(Self {
                feature,
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

    /// Features of each joint.
    pub(super) fn feature(&self) -> PoseFeature {
        self.feature
    }

    /// Number of joints with features.
    pub(super) fn turned_joints(&self) -> usize {
        self.features / self.feature.count()
    }

    /// Number of features of all joints but the root.
    pub(super) fn features(&self) -> usize {
        self.features
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_that_do_not_fit_are_refused() {
        assert!(PoseShapes::new([2, 3], PoseFeature::Matrix, vec![0.0; 5]).is_err());
        assert!(PoseShapes::new([1, 2], PoseFeature::Matrix, vec![f32::NAN; 27]).is_err());
        let sizes = |feature: PoseFeature| {
            let shapes = PoseShapes::new([1, 2], feature, vec![0.0; 3 * feature.count()]);
            let shapes = shapes.expect("sizes fit");
            (shapes.vertices(), shapes.features(), shapes.turned_joints())
        };
        assert_eq!(sizes(PoseFeature::Matrix), (1, 9, 1));
        assert_eq!(sizes(PoseFeature::Quaternion), (1, 4, 1));
    }

    #[test]
    fn vertices_between_others_get_their_share() {
        let rows = (0..54).map(|k| if k < 27 { 1.0 } else { 3.0 });
        let shapes =
            PoseShapes::new([2, 2], PoseFeature::Matrix, rows.collect()).expect("sizes fit");
        let more = shapes.extended([([0, 1], 0.25)].into_iter());
        assert_eq!(more.vertices(), 3);
        assert!(more.rows(2).iter().all(|v| *v == 1.5));
    }
}

//! Features of a pose that the `posedirs` of bodies in SMPL's layout are linear in.

use super::FormatError;
use super::npz_file::NpzFile;

/// Features of a joint's rotation R relative to its parent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PoseFeature {
    /// Entries of R − I, row by row: SMPL, SMPL+H, SMPL-X (Loper et al. 2015, eq. 9).
    #[default]
    Matrix,
    /// Unit quaternion (x, y, z, w − 1) with w ≥ 0: STAR (Osman et al. 2020).
    Quaternion,
}

impl PoseFeature {
    /// Number of features of a joint.
    pub const fn count(self) -> usize {
        match self {
            Self::Matrix => 9,
            Self::Quaternion => 4,
        }
    }
}

/// `posedirs` of a body.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PoseDirections {
    /// Features of each joint but the root.
    pub feature: PoseFeature,
    /// Offsets per feature, metres, row-major, shape `(V, 3, feature.count() · (J − 1))`; empty if absent.
    pub of_pose: Vec<f32>,
    /// STAR's last column: offsets per unit of the second shape coefficient, metres, shape `(V)`; empty if absent. They do
    /// not move the joints.
    pub of_second_shape: Vec<[f32; 3]>,
}

impl PoseDirections {
    /// True for a body without `posedirs`.
    pub fn is_empty(&self) -> bool {
        self.of_pose.is_empty() && self.of_second_shape.is_empty()
    }

    /// Reads the directions of a body with so many vertices and joints.
    ///
    /// # Errors
    /// An array of another shape than SMPL's or STAR's.
    pub(super) fn read(
        file: &mut NpzFile<'_>,
        vertices: usize,
        joints: usize,
    ) -> Result<Self, FormatError> {
        const NAME: &str = "posedirs";
        let Some(array) = file.numbers(NAME)? else {
            return Ok(Self::default());
        };
        let of_joints = |feature: PoseFeature| feature.count() * (joints - 1);
        let (matrices, quaternions) = (
            of_joints(PoseFeature::Matrix),
            of_joints(PoseFeature::Quaternion),
        );
        let columns = array.side(2);
        let is_body = array.shape == [vertices, 3, columns];
        let feature = match columns {
            n if is_body && n == matrices => PoseFeature::Matrix,
            n if is_body && (n == quaternions || n == quaternions + 1) => PoseFeature::Quaternion,
            _ => {
                let why = format!(
                    "shape {:?}, expected [{vertices}, 3, {matrices}] (rotation entries of {joints} joints), or STAR's \
                     [{vertices}, 3, {}] (their quaternions and a shape coefficient)",
                    array.shape,
                    quaternions + 1
                );
                return Err(file.fault(NAME, why));
            }
        };
        let rows = array.data.chunks_exact(columns.max(1));
        let of_pose = rows.clone().flat_map(|row| &row[..of_joints(feature)]);
        let of_shape: Vec<f32> = rows
            .flat_map(|row| &row[of_joints(feature)..])
            .map(|v| *v as f32)
            .collect();
        Ok(Self {
            feature,
            of_pose: of_pose.map(|v| *v as f32).collect(),
            of_second_shape: of_shape.as_chunks::<3>().0.to_vec(),
        })
    }
}

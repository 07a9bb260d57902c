//! Features of a joint's rotation that pose blend shapes are linear in.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use tryon_formats::PoseFeature;

/// Appends the features of a rotation relative to the parent.
pub(super) fn push_features(
    feature: PoseFeature,
    rotation: &UnitQuaternion<f64>,
    out: &mut Vec<f32>,
) {
    match feature {
        PoseFeature::Matrix => {
            let change = rotation.to_rotation_matrix().matrix() - Matrix3::identity();
            out.extend(change.transpose().iter().map(|v| *v as f32));
        }
        PoseFeature::Quaternion => {
            // Of the two that are one rotation, that of the angle up to π.
            let q = rotation.coords * if rotation.w < 0.0 { -1.0 } else { 1.0 };
            out.extend([q.x, q.y, q.z, q.w - 1.0].map(|v| v as f32));
        }
    }
}

/// Turns the coefficients of one joint's features, for rotations M R Mᵀ instead of R: M is a rotation or a reflection.
pub(super) fn turn_features(feature: PoseFeature, map: &Matrix3<f64>, of_joint: &mut [f32]) {
    match (feature, of_joint) {
        (PoseFeature::Matrix, entries) => {
            let rows = Matrix3::from_row_slice(entries).cast::<f64>();
            let turned = map * rows * map.transpose();
            for (entry, value) in entries.iter_mut().zip(turned.transpose().iter()) {
                *entry = *value as f32;
            }
        }
        (PoseFeature::Quaternion, [axis @ .., _]) => {
            // The axis of a rotation is a pseudovector.
            let own = Vector3::from_column_slice(axis).cast::<f64>();
            let turned = map * own * map.determinant();
            for (value, new) in axis.iter_mut().zip(turned.iter()) {
                *value = *new as f32;
            }
        }
        (PoseFeature::Quaternion, []) => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    /// Coefficients turned are those of M R Mᵀ: the sum over features stays, for rotations and reflections M.
    #[test]
    fn turned_coefficients_belong_to_turned_rotations() {
        let turn = Rotation3::from_scaled_axis(Vector3::new(0.4, -1.1, 0.7)).into_inner();
        let mirror = Matrix3::from_diagonal(&Vector3::new(-1.0, 1.0, 1.0));
        let rotation = Rotation3::from_scaled_axis(Vector3::new(-0.5, 0.8, 1.9));
        for feature in [PoseFeature::Matrix, PoseFeature::Quaternion] {
            let directions: Vec<f32> = (0..feature.count()).map(|k| (k as f32).sin()).collect();
            let sum = |rotation: Matrix3<f64>, directions: &[f32]| -> f32 {
                let mut features = Vec::new();
                let rotation = Rotation3::from_matrix_unchecked(rotation);
                push_features(feature, &rotation.into(), &mut features);
                assert_eq!(features.len(), feature.count());
                features.iter().zip(directions).map(|(f, d)| f * d).sum()
            };
            let right = sum(rotation.into_inner(), &directions);
            for map in [turn, mirror * turn] {
                let mut turned = directions.clone();
                turn_features(feature, &map, &mut turned);
                let found = sum(map * rotation.into_inner() * map.transpose(), &turned);
                assert!((found - right).abs() < 1e-5, "{feature:?}: {found} {right}");
            }
        }
    }
}

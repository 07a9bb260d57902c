//! Triangle meshes of the scenes' solids.

use super::Primitive;
use crate::settings::SceneSettings;
use std::f64::consts::PI;
use tryon_geometry::math::V3d;
use tryon_geometry::mesh::Face;

/// Surface of a solid in its own frame, y up, faces outwards (m).
pub(super) fn solid_mesh(solid: &Primitive, settings: &SceneSettings) -> (Vec<V3d>, Vec<Face>) {
    let (radius, half) = match solid {
        Primitive::Sphere { radius } => (*radius, 0.0),
        Primitive::Capsule {
            radius,
            half_segment,
        } => (*radius, *half_segment),
    };
    let [fewest, most] = settings.segments.map(|n| n / 4.0);
    let quarter = (0.5 * PI * radius / settings.edge).clamp(fewest, most);
    let quarter = quarter.ceil() as u32;
    let segments = 4 * quarter;
    let bands = (2.0 * half / settings.edge).ceil();
    let bands = bands.min(settings.max_bands) as u32;
    let rings = rings(radius, half, quarter, bands);
    let mut x = vec![V3d::new(0.0, -radius - half, 0.0)];
    for [height, across] in &rings {
        for k in 0..segments {
            let (s, c) = (2.0 * PI * f64::from(k) / f64::from(segments)).sin_cos();
            x.push(V3d::new(across * c, *height, -across * s));
        }
    }
    x.push(V3d::new(0.0, radius + half, 0.0));

    let (count, top) = (rings.len() as u32, x.len() as u32 - 1);
    let at = |ring: u32, k: u32| 1 + ring * segments + k % segments;
    let mut faces = Vec::new();
    for k in 0..segments {
        faces.push([0, at(0, k + 1), at(0, k)]);
        faces.push([at(count - 1, k), at(count - 1, k + 1), top]);
        for ring in 1..count {
            let [a, b] = [at(ring - 1, k), at(ring - 1, k + 1)];
            let [c, d] = [at(ring, k), at(ring, k + 1)];
            faces.extend([[a, b, d], [a, d, c]]);
        }
    }
    (x, faces)
}

/// Height and radius of each ring from pole to pole, without the poles (m); `quarter`: bands between pole and equator,
/// `bands`: those along the tube.
fn rings(radius: f64, half: f64, quarter: u32, bands: u32) -> Vec<[f64; 2]> {
    let ring = |centre: f64, k: f64| {
        let (sin, cos) = (0.5 * PI * k / f64::from(quarter)).sin_cos();
        [centre + radius * sin, radius * cos]
    };
    let lower = (0..quarter).map(|k| ring(-half, f64::from(k + 1) - f64::from(quarter)));
    let tube = (1..bands).map(|k| [half * (2.0 * f64::from(k) / f64::from(bands) - 1.0), radius]);
    let upper = (u32::from(bands == 0)..quarter).map(|k| ring(half, f64::from(k)));
    lower.chain(tube).chain(upper).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn volumes_near_the_closed_forms() {
        let sphere = Primitive::Sphere { radius: 0.3 };
        let capsule = Primitive::Capsule {
            radius: 0.12,
            half_segment: 0.45,
        };
        let ball = |r: f64| 4.0 / 3.0 * PI * r.powi(3);
        let tube = PI * 0.12 * 0.12 * 0.9;
        for (solid, expected) in [(sphere, ball(0.3)), (capsule, ball(0.12) + tube)] {
            let (x, faces) = solid_mesh(&solid, &SceneSettings::default());
            let [mut volume, mut euler] = [0.0, x.len() as f64];
            for f in &faces {
                let [a, b, c] = f.map(|v| x[v as usize]);
                volume += a.dot(&b.cross(&c)) / 6.0;
                euler -= 0.5;
            }
            assert!(
                (volume / expected - 1.0).abs() < 0.006,
                "{volume} {expected}"
            );
            assert!((euler - 2.0).abs() < 1e-9, "closed");
        }
    }
}

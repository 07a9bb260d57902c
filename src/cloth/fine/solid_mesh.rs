//! Triangle meshes of the scenes' solids.

use crate::live::scene::Primitive;
use std::f64::consts::PI;
use tryon_geometry::math::V3d;
use tryon_geometry::mesh::Face;

/// Segments around the axis. The chord of a sphere of 0.3 m lies 0.6 mm below its surface.
const SEGMENTS: u32 = 96;
/// Rings of each half, without the pole.
const RINGS: u32 = 24;

/// Surface of a solid in its own frame, y up, faces outwards (m).
pub(super) fn solid_mesh(solid: &Primitive) -> (Vec<V3d>, Vec<Face>) {
    let (radius, half) = match solid {
        Primitive::Sphere { radius } => (*radius, 0.0),
        Primitive::Capsule {
            radius,
            half_segment,
        } => (*radius, *half_segment),
    };
    // Latitudes from pole to pole; a capsule has the equator twice, a sphere's rings shift by half a step instead.
    let step = |k: f64| 0.5 * PI * k / f64::from(RINGS);
    let latitude = |ring: u32| match (half > 0.0, ring < RINGS) {
        (true, true) => -step(f64::from(RINGS - 1 - ring)),
        (true, false) => step(f64::from(ring - RINGS)),
        (false, _) => PI * (f64::from(ring) + 1.0) / f64::from(2 * RINGS + 1) - 0.5 * PI,
    };
    let mut x = vec![V3d::new(0.0, -radius - half, 0.0)];
    for ring in 0..2 * RINGS {
        let (height, across) = latitude(ring).sin_cos();
        let centre = if ring < RINGS { -half } else { half };
        for k in 0..SEGMENTS {
            let (s, c) = (2.0 * PI * f64::from(k) / f64::from(SEGMENTS)).sin_cos();
            x.push(V3d::new(
                radius * across * c,
                centre + radius * height,
                -radius * across * s,
            ));
        }
    }
    x.push(V3d::new(0.0, radius + half, 0.0));
    let at = |ring: u32, k: u32| 1 + ring * SEGMENTS + k % SEGMENTS;
    let top = 1 + 2 * RINGS * SEGMENTS;
    let mut faces = Vec::new();
    for k in 0..SEGMENTS {
        faces.push([0, at(0, k + 1), at(0, k)]);
        faces.push([at(2 * RINGS - 1, k), at(2 * RINGS - 1, k + 1), top]);
        for ring in 1..2 * RINGS {
            let [a, b] = [at(ring - 1, k), at(ring - 1, k + 1)];
            let [c, d] = [at(ring, k), at(ring, k + 1)];
            faces.extend([[a, b, d], [a, d, c]]);
        }
    }
    (x, faces)
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
            let (x, faces) = solid_mesh(&solid);
            let [mut volume, mut euler] = [0.0, x.len() as f64];
            for f in &faces {
                let [a, b, c] = f.map(|v| x[v as usize]);
                volume += a.dot(&b.cross(&c)) / 6.0;
                euler -= 0.5;
            }
            assert!(
                (volume / expected - 1.0).abs() < 0.005,
                "{volume} {expected}"
            );
            assert!((euler - 2.0).abs() < 1e-9, "closed");
        }
    }
}

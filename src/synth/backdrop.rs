//! Seamless backdrop of a photographer's studio: one sheet from the floor through a quarter circle into the wall.

use tryon_geometry::math::{P3d, V3d};

/// Sheet of a studio. The floor before the curve is the plane y = 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Backdrop {
    /// Radius of the curve between floor and wall, metres.
    pub radius: f64,
    /// Colour of the sheet in full light, sRGB.
    pub color: [u8; 3],
    /// Middle of the light on it, world, metres.
    pub lit: [f64; 3],
    /// Standard deviations of the light around its middle, metres: to the sides, and up and back.
    pub spread: [f64; 2],
    /// Shares of light everywhere, around the middle, and more on what faces up.
    pub shade: [f64; 3],
}

impl Default for Backdrop {
    /// Warm light grey, brightest behind the person.
    fn default() -> Self {
        Self {
            radius: 1.0,
            color: [232, 228, 221],
            lit: [0.0, 0.7, -3.4],
            spread: [2.0, 2.0],
            shade: [0.70, 0.25, 0.05],
        }
    }
}

/// Point of the sheet that a ray meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SheetPoint {
    /// Ray parameter.
    pub(super) at: f64,
    /// Unit normal.
    pub(super) normal: V3d,
    /// On the plane before the curve.
    pub(super) is_floor: bool,
}

impl Backdrop {
    /// First point of the sheet on the ray from `eye` along `d`, with its wall at `back_z`; `None` above the horizon.
    pub(super) fn hit(&self, back_z: f64, eye: &P3d, d: &V3d) -> Option<SheetPoint> {
        let ahead = |t: f64| t.is_finite() && t > 0.0;
        let curve_z = back_z + self.radius;
        let point = |at: f64, normal: V3d, is_floor: bool| SheetPoint {
            at,
            normal,
            is_floor,
        };
        let floor = -eye.y / d.y;
        if ahead(floor) && eye.z + floor * d.z >= curve_z {
            return Some(point(floor, V3d::y(), true));
        }
        let wall = (back_z - eye.z) / d.z;
        if ahead(wall) && eye.y + wall * d.y >= self.radius {
            return Some(point(wall, V3d::z(), false));
        }
        // Far crossing of the cylinder about the line (radius, curve_z).
        let (y, z) = (eye.y - self.radius, eye.z - curve_z);
        let (a, b) = (d.y * d.y + d.z * d.z, y * d.y + z * d.z);
        let root = (b * b - a * (y * y + z * z - self.radius * self.radius)).sqrt();
        let at = (root - b) / a;
        ahead(at).then(|| {
            let normal = V3d::new(0.0, -(y + at * d.y), -(z + at * d.z));
            point(at, normal / self.radius, false)
        })
    }

    /// Light at a point of the sheet, share of full light.
    pub(super) fn light(&self, p: &P3d, normal: &V3d) -> f64 {
        let [x, y, z] = self.lit;
        let [side, depth] = self.spread;
        let square = |d: f64, spread: f64| (d / spread) * (d / spread);
        let away = square(p.x - x, side) + square(p.y - y, depth) + square(p.z - z, depth);
        let [everywhere, middle, up] = self.shade;
        everywhere + middle * (-0.5 * away).exp() + up * normal.y
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Depth along a fan of rays from a camera one metre high, from the feet up to the wall.
    #[test]
    fn floor_curve_and_wall_meet_without_a_step_or_an_edge() {
        let sheet = Backdrop::default();
        let eye = P3d::new(0.0, 1.0, 0.0);
        let mut last: Option<(P3d, SheetPoint)> = None;
        let mut kinds = [0; 3];
        for i in 0..2000 {
            let d = V3d::new(0.1, -0.8 + 0.0006 * f64::from(i), -1.0);
            let hit = sheet.hit(-4.6, &eye, &d).expect("the sheet is endless");
            let p = eye + d * hit.at;
            assert!((hit.normal.norm() - 1.0).abs() < 1e-9);
            assert_eq!(hit.is_floor, p.z >= -3.6 && p.y.abs() < 1e-9, "{p}");
            kinds[if hit.is_floor {
                0
            } else {
                1 + usize::from(p.y > 1.0)
            }] += 1;
            if let Some((before, was)) = last {
                // The step lies in the sheet: a jump or an edge would show along its normals.
                let step = p - before;
                assert!(step.norm() < 0.05, "{step}");
                assert!(step.dot(&hit.normal).abs() < 0.02 * step.norm().max(1e-6) + 2e-5);
                assert!(hit.normal.dot(&was.normal) > 0.9995);
                let light = |p: &P3d, n: &V3d| sheet.light(p, n);
                assert!((light(&p, &hit.normal) - light(&before, &was.normal)).abs() < 0.01);
            }
            last = Some((p, hit));
        }
        assert!(kinds.iter().all(|n| *n > 100), "{kinds:?}");
    }
}

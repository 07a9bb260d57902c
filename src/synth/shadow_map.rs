//! Shadow map of a body under a distant light (Williams 1978), and ambient occlusion by many of them.

use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::Face;
use tryon_geometry::par::Par;
use tryon_geometry::raster::{Cull, Options, View, VisibilityBuffer, rasterise_with};

/// Resolution (pixels per metre): 6 mm, finer than the body's edges.
const RESOLUTION: f32 = 160.0;
/// Depth by which a surface must be behind the map to be in shadow (m): above the map's error on slopes of 70°.
const BIAS: f32 = 0.018;
/// Directions of ambient occlusion.
const DIRECTIONS: usize = 64;
/// Samples of a soft shadow to either side of its middle.
const TAPS: i32 = 2;

/// Depth of a body as seen from a distant light.
#[derive(Debug)]
pub(super) struct ShadowMap {
    /// Unit axes of the light's view: right, down, away from the light.
    axes: [V3; 3],
    /// Corner of the map, metres.
    corner: [f32; 2],
    buffer: VisibilityBuffer,
}

impl ShadowMap {
    /// Map of a body under light from the direction `to_light` (unit).
    pub(super) fn new(vertices: &[P3], faces: &[Face], to_light: &V3) -> Self {
        let away = -to_light;
        let helper = if away.y.abs() < 0.9 { V3::y() } else { V3::x() };
        let right = helper.cross(&away).normalize();
        let axes = [right, away.cross(&right), away];
        let seen = |p: &P3| P3::from(axes.map(|a| a.dot(&p.coords)));
        let turned: Vec<P3> = vertices.iter().map(seen).collect();
        let bounds = |k: usize| {
            let values = turned.iter().map(|p| p[k]);
            values.fold([f32::MAX, f32::MIN], |[l, h], x| [l.min(x), h.max(x)])
        };
        let [columns, rows] = [bounds(0), bounds(1)];
        let pixels = |[low, high]: [f32; 2]| ((high - low).max(0.0) * RESOLUTION) as u32 + 2;
        let view = View::Orthographic {
            width: pixels(columns),
            height: pixels(rows),
            left: columns[0],
            top: rows[0],
            pixels_per_metre: RESOLUTION,
        };
        let options = Options {
            par: Par::Seq,
            cull: Cull::Back,
            ..Options::default()
        };
        let mut buffer = VisibilityBuffer::default();
        rasterise_with(options, &view, &turned, faces, &mut buffer);
        Self {
            axes,
            corner: [columns[0], rows[0]],
            buffer,
        }
    }

    /// Share of the light that reaches a point, averaged over `softness` to either side (m).
    pub(super) fn visibility(&self, p: &P3, softness: f32) -> f32 {
        let [x, y, z] = self.axes.map(|a| a.dot(&p.coords));
        let pixel = |x: f32, corner: f32| (x - corner) * RESOLUTION;
        let (x, y) = (pixel(x, self.corner[0]), pixel(y, self.corner[1]));
        let (taps, step) = if softness > 0.0 {
            (TAPS, softness * RESOLUTION / TAPS as f32)
        } else {
            (0, 0.0)
        };
        let mut lit = 0u32;
        for i in -taps..=taps {
            for j in -taps..=taps {
                let depth = self.depth(x + i as f32 * step, y + j as f32 * step);
                lit += u32::from(z < depth + BIAS);
            }
        }
        lit as f32 / ((2 * taps + 1) * (2 * taps + 1)) as f32
    }

    /// Depth of the map, infinity off it.
    fn depth(&self, x: f32, y: f32) -> f32 {
        let (x, y) = (x + 0.5, y + 0.5);
        let (width, height) = (self.buffer.width, self.buffer.height);
        let is_inside = x >= 0.0 && y >= 0.0 && x < width as f32 && y < height as f32;
        if !is_inside {
            return f32::INFINITY;
        }
        let at = y as usize * width as usize + x as usize;
        if self.buffer.face[at] == VisibilityBuffer::NONE {
            f32::INFINITY
        } else {
            self.buffer.depth[at]
        }
    }
}

/// Direction `k` of points spread evenly over the sphere (Fibonacci lattice).
fn direction(k: usize) -> V3 {
    let y = 1.0 - (2.0 * k as f32 + 1.0) / DIRECTIONS as f32;
    let around = k as f32 * std::f32::consts::PI * (3.0 - 5f32.sqrt());
    let ring = (1.0 - y * y).sqrt();
    V3::new(ring * around.cos(), y, ring * around.sin())
}

/// Share of its half space that each vertex sees past the body itself, weighted by the cosine: 1 in the open.
pub(super) fn openness(vertices: &[P3], normals: &[V3], faces: &[Face]) -> Vec<f32> {
    let mut seen = vec![[0.0f32; 2]; vertices.len()];
    for k in 0..DIRECTIONS {
        let d = direction(k);
        let map = ShadowMap::new(vertices, faces, &d);
        for (sums, (p, n)) in seen.iter_mut().zip(vertices.iter().zip(normals)) {
            let cosine = n.dot(&d);
            if cosine > 0.0 {
                sums[0] += cosine * map.visibility(p, 0.0);
                sums[1] += cosine;
            }
        }
    }
    let share = |[open, all]: &[f32; 2]| if *all > 0.0 { open / all } else { 1.0 };
    seen.iter().map(share).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_body::embedded;

    #[test]
    fn an_armpit_sees_less_than_a_shoulder() {
        let template = embedded::template();
        let (vertices, faces) = (template.mesh().vertices(), template.mesh().faces());
        let open = openness(vertices, &template.normals(vertices), faces);
        let skeleton = template.skeleton();
        let rest = template.personalise(&Default::default());
        let joint = |name: &str| rest.joints[skeleton.index(name).unwrap_or(0)].cast::<f32>();
        let mean = |at: P3| {
            let near = (vertices.iter().zip(&open)).filter(|(v, _)| (*v - at).norm() < 0.06);
            let (n, sum) = near.fold((0.0, 0.0), |(n, sum), (_, o)| (n + 1.0, sum + o));
            sum / f32::max(n, 1.0)
        };
        let (hip, knee) = (joint("left_hip"), joint("left_knee"));
        let crotch = P3::new(0.0, hip.y - 0.08, hip.z);
        assert!(
            mean(crotch) < 0.6 && mean(knee) > 0.75,
            "{} {}",
            mean(crotch),
            mean(knee)
        );
        assert!(open.iter().all(|o| (0.0..=1.0).contains(o)));
    }
}

//! Plain drawing of surfaces, for looking at garments.

use tryon::math::{P3, V3};
use tryon::mesh::Face;
use tryon::raster::{View, VisibilityBuffer, interpolate, rasterise};

/// A surface to draw: vertices, faces, colour, and texture coordinates in metres for a 4 cm checker.
pub(crate) struct Part {
    /// Metres, y up.
    pub(crate) vertices: Vec<P3>,
    /// Counter-clockwise seen from outside.
    pub(crate) faces: Vec<Face>,
    /// sRGB, 0 to 1.
    pub(crate) color: [f32; 3],
    /// Empty: no checker, and no lining.
    pub(crate) uv: Vec<[f32; 2]>,
    /// Colour of each vertex instead, sRGB.
    pub(crate) painted: Vec<[u8; 3]>,
}

/// Draws `parts` from the side `yaw` (radians) into a cell; `y` is the range of heights shown, `centre` the axis (x, z).
pub(crate) fn draw(
    parts: &[Part],
    yaw: f32,
    cell: (u32, u32),
    y: [f32; 2],
    centre: [f32; 2],
) -> Vec<u8> {
    let (s, c) = yaw.sin_cos();
    let (mut all, mut faces, mut owner) = (Vec::new(), Vec::<Face>::new(), Vec::new());
    for (k, p) in parts.iter().enumerate() {
        let first = all.len() as u32;
        all.extend(p.vertices.iter().map(|q| {
            let (x, z) = (q.x - centre[0], q.z - centre[1]);
            P3::new(c * x - s * z, -q.y, -(s * x + c * z))
        }));
        for (i, f) in p.faces.iter().enumerate() {
            faces.push(f.map(|v| v + first));
            owner.push((k, i));
        }
    }
    let mut normals = vec![V3::zeros(); all.len()];
    for f in &faces {
        let n = tryon::mesh::face_normal(&all, f);
        f.iter().for_each(|&v| normals[v as usize] += n);
    }
    let (w, h) = cell;
    let scale = h as f32 / (y[1] - y[0]);
    let view = View::Orthographic {
        width: w,
        height: h,
        left: -(w as f32) / scale / 2.0,
        top: -y[1],
        pixels_per_metre: scale,
    };
    let mut buffer = VisibilityBuffer::default();
    rasterise(&view, &all, &faces, &mut buffer);
    let light = V3::new(-0.45, -0.6, -0.66).normalize();
    let mut out = vec![250u8; (w * h * 3) as usize];
    for v in 0..h {
        for u in 0..w {
            let Some((face, b)) = interpolate(&view, &all, &faces, &buffer, u, v) else {
                continue;
            };
            let f = faces[face as usize];
            let (part, own) = owner[face as usize];
            let part = &parts[part];
            let n = (0..3)
                .fold(V3::zeros(), |s, k| {
                    s + normals[f[k] as usize].normalize() * b[k]
                })
                .normalize();
            let inside = tryon::mesh::face_normal(&all, &f).z > 0.0;
            let n = if n.z > 0.0 { -n } else { n };
            let mut color = part.color;
            if !part.painted.is_empty() && !inside {
                let t = part.faces[own];
                color = std::array::from_fn(|d| {
                    (0..3)
                        .map(|k| f32::from(part.painted[t[k] as usize][d]) / 255.0 * b[k])
                        .sum::<f32>()
                });
            } else if inside && !part.uv.is_empty() {
                color = [color[1] * 0.5, color[2] * 0.5, color[0] * 0.5];
            } else if !part.uv.is_empty() {
                let t = part.faces[own];
                let at = |d: usize| {
                    (0..3)
                        .map(|k| part.uv[t[k] as usize][d] * b[k])
                        .sum::<f32>()
                };
                let odd = ((at(0) / 0.04).floor() + (at(1) / 0.04).floor()).rem_euclid(2.0);
                color = color.map(|c| c * (0.88 + 0.12 * odd));
            }
            let shade = 0.3 + 0.7 * n.dot(&light).max(0.0);
            for k in 0..3 {
                out[(v * w + u) as usize * 3 + k] =
                    (color[k] * shade * 255.0).clamp(0.0, 255.0) as u8;
            }
        }
    }
    out
}

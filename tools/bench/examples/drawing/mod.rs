//! Plain pictures of surfaces: orthographic, one lamp, a checker along the texture coordinates.
#![allow(dead_code)] // each example uses a part

use tryon::body::Template;
use tryon::garment::{GarmentMesh, library};
use tryon::geometry::math::{P3, V3};
use tryon::geometry::mesh::{Face, face_normal};
use tryon::geometry::raster::{View, VisibilityBuffer, interpolate, rasterise};

/// Colour of bodies, sRGB, 0 to 1.
const SKIN: [f32; 3] = [0.86, 0.70, 0.60];
/// Side of a checker field, metres, and the brightness of the dark ones.
const CHECKER: (f32, f32) = (0.04, 0.88);
/// Towards the lamp, in the view's frame.
const LAMP: [f32; 3] = [-0.45, -0.6, -0.66];
/// Least brightness.
const AMBIENT: f32 = 0.3;
const BACKGROUND: u8 = 250;

/// A surface to draw.
pub(crate) struct DrawnMesh {
    /// Metres, y up.
    pub(crate) vertices: Vec<P3>,
    /// Counter-clockwise seen from outside.
    pub(crate) faces: Vec<Face>,
    /// sRGB, 0 to 1.
    pub(crate) color: [f32; 3],
    /// Texture coordinates in metres, for the checker. Empty: no checker, and no lining.
    pub(crate) uv: Vec<[f32; 2]>,
    /// Colour of each vertex instead of `color`, sRGB; empty for none.
    pub(crate) painted: Vec<[u8; 3]>,
}

impl DrawnMesh {
    /// A bare body.
    pub(crate) fn body(template: &Template, vertices: &[P3]) -> Self {
        Self {
            vertices: vertices.to_vec(),
            faces: template.mesh().faces().to_vec(),
            color: SKIN,
            uv: vec![],
            painted: vec![],
        }
    }

    /// A garment at the positions of its simulated vertices, in the colour of the library's garment `dye`.
    pub(crate) fn garment(mesh: &GarmentMesh, positions: &[P3], dye: &str) -> Self {
        let mut vertices = Vec::new();
        mesh.render_positions(positions, &mut vertices);
        Self {
            vertices,
            faces: mesh.render.faces.clone(),
            color: library::dye(dye).map(|c| f32::from(c) / 255.0),
            uv: mesh.render.uv.clone(),
            painted: vec![],
        }
    }

    /// Interpolates texture coordinates at barycentric coordinates `b` of a face.
    fn uv_at(&self, face: usize, b: [f32; 3]) -> [f32; 2] {
        let t = self.faces[face];
        [0, 1].map(|d| (0..3).map(|k| self.uv[t[k] as usize][d] * b[k]).sum())
    }

    /// Colour at barycentric coordinates `b` of a face, before light.
    fn color_at(&self, face: usize, b: [f32; 3], is_inside: bool) -> [f32; 3] {
        if !self.painted.is_empty() && !is_inside {
            let t = self.faces[face];
            let at = |k: usize, d: usize| f32::from(self.painted[t[k] as usize][d]) / 255.0;
            return [0, 1, 2].map(|d| (0..3).map(|k| at(k, d) * b[k]).sum());
        }
        if self.uv.is_empty() {
            return self.color;
        }
        if is_inside {
            // The lining: a darker colour of another hue.
            return [1, 2, 0].map(|k| self.color[k] * 0.5);
        }
        let (side, dark) = CHECKER;
        let [u, v] = self.uv_at(face, b).map(|x| (x / side).floor());
        let odd = (u + v).rem_euclid(2.0);
        self.color.map(|c| c * (dark + (1.0 - dark) * odd))
    }
}

/// Position of the viewer and the part of space shown.
#[derive(Clone, Copy)]
pub(crate) struct Turn {
    /// Turn about the vertical axis, radians.
    pub(crate) yaw: f32,
    /// Width and height of the picture, pixels.
    pub(crate) cell: (u32, u32),
    /// Lowest and highest y shown, metres.
    pub(crate) y: [f32; 2],
    /// The axis, x and z, metres.
    pub(crate) centre: [f32; 2],
}

/// Draws meshes into one picture, RGB bytes.
pub(crate) fn draw(meshes: &[DrawnMesh], turn: &Turn) -> Vec<u8> {
    let (s, c) = turn.yaw.sin_cos();
    let (mut all, mut faces, mut owner) = (Vec::new(), Vec::<Face>::new(), Vec::new());
    for (k, m) in meshes.iter().enumerate() {
        let first = all.len() as u32;
        all.extend(m.vertices.iter().map(|q| {
            let (x, z) = (q.x - turn.centre[0], q.z - turn.centre[1]);
            P3::new(c * x - s * z, -q.y, -(s * x + c * z))
        }));
        faces.extend(m.faces.iter().map(|f| f.map(|v| v + first)));
        owner.extend((0..m.faces.len()).map(|i| (k, i)));
    }
    let mut normals = vec![V3::zeros(); all.len()];
    for f in &faces {
        let n = face_normal(&all, f);
        f.iter().for_each(|&v| normals[v as usize] += n);
    }
    let (w, h) = turn.cell;
    let scale = h as f32 / (turn.y[1] - turn.y[0]);
    let view = View::Orthographic {
        width: w,
        height: h,
        left: -(w as f32) / scale / 2.0,
        top: -turn.y[1],
        pixels_per_metre: scale,
    };
    let mut buffer = VisibilityBuffer::default();
    rasterise(&view, &all, &faces, &mut buffer);
    let lamp = V3::from(LAMP).normalize();
    let mut out = vec![BACKGROUND; (w * h * 3) as usize];
    for (i, pixel) in (0..w * h).zip(out.chunks_exact_mut(3)) {
        let Some((face, b)) = interpolate(&view, &all, &faces, &buffer, [i % w, i / w]) else {
            continue;
        };
        let f = faces[face as usize];
        let (mesh, own) = owner[face as usize];
        let n = (0..3).fold(V3::zeros(), |s, k| {
            s + normals[f[k] as usize].normalize() * b[k]
        });
        let n = n.normalize();
        let n = if n.z > 0.0 { -n } else { n };
        let is_inside = face_normal(&all, &f).z > 0.0;
        let color = meshes[mesh].color_at(own, b, is_inside);
        let shade = AMBIENT + (1.0 - AMBIENT) * n.dot(&lamp).max(0.0);
        for (out, c) in pixel.iter_mut().zip(color) {
            *out = (c * shade * 255.0).clamp(0.0, 255.0) as u8;
        }
    }
    out
}

/// A sheet of equally large pictures.
pub(crate) struct Sheet {
    cell: (u32, u32),
    columns: u32,
    rows: u32,
    data: Vec<u8>,
}

impl Sheet {
    /// An empty sheet.
    pub(crate) fn new(cell: (u32, u32), columns: u32, rows: u32) -> Self {
        Self {
            cell,
            columns,
            rows,
            data: vec![255; (columns * cell.0 * rows * cell.1 * 3) as usize],
        }
    }

    /// Copies a picture into a cell.
    pub(crate) fn put(&mut self, column: u32, row: u32, picture: &[u8]) {
        let stride = (self.columns * self.cell.0 * 3) as usize;
        let (first, bytes) = (
            (column * self.cell.0 * 3) as usize,
            (self.cell.0 * 3) as usize,
        );
        for (line, pixels) in picture.chunks_exact(bytes).enumerate() {
            let to = ((row * self.cell.1) as usize + line) * stride + first;
            self.data[to..to + bytes].copy_from_slice(pixels);
        }
    }

    /// Writes the sheet and prints its path.
    pub(crate) fn write(self, path: &std::path::Path) {
        let (w, h) = (self.columns * self.cell.0, self.rows * self.cell.1);
        let image = tryon::geometry::camera::ColorImage::new(w, h, self.data).expect("a picture");
        tryon::formats::image::write_png_rgb(path, &image).expect("written");
        println!("{}", path.display());
    }
}

//! Plain pictures of surfaces: orthographic, one lamp, a checker along the texture coordinates.

use tryon::body::Template;
use tryon::garment::{GarmentMesh, library};
use tryon::geometry::math::{P3, V3};
use tryon::geometry::mesh::{Face, face_normal};
use tryon::geometry::raster::{View, VisibilityBuffer, interpolate, rasterise};
use tryon::geometry::settings;

settings! {
    /// Settings of the pictures; colours are sRGB, 0 to 1.
    pub struct DrawingSettings {
        /// Colour of bodies.
        pub skin: [f32; 3] = [0.86, 0.70, 0.60],
        /// Side of a checker field (m).
        pub checker: f32 = 0.04,
        /// Brightness of the dark fields.
        pub dark: f32 = 0.88,
        /// Towards the lamp, in the view's frame.
        pub lamp: [f32; 3] = [-0.45, -0.6, -0.66],
        /// Least brightness.
        pub ambient: f32 = 0.3,
        /// Grey of the background, 0 to 255.
        pub background: u8 = 250,
        /// Space around the body (m).
        pub margin: f32 = 0.03,
    }
}

/// A surface to draw.
pub(super) struct DrawnMesh {
    /// Metres, y up.
    pub(super) vertices: Vec<P3>,
    /// Counter-clockwise seen from outside.
    pub(super) faces: Vec<Face>,
    /// sRGB, 0 to 1.
    pub(super) color: [f32; 3],
    /// Texture coordinates in metres, for the checker. Empty: no checker, and no lining.
    pub(super) uv: Vec<[f32; 2]>,
    /// Colour of each vertex instead of `color`, sRGB; empty for none.
    pub(super) painted: Vec<[u8; 3]>,
}

impl DrawnMesh {
    /// A bare body.
    pub(super) fn body(template: &Template, vertices: &[P3]) -> Self {
        Self {
            vertices: vertices.to_vec(),
            faces: template.mesh().faces().to_vec(),
            color: DrawingSettings::default().skin,
            uv: vec![],
            painted: vec![],
        }
    }

    /// A garment at the positions of its simulated vertices, in the colour of the library's garment `dye`.
    pub(super) fn garment(mesh: &GarmentMesh, positions: &[P3], dye: &str) -> Self {
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
    fn color_at(
        &self,
        face: usize,
        b: [f32; 3],
        is_inside: bool,
        settings: &DrawingSettings,
    ) -> [f32; 3] {
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
        let dark = settings.dark;
        let [u, v] = self.uv_at(face, b).map(|x| (x / settings.checker).floor());
        let odd = (u + v).rem_euclid(2.0);
        self.color.map(|c| c * (dark + (1.0 - dark) * odd))
    }
}

/// Position of the viewer and the part of space shown.
#[derive(Clone, Copy)]
pub(super) struct Turn {
    /// Turn about the vertical axis, radians.
    pub(super) yaw: f32,
    /// Width and height of the picture, pixels.
    pub(super) cell: [u32; 2],
    /// Lowest and highest y shown, metres.
    pub(super) y: [f32; 2],
    /// The axis, x and z, metres.
    pub(super) centre: [f32; 2],
}

impl Turn {
    /// The front of a whole body in a cell of this size, pixels.
    pub(super) fn around(body: &[P3], cell: [u32; 2]) -> Self {
        let sum = (body.iter()).fold([0.0; 2], |s, p| [s[0] + p.x, s[1] + p.z]);
        let range = |y: [f32; 2], p: &P3| [y[0].min(p.y), y[1].max(p.y)];
        let [low, high] = body.iter().fold([f32::MAX, f32::MIN], range);
        let margin = DrawingSettings::default().margin;
        Self {
            yaw: 0.0,
            cell,
            y: [low - margin, high + margin],
            centre: sum.map(|s| s / body.len() as f32),
        }
    }
}

/// Draws meshes into one picture, RGB bytes.
pub(super) fn draw(meshes: &[DrawnMesh], turn: &Turn) -> Vec<u8> {
    let settings = DrawingSettings::default();
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
    let [w, h] = turn.cell;
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
    let lamp = V3::from(settings.lamp).normalize();
    let mut out = vec![settings.background; (w * h * 3) as usize];
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
        let color = meshes[mesh].color_at(own, b, is_inside, &settings);
        let shade = settings.ambient + (1.0 - settings.ambient) * n.dot(&lamp).max(0.0);
        for (out, c) in pixel.iter_mut().zip(color) {
            *out = (c * shade * 255.0).clamp(0.0, 255.0) as u8;
        }
    }
    out
}

//! Pictures of the stages: coloured meshes from the front, side and back, in rows.

use super::capture::FrameCapture;
use super::captured_outfit::CapturedOutfit;
use super::scan::BodyScan;
use super::settings::PictureSettings;
use super::texture::{GarmentTexture, TextureAtlas};
use super::topology::ClothTemplate;
use nalgebra::{Rotation3, Vector3};
use tryon_body::Pose;
use tryon_geometry::camera::ColorImage;
use tryon_geometry::math::{P3, V3, World};
use tryon_geometry::mesh::{Csr, Face, vertex_normals};
use tryon_geometry::par::Par;
use tryon_geometry::raster::{Options, View, VisibilityBuffer, interpolate, rasterise_with};

/// Coloured mesh, or cloud if it has no faces.
#[derive(Clone, Copy, Debug)]
pub struct Painted<'a> {
    /// Positions, world, metres.
    pub points: &'a [P3],
    /// Triangles.
    pub faces: &'a [Face],
    /// Colours, sRGB, shape `[points]`.
    pub colors: &'a [[u8; 3]],
    /// Texture in place of the colours.
    pub texture: Option<(&'a TextureAtlas, &'a GarmentTexture)>,
}

impl<'a> Painted<'a> {
    /// Garment `k` of an outfit at posed points, with its texture if it has one.
    pub fn garment(
        outfit: &'a CapturedOutfit,
        textures: &'a [GarmentTexture],
        k: usize,
        points: &'a [P3],
    ) -> Self {
        Self {
            texture: outfit.atlases.get(k).zip(textures.get(k)),
            ..Self::colored(points, &outfit.cloth.parts[k].faces, &outfit.colors[k])
        }
    }

    /// Mesh in colours of its points.
    pub fn colored(points: &'a [P3], faces: &'a [Face], colors: &'a [[u8; 3]]) -> Self {
        Self {
            points,
            faces,
            colors,
            texture: None,
        }
    }

    /// Colour at a point of a face, sRGB, 0 to 255.
    fn color(&self, face: usize, weights: [f32; 3]) -> V3 {
        match self.texture {
            Some((atlas, texture)) => texture.sample(atlas, face, weights).into(),
            None => {
                let corners = self.faces[face].map(|v| self.colors[v as usize].map(f32::from));
                (0..3).map(|k| V3::from(corners[k]) * weights[k]).sum()
            }
        }
    }
}

/// One panel: meshes seen from a direction.
#[derive(Clone, Debug)]
pub struct PicturePanel<'a> {
    /// Meshes in one picture.
    pub meshes: Vec<Painted<'a>>,
    /// Direction of the viewer about the vertical, radians; 0 is +z.
    pub yaw: f32,
}

/// Colours of parts, sRGB: skin, then garments.
const PART_COLORS: [[u8; 3]; 7] = [
    [230, 190, 160],
    [70, 110, 200],
    [225, 215, 90],
    [90, 160, 90],
    [200, 90, 80],
    [170, 90, 190],
    [90, 190, 200],
];
/// Colour of a part.
pub fn part_color(part: u8) -> [u8; 3] {
    PART_COLORS[usize::from(part) % PART_COLORS.len()]
}

/// Stages of one scan, a row each from the front, side and back: scan, aligned surface, labels, garments, body below,
/// dressed. `front` is the body's direction about the vertical, radians.
pub fn stages(
    cloth: &ClothTemplate,
    scan: &BodyScan,
    frame: &FrameCapture,
    outfit: &CapturedOutfit,
    textures: &[GarmentTexture],
) -> ColorImage {
    let (skin_mesh, surface) = (cloth.body().mesh(), cloth.template().mesh());
    let front = heading(&frame.alignment.body.pose);
    let skin = vec![part_color(0); skin_mesh.vertices().len()];
    let grey = vec![[190, 190, 200]; surface.vertices().len()];
    let labels: Vec<[u8; 3]> = frame.labels.iter().map(|p| part_color(*p)).collect();
    let plain = vec![[160; 3]; scan.points.len()];
    let of_scan = |colors| Painted::colored(&scan.points, &scan.faces, colors);
    let is_plain = scan.colors.is_empty();
    let captured = if is_plain { &plain } else { &scan.colors };
    let body = Painted::colored(&frame.undressed.vertices, skin_mesh.faces(), &skin);
    let garments = frame.garments.iter().enumerate();
    let garments = garments.map(|(k, points)| Painted::garment(outfit, textures, k, points));
    let garments: Vec<Painted<'_>> = garments.collect();
    let aligned = Painted::colored(&frame.alignment.surface, surface.faces(), &grey);
    let dressed = [&[body][..], &garments].concat();
    let columns = [
        vec![of_scan(captured)],
        vec![aligned],
        vec![of_scan(&labels)],
        garments,
        vec![body],
        dressed,
    ];
    let views = PictureSettings::default().views;
    let panels = views.iter().flat_map(|view| {
        columns.iter().map(move |meshes| PicturePanel {
            meshes: meshes.clone(),
            yaw: front + view,
        })
    });
    sheet(&panels.collect::<Vec<_>>(), columns.len())
}

/// Direction that a body faces, radians about the vertical from +z.
pub fn heading(pose: &Pose<World>) -> f32 {
    let z = pose.root.vector(&Vector3::z());
    z.x.atan2(z.z) as f32
}

/// Draws panels side by side, `columns` a row.
pub fn sheet(panels: &[PicturePanel<'_>], columns: usize) -> ColorImage {
    let columns = columns.clamp(1, panels.len().max(1));
    let settings = PictureSettings::default();
    let [w, h] = settings.panel.map(|m| (m * settings.scale) as u32);
    let rows = panels.len().div_ceil(columns) as u32;
    let mut out = ColorImage::filled(w * columns as u32, h * rows, settings.paper);
    let stride = out.width() as usize;
    for (k, panel) in panels.iter().enumerate() {
        let (column, row) = (k % columns, k / columns);
        let picture = draw(panel, [w, h], &settings);
        for y in 0..h as usize {
            let from = 3 * y * w as usize;
            let to = 3 * ((row * h as usize + y) * stride + column * w as usize);
            let line = &picture[from..from + 3 * w as usize];
            out.data_mut()[to..to + line.len()].copy_from_slice(line);
        }
    }
    out
}

fn draw(panel: &PicturePanel<'_>, [w, h]: [u32; 2], settings: &PictureSettings) -> Vec<u8> {
    let turn = Rotation3::from_axis_angle(&V3::y_axis(), -panel.yaw);
    let finite = |p: &&P3| p.iter().all(|c| c.is_finite());
    let all = || panel.meshes.iter().flat_map(|m| m.points).filter(finite);
    let low = all().map(|p| p.y).fold(f32::MAX, f32::min);
    let n = all().count().max(1) as f32;
    let middle = turn * P3::from(all().map(|p| p.coords).sum::<V3>() / n);
    let view = View::Orthographic {
        width: w,
        height: h,
        left: middle.x - 0.5 * settings.panel[0],
        top: -(low - settings.below + settings.panel[1]),
        pixels_per_metre: settings.scale,
    };
    let mut pixels: Vec<u8> = settings.paper.repeat((w * h) as usize);
    let mut depth = vec![f32::INFINITY; (w * h) as usize];
    for mesh in &panel.meshes {
        // The viewer's axes: x right, y down, z away.
        let seen = mesh.points.iter().map(|p| turn * p);
        let seen: Vec<P3> = seen.map(|q| P3::new(q.x, -q.y, -q.z)).collect();
        let mut target = Target {
            settings,
            view: &view,
            pixels: &mut pixels,
            depth: &mut depth,
        };
        if mesh.faces.is_empty() {
            target.dots(&seen, mesh.colors);
        } else {
            target.surface(&seen, mesh);
        }
    }
    pixels
}

struct Target<'a> {
    settings: &'a PictureSettings,
    view: &'a View,
    pixels: &'a mut [u8],
    depth: &'a mut [f32],
}

impl Target<'_> {
    fn put(&mut self, at: usize, z: f32, color: [f32; 3]) {
        if z < self.depth[at] {
            self.depth[at] = z;
            for (out, c) in self.pixels[3 * at..3 * at + 3].iter_mut().zip(color) {
                *out = c.round().clamp(0.0, 255.0) as u8;
            }
        }
    }

    fn surface(&mut self, seen: &[P3], mesh: &Painted<'_>) {
        let (around, mut normals) = (Csr::of_faces(seen.len(), mesh.faces), Vec::new());
        vertex_normals(Par::Rayon, seen, mesh.faces, &around, &mut normals);
        let mut buffer = VisibilityBuffer::default();
        let options = Options {
            par: Par::Rayon,
            ..Options::default()
        };
        rasterise_with(options, self.view, seen, mesh.faces, &mut buffer);
        let (ambient, [x, y, z]) = (self.settings.ambient, self.settings.light);
        let light = V3::new(x, -y, -z).normalize();
        let (w, h) = self.view.size();
        for v in 0..h {
            for u in 0..w {
                let found = interpolate(self.view, seen, mesh.faces, &buffer, [u, v]);
                let Some((id, b)) = found else {
                    continue;
                };
                let f = mesh.faces[id as usize];
                let n: V3 = (0..3).map(|k| normals[f[k] as usize] * b[k]).sum();
                let n = n.try_normalize(f32::MIN_POSITIVE).unwrap_or_default();
                // Both sides of cloth are lit.
                let n = if n.z > 0.0 { -n } else { n };
                let lit = ambient + (1.0 - ambient) * n.dot(&light).max(0.0);
                let color = mesh.color(id as usize, b);
                let at = (v * w + u) as usize;
                self.put(at, buffer.depth[at], (color * lit).into());
            }
        }
    }

    fn dots(&mut self, seen: &[P3], colors: &[[u8; 3]]) {
        let ((w, h), dot) = (self.view.size(), self.settings.dot);
        for (p, c) in seen.iter().zip(colors) {
            let Some([x, y, z]) = self.view.project(p) else {
                continue;
            };
            for dy in 0..dot {
                for dx in 0..dot {
                    let (u, v) = (x as i32 + dx, y as i32 + dy);
                    if (0..w as i32).contains(&u) && (0..h as i32).contains(&v) {
                        self.put(v as usize * w as usize + u as usize, z, c.map(f32::from));
                    }
                }
            }
        }
    }
}

//! All garments as one surface in the picture's camera, and which of it each sample sees.

use super::framing::Stage;
use super::input::{Config, Input};
use super::look::Fabric;
use crate::math::{P3, V3};
use crate::mesh::Face;
use crate::raster::{Cull, Options, View, VisibilityBuffer, rasterise_with};

/// Nothing nearer to the camera is drawn, metres.
pub(crate) const NEAR: f32 = 0.1;
/// Side of the tiles that are counted as drawn or skipped, pixels.
pub(crate) const TILE: u32 = 32;

/// A rectangle of the picture, pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Area {
    pub(crate) left: u32,
    pub(crate) top: u32,
    pub(crate) width: u32,
    pub(crate) height: u32,
}

impl Area {
    pub(crate) fn len(&self) -> usize {
        self.width as usize * self.height as usize
    }
}

/// Garments joined, innermost first. Rebuilt for every picture; capacity is kept.
#[derive(Clone, Debug, Default)]
pub(crate) struct Surface {
    pub(crate) vertices: Vec<P3>,
    normals: Vec<V3>,
    /// What shading interpolates, shape `[vertices]`: normal, share of ambient light that reaches the vertex (less in
    /// the valley of a fold), texture coordinate, depth, and one unused.
    pub(crate) attributes: Vec<[f32; 8]>,
    openness: Vec<f32>,
    uv: Vec<[f32; 2]>,
    pub(crate) faces: Vec<Face>,
    /// Index into `fabrics`, shape `[faces]`.
    pub(crate) garment: Vec<u8>,
    /// Seen from inside, shape `[faces]`.
    pub(crate) inner: Vec<bool>,
    pub(crate) fabrics: Vec<Fabric>,
    /// Median distance of the vertices, metres.
    pub(crate) distance: f32,
    /// What the samples of the drawn area see.
    pub(crate) samples: VisibilityBuffer,
}

/// How much a fold whose flanks rise at 45° loses of its ambient light.
const FOLD_SHADE: f32 = 0.9;
/// Darkest and brightest openness.
const OPENNESS: [f32; 2] = [0.6, 1.08];

impl Surface {
    pub(crate) fn build(&mut self, input: &Input<'_>, config: &Config) {
        self.vertices.clear();
        self.normals.clear();
        self.uv.clear();
        self.faces.clear();
        self.garment.clear();
        self.fabrics.clear();
        let iso: nalgebra::Isometry3<f32> = match input.calibration.color {
            Some(_) => input.calibration.color_from_depth.iso().cast(),
            None => nalgebra::Isometry3::identity(),
        };
        let rotation = iso.rotation.to_rotation_matrix().into_inner();
        for (number, g) in input.garments.iter().enumerate().take(usize::from(u8::MAX)) {
            let base = self.vertices.len() as u32;
            let nearer = config.layer_offset * number as f32;
            self.vertices.extend(g.vertices.iter().map(|p| {
                let p = P3::from(rotation * p.coords + iso.translation.vector);
                // Along the line of sight, so that the outline stays where it is.
                if p.z > NEAR { p * (1.0 - nearer / p.z) } else { p }
            }));
            if g.normals.is_empty() {
                self.normals.resize(self.vertices.len(), V3::zeros());
                for f in g.faces {
                    let f = f.map(|i| i + base);
                    let n = crate::mesh::face_normal(&self.vertices, &f);
                    f.iter().for_each(|&i| self.normals[i as usize] += n);
                }
                for n in &mut self.normals[base as usize..] {
                    *n = n.try_normalize(0.0).unwrap_or_else(V3::zeros);
                }
            } else {
                self.normals.extend(g.normals.iter().map(|n| rotation * n));
            }
            if g.uv.is_empty() {
                self.uv.resize(self.vertices.len(), [0.0; 2]);
            } else {
                self.uv.extend_from_slice(g.uv);
            }
            self.faces.extend(g.faces.iter().map(|f| f.map(|i| i + base)));
            self.garment.resize(self.faces.len(), number as u8);
            self.fabrics.push(Fabric::new(g.look));
        }
        self.look_at_folds();
        let mut z: Vec<f32> = self.vertices.iter().step_by(16).map(|p| p.z).collect();
        z.sort_by(f32::total_cmp);
        self.distance = z.get(z.len() / 2).copied().unwrap_or(1.0).max(NEAR);
    }

    fn look_at_folds(&mut self) {
        self.inner.clear();
        self.openness.clear();
        self.openness.resize(self.vertices.len(), 0.0);
        let mut count = vec![0u16; self.vertices.len()];
        for f in &self.faces {
            let n = crate::mesh::face_normal(&self.vertices, f);
            self.inner.push(n.dot(&self.vertices[f[0] as usize].coords) > 0.0);
            for k in 0..3 {
                let (i, j) = (f[k] as usize, f[(k + 1) % 3] as usize);
                let e = self.vertices[j] - self.vertices[i];
                let length = e.norm().max(f32::MIN_POSITIVE);
                // Sine of the angle by which the neighbour rises above the tangent plane.
                self.openness[i] += e.dot(&self.normals[i]) / length;
                self.openness[j] -= e.dot(&self.normals[j]) / length;
                count[i] = count[i].saturating_add(1);
                count[j] = count[j].saturating_add(1);
            }
        }
        for (o, n) in self.openness.iter_mut().zip(count) {
            *o = (1.0 - FOLD_SHADE * *o / f32::from(n.max(1))).clamp(OPENNESS[0], OPENNESS[1]);
        }
        self.attributes.clear();
        self.attributes.extend(
            self.vertices
                .iter()
                .zip(&self.normals)
                .zip(&self.openness)
                .zip(&self.uv)
                .map(|(((p, n), open), uv)| [n.x, n.y, n.z, *open, uv[0], uv[1], p.z, 0.0]),
        );
    }

    /// The part of the picture that garments can touch, `margin` pixels around included; `None` when there is none.
    pub(crate) fn area(&self, stage: &Stage, margin: f32) -> Option<Area> {
        let (mut lo, mut hi) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
        let size = [stage.camera.width, stage.camera.height].map(|s| s as f32);
        for p in &self.vertices {
            if p.z < NEAR {
                if self.vertices.iter().all(|p| p.z < NEAR) {
                    return None;
                }
                (lo, hi) = ([0.0; 2], size);
                break;
            }
            let q = stage.camera.project(p);
            for k in 0..2 {
                lo[k] = lo[k].min(q[k]);
                hi[k] = hi[k].max(q[k]);
            }
        }
        let from = [0, 1].map(|k| (lo[k] - margin).floor().clamp(0.0, size[k]) as u32);
        let to = [0, 1].map(|k| (hi[k] + margin + 2.0).floor().clamp(0.0, size[k]) as u32);
        (from[0] < to[0] && from[1] < to[1] && !self.faces.is_empty()).then(|| Area {
            left: from[0],
            top: from[1],
            width: to[0] - from[0],
            height: to[1] - from[1],
        })
    }

    /// Fills `samples` over `area`, `n` samples along each side of a pixel.
    pub(crate) fn rasterise(&mut self, config: &Config, stage: &Stage, area: &Area, n: u32) {
        let view = part_of(stage, area, n);
        let options = Options { par: config.par, cull: Cull::None };
        rasterise_with(options, &view, &self.vertices, &self.faces, &mut self.samples);
    }
}

/// The view of `area` alone with `n` samples a pixel along each side (n may be a fraction: fewer than one).
pub(crate) fn part_of(stage: &Stage, area: &Area, n: u32) -> View {
    let full = stage.camera.resized(stage.camera.width * n, stage.camera.height * n);
    let camera = crate::camera::Intrinsics {
        width: area.width * n,
        height: area.height * n,
        cx: full.cx - f64::from(area.left * n),
        cy: full.cy - f64::from(area.top * n),
        ..full
    };
    View::Perspective { camera, near: NEAR }
}

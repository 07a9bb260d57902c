//! All garments as one surface in the picture's camera, and which of it each sample sees.
//!
//! Normals, the light in folds and which side of a face is seen come after the visibility, and only where something is
//! seen ([`Surface::light`]): the far side of a garment and what another one covers have none.

use super::framing::Stage;
use super::input::{Config, Input};
use super::look::Fabric;
use crate::math::{P3, V3};
use crate::mesh::{Face, face_normal};
use crate::raster::{Cull, Options, View, VisibilityBuffer, rasterise_layers, rasterise_with};
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

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

/// A mark for each face, set by any thread; the order of setting leaves no trace.
#[derive(Debug, Default)]
pub(crate) struct Marks(Vec<AtomicBool>);

impl Clone for Marks {
    fn clone(&self) -> Self {
        Self(self.of(0..self.0.len()).map(AtomicBool::new).collect())
    }
}

impl Marks {
    /// `n` marks, all set or none.
    pub(crate) fn reset(&mut self, n: usize, set: bool) {
        self.0.clear();
        self.0.resize_with(n, || AtomicBool::new(set));
    }
    #[inline]
    pub(crate) fn set(&self, face: u32) {
        self.0[face as usize].store(true, Ordering::Relaxed);
    }
    fn of(&self, faces: Range<usize>) -> impl Iterator<Item = bool> {
        self.0[faces].iter().map(|m| m.load(Ordering::Relaxed))
    }
}

/// Garments joined, innermost first. Rebuilt for every picture; capacity is kept.
#[derive(Clone, Debug, Default)]
pub(crate) struct Surface {
    pub(crate) vertices: Vec<P3>,
    normals: Vec<V3>,
    /// What shading interpolates, shape `[vertices]`: normal, share of ambient light that reaches the vertex (less in
    /// the valley of a fold), texture coordinate, depth, and one unused. Only those of seen faces are right.
    pub(crate) attributes: Vec<[f32; 8]>,
    openness: Vec<f32>,
    /// Edges at each vertex, from both sides.
    edges: Vec<u16>,
    uv: Vec<[f32; 2]>,
    pub(crate) faces: Vec<Face>,
    /// Index into `fabrics`, shape `[faces]`.
    pub(crate) garment: Vec<u8>,
    /// Seen from inside, shape `[faces]`; right where the face is seen.
    pub(crate) inner: Vec<bool>,
    /// Faces of each garment.
    layers: Vec<Range<usize>>,
    /// Vertices of each garment.
    corners: Vec<Range<usize>>,
    /// Normals came with the garment, by garment.
    given: Vec<bool>,
    /// Faces that a sample sees.
    pub(crate) seen: Marks,
    /// A seen face has this corner, shape `[vertices]`.
    wanted: Vec<bool>,
    /// Faces with a wanted corner.
    near: Vec<u32>,
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
        self.layers.clear();
        self.corners.clear();
        self.given.clear();
        let iso: nalgebra::Isometry3<f32> = match input.calibration.color {
            Some(_) => input.calibration.color_from_depth.iso().cast(),
            None => nalgebra::Isometry3::identity(),
        };
        let rotation = iso.rotation.to_rotation_matrix().into_inner();
        for (number, g) in input.garments.iter().enumerate().take(usize::from(u8::MAX)) {
            let (base, first) = (self.vertices.len() as u32, self.faces.len());
            let nearer = config.layer_offset * number as f32;
            self.vertices.extend(g.vertices.iter().map(|p| {
                let p = P3::from(rotation * p.coords + iso.translation.vector);
                // Along the line of sight, so that the outline stays where it is.
                if p.z > NEAR {
                    p * (1.0 - nearer / p.z)
                } else {
                    p
                }
            }));
            self.normals.extend(g.normals.iter().map(|n| rotation * n));
            self.normals.resize(self.vertices.len(), V3::zeros());
            self.given.push(!g.normals.is_empty());
            if g.uv.is_empty() {
                self.uv.resize(self.vertices.len(), [0.0; 2]);
            } else {
                self.uv.extend_from_slice(g.uv);
            }
            self.faces
                .extend(g.faces.iter().map(|f| f.map(|i| i + base)));
            self.garment.resize(self.faces.len(), number as u8);
            self.layers.push(first..self.faces.len());
            self.corners.push(base as usize..self.vertices.len());
            self.fabrics.push(Fabric::new(g.look));
        }
        let mut z: Vec<f32> = self.vertices.iter().step_by(16).map(|p| p.z).collect();
        z.sort_by(f32::total_cmp);
        self.distance = z.get(z.len() / 2).copied().unwrap_or(1.0).max(NEAR);
    }

    /// Garments of which nothing is seen.
    pub(crate) fn garments_hidden(&self) -> usize {
        self.layers
            .iter()
            .filter(|l| !self.seen.of((*l).clone()).any(|s| s))
            .count()
    }

    /// Normals, light in folds and sides of the seen faces; returns how many vertices needed none. The sums run over the
    /// same faces in the same order whatever is seen, so their bits are those of a picture in which all are.
    pub(crate) fn light(&mut self) -> usize {
        self.wanted.clear();
        self.wanted.resize(self.vertices.len(), false);
        self.inner.resize(self.faces.len(), false);
        for ((f, seen), inner) in self
            .faces
            .iter()
            .zip(self.seen.of(0..self.faces.len()))
            .zip(&mut self.inner)
        {
            if seen {
                f.iter().for_each(|i| self.wanted[*i as usize] = true);
                *inner =
                    face_normal(&self.vertices, f).dot(&self.vertices[f[0] as usize].coords) > 0.0;
            }
        }
        self.near.clear();
        for (id, f) in self.faces.iter().enumerate() {
            if f.iter().any(|i| self.wanted[*i as usize]) {
                self.near.push(id as u32);
                if !self.given[usize::from(self.garment[id])] {
                    let n = face_normal(&self.vertices, f);
                    f.iter().for_each(|i| self.normals[*i as usize] += n);
                }
            }
        }
        for (own, _) in self
            .corners
            .iter()
            .zip(&self.given)
            .filter(|(_, given)| !**given)
        {
            for (n, _) in self.normals[own.clone()]
                .iter_mut()
                .zip(&self.wanted[own.clone()])
                .filter(|(_, w)| **w)
            {
                *n = n.try_normalize(0.0).unwrap_or_else(V3::zeros);
            }
        }
        self.look_at_folds();
        let (mut skipped, z) = (0, [0.0; 8]);
        self.attributes.resize(self.vertices.len(), z);
        for (i, out) in self.attributes.iter_mut().enumerate() {
            if self.wanted[i] {
                let (n, uv) = (&self.normals[i], &self.uv[i]);
                *out = [
                    n.x,
                    n.y,
                    n.z,
                    self.openness[i],
                    uv[0],
                    uv[1],
                    self.vertices[i].z,
                    0.0,
                ];
            } else {
                skipped += 1;
            }
        }
        skipped
    }

    /// Openness of the wanted vertices.
    fn look_at_folds(&mut self) {
        self.openness.clear();
        self.openness.resize(self.vertices.len(), 0.0);
        self.edges.clear();
        self.edges.resize(self.vertices.len(), 0);
        for id in &self.near {
            let f = &self.faces[*id as usize];
            for k in 0..3 {
                let (i, j) = (f[k] as usize, f[(k + 1) % 3] as usize);
                let e = self.vertices[j] - self.vertices[i];
                let length = e.norm().max(f32::MIN_POSITIVE);
                // Sine of the angle by which the neighbour rises above the tangent plane.
                self.openness[i] += e.dot(&self.normals[i]) / length;
                self.openness[j] -= e.dot(&self.normals[j]) / length;
                self.edges[i] = self.edges[i].saturating_add(1);
                self.edges[j] = self.edges[j].saturating_add(1);
            }
        }
        for (o, n) in self.openness.iter_mut().zip(&self.edges) {
            *o = (1.0 - FOLD_SHADE * *o / f32::from((*n).max(1))).clamp(OPENNESS[0], OPENNESS[1]);
        }
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

    /// Fills `samples` over `area`, `n` samples along each side of a pixel; returns how many faces were left out as hidden.
    pub(crate) fn rasterise(
        &mut self,
        config: &Config,
        stage: &Stage,
        area: &Area,
        n: u32,
    ) -> usize {
        let view = part_of(stage, area, n);
        if config.skip_hidden {
            let (x, f, of) = (&self.vertices, &self.faces, &self.layers);
            return rasterise_layers(
                config.par,
                config.inside_offset,
                &view,
                x,
                f,
                of,
                &mut self.samples,
            );
        }
        let options = Options {
            par: config.par,
            cull: Cull::None,
            behind: config.inside_offset,
        };
        rasterise_with(
            options,
            &view,
            &self.vertices,
            &self.faces,
            &mut self.samples,
        );
        0
    }
}

/// The view of `area` alone with `n` samples a pixel along each side (n may be a fraction: fewer than one).
pub(crate) fn part_of(stage: &Stage, area: &Area, n: u32) -> View {
    let full = stage
        .camera
        .resized(stage.camera.width * n, stage.camera.height * n);
    let camera = crate::camera::Intrinsics {
        width: area.width * n,
        height: area.height * n,
        cx: full.cx - f64::from(area.left * n),
        cy: full.cy - f64::from(area.top * n),
        ..full
    };
    View::Perspective { camera, near: NEAR }
}

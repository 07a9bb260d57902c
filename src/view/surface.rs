//! All garments as one surface in the picture's camera, and its rasterisation.
//!
//! Normals and openness come after visibility and only for visible faces, see
//! [`shade_vertices`](Surface::shade_vertices).

use super::appearance::Fabric;
use super::area::{Area, NEAR};
use super::config::{Config, Lights};
use super::construction::EdgePlace;
use super::input::{GarmentView, Input};
use super::viewport::Viewport;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use tryon_geometry::math::order_statistics::median;
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::Face;
use tryon_geometry::raster::{
    Cull, LayeredMesh, Options, View, VisibilityBuffer, rasterise_layers, rasterise_with,
};

/// One flag a face, set from any thread; the order of setting leaves no trace.
#[derive(Debug, Default)]
pub(crate) struct FaceFlags(Vec<AtomicBool>);

impl Clone for FaceFlags {
    fn clone(&self) -> Self {
        Self(self.of(0..self.0.len()).map(AtomicBool::new).collect())
    }
}

impl FaceFlags {
    /// `n` flags, all set or none.
    pub(crate) fn reset(&mut self, n: usize, set: bool) {
        self.0.clear();
        self.0.resize_with(n, || AtomicBool::new(set));
    }

    #[inline]
    pub(crate) fn set(&self, face: u32) {
        self.0[face as usize].store(true, Ordering::Relaxed);
    }

    pub(super) fn of(&self, faces: Range<usize>) -> impl Iterator<Item = bool> {
        self.0[faces].iter().map(|m| m.load(Ordering::Relaxed))
    }
}

/// Attributes of a vertex.
pub(crate) type VertexAttributes = [f32; 16];

/// Garments joined, innermost first. Rebuilt for every picture; capacity is kept.
#[derive(Clone, Debug, Default)]
pub(crate) struct Surface {
    pub(crate) vertices: Vec<P3>,
    pub(super) normals: Vec<V3>,
    /// Interpolated by shading, shape `[vertices]`: normal, openness (share of ambient light that reaches the vertex),
    /// texture coordinate, depth, distance from a free edge, length along it, distance from a seam, 1 at an upper edge, unused,
    /// slopes of the four fields of ridges. Valid at corners of visible faces.
    pub(crate) attributes: Vec<VertexAttributes>,
    pub(super) uv: Vec<[f32; 2]>,
    pub(super) places: Vec<EdgePlace>,
    pub(crate) faces: Vec<Face>,
    /// Index into `fabrics`, shape `[faces]`.
    pub(crate) garment: Vec<u8>,
    /// Seen from inside, shape `[faces]`; valid for visible faces.
    pub(crate) inner: Vec<bool>,
    /// Elements of each garment, shape `[garments]`.
    pub(super) layers: Vec<Layer>,
    /// Faces that some sample sees.
    pub(crate) visible: FaceFlags,
    pub(crate) fabrics: Vec<Fabric>,
    /// Median distance of the vertices, metres.
    pub(crate) distance: f32,
    /// Nearest face of each sample of the drawn area.
    pub(crate) samples: VisibilityBuffer,
    pub(super) scratch: ShadingScratch,
}

/// Elements of one garment.
#[derive(Clone, Debug)]
pub(super) struct Layer {
    faces: Range<usize>,
    pub(super) vertices: Range<usize>,
    /// Normals came with the garment.
    pub(super) has_normals: bool,
}

/// Scratch of [`Surface::shade_vertices`].
#[derive(Clone, Debug, Default)]
pub(super) struct ShadingScratch {
    /// Some visible face has this corner, shape `[vertices]`.
    pub(super) is_visible: Vec<bool>,
    /// Vertices whose normals are computed: visible ones and their neighbours, shape `[vertices]`.
    pub(super) has_normal: Vec<bool>,
    /// Sum of the neighbours' normals, shape `[vertices]`.
    pub(super) around: Vec<V3>,
    /// Faces with such a corner.
    pub(super) faces: Vec<u32>,
    /// Sum of area times compression, by its double angle in the pattern, and of area, shape `[vertices]`.
    pub(super) compression: Vec<[f32; 3]>,
    /// Sum of the neighbours' elevations, then openness, shape `[vertices]`.
    pub(super) openness: Vec<f32>,
    /// Edges at each vertex, counted from both sides.
    pub(super) edges: Vec<u16>,
}

/// Stride of the vertices in the median distance.
const DISTANCE_STRIDE: usize = 16;

impl Surface {
    /// Joins the garments of `input` in the picture's camera.
    pub(crate) fn build(&mut self, input: &Input<'_>, config: &Config) {
        self.vertices.clear();
        self.normals.clear();
        self.uv.clear();
        self.places.clear();
        self.faces.clear();
        self.garment.clear();
        self.fabrics.clear();
        self.layers.clear();
        let iso = match input.calibration.color {
            Some(_) => input.calibration.color_from_depth.iso().cast(),
            None => nalgebra::Isometry3::identity(),
        };
        for (number, g) in (0..u8::MAX).zip(input.garments) {
            self.append(g, number, &iso, config.layer_bias * f32::from(number));
        }
        let mut z: Vec<f32> = self
            .vertices
            .iter()
            .step_by(DISTANCE_STRIDE)
            .map(|p| p.z)
            .collect();
        self.distance = median(&mut z).unwrap_or(1.0).max(NEAR);
    }

    /// One garment alone, every face shaded.
    pub(crate) fn shaded(garment: &GarmentView<'_>) -> Self {
        let mut surface = Self::default();
        surface.append(garment, 0, &nalgebra::Isometry3::identity(), 0.0);
        surface.visible.reset(surface.faces.len(), true);
        surface.shade_vertices(&Lights::default());
        surface
    }

    /// Appends one garment, displaced by `nearer` metres along the line of sight, which keeps its outline.
    fn append(
        &mut self,
        g: &GarmentView<'_>,
        number: u8,
        iso: &nalgebra::Isometry3<f32>,
        nearer: f32,
    ) {
        let rotation = iso.rotation.to_rotation_matrix().into_inner();
        let (base, first) = (self.vertices.len(), self.faces.len());
        self.vertices.extend(g.vertices.iter().map(|p| {
            let p = P3::from(rotation * p.coords + iso.translation.vector);
            if p.z > NEAR {
                p * (1.0 - nearer / p.z)
            } else {
                p
            }
        }));
        let end = self.vertices.len();
        self.normals.extend(g.normals.iter().map(|n| rotation * n));
        self.normals.resize(end, V3::zeros());
        self.uv.extend_from_slice(g.uv);
        self.uv.resize(end, [0.0; 2]);
        self.places.extend_from_slice(g.places);
        self.places.resize(end, EdgePlace::INNER);
        self.faces
            .extend(g.faces.iter().map(|f| f.map(|i| i + base as u32)));
        self.garment.resize(self.faces.len(), number);
        self.layers.push(Layer {
            faces: first..self.faces.len(),
            vertices: base..end,
            has_normals: !g.normals.is_empty(),
        });
        self.fabrics.push(Fabric::new(g.appearance));
    }

    /// Number of garments without a visible face.
    pub(crate) fn garments_hidden(&self) -> usize {
        self.layers
            .iter()
            .filter(|l| !self.visible.of(l.faces.clone()).any(|s| s))
            .count()
    }

    /// The part of the picture that garments can touch, `margin` pixels around included; `None` when there is none.
    pub(crate) fn area(&self, viewport: &Viewport, margin: f32) -> Option<Area> {
        let (mut lo, mut hi) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
        let size = [viewport.camera.width, viewport.camera.height].map(|s| s as f32);
        for p in &self.vertices {
            if p.z < NEAR {
                if self.vertices.iter().all(|p| p.z < NEAR) {
                    return None;
                }
                (lo, hi) = ([0.0; 2], size);
                break;
            }
            let q = viewport.camera.project(p);
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

    /// Fills `samples` over `area`, `n` samples along each side of a pixel; returns the number of faces skipped as hidden.
    pub(crate) fn rasterise(
        &mut self,
        config: &Config,
        viewport: &Viewport,
        area: &Area,
        n: u32,
    ) -> usize {
        let view = View::Perspective {
            camera: viewport.sample_camera(area, n),
            near: NEAR,
        };
        let (vertices, faces) = (&self.vertices, &self.faces);
        let options = Options {
            par: config.par,
            cull: Cull::None,
            back_offset: config.inner_bias,
        };
        if config.skip_hidden {
            let layers: Vec<Range<usize>> = self.layers.iter().map(|l| l.faces.clone()).collect();
            let mesh = LayeredMesh {
                vertices,
                faces,
                layers: &layers,
            };
            return rasterise_layers(options, &view, &mesh, &mut self.samples);
        }
        rasterise_with(options, &view, vertices, faces, &mut self.samples);
        0
    }
}

//! Texture atlas of a surface: its charts side by side in one image.

use super::charts::{Chart, charts};
use super::packing::{Packing, packed};
use crate::settings::ChartSettings;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use tryon_geometry::math::P3;
use tryon_geometry::mesh::Face;

/// Widths of an image, texels; that of the smallest image that holds all charts is taken. The last is the longest side.
const WIDTHS: [u32; 8] = [64, 128, 192, 256, 384, 512, 768, 1024];
/// Longest side of an image, texels.
const LONGEST: u32 = WIDTHS[WIDTHS.len() - 1];
/// Texels left free around a chart: bilinear samples and two halvings of the image stay within it.
const GUTTER: u32 = 3;
/// Size of an atlas.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AtlasSize {
    /// Columns of the image.
    pub width: u32,
    /// Rows of the image.
    pub height: u32,
    /// Side of a texel on the cloth, metres.
    pub texel: f32,
}

/// Texture coordinates of a surface. Vertices on borders of charts occur once for each chart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TextureAtlas {
    /// Size of the image.
    pub size: AtlasSize,
    /// Vertex of the surface under each vertex of the atlas.
    pub vertex: Vec<u32>,
    /// Position in the image, 0 to 1, v down, shape of `vertex`.
    pub uv: Vec<[f32; 2]>,
    /// Triangles over vertices of the atlas, in the order of the surface's.
    pub faces: Vec<Face>,
}

/// Point of the surface under the middle of a texel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Texel {
    /// Index in the image, row by row.
    pub index: u32,
    /// Barycentric coordinates in its face.
    pub weights: [f32; 3],
}

impl TextureAtlas {
    /// Atlas of a surface at rest: y up, facing +z, metres. Texels have sides of `texel` metres on the cloth, or larger
    /// ones where the image would be too large.
    pub fn new(vertices: &[P3], faces: &[Face], texel: f32) -> Self {
        let settings = ChartSettings::default();
        let charts = charts(vertices, faces, &settings);
        let flat = FlatCharts::new(&charts, vertices, faces);
        let (size, packing) = flat.fit(texel, &settings);
        let mut out = Self {
            size,
            vertex: Vec::new(),
            uv: Vec::new(),
            faces: vec![[0; 3]; faces.len()],
        };
        let extent = [size.width as f32, size.height as f32];
        for (k, chart) in charts.iter().enumerate() {
            let (low, corner) = (flat.bounds[k][0], packing.corners[k]);
            let mut own: BTreeMap<u32, u32> = BTreeMap::new();
            for f in &chart.faces {
                out.faces[*f as usize] = faces[*f as usize].map(|v| {
                    *own.entry(v).or_insert_with(|| {
                        let p = chart.project(&vertices[v as usize]);
                        let at = |a: usize| {
                            (p[a] - low[a]) / size.texel + (corner[a] + GUTTER) as f32 + 0.5
                        };
                        out.vertex.push(v);
                        out.uv.push([at(0) / extent[0], at(1) / extent[1]]);
                        out.vertex.len() as u32 - 1
                    })
                });
            }
        }
        out
    }

    /// Texels of the image.
    pub fn texels(&self) -> usize {
        self.size.width as usize * self.size.height as usize
    }

    /// Colour between those of the surface's vertices, sRGB, at barycentric coordinates in `face`.
    pub(super) fn mixed(&self, face: usize, weights: [f32; 3], colors: &[[u8; 3]]) -> [f32; 3] {
        let corners = self.faces[face].map(|v| colors[self.vertex[v as usize] as usize]);
        std::array::from_fn(|k| (0..3).map(|c| weights[c] * f32::from(corners[c][k])).sum())
    }

    /// Texels whose middles lie in the triangle `face`, borders included.
    pub fn texels_of(&self, face: usize) -> Vec<Texel> {
        let extent = [self.size.width as f32, self.size.height as f32];
        // Texels are counted by their middles.
        let [a, b, c] = self.faces[face].map(|v| {
            let uv = self.uv[v as usize];
            [0, 1].map(|k| uv[k] * extent[k] - 0.5)
        });
        let cross = |p: [f32; 2], q: [f32; 2], r: [f32; 2]| {
            (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
        };
        let area = cross(a, b, c);
        let range = |k: usize, limit: u32| {
            let low = a[k].min(b[k]).min(c[k]).ceil().max(0.0);
            let high = a[k].max(b[k]).max(c[k]).floor().min(limit as f32 - 1.0);
            low as u32..(high + 1.0) as u32
        };
        let mut out = Vec::new();
        if area == 0.0 {
            return out;
        }
        for y in range(1, self.size.height) {
            for x in range(0, self.size.width) {
                let p = [x as f32, y as f32];
                let weights = [cross(p, b, c), cross(p, c, a), cross(p, a, b)].map(|w| w / area);
                if weights.iter().all(|w| *w >= 0.0) {
                    let index = y * self.size.width + x;
                    out.push(Texel { index, weights });
                }
            }
        }
        out
    }

    /// Fault of an atlas of a surface with so many vertices and faces, by its field.
    ///
    /// # Errors
    /// Field and fault.
    pub fn check(&self, vertices: usize, faces: usize) -> Result<(), (&'static str, String)> {
        let AtlasSize {
            width,
            height,
            texel,
        } = self.size;
        let is_size = |s| (1..=LONGEST).contains(&s);
        let outside = |t: &[f32; 2]| t.iter().any(|c| !(0.0..=1.0).contains(c));
        let own = self.vertex.len();
        let mut corners = self.faces.iter().flatten();
        let faults = [
            (!is_size(width) || !is_size(height), "size", "not an image"),
            (
                !(texel > 0.0 && texel.is_finite()),
                "size.texel",
                "not positive",
            ),
            (self.uv.len() != own, "uv", "one for each vertex expected"),
            (
                self.vertex.iter().any(|v| *v as usize >= vertices),
                "vertex",
                "beyond the garment's",
            ),
            (self.uv.iter().any(outside), "uv", "outside of the image"),
            (
                self.faces.len() != faces,
                "faces",
                "one for each of the garment's expected",
            ),
            (
                corners.any(|v| *v as usize >= own),
                "faces",
                "beyond its vertices",
            ),
        ];
        let fault = faults.into_iter().find(|(is_fault, ..)| *is_fault);
        fault.map_or(Ok(()), |(_, field, why)| Err((field, why.to_owned())))
    }
}

struct FlatCharts {
    /// Least and greatest coordinates of each chart, metres.
    bounds: Vec<[[f32; 2]; 2]>,
}

impl FlatCharts {
    fn new(charts: &[Chart], vertices: &[P3], faces: &[Face]) -> Self {
        let bounds = |chart: &Chart| {
            let corners = chart.faces.iter().flat_map(|f| faces[*f as usize]);
            let points = corners.map(|v| chart.project(&vertices[v as usize]));
            let mut bounds = [[f32::INFINITY; 2], [f32::NEG_INFINITY; 2]];
            for (p, k) in points.flat_map(|p| [(p, 0), (p, 1)]) {
                bounds[0][k] = bounds[0][k].min(p[k]);
                bounds[1][k] = bounds[1][k].max(p[k]);
            }
            bounds
        };
        Self {
            bounds: charts.iter().map(bounds).collect(),
        }
    }

    /// Smallest image with texels of this size.
    fn packed(&self, texel: f32) -> Option<(u32, Packing)> {
        let size = |[low, high]: &[[f32; 2]; 2]| {
            let texels = |k: usize| ((high[k] - low[k]) / texel).ceil().min(1e6) as u32;
            [0, 1].map(|k| texels(k) + 1 + 2 * GUTTER)
        };
        let sizes: Vec<[u32; 2]> = self.bounds.iter().map(size).collect();
        let of_width = |w: &u32| Some((*w, packed(&sizes, *w)?));
        let all = WIDTHS.iter().filter_map(of_width);
        let some = all.filter(|(_, p)| p.height <= LONGEST);
        some.min_by_key(|(width, p)| width * p.height)
    }

    /// Smallest image with texels of the wanted size, or of the smallest size that the largest image has room for.
    fn fit(&self, texel: f32, settings: &ChartSettings) -> (AtlasSize, Packing) {
        let mut best = self.packed(texel);
        let (mut low, mut high) = (texel, texel);
        while best.is_none() && high < settings.largest_texel {
            (low, high) = (high, 2.0 * high);
            best = self.packed(high);
        }
        if high > texel {
            for _ in 0..settings.bisections {
                let middle = 0.5 * (low + high);
                match self.packed(middle) {
                    Some(found) => (best, high) = (Some(found), middle),
                    None => low = middle,
                }
            }
        }
        // More charts than an image has room for lie over each other.
        let over = || {
            let (corners, height) = (vec![[0; 2]; self.bounds.len()], LONGEST);
            (LONGEST, Packing { corners, height })
        };
        let (width, packing) = best.unwrap_or_else(over);
        let size = AtlasSize {
            width,
            height: packing.height.max(1),
            texel: high,
        };
        (size, packing)
    }
}

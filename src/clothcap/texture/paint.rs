//! Texels painted with the coloured points of a scan.

use super::atlas::TextureAtlas;
use super::image::GarmentTexture;
use crate::scan::{BodyScan, TextureColor, mean_spacing};
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::Face;
use tryon_geometry::par::{self, Par};
use tryon_geometry::spatial::{Bvh, HashGrid};

/// Smallest cosine between the normals of a point and of the garment.
const NORMALS: f32 = 0.2;
/// Largest distance of a point from the garment that it colours, metres.
const NEAR: f32 = 0.03;
/// Width of the kernel over the distance between points: larger values blur prints, smaller ones show single points.
const SIGMA: f32 = 0.5;
/// Reach of the kernel over its width.
const REACH: f32 = 3.0;
/// Sum of the kernel's weights from which a texel counts as seen: a point at a distance of 2.4 widths.
const SEEN: f32 = 0.056;
/// Weight of the interpolated colours of the vertices beside the points': joins what was seen to what is filled in.
const FILLED: f32 = 0.005;

/// Coloured points of one garment on its posed surface.
pub(crate) struct ScanPaint {
    /// Nearest points of the surface, metres.
    points: Vec<P3>,
    colors: Vec<[f32; 3]>,
    grid: HashGrid,
    /// Width of the kernel, metres.
    sigma: f32,
}

impl ScanPaint {
    /// Colours of a scan at points for which `is_own` holds, moved onto a posed surface.
    pub(crate) fn new(
        scan: &BodyScan,
        is_own: impl Fn(usize) -> bool,
        (faces, vertices): (&[Face], &[P3]),
    ) -> Self {
        let bvh = Bvh::new(faces, vertices);
        let own: Vec<TextureColor> = colors(scan).filter(|c| is_own(c.point as usize)).collect();
        let mut found = Vec::new();
        par::map_into(Par::Rayon, own.len(), 256, &mut found, |k| {
            let normal = scan.normal(own[k].point as usize);
            let at = bvh.closest(vertices, &own[k].at)?;
            let face_normal = bvh.unit_normal(vertices, at.face)?;
            (normal.agrees(&face_normal, NORMALS) && at.distance < NEAR).then_some(at.point)
        });
        let (points, colors): (Vec<P3>, Vec<[f32; 3]>) = found
            .iter()
            .zip(&own)
            .filter_map(|(p, c)| Some(((*p)?, c.color.map(f32::from))))
            .unzip();
        let sigma = SIGMA * mean_spacing(&points);
        let mut grid = HashGrid::default();
        let longest = faces
            .iter()
            .map(|f| radius(&f.map(|v| vertices[v as usize])))
            .fold(0.0, f32::max);
        // Searches reach half a cell.
        grid.fill(&points, 2.0 * (longest + REACH * sigma));
        Self {
            points,
            colors,
            grid,
            sigma,
        }
    }

    /// Paints the texels of a garment that no scan before showed; `colors` are those of its vertices, sRGB.
    pub(crate) fn apply(
        &self,
        texture: &mut GarmentTexture,
        atlas: &TextureAtlas,
        vertices: &[P3],
        colors: &[[u8; 3]],
    ) {
        let mut painted = Vec::new();
        let before = &*texture;
        par::map_into(Par::Rayon, atlas.faces.len(), 64, &mut painted, |f| {
            let corners = atlas.faces[f].map(|v| vertices[atlas.vertex[v as usize] as usize]);
            let mut texels = atlas.texels_of(f);
            texels.retain(|t| !before.is_seen(t.index));
            if texels.is_empty() {
                return Vec::new();
            }
            let near = self.near(&corners);
            let of = texels.into_iter().filter_map(|t| {
                let at = (0..3).map(|k| corners[k].coords * t.weights[k]).sum();
                let fill = atlas.mixed(f, t.weights, colors);
                Some((t.index, self.color(&near, &P3 { coords: at }, fill)?))
            });
            of.collect()
        });
        let painted: Vec<(u32, [f32; 3])> = painted.into_iter().flatten().collect();
        texture.paint(atlas, &painted);
    }

    /// Points that can colour a triangle, each once.
    fn near(&self, corners: &[P3; 3]) -> Vec<u32> {
        let mut near = Vec::new();
        let reach = radius(corners) + REACH * self.sigma;
        self.grid
            .within(&middle(corners), reach, |i, _| near.push(i));
        near.sort_unstable();
        near.dedup();
        near
    }

    /// Mean colour about a point of the surface; `None` where no point is near.
    fn color(&self, near: &[u32], at: &P3, fill: [f32; 3]) -> Option<[f32; 3]> {
        let (mut sum, mut color) = (0.0, fill.map(|c| FILLED * c));
        for i in near {
            let d = (self.points[*i as usize] - at).norm() / self.sigma;
            if d < REACH {
                let w = (-0.5 * d * d).exp();
                sum += w;
                let own = self.colors[*i as usize];
                color = std::array::from_fn(|k| color[k] + w * own[k]);
            }
        }
        (sum > SEEN).then(|| color.map(|c| c / (sum + FILLED)))
    }
}

/// Colours of a scan: those of its texture, or else of its points.
fn colors(scan: &BodyScan) -> impl Iterator<Item = TextureColor> {
    let of_points = (0..).zip(scan.points.iter().zip(&scan.colors));
    let of_points = of_points.map(|(point, (at, color))| TextureColor {
        at: *at,
        point,
        color: *color,
    });
    let count = if scan.texture.is_empty() {
        usize::MAX
    } else {
        0
    };
    scan.texture.iter().copied().chain(of_points.take(count))
}

fn middle(corners: &[P3; 3]) -> P3 {
    P3::from(corners.iter().map(|p| p.coords / 3.0).sum::<V3>())
}

/// Largest distance of a corner from the middle, metres.
fn radius(corners: &[P3; 3]) -> f32 {
    let middle = middle(corners);
    corners
        .iter()
        .map(|p| (p - middle).norm())
        .fold(0.0, f32::max)
}

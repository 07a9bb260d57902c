//! Texels painted with the coloured points of a scan.

use super::atlas::TextureAtlas;
use super::image::GarmentTexture;
use crate::scan::{BodyScan, TextureColor, mean_spacing};
use crate::settings::PaintSettings;
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::Face;
use tryon_geometry::par::{self, Par};
use tryon_geometry::spatial::{Bvh, HashGrid};

/// Coloured points of one garment on its posed surface.
pub(crate) struct ScanPaint {
    /// Nearest points of the surface, metres.
    points: Vec<P3>,
    colors: Vec<[f32; 3]>,
    grid: HashGrid,
    /// Width of the kernel, metres.
    sigma: f32,
    settings: PaintSettings,
}

impl ScanPaint {
    /// Colours of a scan at points for which `is_own` holds, moved onto a posed surface.
    pub(crate) fn new(
        scan: &BodyScan,
        is_own: impl Fn(usize) -> bool,
        faces: &[Face],
        vertices: &[P3],
        settings: &PaintSettings,
    ) -> Self {
        let bvh = Bvh::new(faces, vertices);
        let own: Vec<TextureColor> = colors(scan).filter(|c| is_own(c.point as usize)).collect();
        let mut found = Vec::new();
        par::map_into(Par::Rayon, own.len(), 256, &mut found, |k| {
            let at = bvh.closest(vertices, &own[k].at)?;
            let face_normal = bvh.unit_normal(vertices, at.face)?;
            let agrees = scan.agrees(own[k].point as usize, &face_normal, settings.normals);
            (agrees && at.distance < settings.near).then_some(at.point)
        });
        let found = found.iter().zip(&own);
        let found = found.filter_map(|(p, c)| Some(((*p)?, c.color.map(f32::from))));
        let (points, colors): (Vec<P3>, Vec<[f32; 3]>) = found.unzip();
        let sigma = settings.sigma * mean_spacing(&points);
        let mut grid = HashGrid::default();
        let radius_of = |f: &Face| radius(&f.map(|v| vertices[v as usize]));
        let longest = faces.iter().map(radius_of).fold(0.0, f32::max);
        // Searches reach half a cell.
        grid.fill(&points, 2.0 * (longest + settings.reach * sigma));
        Self {
            points,
            colors,
            grid,
            sigma,
            settings: *settings,
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
        let reach = radius(corners) + self.settings.reach * self.sigma;
        let middle = middle(corners);
        self.grid.within(&middle, reach, |i, _| near.push(i));
        near.sort_unstable();
        near.dedup();
        near
    }

    /// Mean colour about a point of the surface; `None` where no point is near.
    fn color(&self, near: &[u32], at: &P3, fill: [f32; 3]) -> Option<[f32; 3]> {
        let PaintSettings {
            reach,
            seen,
            filled,
            ..
        } = self.settings;
        let (mut sum, mut color) = (0.0, fill.map(|c| filled * c));
        for i in near {
            let d = (self.points[*i as usize] - at).norm() / self.sigma;
            if d < reach {
                let w = (-0.5 * d * d).exp();
                sum += w;
                let own = self.colors[*i as usize];
                color = std::array::from_fn(|k| color[k] + w * own[k]);
            }
        }
        (sum > seen).then(|| color.map(|c| c / (sum + filled)))
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
    let of_points = of_points.filter(|_| scan.texture.is_empty());
    scan.texture.iter().copied().chain(of_points)
}

fn middle(corners: &[P3; 3]) -> P3 {
    P3::from(corners.iter().map(|p| p.coords / 3.0).sum::<V3>())
}

/// Largest distance of a corner from the middle, metres.
fn radius(corners: &[P3; 3]) -> f32 {
    let middle = middle(corners);
    let far = corners.iter().map(|p| (p - middle).norm());
    far.fold(0.0, f32::max)
}

//! Virtual depth maps of a body from around it (Ye et al. 2014, section 4, after Kim et al. and Zeller).
//!
//! The paper pushes a cloth vertex that lies behind a map's surface. Here a map only *proposes* the nearest face: from
//! it the exact nearest point is walked to on the mesh itself, so the resolution of the maps decides how good the
//! proposal is, never how deep cloth may sink.

use crate::math::P3;
use crate::mesh::Face;
use crate::par::{self, Par};
use crate::raster::{Cull, Options, View, VisibilityBuffer, rasterise_with};

/// A direction to look at the body from: orthographic, world axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapView {
    /// Camera axes in the world (right, down, forward), orthonormal.
    pub axes: [[f32; 3]; 3],
    /// Scale.
    pub pixels_per_metre: f32,
}

/// Scale of the side and back maps: a pixel is a body edge wide.
const COARSE: f32 = 64.0;
/// Scale of the map that looks from the real camera; the paper asks for a higher resolution there.
const FINE: f32 = 128.0;

impl MapView {
    /// The four level directions, starting with the one of the real camera: `toward` is the horizontal direction it
    /// looks along, in the world.
    pub fn around(toward: [f32; 2]) -> [Self; 4] {
        let n = toward[0].hypot(toward[1]);
        let (x, z) = if n > 1e-6 { (toward[0] / n, toward[1] / n) } else { (0.0, -1.0) };
        [(x, z, FINE), (-x, -z, COARSE), (-z, x, COARSE), (z, -x, COARSE)].map(|(fx, fz, pixels_per_metre)| Self {
            // forward f, down −y, right = down × forward.
            axes: [[-fz, 0.0, fx], [0.0, -1.0, 0.0], [fx, 0.0, fz]],
            pixels_per_metre,
        })
    }
}

/// Rendered maps of one body pose. Pure scratch: it can be made again from the body.
#[derive(Debug, Default)]
pub struct DepthMaps {
    maps: Vec<Map>,
}

#[derive(Debug, Default)]
struct Map {
    axes: [[f32; 3]; 3],
    view: Option<View>,
    buffer: VisibilityBuffer,
    points: Vec<P3>,
}

fn turn(axes: &[[f32; 3]; 3], p: &P3) -> P3 {
    let dot = |a: &[f32; 3]| a[0] * p.x + a[1] * p.y + a[2] * p.z;
    P3::new(dot(&axes[0]), dot(&axes[1]), dot(&axes[2]))
}

impl DepthMaps {
    /// Renders the body into every view, each view on its own thread when allowed.
    pub fn render(&mut self, par: Par, views: &[MapView], vertices: &[P3], faces: &[Face]) {
        /// Empty border, metres: a garment hangs outside the silhouette.
        const BORDER: f32 = 0.02;
        /// No map gets larger than this on a side, pixels: a broken body must not exhaust memory.
        const LARGEST: f32 = 1024.0;
        self.maps.resize_with(views.len(), Map::default);
        par::for_chunks(par, &mut self.maps, 1, |i, m| {
            let (m, v) = (&mut m[0], &views[i]);
            m.axes = v.axes;
            m.points.clear();
            m.points.extend(vertices.iter().map(|p| turn(&v.axes, p)));
            let (lo, hi) = m
                .points
                .iter()
                .fold((P3::from([f32::MAX; 3]), P3::from([f32::MIN; 3])), |(lo, hi), p| (lo.inf(p), hi.sup(p)));
            let side = |k: usize| ((hi[k] - lo[k] + 2.0 * BORDER) * v.pixels_per_metre).clamp(1.0, LARGEST) as u32;
            let view = View::Orthographic {
                width: side(0),
                height: side(1),
                left: lo.x - BORDER,
                top: lo.y - BORDER,
                pixels_per_metre: v.pixels_per_metre,
            };
            rasterise_with(Options { par: Par::Seq, cull: Cull::Back }, &view, &m.points, faces, &mut m.buffer);
            m.view = Some(view);
        });
    }
    /// Faces seen at the pixel of a point, one for each map that shows a surface there.
    pub fn proposals<'a>(&'a self, p: &'a P3) -> impl Iterator<Item = u32> + 'a {
        self.maps.iter().filter_map(move |m| {
            let [u, v, _] = m.view.as_ref()?.project(&turn(&m.axes, p))?;
            let (u, v) = (u.round(), v.round());
            if !(u >= 0.0 && v >= 0.0 && u < m.buffer.width as f32 && v < m.buffer.height as f32) {
                return None;
            }
            let f = m.buffer.face[v as usize * m.buffer.width as usize + u as usize];
            (f != VisibilityBuffer::NONE).then_some(f)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_map_shows_the_side_it_looks_at() {
        // A box of 0.2 m: eight corners, twelve faces, two a side.
        let v: Vec<P3> =
            (0..8).map(|i| P3::new((i & 1) as f32, ((i >> 1) & 1) as f32, ((i >> 2) & 1) as f32) * 0.2).collect();
        let f: Vec<Face> = vec![
            [4, 5, 7],
            [4, 7, 6], // z = 0.2
            [1, 0, 2],
            [1, 2, 3], // z = 0
            [0, 4, 6],
            [0, 6, 2], // x = 0
            [5, 1, 3],
            [5, 3, 7], // x = 0.2
            [2, 6, 7],
            [2, 7, 3],
            [0, 1, 5],
            [0, 5, 4],
        ];
        let mut maps = DepthMaps::default();
        maps.render(Par::Seq, &MapView::around([0.0, -1.0]), &v, &f);
        let p = P3::new(0.11, 0.08, 0.09);
        let got: Vec<u32> = maps.proposals(&p).map(|f| f / 2).collect();
        // Camera looks along −z: front map sees z = 0.2, then back, then the two sides.
        assert_eq!(got.len(), 4);
        assert_eq!(got[..2], [0, 1]);
        assert!(got[2..].contains(&2) && got[2..].contains(&3));
    }
}

//! Virtual depth maps of a body from around it (Ye et al. 2014, section 4, after Kim et al. and Zeller).
//!
//! The paper pushes a cloth vertex that lies behind a map's surface. Here a map only *proposes* the nearest face: from
//! it the exact nearest point is walked to on the mesh itself, so the resolution of the maps decides how good the
//! proposal is, never how deep cloth may sink.

use crate::settings::{MapDetail, MapSettings};
use tryon_geometry::math::P3;
use tryon_geometry::mesh::Face;
use tryon_geometry::par::{self, Par};
use tryon_geometry::raster::{Cull, Options, View, VisibilityBuffer, rasterise_with};

/// A direction to look at the body from: orthographic, world axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapView {
    /// Camera axes in the world (right, down, forward), orthonormal.
    pub axes: [[f32; 3]; 3],
    /// Scale.
    pub pixels_per_metre: f32,
    /// Border, metres.
    pub border: f32,
    /// Largest side, pixels.
    pub largest: f32,
}

impl MapView {
    /// The four level directions, starting with the one of the real camera: `toward` is the horizontal direction it
    /// looks along, in the world.
    pub fn around(toward: [f32; 2], detail: MapDetail, settings: &MapSettings) -> [Self; 4] {
        let MapSettings {
            coarse,
            fine,
            border,
            largest,
        } = *settings;
        let n = toward[0].hypot(toward[1]);
        let (x, z) = if n > 1e-6 {
            (toward[0] / n, toward[1] / n)
        } else {
            (0.0, -1.0)
        };
        let [front, others] = match detail {
            MapDetail::InView => [fine, coarse],
            MapDetail::Everywhere => [fine; 2],
            MapDetail::Nowhere => [coarse; 2],
        };
        [
            (x, z, front),
            (-x, -z, others),
            (-z, x, others),
            (z, -x, others),
        ]
        .map(|(fx, fz, pixels_per_metre)| Self {
            // forward f, down −y, right = down × forward.
            axes: [[-fz, 0.0, fx], [0.0, -1.0, 0.0], [fx, 0.0, fz]],
            pixels_per_metre,
            border,
            largest,
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
        self.maps.resize_with(views.len(), Map::default);
        par::for_chunks(par, &mut self.maps, 1, |i, m| {
            let (m, v) = (&mut m[0], &views[i]);
            m.axes = v.axes;
            m.points.clear();
            m.points.extend(vertices.iter().map(|p| turn(&v.axes, p)));
            let (lo, hi) = m.points.iter().fold(
                (P3::from([f32::MAX; 3]), P3::from([f32::MIN; 3])),
                |(lo, hi), p| (lo.inf(p), hi.sup(p)),
            );
            let side = |k: usize| {
                let metres = hi[k] - lo[k] + 2.0 * v.border;
                (metres * v.pixels_per_metre).clamp(1.0, v.largest) as u32
            };
            let view = View::Orthographic {
                width: side(0),
                height: side(1),
                left: lo.x - v.border,
                top: lo.y - v.border,
                pixels_per_metre: v.pixels_per_metre,
            };
            rasterise_with(
                Options {
                    par: Par::Seq,
                    cull: Cull::Back,
                    ..Options::default()
                },
                &view,
                &m.points,
                faces,
                &mut m.buffer,
            );
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
        let v: Vec<P3> = (0..8)
            .map(|i| P3::new((i & 1) as f32, ((i >> 1) & 1) as f32, ((i >> 2) & 1) as f32) * 0.2)
            .collect();
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
        maps.render(
            Par::Seq,
            &MapView::around([0.0, -1.0], MapDetail::InView, &MapSettings::default()),
            &v,
            &f,
        );
        let p = P3::new(0.11, 0.08, 0.09);
        let got: Vec<u32> = maps.proposals(&p).map(|f| f / 2).collect();
        // Camera looks along −z: front map sees z = 0.2, then back, then the two sides.
        assert_eq!(got.len(), 4);
        assert_eq!(got[..2], [0, 1]);
        assert!(got[2..].contains(&2) && got[2..].contains(&3));
    }

    /// How much farther than the nearest vertex the best proposed one is, metres, at points 5 mm off a finely
    /// triangulated figure of elliptic slices: mean and worst of those in front of and behind it (camera along −z).
    fn misses(detail: MapDetail) -> [[f32; 2]; 2] {
        let (rings, around) = (140u32, 120u32);
        let surface = |y: f32, t: f32, off: f32| {
            let r = [
                0.16 + 0.03 * (5.0 * y).sin() + off,
                0.11 + 0.02 * (7.0 * y).cos() + off,
            ];
            P3::new(r[0] * t.cos(), y, r[1] * t.sin())
        };
        let angle = |j: f32| std::f32::consts::TAU * j / around as f32;
        let height = |k: f32| 1.2 * k / rings as f32;
        let (mut v, mut f) = (Vec::new(), Vec::new());
        for k in 0..=rings {
            v.extend((0..around).map(|j| surface(height(k as f32), angle(j as f32), 0.0)));
        }
        for k in 0..rings {
            for j in 0..around {
                let (a, b) = (k * around + j, k * around + (j + 1) % around);
                f.extend([[a, a + around, b], [b, a + around, b + around]]);
            }
        }
        let mut maps = DepthMaps::default();
        let views = MapView::around([0.0, -1.0], detail, &MapSettings::default());
        maps.render(Par::Seq, &views, &v, &f);
        let mut out = [[0.0f32; 2]; 2];
        let mut counts = [0; 2];
        for k in 10..rings - 10 {
            for j in 0..around {
                let (j, k) = (j as f32 + 0.37, k as f32 + 0.41);
                let p = surface(height(k), angle(j), 0.005);
                let nearest = v.iter().map(|q| (q - p).norm()).fold(f32::MAX, f32::min);
                let best = maps
                    .proposals(&p)
                    .map(|face| (v[f[face as usize][0] as usize] - p).norm());
                let miss = best.fold(f32::MAX, f32::min) - nearest;
                let side = usize::from(p.z < 0.0);
                counts[side] += 1;
                out[side] = [out[side][0] + miss, out[side][1].max(miss)];
            }
        }
        [0, 1].map(|s| [out[s][0] / counts[s] as f32, out[s][1]])
    }

    #[test]
    fn what_the_camera_sees_is_proposed_as_well_as_with_fine_maps_everywhere() {
        let [all, view, none] =
            [MapDetail::Everywhere, MapDetail::InView, MapDetail::Nowhere].map(misses);
        // In view (flanks too): within a millimetre of fine maps everywhere. Elsewhere: within a coarse pixel of the nearest.
        assert!(view[0][0] < all[0][0] + 1e-3, "{view:?} {all:?}");
        let coarse = MapSettings::default().coarse;
        assert!(
            view[1][1] < 1.0 / coarse && none[0][1] < 1.0 / coarse,
            "{view:?} {none:?}"
        );
        // And the switch does something.
        assert!(
            none[0][0] > view[0][0] && view[1][0] > all[1][0],
            "{none:?} {view:?} {all:?}"
        );
    }
}

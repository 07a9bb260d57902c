//! Drawing order of the faces of a band: as given, or by layers with occlusion culling.
//!
//! A garment hides its own far side and most of the cloth under it. Drawn from the outside in, back faces last, those
//! faces fail one comparison a tile instead of one a sample.

use super::clip;
use super::kernel::Band;
use super::options::Cull;
use super::screen::{Corner, Projector};
use crate::math::P3;
use crate::mesh::Face;
use std::ops::Range;

/// Input shared by all bands.
pub(super) struct DrawJob<'a> {
    pub(super) projector: Projector,
    pub(super) cull: Cull,
    pub(super) vertices: &'a [P3],
    /// Snapped vertices.
    pub(super) corners: &'a [Corner],
    pub(super) faces: &'a [Face],
    /// Faces of each garment, innermost first; empty to draw in the order of the faces.
    pub(super) layers: &'a [Range<usize>],
    /// First and last band of every face; empty if there is one band.
    pub(super) ranges: &'a [[u8; 2]],
}

impl DrawJob<'_> {
    /// Corners of a face that may touch a band; `None` if it does not, or has an index out of range.
    #[inline(always)]
    fn corners(&self, id: usize, number: u8) -> Option<[Corner; 3]> {
        if self
            .ranges
            .get(id)
            .is_some_and(|r| number < r[0] || r[1] < number)
        {
            return None;
        }
        let [Some(a), Some(b), Some(c)] = self.faces[id].map(|i| self.corners.get(i as usize))
        else {
            return None;
        };
        Some([*a, *b, *c])
    }
    /// True if this is the first band of a face.
    #[inline(always)]
    fn begins(&self, id: usize, number: u8) -> bool {
        self.ranges.get(id).is_none_or(|r| r[0] == number)
    }
    /// Draws a face, clipped if a corner is off the grid.
    #[inline(always)]
    fn draw<const PERSPECTIVE: bool, const TIES: bool>(
        &self,
        id: usize,
        corners: [Corner; 3],
        band: &mut Band<'_>,
    ) {
        if corners.iter().any(Corner::is_outside) {
            let points = self.faces[id].map(|i| self.vertices[i as usize]);
            clip::clip(&self.projector, points, |piece| {
                band.draw::<PERSPECTIVE, TIES>(piece, id as u32, self.cull);
            });
        } else {
            band.draw::<PERSPECTIVE, TIES>(corners, id as u32, self.cull);
        }
    }
}

/// Draws all faces into band `number`.
#[inline(always)]
pub(super) fn draw_into(job: &DrawJob<'_>, number: u8, band: &mut Band<'_>) {
    match (job.projector.perspective, job.layers.is_empty()) {
        (true, true) => draw_faces::<true>(job, number, band),
        (false, true) => draw_faces::<false>(job, number, band),
        (true, false) => draw_layers::<true>(job, number, band),
        (false, false) => draw_layers::<false>(job, number, band),
    }
}

#[inline(always)]
fn draw_faces<const PERSPECTIVE: bool>(job: &DrawJob<'_>, number: u8, band: &mut Band<'_>) {
    for id in 0..job.faces.len() {
        if let Some(corners) = job.corners(id, number) {
            job.draw::<PERSPECTIVE, false>(id, corners, band);
        }
    }
}

/// Draws the front faces of a band from the outermost layer to the innermost, then the back faces. Occluded faces are
/// left out.
#[inline(always)]
fn draw_layers<const PERSPECTIVE: bool>(job: &DrawJob<'_>, number: u8, band: &mut Band<'_>) {
    let mut back_faces = std::mem::take(&mut band.scratch.back_faces);
    back_faces.clear();
    for (order, layer) in job.layers.iter().rev().enumerate() {
        if order > 0 {
            band.update_tiles();
        }
        for id in layer.clone() {
            let Some(corners) = job.corners(id, number) else {
                continue;
            };
            if corners.iter().any(Corner::is_outside) {
                job.draw::<PERSPECTIVE, true>(id, corners, band);
                continue;
            }
            let [a, b, c] = corners;
            let area = i64::from(b.x - a.x) * i64::from(c.y - a.y)
                - i64::from(b.y - a.y) * i64::from(c.x - a.x);
            if area > 0 {
                back_faces.push(id as u32);
            } else if order > 0 && band.occludes::<PERSPECTIVE>(&corners) {
                band.occluded += usize::from(job.begins(id, number));
            } else {
                job.draw::<PERSPECTIVE, true>(id, corners, band);
            }
        }
    }
    band.update_tiles();
    for &id in &back_faces {
        let id = id as usize;
        let Some(corners) = job.corners(id, number) else {
            continue;
        };
        if band
            .occludes::<PERSPECTIVE>(&corners.map(|c| c.farther::<PERSPECTIVE>(band.back_offset)))
        {
            band.occluded += usize::from(job.begins(id, number));
        } else {
            job.draw::<PERSPECTIVE, true>(id, corners, band);
        }
    }
    band.scratch.back_faces = back_faces;
}

#[cfg(test)]
mod tests {
    use crate::camera::Intrinsics;
    use crate::math::{P3, V3};
    use crate::mesh::Face;
    use crate::par::{self, Par};
    use crate::raster::{
        LayeredMesh, Options, View, VisibilityBuffer, rasterise_layers, rasterise_with,
    };
    use rand::{Rng, SeedableRng};
    use std::ops::Range;

    /// Crumpled nested tubes and random faces; some faces behind the camera, doubled or degenerate.
    fn garments(seed: u64) -> (Vec<P3>, Vec<Face>, Vec<Range<usize>>) {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
        let (mut v, mut f, mut layers) = (Vec::new(), Vec::new(), Vec::new());
        let (rings, around) = (24u32, 40u32);
        for layer in 0..3 {
            let (base, first) = (v.len() as u32, f.len());
            let radius = 0.2 + 0.03 * layer as f32;
            for k in 0..=rings {
                for j in 0..around {
                    let t = std::f32::consts::TAU * j as f32 / around as f32;
                    let r = radius + rng.random_range(-0.02..0.02);
                    v.push(P3::new(
                        r * t.cos(),
                        -0.5 + 0.04 * k as f32,
                        1.6 - r * t.sin(),
                    ));
                }
            }
            for k in 0..rings {
                for j in 0..around {
                    let (a, b) = (base + k * around + j, base + k * around + (j + 1) % around);
                    f.push([a, b, a + around]);
                    f.push([b, b + around, a + around]);
                }
            }
            // The same face again, and in the next layer too: ties.
            f.push(f[first]);
            f.push(f[0]);
            for _ in 0..20 {
                let at = v.len() as u32;
                let centre = P3::new(0.0, 0.0, rng.random_range(-0.5..3.0));
                for _ in 0..3 {
                    v.push(centre + V3::from_fn(|_, _| rng.random_range(-1.5..1.5)));
                }
                f.push([at, at + 1, at + 2]);
            }
            v.push(P3::new(f32::NAN, 0.0, 1.0));
            f.push([base, base + 1, v.len() as u32 - 1]);
            f.push([base, base + 1, 9_000_000]);
            f.push([base; 3]);
            layers.push(first..f.len());
        }
        (v, f, layers)
    }

    #[test]
    fn layered_drawing_keeps_the_picture_and_counts_occluded_faces() {
        let k = Intrinsics {
            width: 203,
            height: 317,
            fx: 260.0,
            fy: 260.0,
            cx: 101.0,
            cy: 150.0,
        };
        let views = [
            View::Perspective {
                camera: k,
                near: 0.1,
            },
            View::Orthographic {
                width: 190,
                height: 205,
                left: -0.4,
                top: -0.5,
                pixels_per_metre: 230.0,
            },
        ];
        for seed in 0..8 {
            let (v, mut f, layers) = garments(seed);
            // Odd seeds turn the faces inside out: the order of the sides changes, the picture stays.
            if seed % 2 == 1 {
                f.iter_mut().for_each(|f| f.swap(0, 1));
            }
            for view in &views {
                let back_offset = if seed % 4 < 2 { 0.0 } else { 0.03 };
                let mut plain = VisibilityBuffer::default();
                let options = Options {
                    par: Par::Seq,
                    back_offset,
                    ..Options::default()
                };
                rasterise_with(options, view, &v, &f, &mut plain);
                let mut out = VisibilityBuffer::default();
                let mesh = LayeredMesh {
                    vertices: &v,
                    faces: &f,
                    layers: &layers,
                };
                let occluded = rasterise_layers(options, view, &mesh, &mut out);
                assert!(out == plain, "seed {seed}");
                // One of six walls is visible.
                assert!(
                    seed % 2 == 1 || occluded > f.len() / 3,
                    "{occluded} of {}",
                    f.len()
                );
                for threads in [1, 3] {
                    let mut banded = VisibilityBuffer::default();
                    let counts = par::with_threads(threads, || {
                        let options = Options {
                            par: Par::Rayon,
                            ..options
                        };
                        [0, 1].map(|_| rasterise_layers(options, view, &mesh, &mut banded))
                    });
                    let counts = counts.expect("pool");
                    assert!(
                        banded == plain && counts[0] == counts[1],
                        "{threads} threads, seed {seed}"
                    );
                }
            }
        }
    }

    #[test]
    fn an_empty_buffer_occludes_nothing() {
        let view = View::Orthographic {
            width: 64,
            height: 64,
            left: 0.0,
            top: 0.0,
            pixels_per_metre: 64.0,
        };
        let v = [
            [0.1, 0.1, 1.0],
            [0.9, 0.1, 1.0],
            [0.1, 0.9, 1.0],
            [0.9, 0.9, 2.0],
        ]
        .map(P3::from);
        let mut out = VisibilityBuffer::default();
        let draw = |view: &View, faces: &[Face], layers: &[Range<usize>], out: &mut _| {
            let mesh = LayeredMesh {
                vertices: &v,
                faces,
                layers,
            };
            rasterise_layers(Options::default(), view, &mesh, out)
        };
        assert_eq!(
            draw(&view, &[[0, 1, 2]], std::slice::from_ref(&(0..1)), &mut out),
            0
        );
        // The second lies beside the first, both sides of both.
        let faces = [[0, 1, 2], [1, 2, 3], [0, 2, 1], [1, 3, 2]];
        draw(&view, &faces, &[0..2, 2..4], &mut out);
        assert!(out.face.contains(&0) && out.face.contains(&1));
        let empty = View::Orthographic {
            width: 0,
            height: 0,
            left: 0.0,
            top: 0.0,
            pixels_per_metre: 1.0,
        };
        assert_eq!(draw(&empty, &faces, &[0..2, 2..4], &mut out), 0);
    }
}

//! Faces behind what is drawn already, told by a coarse image of the farthest depth.
//!
//! A garment hides its own far side and most of what is worn under it. Drawn from the outside in, with sides turned away
//! last, those faces fail one comparison a tile instead of one a sample.

use super::fast::Job;
use super::kernel::Band;
use super::screen::Corner;

/// Pixels along each side of a coarse one, as a power of two: a face of a garment touches about nine of 8×8.
const TILE_BITS: u32 = 3;
const TILE: usize = 1 << TILE_BITS;

/// The coarse image of a band, and what waits to be drawn against it. Scratch.
#[derive(Clone, Debug, Default)]
pub(super) struct Coarse {
    /// Farthest depth of each tile; infinity where a pixel is empty.
    far: Vec<f32>,
    /// Tiles in a row.
    across: usize,
    /// Faces turned away.
    later: Vec<u32>,
    /// Faces left out as hidden.
    pub(super) hidden: usize,
}

impl Coarse {
    /// The farthest depth of each tile of rows `width` pixels long.
    #[inline(always)]
    fn look(&mut self, depth: &[f32], width: usize) {
        self.across = width.div_ceil(TILE);
        self.far.clear();
        self.far.resize(
            self.across * (depth.len() / width.max(1)).div_ceil(TILE),
            0.0,
        );
        for (rows, far) in depth
            .chunks(TILE * width)
            .zip(self.far.chunks_mut(self.across))
        {
            for row in rows.chunks_exact(width) {
                for (pixels, far) in row.chunks(TILE).zip(far.iter_mut()) {
                    let farthest = |m: f32, d: &f32| if *d > m { *d } else { m };
                    *far = pixels.iter().fold(*far, farthest);
                }
            }
        }
    }
}

impl Band<'_> {
    #[inline(always)]
    fn look(&mut self) {
        self.coarse.look(self.depth, self.width as usize);
    }

    /// Every pixel the triangle may touch is nearer already.
    #[inline(always)]
    fn hides<const PERSPECTIVE: bool>(&self, corners: &[Corner; 3]) -> bool {
        let Some(span) = self.span(corners) else {
            return false;
        };
        let q = corners.map(|c| c.q);
        // The kernel keeps depths of a face between those of its corners, so this is exact.
        let nearest = if PERSPECTIVE {
            1.0 / q[0].max(q[1]).max(q[2])
        } else {
            q[0].min(q[1]).min(q[2])
        };
        let [left, right] = span.columns.map(|x| x as usize >> TILE_BITS);
        let [top, bottom] = span.rows.map(|y| (y - self.top) as usize >> TILE_BITS);
        (top..=bottom).all(|y| {
            self.coarse.far[y * self.coarse.across..][left..=right]
                .iter()
                .all(|far| nearest > *far)
        })
    }
}

/// Draws the faces of a band from the outermost layer to the innermost, then the sides turned away.
#[inline(always)]
pub(super) fn draw_layers<const PERSPECTIVE: bool>(job: &Job<'_>, number: u8, band: &mut Band<'_>) {
    let mut later = std::mem::take(&mut band.coarse.later);
    later.clear();
    let mut hidden = 0;
    for (order, layer) in job.layers.iter().rev().enumerate() {
        if order > 0 {
            band.look();
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
                later.push(id as u32);
            } else if order > 0 && band.hides::<PERSPECTIVE>(&corners) {
                hidden += usize::from(job.begins(id, number));
            } else {
                job.draw::<PERSPECTIVE, true>(id, corners, band);
            }
        }
    }
    band.look();
    for &id in &later {
        let id = id as usize;
        let Some(corners) = job.corners(id, number) else {
            continue;
        };
        if band.hides::<PERSPECTIVE>(&corners.map(|c| c.farther::<PERSPECTIVE>(band.behind))) {
            hidden += usize::from(job.begins(id, number));
        } else {
            job.draw::<PERSPECTIVE, true>(id, corners, band);
        }
    }
    band.coarse.hidden = hidden;
    band.coarse.later = later;
}

#[cfg(test)]
mod tests {
    use crate::camera::Intrinsics;
    use crate::math::{P3, V3};
    use crate::mesh::Face;
    use crate::par::{self, Par};
    use crate::raster::{Options, View, VisibilityBuffer, rasterise_layers, rasterise_with};
    use rand::{Rng, SeedableRng};
    use std::ops::Range;

    /// Crumpled tubes inside each other and faces at random, some behind the camera, doubled or no faces at all.
    fn clothes(seed: u64) -> (Vec<P3>, Vec<Face>, Vec<Range<usize>>) {
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
    fn the_picture_is_the_same_in_any_order_and_hidden_faces_are_counted() {
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
            let (v, mut f, layers) = clothes(seed);
            // Every second time inside out: sides are drawn in the wrong order, the picture stays.
            if seed % 2 == 1 {
                f.iter_mut().for_each(|f| f.swap(0, 1));
            }
            for view in &views {
                let behind = if seed % 4 < 2 { 0.0 } else { 0.03 };
                let mut plain = VisibilityBuffer::default();
                let options = Options {
                    par: Par::Seq,
                    behind,
                    ..Options::default()
                };
                rasterise_with(options, view, &v, &f, &mut plain);
                let mut out = VisibilityBuffer::default();
                let hidden = rasterise_layers(Par::Seq, behind, view, &v, &f, &layers, &mut out);
                assert!(out == plain, "seed {seed}");
                // Six walls, one of them seen: five of six minus what stands out.
                assert!(
                    seed % 2 == 1 || hidden > f.len() / 3,
                    "{hidden} of {}",
                    f.len()
                );
                for threads in [1, 3] {
                    let mut banded = VisibilityBuffer::default();
                    let counts = par::with_threads(threads, || {
                        [0, 1].map(|_| {
                            rasterise_layers(Par::Rayon, behind, view, &v, &f, &layers, &mut banded)
                        })
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
    fn nothing_is_hidden_by_nothing() {
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
        assert_eq!(
            rasterise_layers(
                Par::Seq,
                0.0,
                &view,
                &v,
                &[[0, 1, 2]],
                std::slice::from_ref(&(0..1)),
                &mut out
            ),
            0
        );
        // The second lies beside the first, both sides of both.
        let faces = [[0, 1, 2], [1, 2, 3], [0, 2, 1], [1, 3, 2]];
        rasterise_layers(Par::Seq, 0.0, &view, &v, &faces, &[0..2, 2..4], &mut out);
        assert!(out.face.contains(&0) && out.face.contains(&1));
        let empty = View::Orthographic {
            width: 0,
            height: 0,
            left: 0.0,
            top: 0.0,
            pixels_per_metre: 1.0,
        };
        assert_eq!(
            rasterise_layers(Par::Seq, 0.0, &empty, &v, &faces, &[0..2, 2..4], &mut out),
            0
        );
    }
}

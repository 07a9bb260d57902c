//! The inner loops: one triangle into a band of rows.
//!
//! Small triangles (nearly all) test every pixel of their box with i32 edge functions; large ones solve for the
//! span of each row in i64. Both decide the same pixels, since both are exact.

use super::buffer::BandScratch;
use super::options::Cull;
use super::screen::{Corner, ONE, SUB_BITS};

/// Triangles whose box has no side above this (sub-pixels, 64 px) keep their edge functions inside i32.
const SMALL: i32 = 64 << SUB_BITS;

/// Rows `top..top + rows` of the picture, written by one thread.
pub(super) struct Band<'a> {
    pub(super) width: i32,
    pub(super) top: i32,
    pub(super) rows: i32,
    /// Size of the whole picture in rows; anchors of the depth plane depend on it, never on the band.
    pub(super) height: i32,
    /// Depth added to back faces, metres.
    pub(super) back_offset: f32,
    pub(super) depth: &'a mut [f32],
    pub(super) face: &'a mut [u32],
    pub(super) scratch: &'a mut BandScratch,
    /// Faces left out as occluded; a face of several bands counts in its first.
    pub(super) occluded: usize,
}

/// Columns and rows of the pixels whose centres may lie in a triangle.
#[derive(Clone, Copy)]
pub(super) struct Span {
    pub(super) columns: [i32; 2],
    pub(super) rows: [i32; 2],
    /// First row without the limits of the band.
    top: i32,
}

/// Depth test of a sample at depth `z` of face `id`. Of equal depths the first face drawn wins, or with `TIES` the lowest
/// number.
#[inline(always)]
fn wins<const TIES: bool>(z: f32, id: u32, depth: f32, face: u32) -> bool {
    if TIES {
        (z < depth) | ((z == depth) & (id < face))
    } else {
        z < depth
    }
}

/// Plane of the affine quantity q over the picture, anchored at pixel `(x0, y0)` and limited to `lo..=hi`.
struct DepthPlane {
    x0: i32,
    y0: i32,
    q0: f64,
    gx: f64,
    gy: f64,
    lo: f32,
    hi: f32,
}

impl DepthPlane {
    /// Plane through three corners of twice the area `area` (sub-pixels²), counter-clockwise on the grid.
    #[inline(always)]
    fn new([a, b, c]: &[Corner; 3], area: u64, [x0, y0]: [i32; 2]) -> Self {
        let scale = f64::from(ONE) / area as f64;
        let (db, dc) = (f64::from(b.q - a.q), f64::from(c.q - a.q));
        let gx = (f64::from(c.y - a.y) * db - f64::from(b.y - a.y) * dc) * scale;
        let gy = (f64::from(b.x - a.x) * dc - f64::from(c.x - a.x) * db) * scale;
        let unit = 1.0 / f64::from(ONE);
        let q0 = f64::from(a.q)
            + (gx * f64::from((x0 << SUB_BITS) - a.x) + gy * f64::from((y0 << SUB_BITS) - a.y))
                * unit;
        Self {
            x0,
            y0,
            q0,
            gx,
            gy,
            lo: a.q.min(b.q).min(c.q),
            hi: a.q.max(b.q).max(c.q),
        }
    }
    fn row(&self, y: i32) -> f32 {
        (self.q0 + self.gy * f64::from(y - self.y0)) as f32
    }
}

/// Triangle set up for one band: counter-clockwise on the grid, last column `x1`.
struct BandTriangle {
    corners: [Corner; 3],
    id: u32,
    plane: DepthPlane,
    rows: [i32; 2],
    x1: i32,
}

impl Band<'_> {
    /// Pixels of the band whose centres a triangle may cover.
    #[inline(always)]
    pub(super) fn span(&self, [a, b, c]: &[Corner; 3]) -> Option<Span> {
        let min_y = a.y.min(b.y).min(c.y);
        let max_y = a.y.max(b.y).max(c.y);
        // First pixel centre at or after the minimum, last one at or before the maximum.
        let y0 = ((min_y + (ONE - 1)) >> SUB_BITS).max(0);
        let y1 = (max_y >> SUB_BITS).min(self.height - 1);
        let (first, last) = (y0.max(self.top), y1.min(self.top + self.rows - 1));
        let min_x = a.x.min(b.x).min(c.x);
        let max_x = a.x.max(b.x).max(c.x);
        let x0 = ((min_x + (ONE - 1)) >> SUB_BITS).max(0);
        let x1 = (max_x >> SUB_BITS).min(self.width - 1);
        (first <= last && x0 <= x1).then_some(Span {
            columns: [x0, x1],
            rows: [first, last],
            top: y0,
        })
    }

    /// True if every pixel that the triangle may cover is nearer already, by the tiles of the last
    /// [`Band::update_tiles`].
    #[inline(always)]
    pub(super) fn occludes<const PERSPECTIVE: bool>(&self, corners: &[Corner; 3]) -> bool {
        let Some(span) = self.span(corners) else {
            return false;
        };
        let q = corners.map(|c| c.q);
        // The fill loops keep depths of a face between those of its corners, so this is exact.
        let nearest = if PERSPECTIVE {
            1.0 / q[0].max(q[1]).max(q[2])
        } else {
            q[0].min(q[1]).min(q[2])
        };
        let rows = span.rows.map(|y| y - self.top);
        self.scratch.tiles.occlude(span.columns, rows, nearest)
    }
    /// Rebuilds the depth tiles.
    #[inline(always)]
    pub(super) fn update_tiles(&mut self) {
        self.scratch.tiles.update(self.depth, self.width as usize);
    }

    /// Draws the part of a triangle that lies in the band.
    #[inline(always)]
    pub(super) fn draw<const PERSPECTIVE: bool, const TIES: bool>(
        &mut self,
        corners: [Corner; 3],
        id: u32,
        cull: Cull,
    ) {
        let Some(Span {
            columns: [x0, x1],
            rows: [first, last],
            top: y0,
        }) = self.span(&corners)
        else {
            return;
        };
        let [mut a, mut b, mut c] = corners;
        let [min_x, max_x] = [a.x.min(b.x).min(c.x), a.x.max(b.x).max(c.x)];
        let [min_y, max_y] = [a.y.min(b.y).min(c.y), a.y.max(b.y).max(c.y)];
        let small = max_x - min_x < SMALL && max_y - min_y < SMALL;
        let area = if small {
            i64::from((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x))
        } else {
            i64::from(b.x - a.x) * i64::from(c.y - a.y)
                - i64::from(b.y - a.y) * i64::from(c.x - a.x)
        };
        // In a picture with y down, a face seen from outside (counter-clockwise) has negative area.
        let dropped = match cull {
            Cull::None => area == 0,
            Cull::Back => area >= 0,
            Cull::Front => area <= 0,
        };
        if dropped {
            return;
        }
        if area < 0 {
            std::mem::swap(&mut b, &mut c);
        } else {
            [a, b, c] = [a, b, c].map(|c| c.farther::<PERSPECTIVE>(self.back_offset));
        }
        let corners = [a, b, c];
        let triangle = BandTriangle {
            plane: DepthPlane::new(&corners, area.unsigned_abs(), [x0, y0]),
            corners,
            id,
            rows: [first, last],
            x1,
        };
        if small {
            self.fill_box::<PERSPECTIVE, TIES>(&triangle);
        } else {
            self.fill_spans::<PERSPECTIVE, TIES>(&triangle);
        }
    }

    /// Tests every pixel of the box with i32 edge functions.
    #[inline(always)]
    fn fill_box<const PERSPECTIVE: bool, const TIES: bool>(&mut self, triangle: &BandTriangle) {
        let BandTriangle {
            corners: [a, b, c],
            id,
            plane,
            rows: [first, last],
            x1,
        } = triangle;
        let (id, x1) = (*id, *x1);
        let (x, y) = (plane.x0 << SUB_BITS, *first << SUB_BITS);
        let edge = |p: &Corner, q: &Corner| (q.x - p.x) * (y - p.y) - (q.y - p.y) * (x - p.x);
        let mut e = [edge(b, c), edge(c, a), edge(a, b)];
        let step = |p: &Corner, q: &Corner| [(p.y - q.y) << SUB_BITS, (q.x - p.x) << SUB_BITS];
        let s = [step(b, c), step(c, a), step(a, b)];
        let n = (x1 - plane.x0 + 1) as usize;
        let gx = plane.gx as f32;
        for row in *first..=*last {
            let start = (row - self.top) as usize * self.width as usize + plane.x0 as usize;
            let depth = &mut self.depth[start..start + n];
            let face = &mut self.face[start..start + n];
            let base = plane.row(row);
            let mut w = e;
            for (i, (d, f)) in depth.iter_mut().zip(face).enumerate() {
                let inside = (w[0] | w[1] | w[2]) >= 0;
                let q = (base + gx * i as f32).max(plane.lo).min(plane.hi);
                let z = if PERSPECTIVE { 1.0 / q } else { q };
                let win = inside & wins::<TIES>(z, id, *d, *f);
                *d = if win { z } else { *d };
                *f = if win { id } else { *f };
                for k in 0..3 {
                    w[k] = w[k].wrapping_add(s[k][0]);
                }
            }
            for k in 0..3 {
                e[k] += s[k][1];
            }
        }
    }

    /// Solves for the covered span of each row in i64.
    #[inline(never)]
    fn fill_spans<const PERSPECTIVE: bool, const TIES: bool>(&mut self, triangle: &BandTriangle) {
        let BandTriangle {
            corners: [a, b, c],
            id,
            plane,
            rows: [first, last],
            x1,
        } = triangle;
        let (id, x1) = (*id, *x1);
        let gx = plane.gx as f32;
        for row in *first..=*last {
            let y = i64::from(row) << SUB_BITS;
            let (mut lo, mut hi) = (i64::from(plane.x0), i64::from(x1));
            for (p, q) in [(b, c), (c, a), (a, b)] {
                // Inside for e + x·d >= 0, x in pixels.
                let d = i64::from(p.y - q.y) << SUB_BITS;
                let e = i64::from(q.x - p.x) * (y - i64::from(p.y))
                    + i64::from(q.y - p.y) * i64::from(p.x);
                match d.signum() {
                    1 => lo = lo.max(-e.div_euclid(d)),
                    -1 => hi = hi.min(e.div_euclid(-d)),
                    _ if e < 0 => hi = lo - 1,
                    _ => {}
                }
            }
            if lo > hi {
                continue;
            }
            let start = (row - self.top) as usize * self.width as usize;
            let (from, to) = (start + lo as usize, start + hi as usize + 1);
            let skip = (lo - i64::from(plane.x0)) as usize;
            let base = plane.row(row);
            for (i, (d, f)) in self.depth[from..to]
                .iter_mut()
                .zip(&mut self.face[from..to])
                .enumerate()
            {
                let q = (base + gx * (skip + i) as f32).max(plane.lo).min(plane.hi);
                let z = if PERSPECTIVE { 1.0 / q } else { q };
                let win = wins::<TIES>(z, id, *d, *f);
                *d = if win { z } else { *d };
                *f = if win { id } else { *f };
            }
        }
    }
}

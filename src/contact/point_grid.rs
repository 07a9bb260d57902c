//! Points in cells, to find those near a place. Made anew each time: two passes over the points.

use crate::math::P3;
use wide::f32x8;

/// Points sorted by the hash of their cell.
#[derive(Clone, Debug, Default)]
pub struct PointGrid {
    cell: f32,
    first: Vec<u32>,
    /// Number and coordinates of each point, bucket by bucket, then as many points at infinity as are looked at together.
    numbers: Vec<u32>,
    places: [Vec<f32>; 3],
    keys: Vec<u32>,
}

/// Points that are looked at together.
const LANES: usize = 8;

/// Buckets of the hash: a power of two, twice the points of a usual garment.
const BUCKETS: usize = 1 << 13;
/// Cells are so many times as narrow along x, where they lie in a row of buckets. Narrower ones gain nothing.
const NARROW: f32 = 2.0;

/// The whole number below `t`: `f32::floor` is a call into the C library on the machines that this is built for.
fn below(t: f32) -> i32 {
    let i = t as i32;
    i.saturating_sub(i32::from(i as f32 > t))
}

/// Where a row of cells along x has its first bucket.
fn row(y: i32, z: i32) -> u32 {
    let h = (y as u32).wrapping_mul(0x85EB_CA77) ^ (z as u32).wrapping_mul(0xC2B2_AE3D);
    h ^ (h >> 15)
}

fn bucket(x: i32, row: u32) -> usize {
    row.wrapping_add(x as u32) as usize & (BUCKETS - 1)
}

impl PointGrid {
    /// Sorts points into cells of this size, metres; along x they are half as wide.
    pub fn fill(&mut self, points: &[P3], cell: f32) {
        self.cell = cell.max(f32::MIN_POSITIVE);
        let mut keys = std::mem::take(&mut self.keys);
        keys.clear();
        let [narrow, wide] = [NARROW / self.cell, 1.0 / self.cell];
        keys.extend(points.iter().map(|p| {
            bucket(
                below(p.x * narrow),
                row(below(p.y * wide), below(p.z * wide)),
            ) as u32
        }));
        self.keys = keys;
        self.first.clear();
        self.first.resize(BUCKETS + 1, 0);
        for k in &self.keys {
            self.first[*k as usize + 1] += 1;
        }
        for i in 0..BUCKETS {
            self.first[i + 1] += self.first[i];
        }
        self.numbers.clear();
        self.numbers.resize(points.len(), 0);
        for axis in &mut self.places {
            axis.clear();
            axis.resize(points.len() + LANES, f32::INFINITY);
        }
        let mut next = self.first.clone();
        for (i, k) in self.keys.iter().enumerate() {
            let slot = next[*k as usize] as usize;
            next[*k as usize] += 1;
            self.numbers[slot] = i as u32;
            (0..3).for_each(|d| self.places[d][slot] = points[i][d]);
        }
    }
    /// Calls `f` with number and squared distance (m²) of every point within `reach` of `p`, half a cell at most; maybe
    /// more than once.
    pub fn within(&self, p: &P3, reach: f32, mut f: impl FnMut(u32, f32)) {
        if self.numbers.is_empty() {
            return;
        }
        let [narrow, wide] = [NARROW / self.cell, 1.0 / self.cell];
        // Saturating: cloth that has flown away keeps its place in the last cell.
        let [low, high] = [p.x - reach, p.x + reach].map(|x| below(x * narrow));
        let beside = |v: f32| {
            let t = v * wide;
            let i = below(t);
            [
                i,
                i.saturating_add(if t - (i as f32) < 0.5 { -1 } else { 1 }),
            ]
        };
        let (ys, zs) = (beside(p.y), beside(p.z));
        let most = f32x8::splat(reach * reach);
        let at = [p.x, p.y, p.z].map(f32x8::splat);
        for k in 0..4usize {
            let row = row(ys[k & 1], zs[k >> 1]);
            let [from, to] = [low, high].map(|x| bucket(x, row));
            if from <= to {
                self.scan(self.first[from], self.first[to + 1], at, most, &mut f);
            } else {
                self.scan(self.first[from], self.first[BUCKETS], at, most, &mut f);
                self.scan(self.first[0], self.first[to + 1], at, most, &mut f);
            }
        }
    }
    /// Calls `f` with those of some points that are near `at`.
    #[inline(always)]
    fn scan(&self, from: u32, to: u32, at: [f32x8; 3], most: f32x8, f: &mut impl FnMut(u32, f32)) {
        let (mut from, to) = (from as usize, to as usize);
        let [x, y, z] = &self.places;
        while from < to {
            let (Some(x), Some(y), Some(z)) = (
                x[from..].first_chunk::<LANES>(),
                y[from..].first_chunk::<LANES>(),
                z[from..].first_chunk::<LANES>(),
            ) else {
                break;
            };
            let d = [
                f32x8::from(*x) - at[0],
                f32x8::from(*y) - at[1],
                f32x8::from(*z) - at[2],
            ];
            let square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
            let mut near = square.simd_le(most).to_bitmask();
            if near != 0 {
                let square = square.to_array();
                near &= u32::MAX >> (u32::BITS - (to - from).min(LANES) as u32);
                while near != 0 {
                    let l = near.trailing_zeros() as usize;
                    near &= near - 1;
                    f(self.numbers[from + l], square[l]);
                }
            }
            from += LANES;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_what_a_scan_finds() {
        let mut seed = 3u32;
        let mut random = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) as f32 / (1u32 << 24) as f32 - 0.5
        };
        let points: Vec<P3> = (0..3000)
            .map(|_| P3::new(random(), random(), random()))
            .collect();
        let mut grid = PointGrid::default();
        grid.fill(&points, 0.08);
        for q in points.iter().step_by(97) {
            let mut got = Vec::new();
            grid.within(q, 0.039, |i, d| got.push((i, d)));
            for (i, p) in points.iter().enumerate() {
                let d = (p - q).norm_squared();
                assert_eq!(d <= 0.039 * 0.039, got.contains(&(i as u32, d)), "{i}");
            }
        }
        // Far away, and not a number: found or not, but nothing breaks.
        grid.fill(
            &[P3::new(1e30, 0.0, -1e30), P3::new(1e30, f32::NAN, -1e30)],
            0.08,
        );
        let mut got = Vec::new();
        grid.within(&P3::new(1e30, 0.0, -1e30), 0.04, |i, _| got.push(i));
        assert!(got.contains(&0) && !got.contains(&1), "{got:?}");
        grid.within(&P3::new(1e30, f32::NAN, -1e30), 0.04, |_, _| {
            unreachable!("it is nowhere")
        });
        PointGrid::default().within(&P3::origin(), 1.0, |_, _| {
            unreachable!("an empty grid has no points")
        });
    }
}

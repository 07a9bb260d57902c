//! A hash grid of points for radius queries, rebuilt in two passes over the points.

use crate::math::P3;
use wide::f32x8;

/// Points sorted by the hash of their cell (counting sort).
#[derive(Clone, Debug, Default)]
pub struct HashGrid {
    cell: f32,
    /// First slot of each bucket, shape `[buckets + 1]`.
    first: Vec<u32>,
    /// Index and coordinates of each point, bucket by bucket; padded by one register of points at infinity.
    numbers: Vec<u32>,
    places: [Vec<f32>; 3],
    keys: Vec<u32>,
}

/// Points tested together: the lanes of a wide register.
const LANES: usize = 8;

/// Buckets: a power of two, twice the vertices of a usual garment. Fewer collide, more cost the counting sort.
const BUCKETS: usize = 1 << 13;
/// Cells of one row of buckets per cell size along x: a query reads a contiguous run. More gain nothing.
const NARROW: f32 = 2.0;

/// `t` rounded down. `f32::floor` is a library call on the baseline x86-64 target.
fn below(t: f32) -> i32 {
    let i = t as i32;
    i.saturating_sub(i32::from(i as f32 > t))
}

/// First bucket of the row of cells along x.
fn row(y: i32, z: i32) -> u32 {
    let h = (y as u32).wrapping_mul(0x85EB_CA77) ^ (z as u32).wrapping_mul(0xC2B2_AE3D);
    h ^ (h >> 15)
}

fn bucket(x: i32, row: u32) -> usize {
    row.wrapping_add(x as u32) as usize & (BUCKETS - 1)
}

impl HashGrid {
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
    /// Calls `f` with index and squared distance (m²) of every point within `reach` of `p`, possibly more than once.
    /// `reach` is half a cell at most, metres.
    pub fn within(&self, p: &P3, reach: f32, mut f: impl FnMut(u32, f32)) {
        if self.numbers.is_empty() {
            return;
        }
        let [narrow, wide] = [NARROW / self.cell, 1.0 / self.cell];
        // Saturating: points far away fall into the last cell.
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
    /// Calls `f` with the points of some slots whose squared distance from `at` is at most `most`.
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
    use crate::spatial::brute;
    use rand::{Rng, SeedableRng};

    #[test]
    fn within_agrees_with_brute_force() {
        const REACH: f32 = 0.039;
        let mut rng = rand_pcg::Pcg32::seed_from_u64(3);
        let points: Vec<P3> = (0..3000)
            .map(|_| P3::from(std::array::from_fn(|_| rng.random_range(-0.5f32..0.5))))
            .collect();
        let mut grid = HashGrid::default();
        grid.fill(&points, 0.08);
        for q in points.iter().step_by(97) {
            let mut got = Vec::new();
            grid.within(q, REACH, |i, d| got.push((i, d)));
            got.sort_unstable_by_key(|g| g.0);
            got.dedup();
            assert_eq!(got, brute::within(&points, q, REACH));
        }
    }

    #[test]
    fn distant_and_nan_points_and_empty_grids_do_not_panic() {
        let far = P3::new(1e30, 0.0, -1e30);
        let nan = P3::new(1e30, f32::NAN, -1e30);
        let mut grid = HashGrid::default();
        grid.within(&P3::origin(), 1.0, |_, _| unreachable!("no points"));
        grid.fill(&[far, nan], 0.08);
        let mut got = Vec::new();
        grid.within(&far, 0.04, |i, _| got.push(i));
        assert!(got.contains(&0) && !got.contains(&1), "{got:?}");
        grid.within(&nan, 0.04, |_, _| unreachable!("near nothing"));
    }
}

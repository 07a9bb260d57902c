//! Points in cubic cells, to find those near a place. Made anew each time: two passes over the points.

use crate::math::P3;

/// Points sorted by the hash of their cell.
#[derive(Clone, Debug, Default)]
pub struct PointGrid {
    cell: f32,
    first: Vec<u32>,
    /// Number and place of each point, bucket by bucket.
    points: Vec<(u32, P3)>,
    keys: Vec<u32>,
}

/// Buckets of the hash: a power of two, twice the points of a usual garment.
const BUCKETS: usize = 1 << 13;

fn bucket(c: [i32; 3]) -> usize {
    let h = (c[0] as u32).wrapping_mul(0x9E37_79B1)
        ^ (c[1] as u32).wrapping_mul(0x85EB_CA77)
        ^ (c[2] as u32).wrapping_mul(0xC2B2_AE3D);
    ((h ^ (h >> 15)) as usize) & (BUCKETS - 1)
}

impl PointGrid {
    /// Sorts points into cells of this size, metres.
    pub fn fill(&mut self, points: &[P3], cell: f32) {
        self.cell = cell.max(f32::MIN_POSITIVE);
        let mut keys = std::mem::take(&mut self.keys);
        keys.clear();
        keys.extend(points.iter().map(|p| bucket(self.at(p)) as u32));
        self.keys = keys;
        self.first.clear();
        self.first.resize(BUCKETS + 1, 0);
        for k in &self.keys {
            self.first[*k as usize + 1] += 1;
        }
        for i in 0..BUCKETS {
            self.first[i + 1] += self.first[i];
        }
        self.points.clear();
        self.points.resize(points.len(), (0, P3::origin()));
        let mut next = self.first.clone();
        for (i, k) in self.keys.iter().enumerate() {
            let slot = &mut next[*k as usize];
            self.points[*slot as usize] = (i as u32, points[i]);
            *slot += 1;
        }
    }
    fn at(&self, p: &P3) -> [i32; 3] {
        [p.x, p.y, p.z].map(|c| (c / self.cell).floor() as i32)
    }
    /// Calls `f` with number and place of every point that may be within half a cell of `p` (and some others, maybe more than once).
    pub fn around(&self, p: &P3, mut f: impl FnMut(u32, &P3)) {
        if self.points.is_empty() {
            return;
        }
        let c = [p.x, p.y, p.z].map(|v| {
            let t = v / self.cell;
            let i = t.floor();
            (i as i32, if t - i < 0.5 { -1 } else { 1 })
        });
        for k in 0..8usize {
            // Saturating: cloth that has flown away keeps its place in the last cell.
            let cell = [0, 1, 2].map(|d| c[d].0.saturating_add(if k >> d & 1 == 1 { c[d].1 } else { 0 }));
            let b = bucket(cell);
            for (i, q) in &self.points[self.first[b] as usize..self.first[b + 1] as usize] {
                f(*i, q);
            }
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
        let points: Vec<P3> = (0..3000).map(|_| P3::new(random(), random(), random())).collect();
        let mut grid = PointGrid::default();
        grid.fill(&points, 0.08);
        for q in points.iter().step_by(97) {
            let mut got = Vec::new();
            grid.around(q, |i, _| got.push(i));
            for (i, p) in points.iter().enumerate() {
                assert!((p - q).norm() >= 0.04 || got.contains(&(i as u32)), "{i}");
            }
        }
        grid.fill(&[P3::new(1e30, f32::NAN, -1e30)], 0.08);
        let mut got = Vec::new();
        grid.around(&P3::new(1e30, f32::NAN, -1e30), |i, _| got.push(i));
        assert!(got.contains(&0), "far away and not a number: {got:?}");
        PointGrid::default().around(&P3::origin(), |_, _| unreachable!("an empty grid has no points"));
    }
}

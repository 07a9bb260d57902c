//! Cusick's drape test (BS 5058): a disc of 30 cm on a support of 18 cm, its shadow over the ring's area.

use nalgebra::Vector2;
use std::f64::consts::TAU;
use tryon_geometry::math::V3d;
use tryon_geometry::mesh::Face;

/// Radii of support and specimen (m).
pub(crate) const SUPPORT: f64 = 0.09;
pub(crate) const SPECIMEN: f64 = 0.15;
/// Rings held between the plates: they clamp the cloth half-way between the second and the third.
const HELD: usize = 3;

/// Ring of cloth around the support, flat.
#[derive(Clone, Debug, Default)]
pub(crate) struct DrapeDisc {
    /// Vertices from the axis (m), u along the weft.
    pub(crate) at: Vec<Vector2<f64>>,
    /// Triangles.
    pub(crate) faces: Vec<Face>,
    /// Number of vertices between the plates, the first ones.
    pub(crate) held: usize,
}

impl DrapeDisc {
    /// Rings of vertices a distance h apart, (1.5 + `free`) h covering the free width.
    pub(crate) fn new(free: usize) -> Self {
        let h = (SPECIMEN - SUPPORT) / (free as f64 + 0.5);
        let radius = |k: usize| SUPPORT + (k as f64 - 1.5) * h;
        let count = |k: usize| (TAU * radius(k) / h).round() as u32;
        let mut disc = Self::default();
        let mut inner = 0;
        for k in 0..HELD + free {
            let first = disc.at.len() as u32;
            let n = count(k);
            // Half a turn of offset every other ring.
            let phase = 0.5 * (k % 2) as f64;
            disc.at.extend((0..n).map(|i| {
                let (s, c) = (TAU * (f64::from(i) + phase) / f64::from(n)).sin_cos();
                Vector2::new(c, s) * radius(k)
            }));
            if k > 0 {
                disc.join_rings([inner, first]);
            }
            if k < HELD {
                disc.held = disc.at.len();
            }
            inner = first;
        }
        disc
    }

    /// Triangles between the last ring, from vertex `outer`, and the one before it, from `inner`.
    fn join_rings(&mut self, [inner, outer]: [u32; 2]) {
        let end = self.at.len() as u32;
        let [n, m] = [outer - inner, end - outer];
        let angle = |v: u32, turns: u32| {
            let p = self.at[v as usize];
            p.y.atan2(p.x).rem_euclid(TAU) + TAU * f64::from(turns)
        };
        let (mut i, mut j) = (0, 0);
        while i < n || j < m {
            let [a, b] = [inner + i % n, outer + j % m];
            let [next_a, next_b] = [inner + (i + 1) % n, outer + (j + 1) % m];
            let is_inner =
                i < n && (j == m || angle(next_a, (i + 1) / n) <= angle(next_b, (j + 1) / m));
            if is_inner {
                self.faces.push([a, b, next_a]);
                i += 1;
            } else {
                self.faces.push([a, b, next_b]);
                j += 1;
            }
        }
    }

    /// Share of the ring that the shadow of `x` covers, by points 1 mm apart.
    pub(crate) fn drape_coefficient(&self, x: &[V3d]) -> f64 {
        const SIDE: i32 = 320;
        let at = |k: i32| f64::from(k - SIDE / 2) * 1e-3;
        let mut is_covered = vec![false; (SIDE * SIDE) as usize];
        for f in &self.faces {
            let [a, b, c] = f.map(|v| Vector2::new(x[v as usize].x, x[v as usize].z));
            let cell = |p: f64| (p * 1e3) as i32 + SIDE / 2;
            let (low, high) = (a.inf(&b).inf(&c), a.sup(&b).sup(&c));
            for i in cell(low.x) - 1..=cell(high.x) + 1 {
                for j in cell(low.y) - 1..=cell(high.y) + 1 {
                    let p = Vector2::new(at(i), at(j));
                    let turns = [(a, b), (b, c), (c, a)].map(|(q, r)| (r - q).perp(&(p - q)));
                    if turns.iter().all(|t| *t >= 0.0) || turns.iter().all(|t| *t <= 0.0) {
                        is_covered[(i * SIDE + j) as usize] = true;
                    }
                }
            }
        }
        let covered = (0..SIDE * SIDE).filter(|k| {
            let p = Vector2::new(at(k / SIDE), at(k % SIDE));
            is_covered[*k as usize] && p.norm() > SUPPORT
        });
        let ring = 0.5 * TAU * (SPECIMEN.powi(2) - SUPPORT.powi(2));
        covered.count() as f64 * 1e-6 / ring
    }
}

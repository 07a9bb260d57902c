//! Defects of scans: holes, stray points, damaged rows.

use super::points::{STRAY_LABEL, ScanPoints};
use super::random::{ScanSeed, gauss};
use rand::Rng;
use rand::seq::index::sample;
use tryon_geometry::math::{P3, V3};

/// Defects of a scan. Shares are of the points and between 0 and 1.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScanDefects {
    /// Share of points removed in round holes, beyond what no camera sees.
    pub holes: f64,
    /// Points of the floor around the feet.
    pub floor_points: usize,
    /// A ball in the right hand.
    pub has_object: bool,
    /// Share of points with a position that is not finite.
    pub non_finite: f64,
    /// Share of points whose colour is lost.
    pub lost_colors: f64,
    /// Share of points whose normal is flipped.
    pub flipped_normals: f64,
    /// Share of points that are repeated at the end.
    pub duplicates: f64,
}

/// Radius of a hole (m).
const HOLE_RADIUS: std::ops::Range<f32> = 0.02..0.09;
/// Radius of the floor that is scanned, and its noise (m).
const FLOOR_RADIUS: f32 = 0.6;
const FLOOR_NOISE: f64 = 1.5e-3;
/// Colour of the floor, sRGB.
const FLOOR_COLOR: [f32; 3] = [128.0, 126.0, 122.0];
/// Stages with random numbers of their own.
const HOLES: u64 = 11;
const FLOOR: u64 = 12;
const ROWS: u64 = 13;

impl ScanDefects {
    /// Adds the defects to a scan of a subject at `center` on the floor.
    pub(super) fn apply(&self, scan: &mut ScanPoints, center: P3, seed: ScanSeed) {
        self.pierce(scan, seed);
        self.add_floor(scan, center, seed);
        self.damage(scan, seed);
    }

    /// Removes round holes until the share is reached exactly.
    fn pierce(&self, scan: &mut ScanPoints, seed: ScanSeed) {
        let count = scan.len();
        let mut missing = (self.holes.clamp(0.0, 1.0) * count as f64).round() as usize;
        let mut rng = seed.stage(HOLES);
        let mut keep = vec![true; count];
        while missing > 0 {
            let center = rng.random_range(0..count);
            if !keep[center] {
                continue;
            }
            let (center, radius) = (scan.points[center], rng.random_range(HOLE_RADIUS));
            let mut inside: Vec<(f32, usize)> = (0..count)
                .filter(|i| keep[*i])
                .map(|i| ((scan.points[i] - center).norm_squared(), i))
                .filter(|(square, _)| *square < radius * radius)
                .collect();
            inside.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            for (_, i) in inside.into_iter().take(missing) {
                keep[i] = false;
                missing -= 1;
            }
        }
        if self.holes > 0.0 {
            *scan = scan.filtered(&keep);
        }
    }

    fn add_floor(&self, scan: &mut ScanPoints, center: P3, seed: ScanSeed) {
        let mut rng = seed.stage(FLOOR);
        for _ in 0..self.floor_points {
            let radius = FLOOR_RADIUS * rng.random::<f32>().sqrt();
            let (sin, cos) = (std::f32::consts::TAU * rng.random::<f32>()).sin_cos();
            let height = gauss(&mut rng, FLOOR_NOISE);
            let p = center + V3::new(radius * sin, height, radius * cos);
            scan.push(p, V3::y(), FLOOR_COLOR, STRAY_LABEL);
        }
    }

    /// Damages random rows.
    fn damage(&self, scan: &mut ScanPoints, seed: ScanSeed) {
        let mut rng = seed.stage(ROWS);
        let count = scan.len();
        let mut rows = |share: f64| {
            let amount = (share.clamp(0.0, 1.0) * count as f64).round() as usize;
            sample(&mut rng, count, amount).into_vec()
        };
        for i in rows(self.lost_colors) {
            scan.colors[i] = [f32::NAN; 3];
        }
        for i in rows(self.flipped_normals) {
            scan.normals[i] = -scan.normals[i];
        }
        for i in rows(self.duplicates) {
            let (color, label) = (scan.colors[i], scan.labels[i]);
            scan.push(scan.points[i], scan.normals[i], color, label);
        }
        for (k, i) in rows(self.non_finite).into_iter().enumerate() {
            scan.points[i][k % 3] = if k % 2 == 0 { f32::NAN } else { f32::INFINITY };
        }
    }
}

//! Temporal noise of depth against a published model of the sensor.
//!
//! In tiles of 8 × 8 pixels the variance is half the mean square difference of readings one frame apart (von Neumann 1941),
//! so slow motion does not count. Tiles that face the camera are compared with the model; the median tile decides, so people
//! who move and outlines do not.

use serde::{Deserialize, Serialize};
use tryon_geometry::camera::{
    DepthImage, Intrinsics, NoiseSettings, kinect_v1_axial_sigma, time_of_flight_axial_sigma,
};
use tryon_geometry::math::order_statistics::median;

/// Side of a tile, pixels.
const TILE: usize = 8;
/// Least share of a tile's pixels that have both readings.
const LEAST_READ: f64 = 0.2;
/// Least number of tiles.
const LEAST_TILES: usize = 20;

/// Kind of depth camera, for the noise that is to be expected.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SensorModel {
    /// Projected pattern: Kinect v1 (Nguyen et al. 2012), PrimeSense, Xtion, Astra, RealSense D400.
    #[default]
    StructuredLight,
    /// Time of flight: Kinect v2 (Fankhauser et al. 2015), Azure Kinect, L515.
    TimeOfFlight,
}

impl SensorModel {
    /// Axial standard deviation at depth `z` (m) of a surface that faces the camera (m).
    pub fn sigma(self, z: f64) -> f64 {
        f64::from(match self {
            Self::StructuredLight => kinect_v1_axial_sigma(z as f32, 0.0),
            Self::TimeOfFlight => time_of_flight_axial_sigma(z as f32, 0.0),
        })
    }
}

/// Temporal noise of surfaces that face the camera.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct NoiseEstimate {
    /// Standard deviation of the median tile (m).
    pub sigma: f64,
    /// Depth of the median tile (m).
    pub depth: f64,
    /// Median over the tiles of the standard deviation over that of the model.
    pub ratio: f64,
    /// Tiles that were compared.
    pub tiles: usize,
}

/// Sums of one tile.
#[derive(Clone, Copy, Debug, Default)]
struct Tile {
    squares: f64,
    pairs: u64,
    /// Sums of readings (mm) and their numbers by quadrant: upper left, upper right, lower left, lower right.
    readings: [(u64, u64); 4],
}

/// Noise from frames in their order.
#[derive(Clone, Debug)]
pub struct TemporalNoise {
    focal: [f64; 2],
    columns: usize,
    tiles: Vec<Tile>,
    previous: Option<DepthImage>,
    frames: u64,
    settings: NoiseSettings,
}

impl TemporalNoise {
    /// For frames of a camera.
    pub fn new(camera: &Intrinsics) -> Self {
        let [columns, rows] = [camera.width, camera.height].map(|side| side as usize / TILE);
        Self {
            focal: [camera.fx, camera.fy],
            columns,
            tiles: vec![Tile::default(); columns * rows],
            previous: None,
            frames: 0,
            settings: NoiseSettings::default(),
        }
    }

    /// Adds a frame; one of another size than the frame before starts anew.
    pub fn add(&mut self, depth: &DepthImage) {
        let size = |d: &DepthImage| (d.width(), d.height());
        let before = self.previous.take().filter(|p| size(p) == size(depth));
        if let Some(before) = before {
            self.frames += 1;
            for k in 0..self.tiles.len() {
                self.add_tile(k, &before, depth);
            }
        }
        self.previous = Some(depth.clone());
    }

    fn add_tile(&mut self, k: usize, before: &DepthImage, now: &DepthImage) {
        let (width, edge) = (now.width() as usize, self.settings.edge);
        let (u0, v0) = (k % self.columns * TILE, k / self.columns * TILE);
        let tile = &mut self.tiles[k];
        for v in 0..TILE {
            let first = (v0 + v) * width + u0;
            let rows = [before, now].map(|image| image.data().get(first..first + TILE));
            let [Some(before), Some(now)] = rows else {
                return;
            };
            for (u, (a, b)) in before.iter().zip(now).enumerate() {
                let difference = f32::from(*b) - f32::from(*a);
                // Larger differences are outlines and motion.
                if *a == 0 || *b == 0 || difference.abs() > edge * f32::from(*b) {
                    continue;
                }
                tile.squares += f64::from(difference * difference);
                tile.pairs += 1;
                let (sum, count) = &mut tile.readings[2 * (v / (TILE / 2)) + u / (TILE / 2)];
                *sum += u64::from(*b);
                *count += 1;
            }
        }
    }

    /// Noise against the model; `None` of a single frame, or where too little faces the camera.
    pub fn estimate(&self, model: SensorModel) -> Option<NoiseEstimate> {
        let whole = self.frames * (TILE * TILE) as u64;
        let measured = self.tiles.iter().filter_map(|tile| {
            let is_read = tile.pairs as f64 >= LEAST_READ * whole.max(1) as f64;
            let depth = if is_read {
                self.frontal_depth(tile)?
            } else {
                return None;
            };
            Some((
                depth,
                (0.5 * tile.squares / tile.pairs as f64).sqrt() * 1e-3,
            ))
        });
        let measured: Vec<(f64, f64)> = measured.collect();
        if measured.len() < LEAST_TILES {
            return None;
        }
        let middle = |of: &dyn Fn(&(f64, f64)) -> f64| {
            median(&mut measured.iter().map(of).collect::<Vec<f64>>())
        };
        Some(NoiseEstimate {
            sigma: middle(&|t| t.1)?,
            depth: middle(&|t| t.0)?,
            ratio: middle(&|t| t.1 / model.sigma(t.0))?,
            tiles: measured.len(),
        })
    }

    /// Mean depth of a tile (m) whose surface faces the camera.
    fn frontal_depth(&self, tile: &Tile) -> Option<f64> {
        let mut quadrants = [0.0; 4];
        for (mean, (sum, count)) in quadrants.iter_mut().zip(tile.readings) {
            if count == 0 {
                return None;
            }
            *mean = sum as f64 / count as f64 * 1e-3;
        }
        let [a, b, c, d] = quadrants;
        let depth = (a + b + c + d) / 4.0;
        // Middles of quadrants are half a tile apart, which is so many metres on the surface.
        let step = self.focal.map(|f| depth * (TILE / 2) as f64 / f);
        let slope = ((b + d - a - c) / (2.0 * step[0])).hypot((c + d - a - b) / (2.0 * step[1]));
        (slope <= f64::from(self.settings.flat)).then_some(depth)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, Normal};
    use rand_pcg::Pcg32;

    const K: Intrinsics = Intrinsics {
        width: 160,
        height: 120,
        fx: 131.0,
        fy: 131.0,
        cx: 79.5,
        cy: 59.5,
    };

    /// Frames of a surface (mm by pixel and frame) with normal noise of `sigma` (mm).
    fn noise(
        sigma: f64,
        frames: usize,
        surface: impl Fn(usize, usize, usize) -> f64,
    ) -> TemporalNoise {
        let mut rng = Pcg32::seed_from_u64(1);
        let normal = Normal::new(0.0, sigma).expect("finite");
        let mut noise = TemporalNoise::new(&K);
        for frame in 0..frames {
            let pixels = (0..K.pixels()).map(|i| {
                let z = surface(i % 160, i / 160, frame);
                if z > 0.0 {
                    (z + normal.sample(&mut rng)).round() as u16
                } else {
                    0
                }
            });
            noise.add(&DepthImage::new(160, 120, pixels.collect()).expect("its size"));
        }
        noise
    }

    #[test]
    fn noise_of_known_sigma_is_found() {
        for sigma in [1.5, 5.0, 20.0] {
            let noise = noise(sigma, 6, |u, _, _| 2000.0 + u as f64);
            let e = noise
                .estimate(SensorModel::StructuredLight)
                .expect("a wall");
            // Rounding to millimetres adds a twelfth.
            let want = (sigma * sigma + 1.0 / 12.0).sqrt() * 1e-3;
            assert!((e.sigma / want - 1.0).abs() < 0.03, "{sigma}: {e:?}");
            assert!((e.depth - 2.08).abs() < 0.01, "{e:?}");
            // Nguyen et al., eq. 3 at 2.08 m: 0.0012 + 0.0019 · 1.68².
            let model = 0.0012 + 0.0019 * 1.68 * 1.68;
            assert!((e.ratio / (want / model) - 1.0).abs() < 0.05, "{e:?}");
        }
    }

    #[test]
    fn moving_things_and_slopes_and_holes_do_not_count() {
        // A third of the picture is a board that comes nearer by 30 mm a frame, a third rises by 20 mm a pixel, one has holes.
        let noise = noise(4.0, 8, |u, v, frame| match u {
            0..53 => 2500.0 - 30.0 * frame as f64,
            53..106 => 1500.0,
            _ if v % 3 == 0 => 0.0,
            _ if v < 60 => 1500.0,
            _ => 1000.0 + 20.0 * (u - 106) as f64,
        });
        let e = noise
            .estimate(SensorModel::StructuredLight)
            .expect("a wall");
        assert!((e.sigma - 0.004).abs() < 0.0004, "{e:?}");
    }

    #[test]
    fn a_single_frame_and_a_floor_alone_have_no_estimate() {
        let single = noise(3.0, 1, |_, _, _| 2000.0);
        assert_eq!(single.estimate(SensorModel::TimeOfFlight), None);
        // A floor 1 m below a level camera.
        let floor = noise(3.0, 5, |_, v, _| {
            if v > 75 {
                131_000.0 / (v as f64 - 59.5)
            } else {
                0.0
            }
        });
        assert_eq!(floor.estimate(SensorModel::TimeOfFlight), None);
        let still = noise(0.0, 5, |_, _, _| 2000.0);
        let e = still.estimate(SensorModel::TimeOfFlight).expect("a wall");
        assert_eq!((e.sigma, e.ratio), (0.0, 0.0));
    }
}

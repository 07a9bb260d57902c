//! Matrix of fused clouds: scenes × rigs of depth cameras × seeds.

use super::{CaptureScene, CaptureVariant, measure_scans};
use crate::scans::{CameraRig, ScannerSetting, TrueScan};
use crate::{EvaluateError, Row};
use tryon_geometry::camera::NoiseModel;

/// Cameras of a rig.
const CAMERAS: [usize; 4] = [2, 3, 4, 6];
/// Sensors, displacements of their calibration (m), and points or side of a cell (m); they alternate over the rigs.
const SENSORS: [NoiseModel; 2] = [NoiseModel::KinectV1, NoiseModel::TimeOfFlight];
const SHIFTS: [f64; 2] = [0.005, 0.010];
const DENSITIES: [(usize, f32); 4] = [
    (30_000, 0.0),
    (150_000, 0.0),
    (usize::MAX, 0.005),
    (400_000, 0.0),
];
/// Turn of a camera's calibration for each metre of its displacement, radians.
const TURN: f64 = 1.1;
/// Largest gain of a camera's exposure beside 1.
const EXPOSURE: f32 = 0.1;
/// Seed of the clouds of the first scene.
const SEED: u64 = 700;

/// One rig and its seed.
#[derive(Clone, Debug, PartialEq)]
pub struct CloudCell {
    /// Cameras and points.
    pub scanner: ScannerSetting,
    /// Seed of colours, poses of the cameras and noise.
    pub seed: u64,
}

impl CloudCell {
    /// Rigs of the `scene`-th scene with the `round`-th seed: one of each number of cameras.
    pub fn of_scene(scene: usize, round: usize) -> Vec<Self> {
        let cell = |(k, cameras): (usize, usize)| {
            let shift = SHIFTS[(scene / 2 + k + round) % SHIFTS.len()];
            let (points, side) = DENSITIES[(scene + k + 2 * round) % DENSITIES.len()];
            let rig = CameraRig {
                cameras,
                noise: SENSORS[(scene + k + k / 2 + round) % SENSORS.len()],
                shift,
                turn: TURN * shift,
                exposure: EXPOSURE,
                cell: side,
                ..CameraRig::default()
            };
            Self {
                scanner: ScannerSetting {
                    points,
                    rig: Some(rig),
                    ..ScannerSetting::default()
                },
                seed: SEED + 100 * scene as u64 + 10 * round as u64 + k as u64,
            }
        };
        CAMERAS.into_iter().enumerate().map(cell).collect()
    }

    /// Description in tables.
    pub fn name(&self) -> String {
        let rig = self.scanner.rig.clone().unwrap_or_default();
        let density = match rig.cell > 0.0 {
            true => format!("{:.0} mm cells", 1e3 * rig.cell),
            false => format!("{}k points", self.scanner.points / 1000),
        };
        let sensor = format!("{:?}", rig.noise);
        format!(
            "{} cameras, {sensor}, {:.0} mm off, {density}",
            rig.cameras,
            1e3 * rig.shift
        )
    }
}

/// First scans of a scene by some rigs.
///
/// # Errors
/// As [`ScanScene::first_scans`](crate::scans::ScanScene::first_scans).
pub fn film_clouds(
    scene: &CaptureScene,
    cells: &[CloudCell],
) -> Result<Vec<TrueScan>, EvaluateError> {
    let scanners = cells.iter().map(|c| (c.scanner.clone(), c.seed));
    scene.scene.first_scans(&scanners.collect::<Vec<_>>())
}

/// Captures one cloud and compares with its truth; the row's parameter is the rig.
pub fn measure_cloud(scene: &CaptureScene, cell: &CloudCell, scan: TrueScan) -> Row {
    let row = measure_scans(&scene.name, &[scan], &CaptureVariant::whole(), 1);
    row.with("rig", cell.name()).with("seed", cell.seed)
}

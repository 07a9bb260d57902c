//! report.json of a simulation, from which a later run continues it.

use crate::report::{GarmentPart, garment_parts};
use serde::{Deserialize, Serialize};
use tryon::geometry::math::{Camera, Rigid, World};
use tryon::mirror::NOMINAL_INTERVAL;
use tryon_kit::simulations::FineFrame;
use tryon_proto::convert::WireError;
use tryon_proto::convert::garment::WornGarment;
use tryon_proto::convert::geometry::rigid_from_wire;
use tryon_proto::v1::StartSimulationResponse;

/// A simulation and its frames so far.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct FineReport {
    /// Id of the simulation; of the newest one where it was continued.
    pub(super) simulation: String,
    /// Vertices of the garments in positions.npy, inner layer first.
    pub(super) garments: Vec<GarmentPart>,
    /// Camera to world of the first frame's exposure (m).
    pub(super) world_from_camera: Option<Rigid<World, Camera>>,
    /// Frames of positions.npy.
    pub(super) frames: Vec<FrameRow>,
}

/// Exposure and computing time of a frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct FrameRow {
    /// Random number of the camera's start.
    epoch: u64,
    /// Number of the exposure within its epoch.
    sequence: u64,
    /// Exposure time by the sensor's clock (ns).
    capture_time_ns: u64,
    /// Computing time in the service (ms).
    ms: f32,
}

impl FineReport {
    /// Report of a simulation without frames.
    ///
    /// # Errors
    /// Names the part of `world_from_camera` at fault.
    pub(super) fn new(
        started: &StartSimulationResponse,
        garments: &[WornGarment],
    ) -> Result<Self, WireError> {
        let field = "start_simulation_response.world_from_camera";
        let camera = started.world_from_camera.as_ref();
        Ok(Self {
            simulation: started.simulation_id.clone(),
            garments: parts(garments),
            world_from_camera: camera.map(|c| rigid_from_wire(c, field)).transpose()?,
            frames: Vec::new(),
        })
    }

    /// Adds a frame.
    pub(super) fn push(&mut self, frame: &FineFrame) {
        let exposure = &frame.exposure;
        self.frames.push(FrameRow {
            epoch: exposure.epoch,
            sequence: exposure.sequence,
            capture_time_ns: exposure.capture_time_ns,
            ms: frame.ms,
        });
    }

    /// Vertices of all garments.
    pub(super) fn vertices(&self) -> usize {
        self.garments.iter().map(|g| g.vertices).sum()
    }

    /// Mean time between the exposures of successive frames (s); a nominal one for fewer than two frames, or when the clock
    /// did not advance.
    pub(super) fn interval(&self) -> f32 {
        let ends = self.frames.first().zip(self.frames.last());
        let span = ends.map_or(0, |(first, last)| {
            last.capture_time_ns.saturating_sub(first.capture_time_ns)
        });
        let gaps = self.frames.len().saturating_sub(1);
        if span == 0 || gaps == 0 {
            return NOMINAL_INTERVAL as f32;
        }
        (span as f64 * 1e-9 / gaps as f64) as f32
    }
}

/// Vertices of garments in positions.npy.
pub(super) fn parts(garments: &[WornGarment]) -> Vec<GarmentPart> {
    garment_parts(garments.iter().map(|g| (g.garment.as_str(), g.vertices)))
}

#[cfg(test)]
mod tests {
    use super::super::outfit::tests::garment;
    use super::*;
    use tryon_proto::v1::FrameId;

    #[test]
    fn frames_are_as_far_apart_as_their_exposures_in_the_mean() {
        let started = StartSimulationResponse::default();
        let mut report = FineReport::new(&started, &[garment("top")]).expect("valid");
        assert_eq!(
            (report.interval(), report.vertices()),
            (NOMINAL_INTERVAL as f32, 3)
        );
        for (next, interval) in [(0, NOMINAL_INTERVAL as f32), (1, 0.1), (5, 0.25)] {
            report.push(&FineFrame {
                positions: Vec::new(),
                exposure: FrameId {
                    capture_time_ns: 100_000_000 * next,
                    ..FrameId::default()
                },
                ms: 5.0,
            });
            assert!((report.interval() - interval).abs() < 1e-6);
        }
    }
}

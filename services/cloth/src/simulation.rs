//! Simulations that need no camera: started, followed, forgotten.

use std::pin::Pin;
use tonic::Status;
use tryon_proto::convert::WireError;
use tryon_proto::v1::{FollowSimulationResponse, StartSimulationRequest, StartSimulationResponse};

/// Frames of a simulation for one reader.
pub(crate) type Frames = Pin<Box<dyn futures::Stream<Item = Result<FollowSimulationResponse, Status>> + Send>>;

/// The simulations of the process.
pub(crate) struct Simulations {}

impl Simulations {
    pub(crate) fn new(_limit: usize) -> Self {
        Self {}
    }
    pub(crate) async fn start(&self, r: &StartSimulationRequest) -> Result<StartSimulationResponse, Status> {
        if r.scene_json.len() > 1024 * 1024 {
            return Err(WireError::new("start_simulation_request.scene_json", "at most 1 MiB").into());
        }
        Err(Status::unimplemented("simulations on request are not built yet"))
    }
    pub(crate) fn follow(&self, id: &str) -> Result<Frames, Status> {
        Err(tryon_kit::status::not_found("simulation", id))
    }
}

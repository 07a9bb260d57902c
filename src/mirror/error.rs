//! Failures of the chain, by the stage at fault.

use tryon_body::measure::MeasureError;
use tryon_cloth::ClothError;
use tryon_cloth::fine::OfflineError;
use tryon_dressing::DressError;
use tryon_garment::GarmentError;
use tryon_view::RenderError;

/// Frame or garment that stops the chain.
#[derive(Debug, thiserror::Error)]
pub enum MirrorError {
    /// The frame does not fit the camera.
    #[error(transparent)]
    Track(#[from] tryon_tracking::StepError),
    /// The eye for colour.
    #[error(transparent)]
    Color(#[from] tryon_tracking::ColorEyeError),
    /// The tracked body cannot be measured.
    #[error(transparent)]
    Measure(#[from] MeasureError),
    /// A garment is unknown or at fault.
    #[error(transparent)]
    Garment(#[from] GarmentError),
    /// The garments cannot be put on the tracked body.
    #[error("the garments cannot be put on")]
    Dress(#[source] DressError),
    /// The cloth cannot be stepped.
    #[error(transparent)]
    ShadedCloth(#[from] ClothError),
    /// The picture cannot be drawn.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// The offline solver.
    #[error(transparent)]
    Offline(#[from] OfflineError),
    /// The real-time result passes through itself or the body too much for the offline solver to start from it.
    #[error("{found} edges pass through faces at the start: {places}")]
    TangledStart {
        /// Crossings of an edge and a face.
        found: usize,
        /// Number between each pair of surfaces, with the place of the first (m).
        places: String,
    },
}

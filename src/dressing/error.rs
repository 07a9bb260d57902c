//! Faults of dressing.

use super::suggest::Misfit;
use tryon_body::BodyError;
use tryon_body::import::BodyFileError;
use tryon_cloth::ClothError;
use tryon_formats::FormatError;
use tryon_garment::GarmentError;

/// Why a garment could not be put on.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DressError {
    /// Nothing to put on.
    #[error("garments: the list is empty")]
    NoGarments,
    /// The pattern is at fault.
    #[error(transparent)]
    Garment(#[from] GarmentError),
    /// The body or the simulation is at fault.
    #[error(transparent)]
    Cloth(#[from] ClothError),
    /// A size that cannot be worn by this body.
    #[error(transparent)]
    Misfit(#[from] Misfit),
    /// The pose has a value that is not finite or the wrong number of angles.
    #[error("pose: {0}")]
    Pose(String),
}

/// Why a mesh garment cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum MeshGarmentError {
    /// A file is at fault.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// The cloth is at fault.
    #[error("piece {piece}: {why}")]
    Piece {
        /// Number of the piece, the largest is 0.
        piece: usize,
        /// The fault; vertices and faces are counted within the piece.
        why: GarmentError,
    },
    /// The body that it was made on is at fault.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// The file of the body that it was made on is at fault.
    #[error(transparent)]
    BodyFile(#[from] BodyFileError),
    /// The body that it was made on has no skeleton, and none was found for it.
    #[error("the body that the garment was made on: {0}")]
    NotFound(String),
    /// Two frames fit a garment alike.
    #[error("the garment lies over a body {first} as well as {second}: {option} says which")]
    Ambiguous {
        /// Unit and axes of the better one.
        first: String,
        /// Unit and axes of the other one.
        second: String,
        /// Option that tells them apart.
        option: &'static str,
    },
    /// Cloth that lies beside the body.
    #[error(
        "it is not worn like a garment: its cloth goes {most} % of the way around the body where it lies, expected {least} %: \
         --unit, --up and --facing say how the file was made, --garment-body on whom"
    )]
    NotWorn {
        /// Mean share of the way of the piece that goes farthest, percent.
        most: u32,
        /// Least share of cloth that is worn, percent.
        least: u32,
    },
    /// The file has no piece to wear.
    #[error("{0}")]
    Nothing(String),
}

//! Outfit of a sequence: its garments as the first scan shows them.

use super::align::AlignedBody;
use super::multi::MultiCloth;
use super::segment::Labelling;
use super::texture::TextureAtlas;
use serde::{Deserialize, Serialize};
use tryon_geometry::math::P3;

/// Outfit found in the first scan.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct CapturedOutfit {
    /// Labels, slots and appearances.
    pub labelling: Labelling,
    /// Garments.
    pub cloth: MultiCloth,
    /// Rest vertices of each garment (L of eq. 15), metres.
    pub rest: Vec<Vec<P3>>,
    /// Colours of each garment's vertices, sRGB.
    pub colors: Vec<Vec<[u8; 3]>>,
    /// Texture coordinates of each garment; empty for scans without colours.
    #[serde(default)]
    pub atlases: Vec<TextureAtlas>,
    /// Minimally clothed shape with the first pose.
    pub body: AlignedBody,
}

//! Scratch of a renderer.

use super::body_depth::BodyDepth;
use super::captured_depth::PictureDepth;
use super::contact_shadow::ContactShadows;
use super::coverage::PixelCoverage;
use super::hand::HandDetector;
use super::matte::Matte;
use super::own_clothes::OwnClothes;
use super::surface::Surface;

/// Scratch of [`render`](super::render()); dropping it changes no picture.
#[derive(Clone, Debug, Default)]
pub struct Workspace {
    pub(super) picture_depth: PictureDepth,
    pub(crate) surface: Surface,
    /// Coverage of each pixel of the drawn area.
    pub(crate) pixels: Vec<PixelCoverage>,
    pub(crate) matte: Matte,
    pub(crate) shadows: ContactShadows,
    pub(super) body: BodyDepth,
    pub(super) hands: HandDetector,
    pub(super) own_clothes: OwnClothes,
}

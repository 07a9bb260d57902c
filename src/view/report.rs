//! Cost of a picture, work left out, and its measured fault.

use super::off_person::OffPerson;
use super::own_clothes::OwnClothesReport;
use super::room_light::RoomLight;

/// Outcome of the detection of bare hands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HandReport {
    /// Arms near a garment, tested by colour.
    pub tested: usize,
    /// Arms that no garment is near, or that are covered, skipped.
    pub skipped: usize,
    /// Colour separates skin from clothes.
    pub known: bool,
    /// Pixels decided for an arm.
    pub pixels: usize,
}

/// Cost of a picture, work left out, and its measured fault.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RenderReport {
    /// Pixels in which a garment is visible.
    pub pixels_drawn: usize,
    /// Pixels in which something in front hides a garment (by half or more).
    pub pixels_occluded: usize,
    /// Tiles of 32×32 pixels that hold a garment.
    pub tiles_drawn: usize,
    /// Tiles of the captured picture left untouched.
    pub tiles_skipped: usize,
    /// Faces skipped because they lie entirely behind garments drawn before.
    pub faces_hidden: usize,
    /// Garments entirely behind others or outside the picture.
    pub garments_hidden: usize,
    /// Garment vertices without a visible face, for which no normal was computed.
    pub normals_skipped: usize,
    /// Pixels of occluder patches dropped as noise.
    pub specks_dropped: usize,
    /// Bare hands and forearms found in front by colour.
    pub hands: HandReport,
    /// Own clothes beside garments that take their place; `None` where none are told.
    pub own_clothes: Option<OwnClothesReport>,
    /// Garments off the person; `None` in pictures between two measurements, and where too little is seen to measure.
    pub off_person: Option<OffPerson>,
    /// Brightness of the captured picture by its bright parts alone; 1 = a well exposed room.
    pub brightness: f32,
    /// Light on the garments; `None` while it is not known.
    pub light: Option<RoomLight>,
    /// Milliseconds by stage, in order.
    pub stages_ms: Vec<(&'static str, f32)>,
}

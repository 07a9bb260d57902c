//! The captured image and the garments in one picture: visibility, shading, edges.
//!
//! Two passes (Ye et al. 2014, section 5): the captured pixels at their depth, then the garments with a depth test.
//! The test is decided by area, not by pixel (`occluder`): sensor noise is as large as the gap between chest and shirt.
//! [`render()`] runs the stages: captured picture, rasterisation, vertex shading, visibility, blending.
//!
//! ```
//! use tryon_geometry::camera::{Calibration, ColorImage, DepthImage, Intrinsics, RgbdFrame};
//! use tryon_view::{Appearance, GarmentView, Input, Model, State, Workspace, render};
//! use tryon_geometry::math::P3;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let camera = Intrinsics::KINECT_V1.resized(64, 48);
//! let frame = RgbdFrame {
//!     sequence: 0,
//!     time_ns: 0,
//!     depth: DepthImage::new(64, 48, vec![2500; 64 * 48])?, // a wall at 2.5 m
//!     color: Some(ColorImage::filled(64, 48, [90; 3])),
//! };
//! let cloth = [[-0.3, 0.3, 2.0], [0.3, 0.3, 2.0], [0.0, -0.3, 2.0]].map(P3::from);
//! let garment = GarmentView {
//!     vertices: &cloth,
//!     faces: &[[0, 1, 2]],
//!     uv: &[],
//!     normals: &[],
//!     places: &[],
//!     appearance: &Appearance::default(),
//! };
//! let input = Input {
//!     frame: &frame,
//!     calibration: &Calibration::registered(camera),
//!     garments: &[garment],
//!     body: None,
//!     output: None,
//! };
//! let (mut state, mut work) = (State::default(), Workspace::default());
//! let (picture, report) = render(&Model::default(), &mut state, &input, &mut work)?;
//! assert_ne!(picture.at(32, 24), [90; 3]);
//! assert_eq!(picture.at(2, 2), [90; 3]);
//! assert!(report.pixels_drawn > 50 && report.pixels_occluded == 0);
//! # Ok(())
//! # }
//! ```
//!
//! # Ideas
//!
//! - Captured pixels, then garments: [`mod@captured`], [`mod@blend`].
//! - Garment or person in front, with and without a depth reading: [`mod@evidence`].
//! - Patches that hide cloth: [`mod@occluder`].
//! - Own clothes that disappear, and the scene behind: [`mod@own_clothes`].
//! - Crops that follow the person: [`mod@focus`].
//! - Soft edges: [`mod@matte`].
//! - Depth moved to the colour camera: [`mod@captured_depth`].
//! - Garments beside the recorded person: [`mod@off_person`], [`mod@silhouette_grid`].
//! - Bare hands by colour: [`mod@hand::detect`].
//! - Light: [`mod@shading`], [`mod@contact_shadow`].
//! - Light of the room, from the captured person: [`mod@room_light`], its level: [`mod@room_level`]. Grain of the camera: [`mod@grain`].
//! - Blur of the camera: [`mod@camera_blur`], on outlines of garments: [`mod@outline_blur`].
//! - Fabric colour and prints: [`mod@appearance`]. Yarns and surface: [`mod@cloth_tile`]; both: [`mod@cloth`].
//! - Seams, hems, ribs: [`mod@construction`], [`mod@edge_profile`].
//! - Normals of a garment as they are shaded, for judges of folds: [`mod@drawn_normals`].
//! - Images on fabric: [`mod@image_pyramid`].
//! - Card or processor: [`mod@gpu::choice`].
//! - Shaders: [`mod@gpu::pipelines`].
#![allow(rustdoc::private_intra_doc_links)] // the index of ideas names private modules

pub(crate) mod appearance;
pub(crate) mod area;
mod arm;
mod blend;
mod body_depth;
mod camera_blur;
mod captured;
pub(crate) mod captured_depth;
mod captured_pixels;
mod cloth;
mod cloth_tile;
pub(crate) mod composition;
mod config;
mod construction;
pub(crate) mod contact_shadow;
pub(crate) mod coverage;
mod drawn_normals;
mod edge_profile;
mod evidence;
mod focus;
#[cfg(feature = "gpu")]
pub mod gpu;
mod grain;
mod hand;
mod image_pyramid;
mod input;
mod limbs;
mod matte;
mod occluder;
mod off_person;
mod outline_blur;
mod own_clothes;
mod print_layout;
mod relief_curve;
mod render;
mod report;
mod room_level;
mod room_light;
mod settings;
pub(crate) mod shading;
mod silhouette_grid;
mod skin;
pub(crate) mod srgb;
mod state;
pub(crate) mod surface;
#[cfg(test)]
pub(crate) mod tests;
mod trim_relief;
mod trims;
mod vertex_shading;
pub(crate) mod viewport;
mod workspace;

pub use appearance::{Appearance, Print};
pub use cloth::ShadedCloth;
pub use config::{Config, Lights, Margins, Model};
pub use construction::{EdgePlace, edge_places};
pub use drawn_normals::{DrawnPoint, drawn_normals};
pub use image_pyramid::ImagePyramid;
pub use input::{BodyView, Framing, GarmentView, Input, OutputFrame, RenderError};
pub use limbs::Limbs;
pub use off_person::OffPerson;
pub use own_clothes::OwnClothesReport;
pub use print_layout::PrintLayout;
pub use render::render;
pub use report::{HandReport, RenderReport};
pub use room_light::RoomLight;
pub use settings::{
    BareArmSettings, BlurSettings, ExposureSettings, FocusSettings, GrainSettings, LimbSettings,
    MatteSettings, OffPersonSettings, OwnClothesSettings, PlateSettings, RoomLevelSettings,
    RoomLightSettings, SkinSettings,
};
pub use state::State;
pub use trims::DrawnTrims;
pub use workspace::Workspace;

//! Dressed, coloured 4D scans with truth per point: the judge of garment capture.
//!
//! A [`ScanScene`] dresses a body, simulates its garments over a motion and scans the visible surface with a ring of
//! virtual cameras. Scans are functions of the scene: the same bits every time.

mod camera_rig;
mod cloth_run;
mod depth_camera;
mod film;
mod motion;
mod paint;
mod points;
mod random;
mod sampling;
mod scanner;
pub(crate) mod scene;
mod settings;
mod skinned;
mod surface;
#[cfg(test)]
mod tests;
mod view;
mod write;

pub use camera_rig::CameraRig;
pub use cloth_run::ScanGarment;
pub use depth_camera::DepthCamera;
pub use film::FilmedFrame;
pub use motion::ScanMotion;
pub use paint::ScanPalette;
pub use points::{SKIN_LABEL, STRAY_LABEL};
pub use scanner::ScannerSetting;
pub use scene::{ScanScene, TrueGarment, TrueScan};
pub use settings::ScanSettings;
pub use skinned::{GarmentParts, SkinnedGarment};
pub use write::write_scan_folder;

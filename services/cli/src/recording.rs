//! Recordings and cameras as commands take them: chosen by flags, set upright, and what is left out said once.

use anyhow::{Context, Result};
use clap::Args;
use std::path::{Path, PathBuf};
use tryon::formats::{
    CameraFile, FormatError, RecordingOptions, Reoriented, RgbdSource, open_recording_with,
};
use tryon::geometry::camera::{Calibration, LensCalibration, Mounting, PictureTurn, RgbdFrame};
use tryon_kit::config::Ros2Config;

/// Choices that a recording may leave to the reader.
#[derive(Debug, Default, Args)]
#[command(next_help_heading = "Recording")]
pub(crate) struct RecordingArgs {
    /// Topic of depth, of a recording that has several.
    #[arg(long, value_name = "TOPIC")]
    pub(crate) depth_topic: Option<String>,
    /// Topic of colour.
    #[arg(long, value_name = "TOPIC")]
    pub(crate) color_topic: Option<String>,
    /// A camera.json for a recording or a camera without a calibration of its own.
    #[arg(long, value_name = "JSON")]
    pub(crate) camera: Option<PathBuf>,
    /// Degrees clockwise by which the picture must be turned to be upright: 0, 90, 180 or 270.
    #[arg(long, value_name = "DEGREES", default_value = "0", hide_default_value = true, value_parser = turn)]
    pub(crate) turned: PictureTurn,
    /// The pictures are mirrored; they are unmirrored before they are turned.
    #[arg(long)]
    pub(crate) mirrored: bool,
}

/// Quarter turn by its degrees.
fn turn(degrees: &str) -> Result<PictureTurn, String> {
    let degrees: u16 = degrees.parse().map_err(|e| format!("{e}"))?;
    PictureTurn::try_from(degrees).map_err(|e| e.to_string())
}

impl RecordingArgs {
    /// Opens a recording that tells on stderr what no frame of it has.
    ///
    /// # Errors
    /// Names the file and the field, or the topics to choose from.
    pub(crate) fn open(&self, path: &Path) -> Result<Box<dyn RgbdSource>> {
        let options = RecordingOptions {
            depth_topic: self.depth_topic.clone(),
            color_topic: self.color_topic.clone(),
            camera: self.camera.clone(),
        };
        Ok(self.prepared(path, open_recording_with(path, &options)?))
    }

    /// Opens a recording, a camera of this machine, or a source of the capture service such as `synth`.
    ///
    /// # Errors
    /// Names the source and its fault.
    pub(crate) fn open_source(&self, name: &str) -> Result<Box<dyn RgbdSource>> {
        let path = Path::new(name);
        if tryon_capture_service::is_recording(name) {
            let neither =
                || format!("{name} is neither a camera (`tryon camera list`) nor a recording");
            return if path.exists() {
                self.open(path)
            } else {
                self.open(path).with_context(neither)
            };
        }
        let source =
            tryon_capture_service::open_with(name, self.camera.as_deref(), &Ros2Config::default())?;
        Ok(self.prepared(path, source))
    }

    /// The source set upright, its omissions told.
    fn prepared(&self, path: &Path, source: Box<dyn RgbdSource>) -> Box<dyn RgbdSource> {
        let mounting = Mounting {
            turned: self.turned,
            mirrored: self.mirrored,
        };
        let source = Reoriented::wrap(path, source, mounting);
        let mut told = Told { source, told: 0 };
        told.tell();
        Box::new(told)
    }
}

/// A recording whose omissions are told as they are found.
struct Told {
    source: Box<dyn RgbdSource>,
    /// Omissions told so far.
    told: usize,
}

impl Told {
    fn tell(&mut self) {
        let all = self.source.untaken();
        let new = all.get(self.told..).unwrap_or_default();
        for omission in new {
            eprintln!("tryon: not taken: {omission}");
        }
        self.told = all.len();
    }
}

impl RgbdSource for Told {
    fn calibration(&self) -> &Calibration {
        self.source.calibration()
    }
    fn lenses(&self) -> LensCalibration {
        self.source.lenses()
    }
    fn untaken(&self) -> &[String] {
        self.source.untaken()
    }
    fn camera_file(&self) -> CameraFile {
        self.source.camera_file()
    }
    fn color_time_ns(&self) -> Option<u64> {
        self.source.color_time_ns()
    }
    fn len(&self) -> Option<usize> {
        self.source.len()
    }
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, FormatError> {
        let frame = self.source.next_frame();
        self.tell();
        frame
    }
    fn skip_frame(&mut self) -> Result<bool, FormatError> {
        self.source.skip_frame()
    }
    fn rewind(&mut self) -> Result<(), FormatError> {
        self.source.rewind()
    }
}

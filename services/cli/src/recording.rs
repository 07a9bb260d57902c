//! Recordings as commands take them: chosen by flags, and what is left out said once.

use anyhow::Result;
use clap::Args;
use std::path::{Path, PathBuf};
use tryon::formats::{CameraFile, FormatError, RecordingOptions, RgbdSource, open_recording_with};
use tryon::geometry::camera::{Calibration, RgbdFrame};

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
    /// A camera.json for a recording without a calibration of its own.
    #[arg(long, value_name = "JSON")]
    pub(crate) camera: Option<PathBuf>,
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
        let source = open_recording_with(path, &options)?;
        let mut told = Told { source, told: 0 };
        told.tell();
        Ok(Box::new(told))
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
    fn rewind(&mut self) -> Result<(), FormatError> {
        self.source.rewind()
    }
}

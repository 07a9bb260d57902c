//! Messages of a simulation into its files.

use super::files::FineFiles;
use super::order::FrameOrder;
use super::progress::FineProgress;
use anyhow::Result;
use tryon_proto::v1::FollowSimulationResponse;

/// Destination of the messages: frames in order into the files, all of them onto the progress bar.
#[derive(Debug)]
pub(super) struct Intake<'a> {
    files: &'a mut FineFiles,
    order: FrameOrder,
    progress: FineProgress,
    messages: usize,
}

impl<'a> Intake<'a> {
    /// After the frames of the files.
    pub(super) fn new(files: &'a mut FineFiles) -> Self {
        let order = FrameOrder::new(files.vertices(), files.len() as u32);
        Self {
            files,
            order,
            progress: FineProgress::new(),
            messages: 0,
        }
    }

    /// Takes a message.
    ///
    /// # Errors
    /// Names the field of the message at fault, or the file that cannot be written.
    pub(super) fn take(&mut self, message: &FollowSimulationResponse) -> Result<()> {
        self.messages += 1;
        if let Some(frame) = self.order.take(message)? {
            self.files.push(&frame)?;
        }
        self.progress.show(message);
        Ok(())
    }

    /// Number of messages so far.
    pub(super) fn messages(&self) -> usize {
        self.messages
    }

    /// Frames that have arrived, and that are still to come.
    pub(super) fn order(&mut self) -> &mut FrameOrder {
        &mut self.order
    }
}

//! Buffer of the newest frames and bodies, joined with garments by frame id.

use std::collections::VecDeque;
use std::sync::Arc;
use tokio::time::Instant;
use tryon::body::{BodyShape, Template};
use tryon_kit::frames::Exposure;
use tryon_proto::v1::{BodyState, FrameId};

/// Frames kept: half a second at 30 Hz, 25 MB at 640×480. Garments that arrive later count as late anyway.
const FRAMES: usize = 16;

/// A body as it was reported.
#[derive(Clone)]
pub(crate) struct ReportedBody {
    pub(crate) state: Arc<BodyState>,
    pub(crate) shape: Arc<BodyShape>,
    pub(crate) template: Arc<Template>,
}

/// Two exposures are the same when epoch and sequence are.
pub(crate) fn same(a: &FrameId, b: &FrameId) -> bool {
    (a.epoch, a.sequence) == (b.epoch, b.sequence)
}

/// `a` was taken before `b`, or the same; exposures of different epochs cannot be compared.
pub(crate) fn not_after(a: &FrameId, b: &FrameId) -> bool {
    a.epoch == b.epoch && a.sequence <= b.sequence
}

/// Frames and bodies waiting for their garments.
#[derive(Clone, Default)]
pub(crate) struct JoinBuffer {
    frames: VecDeque<(Instant, Arc<Exposure>)>,
    bodies: VecDeque<ReportedBody>,
}

impl JoinBuffer {
    /// Adds a frame, dropping the oldest.
    pub(crate) fn push_frame(&mut self, e: Arc<Exposure>) {
        if self.frames.len() == FRAMES {
            self.frames.pop_front();
        }
        self.frames.push_back((Instant::now(), e));
    }

    /// Adds a body, dropping the oldest.
    pub(crate) fn push_body(&mut self, b: ReportedBody) {
        if self.bodies.len() == FRAMES {
            self.bodies.pop_front();
        }
        self.bodies.push_back(b);
    }

    /// The exposure of that id and when it arrived.
    pub(crate) fn find(&self, id: &FrameId) -> Option<(Instant, Arc<Exposure>)> {
        self.frames
            .iter()
            .rev()
            .find(|(_, e)| same(&e.id, id))
            .cloned()
    }

    /// The body measured from that exposure.
    pub(crate) fn find_body(&self, id: &FrameId) -> Option<ReportedBody> {
        self.bodies
            .iter()
            .rev()
            .find(|b| b.state.frame.as_ref().is_some_and(|f| same(f, id)))
            .cloned()
    }
}

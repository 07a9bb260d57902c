//! The newest frames and bodies, so that garments and the frame they were computed for meet.

use std::collections::VecDeque;
use std::sync::Arc;
use tokio::time::Instant;
use tryon::body::{BodyShape, Template};
use tryon_kit::frames::Exposure;
use tryon_proto::v1::{BodyState, FrameId};

/// Frames kept: half a second at 30 a second, 25 MB at 640×480. Garments are later than that only when they count as
/// late anyway.
const FRAMES: usize = 16;

/// A body as it was reported.
#[derive(Clone)]
pub(crate) struct Body {
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

/// What is waiting to be joined.
#[derive(Default)]
pub(crate) struct Scene {
    frames: VecDeque<(Instant, Arc<Exposure>)>,
    bodies: VecDeque<Body>,
}

impl Scene {
    pub(crate) fn frame(&mut self, e: Arc<Exposure>) {
        if self.frames.len() == FRAMES {
            self.frames.pop_front();
        }
        self.frames.push_back((Instant::now(), e));
    }
    pub(crate) fn body(&mut self, b: Body) {
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
    pub(crate) fn find_body(&self, id: &FrameId) -> Option<Body> {
        self.bodies
            .iter()
            .rev()
            .find(|b| b.state.frame.as_ref().is_some_and(|f| same(f, id)))
            .cloned()
    }
}

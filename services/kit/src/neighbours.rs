//! Subscribers in the publisher's own process: they share its exposures, which are packed for other processes only.

use crate::frames::{CameraKey, Exposure, Packet};
use crate::queue::latest;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError, Weak};

/// Queues of subscribers, by camera.
#[derive(Default)]
pub(crate) struct Neighbours(Mutex<BTreeMap<CameraKey, Vec<Weak<latest::Sender<Packet>>>>>);

impl Neighbours {
    /// Adds a subscriber, as long as somebody keeps its queue.
    pub(crate) fn add(&self, camera: &CameraKey, queue: &Arc<latest::Sender<Packet>>) {
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        all.entry(camera.clone())
            .or_default()
            .push(Arc::downgrade(queue));
    }

    /// Hands an exposure to all subscribers of a camera; true when there is one.
    pub(crate) fn send(&self, camera: &CameraKey, exposure: &Arc<Exposure>) -> bool {
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(queues) = all.get_mut(camera) else {
            return false;
        };
        queues.retain(|q| (q.upgrade()).is_some_and(|q| q.send(Packet::Ready(exposure.clone()))));
        !queues.is_empty()
    }
}

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
        let queues = all.entry(camera.clone()).or_default();
        // A process without the camera never sends, which would drop them.
        queues.retain(|q| q.strong_count() > 0);
        queues.push(Arc::downgrade(queue));
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn subscribers_that_went_leave_nothing_in_a_process_without_the_camera() {
        let (all, camera) = (
            Neighbours::default(),
            CameraKey::new("store", "front").expect("a key"),
        );
        for _ in 0..100 {
            all.add(&camera, &Arc::new(latest::channel().0));
        }
        let queues = all.0.lock().expect("whole");
        assert_eq!(queues[&camera].len(), 1);
    }
}

//! Settled body of the person before a camera, remembered by the holder of the consent: tracking goes on with it after a
//! restart instead of measuring anew. In memory only.

use crate::consent::REMEMBER_FOR;
use std::sync::Arc;
use tokio::sync::watch;
use tokio::time::Instant;
use tryon_body::{BodyShape, Template};
use tryon_proto::convert::body::known_body_to_wire;
use tryon_proto::v1::{self, BodyState, TrackingStatus};
use tryon_tracking::KnownBody;

/// Weight of a new residual in the mean of the remembered one.
const NEWEST: f64 = 0.1;

/// A body and the last time that its person was seen.
struct Seen {
    subject: u64,
    shape: Arc<BodyShape>,
    template: Arc<Template>,
    /// Mean residual of its fits, metres.
    residual: f64,
    at: Instant,
}

/// Memory of one body, none at first. Clones share it.
#[derive(Clone)]
pub struct RememberedBody(watch::Sender<Option<Seen>>);

impl Default for RememberedBody {
    fn default() -> Self {
        Self(watch::Sender::new(None))
    }
}

impl RememberedBody {
    /// Takes a state of tracking: the body of another subject is forgotten, and a settled one remembered.
    pub fn see(&self, state: &BodyState, shape: Option<&Arc<BodyShape>>, template: &Arc<Template>) {
        self.see_at(Instant::now(), state, shape.map(|s| (s, template)));
    }

    fn see_at(
        &self,
        now: Instant,
        state: &BodyState,
        body: Option<(&Arc<BodyShape>, &Arc<Template>)>,
    ) {
        let is_settled = state.status() == TrackingStatus::Tracking;
        let is_seen = is_settled || state.status() == TrackingStatus::Sitting;
        self.0.send_modify(|memory| {
            if state.subject != 0 && memory.as_ref().is_some_and(|m| m.subject != state.subject) {
                *memory = None;
            }
            let newest = f64::from(state.residual_mm) * 1e-3;
            let mean = |m: &Seen| m.residual + NEWEST * (newest - m.residual);
            if let (true, Some((shape, template))) = (is_settled, body) {
                *memory = Some(Seen {
                    subject: state.subject,
                    shape: shape.clone(),
                    template: template.clone(),
                    residual: memory.as_ref().map_or(newest, mean),
                    at: now,
                });
            } else if let (true, Some(m)) = (is_seen, memory.as_mut()) {
                m.at = now;
            }
        });
    }

    /// Forgets a body whose person was not seen for [`REMEMBER_FOR`].
    pub fn check(&self) {
        self.check_at(Instant::now());
    }

    fn check_at(&self, now: Instant) {
        let is_old = |m: &mut Seen| now.saturating_duration_since(m.at) > REMEMBER_FOR;
        (self.0).send_if_modified(|memory| memory.take_if(is_old).is_some());
    }

    /// Forgets the body.
    pub fn forget(&self) {
        self.0.send_replace(None);
    }

    /// The body for [`v1::OpenSessionRequest`].
    pub fn message(&self) -> Option<v1::KnownBody> {
        self.check();
        let memory = self.0.borrow();
        let m = memory.as_ref()?;
        let known = KnownBody {
            subject: m.subject,
            shape: m.shape.as_ref().clone(),
            residual: m.residual,
        };
        Some(known_body_to_wire(&known, &m.template))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;
    use tryon_body::embedded;

    fn state(subject: u64, status: TrackingStatus) -> BodyState {
        BodyState {
            subject,
            status: status.into(),
            residual_mm: 2.0,
            ..BodyState::default()
        }
    }

    #[test]
    fn a_settled_body_is_kept_for_its_person_and_ten_seconds() {
        use TrackingStatus::{Calibrating, Searching, Tracking};
        let (template, shape) = (embedded::template(), Arc::new(BodyShape::default()));
        let (memory, begun) = (RememberedBody::default(), Instant::now());
        let see = |seconds, subject, status| {
            let now = begun + Duration::from_secs(seconds);
            memory.see_at(now, &state(subject, status), Some((&shape, &template)));
        };
        let subject_at = |seconds| {
            memory.check_at(begun + Duration::from_secs(seconds));
            memory.0.borrow().as_ref().map(|m| m.subject)
        };
        see(0, 1, Calibrating);
        assert_eq!(subject_at(0), None, "its size still changes");
        see(1, 1, Tracking);
        let message = memory.message().expect("remembered");
        assert_eq!((message.subject, message.residual_mm), (1, 2.0));
        // Tracking has lost it, in a restart too.
        see(6, 0, Searching);
        assert_eq!(subject_at(10), Some(1));
        see(11, 1, Tracking);
        assert_eq!(subject_at(20), Some(1), "seen again");
        assert_eq!(subject_at(22), None, "too long ago");

        see(30, 2, Tracking);
        see(31, 3, Calibrating);
        assert_eq!(subject_at(31), None, "another person");
        see(32, 3, Tracking);
        memory.forget();
        assert_eq!(subject_at(32), None);
    }
}

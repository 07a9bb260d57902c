//! State of one try-on: the transition table of `tryon::session`, fed with events, faults and silences.

use crate::life;
use std::time::Duration;
use tokio::time::Instant;
use tryon::session::{Ages, Event, Fault, SilenceLimits, State, transition};
use tryon_kit::sessions::brief;
use tryon_proto::v1::{TryOnEnd, TryOnStatus};

/// Answers of a service behind the try-on.
#[derive(Default)]
struct Upstream {
    is_up: bool,
    /// Fault as a level: repeated to the table as long as it lasts.
    fault: Option<(Fault, String)>,
}

/// State, faults and ages of one try-on.
pub(super) struct Lifecycle {
    id: String,
    limits: SilenceLimits,
    state: State,
    detail: String,
    /// Start of the current state.
    since: Instant,
    born: Instant,
    last_live: Option<Instant>,
    ages: Ages,
    tracking: Upstream,
    cloth: Upstream,
    announced: Vec<TryOnStatus>,
    /// Reason of the end.
    end: TryOnEnd,
}

impl Lifecycle {
    /// A try-on that opens now.
    pub(super) fn new(id: String, limits: SilenceLimits) -> Self {
        let now = Instant::now();
        Self {
            id,
            limits,
            state: State::Opening,
            detail: String::new(),
            since: now,
            born: now,
            last_live: None,
            ages: Ages::default(),
            tracking: Upstream::default(),
            cloth: Upstream::default(),
            announced: Vec::new(),
            end: TryOnEnd::Unspecified,
        }
    }

    /// Current state.
    pub(super) fn state(&self) -> State {
        self.state
    }

    /// Time since the last live picture could be shown (s); 0 before the first.
    pub(super) fn degraded_age(&self) -> f32 {
        self.last_live.map_or(0.0, |t| t.elapsed().as_secs_f32())
    }

    /// Tracking answered last time.
    pub(super) fn is_tracking_up(&self) -> bool {
        self.tracking.is_up
    }

    /// Time since the last frame; `None` before the first.
    pub(super) fn silence(&self) -> Option<Duration> {
        let now = self.since_birth_ns(Instant::now());
        let at = self.ages.frame_ns?;
        Some(Duration::from_nanos(now.saturating_sub(at)))
    }

    /// Likely cause of pictures that do not come.
    pub(super) fn stall(&self) -> String {
        match self.silence() {
            None => "no frame has come: is the camera on the bus, do bus.connect and the router lead to it?".into(),
            Some(s) if s >= Duration::from_secs(1) => {
                format!("no frame has come for {:.0} s", s.as_secs_f64())
            }
            Some(_) => format!(
                "frames come and none is drawn; the state is {}",
                life::state(self.state).as_str_name()
            ),
        }
    }

    /// Garments of a frame that arrived at `arrived` are too old to be shown.
    pub(super) fn is_late(&self, arrived: Instant) -> bool {
        arrived.elapsed().as_nanos() > u128::from(self.limits.garments_age_ns)
    }

    /// Current state in the terms of the wire.
    pub(super) fn status(&self) -> TryOnStatus {
        TryOnStatus {
            state: life::state(self.state).into(),
            reason: life::reason(self.state).into(),
            age: self.since.elapsed().as_secs_f32(),
            service: life::service(self.state).into(),
            detail: match self.state.fault() {
                Some(r) if self.detail.is_empty() => r.words().into(),
                Some(_) => self.detail.clone(),
                None => String::new(),
            },
            retry_after: 0.0,
            end: self.end.into(),
        }
    }

    /// Statuses to announce since the last call, in order.
    pub(super) fn take_announced(&mut self) -> Vec<TryOnStatus> {
        std::mem::take(&mut self.announced)
    }

    /// Applies one event to the table.
    pub(super) fn apply(&mut self, event: Event) {
        let next = transition(self.state, event);
        if next == self.state {
            return;
        }
        tracing::info!(try_on = brief(&self.id), from = ?self.state, to = ?next, detail = self.detail, "state");
        if self.state == State::Live {
            self.last_live = Some(Instant::now());
        }
        (self.state, self.since) = (next, Instant::now());
        self.announced.push(self.status());
        if next.invalidates_garments() {
            self.ages.garments_ns = None;
        }
    }

    /// Closes it for that reason.
    pub(super) fn close(&mut self, end: TryOnEnd) {
        self.end = end;
        self.apply(Event::Close);
    }

    /// Applies a fault of this moment.
    pub(super) fn fail(&mut self, reason: Fault, detail: &str) {
        if self.detail != detail {
            self.detail = detail.into();
        }
        self.apply(Event::Failed(reason));
    }

    /// A frame arrived.
    pub(super) fn on_frame(&mut self) {
        self.ages.frame_ns = Some(self.since_birth_ns(Instant::now()));
        if self.state == State::Degraded(Fault::CameraSilent) {
            self.apply(Event::CameraBack);
        }
    }

    /// Tracking answered.
    pub(super) fn on_tracking(&mut self) {
        self.tracking.is_up = true;
        self.ages.body_ns = Some(self.since_birth_ns(Instant::now()));
        self.open_if_both_answer();
        self.tracking.fault = None;
    }

    /// Tracking sees nobody.
    pub(super) fn is_nobody_in_view(&self) -> bool {
        matches!(
            self.state,
            State::Degraded(Fault::NoPerson | Fault::PersonLeft)
        )
    }

    /// Tracking answered that it follows nobody.
    pub(super) fn on_nobody(&mut self, reason: Fault, detail: &str) {
        self.fail(reason, detail);
        self.tracking.fault = Some((reason, detail.to_owned()));
    }

    /// Tracking does not answer.
    pub(super) fn on_tracking_gone(&mut self, why: String) {
        self.tracking.is_up = false;
        self.ages.body_ns = None;
        self.fail(Fault::TrackingUnavailable, &why);
        self.tracking.fault = Some((Fault::TrackingUnavailable, why));
    }

    /// Cloth answered; without garments their age is forgotten.
    pub(super) fn on_cloth(&mut self, has_garments: bool) {
        self.cloth.is_up = true;
        self.open_if_both_answer();
        self.cloth.fault = None;
        if !has_garments {
            self.ages.garments_ns = None;
        }
    }

    /// Garments belong to a frame that arrived at `arrived`.
    pub(super) fn on_garments(&mut self, arrived: Instant) {
        self.ages.garments_ns = Some(self.since_birth_ns(arrived));
    }

    /// Cloth does not answer.
    pub(super) fn on_cloth_gone(&mut self, why: String) {
        self.cloth.is_up = false;
        self.fail(Fault::ClothUnavailable, &why);
        self.cloth.fault = Some((Fault::ClothUnavailable, why));
    }

    /// Repeats lasting faults and looks for silence.
    pub(super) fn check(&mut self) {
        let faults = [self.cloth.fault.clone(), self.tracking.fault.clone()];
        for (reason, why) in faults.into_iter().flatten() {
            self.fail(reason, &why);
        }
        let now = self.since_birth_ns(Instant::now());
        if let Some(reason) = self.ages.overdue(now, &self.limits) {
            self.fail(reason, "");
        } else if self.ages.frame_ns.is_none() && now > self.limits.camera_silence_ns {
            self.fail(Fault::CameraSilent, "no frame has come yet");
        }
    }

    fn open_if_both_answer(&mut self) {
        let is_closed = matches!(
            self.state,
            State::Opening | State::Degraded(Fault::TrackingUnavailable | Fault::ClothUnavailable)
        );
        if is_closed && self.tracking.is_up && self.cloth.is_up {
            self.apply(Event::Opened);
        }
    }

    fn since_birth_ns(&self, at: Instant) -> u64 {
        let age = at.saturating_duration_since(self.born);
        u64::try_from(age.as_nanos()).unwrap_or(u64::MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn garments_that_are_put_on_again_leave_a_plain_mirror_until_they_are_back() {
        let mut life = Lifecycle::new("t".into(), SilenceLimits::default());
        life.on_frame();
        life.on_tracking();
        life.on_cloth(true);
        life.apply(Event::GarmentsOn);
        assert!(life.state().shows_garments());

        life.on_cloth(false);
        life.apply(Event::OutfitOff);
        life.check();
        assert_eq!(
            life.state(),
            State::Calibrating,
            "no fault, no frozen picture"
        );
        life.apply(Event::GarmentsOn);
        assert_eq!(life.state(), State::Live);
    }

    #[tokio::test]
    async fn a_hidden_fault_comes_up_once_the_one_before_it_is_gone() {
        let mut life = Lifecycle::new("t".into(), SilenceLimits::default());
        life.on_frame();
        life.on_tracking();
        life.on_cloth(true);
        assert_eq!(life.state(), State::Calibrating);

        life.on_cloth_gone("no cloth".into());
        life.on_tracking_gone("no tracking".into());
        life.check();
        assert_eq!(life.state(), State::Degraded(Fault::TrackingUnavailable));

        life.on_tracking();
        life.apply(Event::Opened);
        life.check();
        assert_eq!(life.state(), State::Degraded(Fault::ClothUnavailable));
        assert_eq!(life.status().detail, "no cloth");
        assert_eq!(life.take_announced().len(), 5);
        assert!(life.take_announced().is_empty());
    }
}

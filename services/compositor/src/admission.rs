//! Admission of try-ons by measured capacity: one more is let in if the processors that those at work take, and as much
//! again for the new one, are there.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use tokio::time::Instant;
use tokio_util::sync::CancellationToken;
use tryon::geometry::settings;
use tryon_kit::load::{Load, LoadMeter};

/// Interval of readings.
const READ_EVERY: Duration = Duration::from_millis(500);
/// Time from the opening of a try-on until it takes what it will take: it is found, measured and dressed.
const SETTLED: Duration = Duration::from_secs(6);

settings! {
    /// Settings of the admission.
    pub struct AdmissionSettings {
        /// Share of the processors that try-ons may take together. Less refuses earlier, more lets hiccups cost pictures.
        pub full: f64 = 0.92,
        /// Processors that a try-on takes before one was measured: a person in a T-shirt at 30 Hz on the bars' machine.
        pub first_cost: f64 = 0.8,
        /// Weight of a reading.
        pub weight: f64 = 0.2,
        /// Weight of a reading above what others took so far: the start of the services themselves is no load that stays.
        pub rise: f64 = 0.02,
        /// Fall of the cost a reading: try-ons cost little while nobody is in view, and people come back. Half in six minutes.
        pub forgetting: f64 = 0.001,
    }
}

/// Measured capacity. Clones share it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Admission(Arc<Mutex<Capacity>>);

#[derive(Debug)]
struct Capacity {
    settings: AdmissionSettings,
    /// Processors that one try-on takes, and those that everything else takes.
    cost: f64,
    others: f64,
    /// Processors that there are; `None` where the system does not tell.
    processors: Option<f64>,
    opened: Option<Instant>,
}

impl Default for Capacity {
    fn default() -> Self {
        let settings = AdmissionSettings::default();
        Self {
            cost: settings.first_cost,
            settings,
            others: 0.0,
            processors: None,
            opened: None,
        }
    }
}

impl Admission {
    /// Reads the load until `shutdown`; `count` is the number of open try-ons.
    pub(crate) fn start(
        count: impl Fn() -> usize + Send + 'static,
        shutdown: CancellationToken,
    ) -> Self {
        let admission = Self::default();
        let Some(mut meter) = LoadMeter::new() else {
            tracing::info!("the load of this machine cannot be read: only max_try_ons limits");
            return admission;
        };
        let reading = admission.clone();
        tokio::spawn(shutdown.run_until_cancelled_owned(async move {
            let mut tick = tokio::time::interval(READ_EVERY);
            tick.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
            loop {
                tick.tick().await;
                if let Some(load) = meter.read() {
                    reading.with(|c| c.learn(load, count(), Instant::now()));
                }
            }
        }));
        admission
    }

    /// One more try-on beside `open` ones finds the processors that it will need.
    pub(crate) fn has_room(&self, open: usize) -> bool {
        self.with(|c| c.has_room(open))
    }

    /// A try-on was opened.
    pub(crate) fn on_opened(&self) {
        self.with(|c| c.opened = Some(Instant::now()));
    }

    fn with<R>(&self, f: impl FnOnce(&mut Capacity) -> R) -> R {
        f(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Capacity {
    fn learn(&mut self, load: Load, open: usize, now: Instant) {
        self.processors = Some(load.processors);
        if open == 0 {
            let weight = if load.busy > self.others {
                self.settings.rise
            } else {
                self.settings.weight
            };
            self.others += weight * (load.busy - self.others);
            return;
        }
        let is_settled = self.opened.is_none_or(|t| now - t >= SETTLED);
        if is_settled {
            let cost = (load.busy - self.others).max(0.0) / open as f64;
            let weight = if cost > self.cost {
                self.settings.weight
            } else {
                self.settings.forgetting
            };
            self.cost += weight * (cost - self.cost);
        }
        metrics::gauge!("tryon_try_on_processors").set(self.cost);
    }

    fn has_room(&self, open: usize) -> bool {
        // The first one is always let in: it has the ladder of detail.
        let wanted = self.others + self.cost * (open + 1) as f64;
        open == 0
            || self
                .processors
                .is_none_or(|all| wanted <= self.settings.full * all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Readings of a minute with so many try-ons.
    fn run(c: &mut Capacity, busy: f64, open: usize, start: Instant) -> Instant {
        let load = Load {
            busy,
            processors: 2.0,
        };
        let mut now = start;
        for _ in 0..120 {
            now += READ_EVERY;
            c.learn(load, open, now);
        }
        now
    }

    #[test]
    fn places_follow_what_try_ons_take() {
        let (mut c, start) = (Capacity::default(), Instant::now());
        assert!(c.has_room(3), "nothing is known");
        let now = run(&mut c, 0.1, 0, start);
        c.opened = Some(now);
        let now = run(&mut c, 0.9, 1, now);
        assert!(c.has_room(1) && !c.has_room(2), "{c:?}");
        run(&mut c, 1.9, 1, now);
        assert!(c.has_room(0) && !c.has_room(1), "{c:?}");
    }

    #[test]
    fn try_ons_that_settle_teach_nothing_and_quiet_ones_little() {
        let (mut c, start) = (Capacity::default(), Instant::now());
        let mut now = start;
        for _ in 0..10 {
            c.opened = Some(now);
            now = start + READ_EVERY;
            let load = Load {
                busy: 2.0,
                processors: 2.0,
            };
            c.learn(load, 1, now);
        }
        assert!((c.cost - c.settings.first_cost).abs() < 1e-12, "{c:?}");
        c.opened = None;
        run(&mut c, 0.1, 1, now);
        assert!(c.cost > 0.7, "nobody was in view for a minute: {c:?}");
    }

    #[test]
    fn work_of_others_takes_places() {
        let (mut c, start) = (Capacity::default(), Instant::now());
        let busy = |busy| Load {
            busy,
            processors: 2.0,
        };
        for _ in 0..6 {
            c.learn(busy(1.8), 0, start);
        }
        assert!(c.has_room(1), "the services have just started: {c:?}");
        run(&mut c, 1.2, 0, start);
        assert!(c.has_room(0) && !c.has_room(1), "{c:?}");
    }
}

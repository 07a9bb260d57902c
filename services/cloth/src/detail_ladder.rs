//! Detail of a session's cloth by what the machine can do: given up while exposures go without garments, taken back when
//! none do. A step up that fails makes the next one wait longer.

use std::time::{Duration, Instant};
use tryon::geometry::settings;
use tryon_proto::v1::ClothDetail;

/// Time over which exposures are counted. Longer reacts later, shorter takes a hiccup for a load.
const WINDOW: Duration = Duration::from_secs(2);
/// Calm windows before a step up: at first, and at most.
const PATIENCE: u32 = 4;
const MOST_PATIENCE: u32 = 64;
/// Windows after a step up in which a step down counts as its failure.
const TRIAL: u32 = 15;

settings! {
    /// Settings of the detail of cloth.
    pub struct LadderSettings {
        /// Share of exposures with garments below which detail is given up.
        pub least_share: f64 = 0.75,
        /// Share of exposures with garments from which a window counts as calm.
        pub calm_share: f64 = 0.95,
        /// Share of the interval between exposures that cloth must take: giving up less would not help.
        pub least_cost: f64 = 0.15,
        /// Rate of bodies (Hz) below which skinned cloth gives way to the plain mirror.
        pub mirror_rate: f64 = 4.0,
        /// Rate of bodies (Hz) from which skinned cloth returns.
        pub return_rate: f64 = 8.0,
    }
}

/// Exposures of a window.
#[derive(Clone, Copy, Debug)]
struct Window {
    start: Instant,
    served: u32,
    missed: u64,
    cost: Duration,
}

impl Window {
    fn new(start: Instant) -> Self {
        Self {
            start,
            served: 0,
            missed: 0,
            cost: Duration::ZERO,
        }
    }
}

/// Detail of one session.
#[derive(Debug)]
pub(crate) struct DetailLadder {
    settings: LadderSettings,
    detail: ClothDetail,
    window: Window,
    /// Calm windows in a row, and as many as a step up needs.
    calm: u32,
    patience: u32,
    /// Windows since the last step up.
    since_up: u32,
}

impl DetailLadder {
    /// Full detail.
    pub(crate) fn new(now: Instant) -> Self {
        Self {
            settings: LadderSettings::default(),
            detail: ClothDetail::Full,
            window: Window::new(now),
            calm: 0,
            patience: PATIENCE,
            since_up: u32::MAX,
        }
    }

    /// Detail to compute now.
    pub(crate) fn detail(&self) -> ClothDetail {
        self.detail
    }

    /// Leaves out what has been counted: dressing takes the machine for a second.
    pub(crate) fn restart(&mut self, now: Instant) {
        self.window = Window::new(now);
    }

    /// Counts an exposure whose garments took `cost`, and `missed` ones before it that went without.
    pub(crate) fn count(&mut self, now: Instant, missed: u64, cost: Duration) {
        let w = &mut self.window;
        (w.served, w.missed, w.cost) = (w.served + 1, w.missed + missed, w.cost + cost);
        let span = now.saturating_duration_since(w.start);
        if span < WINDOW {
            return;
        }
        let (served, all) = (f64::from(w.served), f64::from(w.served) + w.missed as f64);
        let share = served / all;
        let rate = served / span.as_secs_f64();
        // Of the interval between exposures.
        let cost = w.cost.as_secs_f64() / served * all / span.as_secs_f64();
        self.window = Window::new(now);
        self.since_up = self.since_up.saturating_add(1);
        if self.must_step_down(share, rate, cost) {
            self.step_down();
        } else if share >= self.settings.calm_share
            || self.detail == ClothDetail::None && rate >= self.settings.return_rate
        {
            self.calm += 1;
            self.step_up();
        } else {
            self.calm = 0;
        }
    }

    fn must_step_down(&self, share: f64, rate: f64, cost: f64) -> bool {
        let s = &self.settings;
        match self.detail {
            ClothDetail::Full | ClothDetail::Coarse => share < s.least_share && cost > s.least_cost,
            ClothDetail::Skinned => share < s.least_share && rate < s.mirror_rate,
            _ => false,
        }
    }

    fn step_down(&mut self) {
        if self.since_up < TRIAL {
            self.patience = (2 * self.patience).min(MOST_PATIENCE);
        }
        self.calm = 0;
        self.detail = match self.detail {
            ClothDetail::Full => ClothDetail::Coarse,
            ClothDetail::Coarse => ClothDetail::Skinned,
            _ => ClothDetail::None,
        };
    }

    fn step_up(&mut self) {
        if self.detail == ClothDetail::Full {
            if self.since_up > TRIAL {
                self.patience = PATIENCE;
            }
            return;
        }
        if self.calm < self.patience {
            return;
        }
        (self.calm, self.since_up) = (0, 0);
        self.detail = match self.detail {
            ClothDetail::None => ClothDetail::Skinned,
            ClothDetail::Skinned => ClothDetail::Coarse,
            _ => ClothDetail::Full,
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs windows at 30 Hz of which `served` exposures each get garments of that cost; the detail after each.
    fn run(ladder: &mut DetailLadder, windows: u32, served: u32, cost_ms: u64) -> Vec<ClothDetail> {
        let mut start = ladder.window.start;
        let (all, cost) = (60, Duration::from_millis(cost_ms));
        let mut details = Vec::new();
        for _ in 0..windows {
            for i in 0..served {
                let now = start + WINDOW * (i + 1) / served;
                let missed = u64::from(all - served) / u64::from(served);
                let rest = u64::from(all - served) % u64::from(served);
                ladder.count(now, missed + u64::from(u64::from(i) < rest), cost);
            }
            details.push(ladder.detail());
            start += WINDOW;
        }
        details
    }

    #[test]
    fn detail_is_given_up_step_by_step_and_taken_back_with_patience() {
        use ClothDetail::{Coarse, Full, None, Skinned};
        let mut ladder = DetailLadder::new(Instant::now());
        assert_eq!(run(&mut ladder, 5, 60, 20), [Full; 5], "none is missed");
        assert_eq!(run(&mut ladder, 2, 30, 30), [Coarse, Skinned]);
        assert_eq!(
            run(&mut ladder, 3, 20, 1),
            [Skinned; 3],
            "10 Hz are better than none"
        );
        assert_eq!(run(&mut ladder, 2, 6, 1), [None; 2]);
        assert_eq!(run(&mut ladder, 4, 17, 0), [None, None, None, Skinned]);
        let back = run(&mut ladder, 8, 60, 5);
        assert_eq!(
            back,
            [
                Skinned, Skinned, Skinned, Coarse, Coarse, Coarse, Coarse, Full
            ]
        );
    }

    #[test]
    fn a_step_up_that_fails_makes_the_next_one_wait() {
        let mut ladder = DetailLadder::new(Instant::now());
        run(&mut ladder, 1, 30, 20);
        for patience in [4, 8, 16, 32, 64, 64] {
            let calm = run(&mut ladder, patience, 60, 5);
            let ups = calm.iter().filter(|d| **d == ClothDetail::Full).count();
            assert_eq!(ups, 1, "after {patience} windows: {calm:?}");
            assert_eq!(run(&mut ladder, 1, 30, 20), [ClothDetail::Coarse]);
        }
        run(&mut ladder, 64 + TRIAL + 2, 60, 5);
        assert_eq!(ladder.patience, PATIENCE, "it holds");
    }

    #[test]
    fn cheap_cloth_is_not_given_up_for_a_slow_tracker() {
        let mut ladder = DetailLadder::new(Instant::now());
        assert_eq!(run(&mut ladder, 4, 12, 2), [ClothDetail::Full; 4]);
        run(&mut ladder, 1, 12, 30);
        assert_eq!(ladder.detail(), ClothDetail::Coarse);
        ladder.restart(Instant::now());
        assert_eq!(ladder.window.served, 0);
    }
}

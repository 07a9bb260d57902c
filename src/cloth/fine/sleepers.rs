//! Sleepers of a frame, and the time that each vertex has been still.

use super::sleep::Sleep;
use super::step::{OfflineFrameReport, OfflineSolver};
use super::targets::FrameTargets;
use crate::settings::SleepSettings;
use tryon_geometry::math::V3d;

impl OfflineSolver<'_> {
    /// Decides what sleeps during a frame of `duration` (s).
    pub(super) fn fall_asleep(&mut self, duration: f64, targets: &FrameTargets<'_>) {
        self.sleep.asleep.clear();
        if let Some(settings) = self.settings.sleep {
            self.sleep.since += duration;
            if self.sleep.since <= settings.time {
                self.sleep.asleep = self.sleepers(settings, targets);
            } else {
                self.sleep.since = 0.0;
            }
        }
        let cloth = self.sleep.asleep.iter().take(self.cloth.len()).enumerate();
        for (i, _) in cloth.filter(|(_, is_asleep)| **is_asleep) {
            let now = &mut self.state.now;
            now.v[i] = V3d::zeros();
            if let Some((earlier, _)) = &mut self.state.earlier {
                (earlier.x[i], earlier.v[i]) = (now.x[i], V3d::zeros());
            }
        }
        self.leave_out_sleepers();
    }

    /// Wakes everything, and counts anew from the next frame on.
    pub(super) fn wake_up(&mut self) {
        self.sleep.asleep.clear();
        self.sleep.still.fill(0.0);
        self.leave_out_sleepers();
    }

    fn leave_out_sleepers(&mut self) {
        let asleep = &self.sleep.asleep;
        self.directions.select(asleep);
        if let Some(contacts) = &mut self.contacts {
            contacts.leave_out(asleep);
        }
    }

    /// Sleepers by vertex; empty for none.
    fn sleepers(&mut self, settings: SleepSettings, targets: &FrameTargets<'_>) -> Vec<bool> {
        let n = self.cloth.len();
        let still = self.sleep.still.iter();
        let mut asleep: Vec<bool> = still.map(|time| *time >= settings.time).collect();
        let places = &self.sleep.places;
        let stays = |v: usize, to: &V3d| (to - places[v]).norm() <= settings.distance;
        for pin in targets.pins {
            let vertex = pin.vertex as usize;
            asleep[vertex] &= stays(vertex, &pin.target);
        }
        for (vertex, to) in (n..).zip(targets.obstacle) {
            asleep[vertex] &= stays(vertex, to);
        }
        let is_beside_awake = |i: usize| {
            let mut beside = self.cloth.neighbours(i).iter();
            beside.any(|j| !asleep[*j as usize])
        };
        let woken: Vec<usize> = (0..n).filter(|i| is_beside_awake(*i)).collect();
        woken.into_iter().for_each(|i| asleep[i] = false);
        if !asleep.contains(&true) {
            return Vec::new();
        }
        if let Some(contacts) = &mut self.contacts {
            contacts.wake(&self.state.unknowns(), &mut asleep);
        }
        asleep
    }

    /// True if nothing at all is awake.
    pub(super) fn is_asleep(&self) -> bool {
        let asleep = &self.sleep.asleep;
        !asleep.is_empty() && asleep.iter().all(|is_asleep| *is_asleep)
    }

    /// Counts the time that each vertex has been still, after a frame of `duration` (s).
    pub(super) fn note_motion(&mut self, duration: f64, report: &mut OfflineFrameReport) {
        let Some(settings) = self.settings.sleep else {
            return;
        };
        let Sleep {
            places,
            still,
            asleep,
            ..
        } = &mut self.sleep;
        let sleepers = asleep.iter().take(self.cloth.len());
        report.asleep = sleepers.filter(|is_asleep| **is_asleep).count();
        let now = self.state.now.x.iter().chain(&self.state.obstacle[1]);
        for ((place, still), now) in places.iter_mut().zip(still).zip(now) {
            if (now - *place).norm() <= settings.distance {
                *still += duration;
            } else {
                (*place, *still) = (*now, 0.0);
            }
        }
    }
}

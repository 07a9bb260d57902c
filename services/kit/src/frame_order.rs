//! Order of the exposures of one camera behind a bus that may lose, double or reorder them.

/// Newest exposure so far, and the number of missed ones.
#[derive(Debug, Default)]
pub(crate) struct FrameOrder {
    /// Epoch and sequence of the newest.
    last: Option<(u64, u64)>,
    /// Epoch before that of the newest: a late exposure of it is no restart of the camera.
    retired: Option<u64>,
    /// The next gap is on purpose.
    is_gap_wanted: bool,
    missed: u64,
}

impl FrameOrder {
    /// True for an exposure after all others; an earlier one, a second one and one of an epoch that is over are refused.
    pub(crate) fn admit(&mut self, epoch: u64, sequence: u64) -> bool {
        let is_newer = match self.last {
            Some((e, s)) if e == epoch => sequence > s,
            _ => self.retired != Some(epoch),
        };
        if !is_newer {
            return false;
        }
        let is_wanted = std::mem::take(&mut self.is_gap_wanted);
        match self.last {
            Some((e, s)) if e == epoch => {
                self.missed += if is_wanted { 0 } else { sequence - s - 1 };
            }
            Some((e, _)) => self.retired = Some(e),
            None => {}
        }
        self.last = Some((epoch, sequence));
        true
    }

    /// Exposures up to the next one are not missed.
    pub(crate) fn pause(&mut self) {
        self.is_gap_wanted = true;
    }

    /// Number of missed exposures.
    pub(crate) fn missed(&self) -> u64 {
        self.missed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Admitted ones of `sent`, and the number missed.
    fn admitted(sent: &[(u64, u64)]) -> (Vec<(u64, u64)>, u64) {
        let mut order = FrameOrder::default();
        let kept = sent.iter().copied().filter(|(e, s)| order.admit(*e, *s));
        (kept.collect(), order.missed())
    }

    #[test]
    fn late_and_double_exposures_are_refused_and_losses_counted() {
        let sent = [1, 2, 2, 5, 4, 3, 5, 6, u64::MAX, 0].map(|s| (7, s));
        let (kept, missed) = admitted(&sent);
        assert_eq!(kept, [1, 2, 5, 6, u64::MAX].map(|s| (7, s)));
        assert_eq!(missed, 2 + (u64::MAX - 7));
    }

    #[test]
    fn a_restart_is_followed_and_what_is_late_from_before_it_is_not() {
        let (kept, missed) = admitted(&[(7, 90), (8, 0), (7, 91), (8, 1), (9, 0), (8, 2), (9, 1)]);
        assert_eq!(kept, [(7, 90), (8, 0), (8, 1), (9, 0), (9, 1)]);
        assert_eq!(missed, 0);
    }

    #[test]
    fn a_gap_on_purpose_is_no_loss_and_order_holds_across_it() {
        let mut order = FrameOrder::default();
        assert!(order.admit(1, 5));
        order.pause();
        assert!(!order.admit(1, 4));
        assert!(order.admit(1, 9) && order.admit(1, 11));
        assert_eq!(order.missed(), 1);
    }
}

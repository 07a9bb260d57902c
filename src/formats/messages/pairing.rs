//! Pairs of two streams by nearest time.
//!
//! Each stream of a file has a reader of its own, so their order in the file does not matter, and memory holds one item of
//! the first stream and two of the second. A live stream ends its items for now where it would have to wait too long.

use crate::rgbd_source::MAX_COLOR_GAP_NS;

/// Items around a time, of a stream whose times ascend.
#[derive(Debug)]
pub(super) struct NearestItem<T> {
    /// Latest item at or before the time asked for.
    before: Option<(u64, T)>,
    /// First item after it.
    after: Option<(u64, T)>,
}

impl<T> NearestItem<T> {
    pub(super) fn new() -> Self {
        Self {
            before: None,
            after: None,
        }
    }

    /// The item that pairs with time `at`: the nearest one within [`MAX_COLOR_GAP_NS`], unless a neighbour of `at` in its own
    /// stream is nearer to it. `next` yields items in order, `None` where there is none now; it is told how far the nearest
    /// item so far is from `at`, nanoseconds.
    ///
    /// # Errors
    /// Those of `next`.
    pub(super) fn pair<E>(
        &mut self,
        at: u64,
        neighbours: [Option<u64>; 2],
        mut next: impl FnMut(Option<u64>) -> Result<Option<(u64, T)>, E>,
    ) -> Result<Option<&T>, E> {
        while self.after.as_ref().is_none_or(|(t, _)| *t <= at) {
            if let Some(passed) = self.after.take() {
                self.before = Some(passed);
            }
            let gap = self.before.as_ref().map(|(t, _)| t.abs_diff(at));
            match next(gap)? {
                Some(item) => self.after = Some(item),
                None => break,
            }
        }
        let nearest = self.nearest(at);
        Ok(nearest.and_then(|(t, item)| {
            let gap = t.abs_diff(at);
            let is_taken = neighbours
                .into_iter()
                .flatten()
                .any(|n| n.abs_diff(*t) < gap);
            (gap <= MAX_COLOR_GAP_NS && !is_taken).then_some(item)
        }))
    }

    fn nearest(&self, at: u64) -> Option<&(u64, T)> {
        let around = [&self.before, &self.after].into_iter().flatten();
        around.min_by_key(|(t, _)| t.abs_diff(at))
    }

    /// Time of the nearest item less `at`, nanoseconds; `None` without one.
    pub(super) fn offset(&self, at: u64) -> Option<i64> {
        let (t, _) = self.nearest(at)?;
        let gap = i64::try_from(t.abs_diff(at)).unwrap_or(i64::MAX);
        Some(if *t < at { -gap } else { gap })
    }

    /// Forgets items further than `gap` nanoseconds from `at`: those of a clock that has jumped.
    pub(super) fn forget_beyond(&mut self, at: u64, gap: u64) {
        for slot in [&mut self.before, &mut self.after] {
            slot.take_if(|(t, _)| t.abs_diff(at) > gap);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const MS: u64 = 1_000_000;

    /// Colour time of each depth time.
    fn pairs(depth: &[u64], color: &[u64]) -> Vec<Option<u64>> {
        let mut colors = color.iter().copied();
        let mut nearest = NearestItem::new();
        let mut out = Vec::new();
        for (i, &at) in depth.iter().enumerate() {
            let neighbour = |k: Option<usize>| k.and_then(|k| depth.get(k).copied());
            let neighbours = [neighbour(i.checked_sub(1)), neighbour(Some(i + 1))];
            let next = |_| Ok::<_, ()>(colors.next().map(|t| (t, t)));
            out.push(
                nearest
                    .pair(at, neighbours, next)
                    .expect("no errors")
                    .copied(),
            );
        }
        out
    }

    #[test]
    fn the_nearest_color_pairs_also_when_it_is_later() {
        let depth = [0, 33, 66, 99].map(|t| t * MS);
        let color = [10, 43, 60, 70].map(|t| t * MS);
        let want = [Some(10), Some(43), Some(70), None].map(|t| t.map(|t: u64| t * MS));
        assert_eq!(pairs(&depth, &color), want);
        assert_eq!(pairs(&depth, &[]), [None; 4]);
        let far = pairs(&[0, 1000 * MS], &[500 * MS]);
        assert_eq!(far, [None, None]);
    }

    #[test]
    fn a_missing_color_is_not_replaced_by_its_neighbours() {
        let depth = [0, 33, 66, 99].map(|t| t * MS);
        let color = [0, 33, 99].map(|t| t * MS);
        let want = [Some(0), Some(33 * MS), None, Some(99 * MS)];
        assert_eq!(pairs(&depth, &color), want);
    }

    proptest! {
        #[test]
        fn pairs_are_those_of_a_full_search(
            mut depth in prop::collection::vec(0u64..400, 0..20),
            mut color in prop::collection::vec(0u64..400, 0..20),
        ) {
            depth.sort_unstable();
            depth.dedup();
            color.sort_unstable();
            let (depth, color): (Vec<u64>, Vec<u64>) =
                (depth.iter().map(|t| t * MS).collect(), color.iter().map(|t| t * MS).collect());
            for (at, got) in depth.iter().zip(pairs(&depth, &color)) {
                let gap = color.iter().map(|c| c.abs_diff(*at)).min();
                if let Some(c) = got {
                    prop_assert_eq!(Some(c.abs_diff(*at)), gap);
                    prop_assert!(depth.iter().all(|d| d.abs_diff(c) >= c.abs_diff(*at)));
                    prop_assert!(c.abs_diff(*at) <= MAX_COLOR_GAP_NS);
                } else if let Some(gap) = gap.filter(|g| *g <= MAX_COLOR_GAP_NS) {
                    // Every nearest colour is nearer to another depth.
                    let mut nearest = color.iter().filter(|c| c.abs_diff(*at) == gap);
                    prop_assert!(nearest.any(|c| depth.iter().any(|d| d.abs_diff(*c) < gap)));
                }
            }
        }
    }
}

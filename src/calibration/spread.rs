//! A sample of a stream, spread evenly over it.

/// At most a number of items, every n-th of those seen.
#[derive(Clone, Debug)]
pub(crate) struct SpreadSample<T> {
    most: usize,
    stride: usize,
    seen: usize,
    items: Vec<T>,
}

impl<T> SpreadSample<T> {
    pub(crate) fn new(most: usize) -> Self {
        Self {
            most: most.max(2),
            stride: 1,
            seen: 0,
            items: Vec::new(),
        }
    }

    /// Counts an item and takes it if its turn has come.
    pub(crate) fn push_with(&mut self, make: impl FnOnce() -> T) {
        if self.items.len() == self.most {
            let mut at = 0;
            self.items.retain(|_| {
                at += 1;
                at % 2 == 1
            });
            self.stride *= 2;
        }
        if self.seen.is_multiple_of(self.stride) {
            self.items.push(make());
        }
        self.seen += 1;
    }

    /// Items seen.
    pub(crate) fn seen(&self) -> usize {
        self.seen
    }

    pub(crate) fn items(&self) -> &[T] {
        &self.items
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn items_are_spread_over_all() {
        for total in [3, 8, 9, 100, 1000] {
            let mut sample = SpreadSample::new(8);
            (0..total).for_each(|i| sample.push_with(|| i));
            let items = sample.items();
            assert_eq!(sample.seen(), total);
            assert!(items.len() >= total.min(4) && items.len() <= 8, "{items:?}");
            let steps: Vec<usize> = items.windows(2).map(|w| w[1] - w[0]).collect();
            assert!(steps.windows(2).all(|w| w[0] == w[1]), "{items:?}");
            assert!(2 * items.len() * steps.first().map_or(1, |s| *s) >= total);
        }
    }
}

//! Disjoint sets of vertex numbers; the smallest member is the root of its set.

/// Union–find with path halving.
pub(super) struct UnionFind(Vec<u32>);

impl UnionFind {
    /// `n` sets of one member.
    pub(super) fn new(n: usize) -> Self {
        Self((0..n as u32).collect())
    }
    /// Smallest member of the set of `i`.
    pub(super) fn root(&mut self, mut i: u32) -> u32 {
        while self.0[i as usize] != i {
            self.0[i as usize] = self.0[self.0[i as usize] as usize];
            i = self.0[i as usize];
        }
        i
    }
    /// Joins the sets of `a` and `b`.
    pub(super) fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
    /// Consecutive numbers of the sets, in the order of their first members; shape `[n]`. Also their count.
    pub(super) fn number(&mut self) -> (Vec<u32>, usize) {
        let mut label = vec![u32::MAX; self.0.len()];
        let mut next = 0;
        let numbers = (0..self.0.len() as u32).map(|i| {
            let r = self.root(i) as usize;
            if label[r] == u32::MAX {
                label[r] = next;
                next += 1;
            }
            label[r]
        });
        let numbers = numbers.collect();
        (numbers, next as usize)
    }
}

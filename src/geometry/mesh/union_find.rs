//! Disjoint sets of vertex numbers; the smallest member is the root of its set.

/// Union–find with path halving.
#[derive(Clone, Debug)]
pub struct UnionFind(Vec<u32>);

impl UnionFind {
    /// `n` sets of one member.
    pub fn new(n: usize) -> Self {
        Self((0..n as u32).collect())
    }
    /// Smallest member of the set of `i`.
    pub fn root(&mut self, mut i: u32) -> u32 {
        while self.0[i as usize] != i {
            self.0[i as usize] = self.0[self.0[i as usize] as usize];
            i = self.0[i as usize];
        }
        i
    }
    /// Joins the sets of `a` and `b`.
    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
    /// Consecutive numbers of the sets, in the order of their first members; shape `[n]`. Also their count.
    pub fn number(&mut self) -> (Vec<u32>, usize) {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smallest_members_are_roots_and_sets_are_numbered_in_their_order() {
        let mut sets = UnionFind::new(6);
        for [a, b] in [[5, 3], [3, 1], [4, 2], [1, 5], [2, 2]] {
            sets.join(a, b);
        }
        assert_eq!([5, 3, 1].map(|i| sets.root(i)), [1; 3]);
        assert_eq!(sets.number(), (vec![0, 1, 2, 1, 2, 1], 3));
        assert_eq!(UnionFind::new(0).number(), (vec![], 0));
    }
}

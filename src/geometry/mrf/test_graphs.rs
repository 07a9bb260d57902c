//! Random graphs for the tests of this module.

/// SplitMix64 generator.
pub(super) struct TestRandom(pub(super) u64);

impl TestRandom {
    /// Integer in 0..`bound`.
    pub(super) fn below(&mut self, bound: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) % bound as u64) as usize
    }
}

/// Random edges without self-loops, parallel ones included. A graph of one node has none.
pub(super) fn random_edges(random: &mut TestRandom, nodes: usize, edges: usize) -> Vec<[u32; 2]> {
    if nodes < 2 {
        return Vec::new();
    }
    let mut edge = || {
        let a = random.below(nodes);
        let b = (a + 1 + random.below(nodes - 1)) % nodes;
        [a as u32, b as u32]
    };
    (0..edges).map(|_| edge()).collect()
}

//! Random numbers of the stages of a scan.

use rand::{Rng, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

/// Random numbers of one stage of one scan.
#[derive(Clone, Copy, Debug)]
pub(super) struct ScanSeed {
    /// Seed of the scene.
    pub(super) scene: u64,
    /// Number of the scan.
    pub(super) scan: u64,
}

impl ScanSeed {
    /// Generator of a stage: each stage has its own, so that settings of one leave the others alone.
    pub(super) fn stage(self, stage: u64) -> Pcg64 {
        let mixed = self.scene.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        Pcg64::seed_from_u64(mixed ^ (self.scan << 8) ^ stage)
    }
}

/// Normally distributed number.
pub(super) fn gauss(rng: &mut impl Rng, deviation: f64) -> f32 {
    let x: f64 = StandardNormal.sample(rng);
    (x * deviation) as f32
}

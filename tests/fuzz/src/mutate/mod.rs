//! Mutations of bundles, by the kind of each member.

mod bytes;
mod message;
mod text;

use crate::bundle::{Bundle, Member};
use rand::Rng;
use rand::seq::IndexedRandom;
use rand_pcg::Pcg64Mcg;

/// Source of randomness and of material.
#[derive(Debug)]
pub struct Mutator<'a> {
    /// Generator.
    pub rng: Pcg64Mcg,
    /// Tokens of the format.
    pub words: &'a [&'a str],
    /// Longest member, bytes.
    pub longest: usize,
}

/// Most mutations of one input.
const MOST: u32 = 6;
/// Share of inputs that are mutated as plain bytes, whatever they are.
const PLAIN: f64 = 0.15;
/// Share of inputs that lose a member.
const LOSSES: f64 = 0.03;

impl Mutator<'_> {
    /// Changes `bundle` a little; `donor` gives pieces.
    pub fn mutate(&mut self, bundle: &mut Bundle, donor: &Bundle) {
        if bundle.0.len() > 1 && self.rng.random_bool(LOSSES) {
            let lost = self.rng.random_range(0..bundle.0.len());
            bundle.0.remove(lost);
        }
        // One mutation is most often what a decoder does not expect; many find what needs two at a time.
        let times = 1 + self.rng.random_range(0..MOST) * u32::from(self.rng.random_bool(0.5));
        for _ in 0..times {
            let i = self.rng.random_range(0..bundle.0.len());
            let piece = donor.0.choose(&mut self.rng).map_or(&[][..], |m| &m.bytes);
            self.member(&mut bundle.0[i], piece);
            bundle.0[i].bytes.truncate(self.longest);
        }
    }

    fn member(&mut self, member: &mut Member, donor: &[u8]) {
        if self.rng.random_bool(PLAIN) {
            return self.bytes(&mut member.bytes, donor);
        }
        let extension = member.name.rsplit('.').next().unwrap_or_default();
        match extension {
            "pb" => self.message(&mut member.bytes, donor),
            "bin" | "npy" | "png" | "jpg" | "jpeg" | "tdz" | "npz" | "glb" | "mcap" | "gz"
            | "bag" | "db3" | "mkv" | "r3d" | "depth" => self.bytes(&mut member.bytes, donor),
            _ => self.text(&mut member.bytes, donor),
        }
    }

    fn index(&mut self, length: usize) -> usize {
        self.rng.random_range(0..length.max(1))
    }

    /// A range within `length`, mostly short.
    fn range(&mut self, length: usize) -> std::ops::Range<usize> {
        let start = self.index(length);
        let rest = length.saturating_sub(start);
        let most = if self.rng.random_bool(0.8) { 16 } else { 4096 };
        start..start + self.index(rest.min(most) + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn every_kind_changes_and_stays_within_its_length() {
        let mut m = Mutator {
            rng: Pcg64Mcg::seed_from_u64(1),
            words: &["token"],
            longest: 1000,
        };
        for name in ["a.pb", "a.json", "a.png", "a.bin", "a.obj"] {
            let seed = Bundle::of(name, *br#"{"a":[1,2,{"b":"c"}]}"#);
            let mut changed = 0;
            for _ in 0..500 {
                let mut b = seed.clone();
                m.mutate(&mut b, &seed);
                changed += usize::from(b != seed);
                assert!(b.size() <= 1000, "{name}");
            }
            assert!(changed > 300, "{name}: {changed}");
        }
    }
}

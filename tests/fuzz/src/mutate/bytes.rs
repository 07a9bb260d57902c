//! Mutations of plain bytes.

use super::Mutator;
use rand::Rng;
use rand::seq::IndexedRandom;

/// Integers at which sizes, offsets and signs break.
#[rustfmt::skip]
const INTEGERS: [u64; 18] = [
    0, 1, 2, 0x7f, 0x80, 0xff, 0x100, 0x7fff, 0xffff, 0x1_0000, 0x7fff_ffff, 0x8000_0000,
    0xffff_fffe, 0xffff_ffff, 0x1_0000_0000, 0x7fff_ffff_ffff_ffff, 0x8000_0000_0000_0000,
    u64::MAX,
];

/// Numbers at which arithmetic breaks.
#[rustfmt::skip]
const REALS: [f64; 12] = [
    0.0, -0.0, 1.0, -1.0, 1e-320, 1e-30, 1e30, -1e30, f64::MAX, f64::INFINITY, f64::NEG_INFINITY,
    f64::NAN,
];

impl Mutator<'_> {
    pub(super) fn bytes(&mut self, b: &mut Vec<u8>, donor: &[u8]) {
        match self.rng.random_range(0..10) {
            0..=1 => self.flip(b),
            2..=3 => self.overwrite_number(b),
            4 => {
                let range = self.range(b.len());
                b.drain(range);
            }
            5 => {
                let range = self.range(b.len());
                let piece = b[range].to_vec();
                self.insert(b, &piece);
            }
            6 => {
                let piece = donor.get(self.range(donor.len())).unwrap_or_default();
                self.insert(b, piece);
            }
            7 => {
                let n = self.rng.random_range(1..8);
                let noise: Vec<u8> = (0..n).map(|_| self.rng.random()).collect();
                self.insert(b, &noise);
            }
            8 => {
                let word = self.words.choose(&mut self.rng).copied().unwrap_or("\0");
                self.insert(b, word.as_bytes());
            }
            _ => b.truncate(self.index(b.len())),
        }
    }

    fn flip(&mut self, b: &mut [u8]) {
        let (at, bit) = (self.index(b.len()), self.rng.random_range(0..8));
        if let Some(byte) = b.get_mut(at) {
            *byte ^= 1 << bit;
        }
    }

    /// Puts a number of 1 to 8 bytes over the bytes at some place, or adds a little to the one that is there.
    fn overwrite_number(&mut self, b: &mut [u8]) {
        let width = [1, 2, 4, 8][self.rng.random_range(0..4)];
        let at = self.index(b.len().saturating_sub(width - 1));
        let Some(place) = b.get_mut(at..at + width) else {
            return;
        };
        let bytes = match self.rng.random_range(0..5) {
            0 => self.integer().to_be_bytes()[8 - width..].to_vec(),
            1 if width == 8 => self.real().to_le_bytes().to_vec(),
            1 if width == 4 => (self.real() as f32).to_le_bytes().to_vec(),
            2 => {
                let step: i8 = self.rng.random();
                place[0] = place[0].wrapping_add(step as u8);
                return;
            }
            _ => self.integer().to_le_bytes()[..width].to_vec(),
        };
        place.copy_from_slice(&bytes);
    }

    pub(super) fn integer(&mut self) -> u64 {
        let n = INTEGERS[self.rng.random_range(0..INTEGERS.len())];
        n.wrapping_add(self.rng.random_range(0..3)).wrapping_sub(1)
    }

    pub(super) fn real(&mut self) -> f64 {
        REALS[self.rng.random_range(0..REALS.len())]
    }

    pub(super) fn insert(&mut self, b: &mut Vec<u8>, piece: &[u8]) {
        let at = self.index(b.len() + 1);
        b.splice(at..at, piece.iter().copied());
    }
}

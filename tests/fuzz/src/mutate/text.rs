//! Mutations of text: lines, words and numbers.

use super::Mutator;
use rand::Rng;
use rand::seq::IndexedRandom;

/// Numbers that parsers, casts and sums break at.
#[rustfmt::skip]
const NUMBERS: [&str; 24] = [
    "0", "1", "-1", "2", "-0", "0.5", "1e-320", "1e9", "1e30", "-1e30", "1e308", "1e999", "NaN",
    "inf", "-inf", "255", "256", "65536", "2147483648", "4294967295", "4294967296",
    "9223372036854775808", "18446744073709551615", "99999999999999999999",
];

impl Mutator<'_> {
    pub(super) fn text(&mut self, b: &mut Vec<u8>, donor: &[u8]) {
        let Ok(text) = std::str::from_utf8(b) else {
            return self.bytes(b, donor);
        };
        let text = match self.rng.random_range(0..5) {
            0..=2 => self.words_of(text),
            _ => self.lines_of(text, &String::from_utf8_lossy(donor)),
        };
        *b = text.into_bytes();
    }

    /// Replaces, deletes or adds one word.
    fn words_of(&mut self, text: &str) -> String {
        let at = self.index(text.len());
        let is_gap = |c: char| c.is_whitespace() || "{}[](),:;/=\"".contains(c);
        let Some(at) = (0..=at).rev().find(|&i| text.is_char_boundary(i)) else {
            return text.into();
        };
        let start = text[..at].rfind(is_gap).map_or(0, |i| {
            i + text[i..].chars().next().map_or(1, char::len_utf8)
        });
        let end = text[at..]
            .find(is_gap)
            .map_or(text.len(), |i| at + i)
            .max(start);
        let old = &text[start..end];
        let word = self.word(text);
        let new = match self.rng.random_range(0..8) {
            0 => String::new(),
            1 => format!("{old} {word}"),
            2 => format!("{word} {old}"),
            3 => format!("-{old}"),
            _ => word,
        };
        format!("{}{new}{}", &text[..start], &text[end..])
    }

    /// A number, a token of the format, or a word of the text.
    fn word(&mut self, text: &str) -> String {
        match self.rng.random_range(0..4) {
            0..=1 => NUMBERS[self.rng.random_range(0..NUMBERS.len())].into(),
            2 => self
                .words
                .choose(&mut self.rng)
                .copied()
                .unwrap_or("x")
                .into(),
            _ => {
                let words: Vec<&str> = text.split_whitespace().take(200).collect();
                words.choose(&mut self.rng).copied().unwrap_or("x").into()
            }
        }
    }

    /// Deletes, repeats, exchanges or borrows a line, or cuts the text.
    fn lines_of(&mut self, text: &str, donor: &str) -> String {
        let mut lines: Vec<&str> = text.split('\n').collect();
        let (i, j) = (self.index(lines.len()), self.index(lines.len()));
        let strange: Vec<&str> = donor.split('\n').take(500).collect();
        match self.rng.random_range(0..6) {
            0 => {
                lines.remove(i);
            }
            1 => lines.insert(j, lines[i]),
            2 => {
                let times = self.rng.random_range(2..40);
                lines.splice(i..i, std::iter::repeat_n(lines[j], times));
            }
            3 => lines.swap(i, j),
            4 => lines.insert(
                i,
                strange.choose(&mut self.rng).copied().unwrap_or_default(),
            ),
            _ => lines.truncate(i + 1),
        }
        lines.join("\n")
    }
}

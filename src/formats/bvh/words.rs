//! Words of a BVH file with their lines.

use crate::FormatError;
use std::iter::Peekable;
use std::path::Path;

type WordIter<'a> = Box<dyn Iterator<Item = (usize, &'a str)> + 'a>;

/// Words in the file's order; braces are words by themselves.
pub(super) struct Words<'a> {
    path: &'a Path,
    words: Peekable<WordIter<'a>>,
    line: usize,
}

/// Splits at white space and around braces.
fn split(line: &str) -> impl Iterator<Item = &str> {
    line.split_whitespace()
        .flat_map(|word| word.split_inclusive(['{', '}']))
        .flat_map(|word| {
            let at = word.len() - usize::from(word.ends_with(['{', '}']));
            let (before, brace) = word.split_at(at);
            [before, brace].into_iter().filter(|w| !w.is_empty())
        })
}

impl<'a> Words<'a> {
    /// Words of a text; `path` is named in errors.
    pub(super) fn new(text: &'a str, path: &'a Path) -> Self {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        // Old Macs end lines with a carriage return alone.
        let lines = text.split(['\n', '\r']).enumerate();
        let per_line = 1 + usize::from(text.contains("\r\n"));
        let words: WordIter<'a> = Box::new(
            lines.flat_map(move |(n, line)| split(line).map(move |w| (n / per_line + 1, w))),
        );
        Self {
            path,
            words: words.peekable(),
            line: 1,
        }
    }
    pub(super) fn fault(&self, why: impl Into<String>) -> FormatError {
        FormatError::field(self.path, format!("line {}", self.line), why)
    }
    pub(super) fn is_at_end(&mut self) -> bool {
        self.words.peek().is_none()
    }
    /// Next word, without taking it.
    pub(super) fn peek(&mut self) -> Option<&'a str> {
        self.words.peek().map(|w| w.1)
    }
    pub(super) fn next(&mut self, what: &str) -> Result<&'a str, FormatError> {
        match self.words.next() {
            Some((line, word)) => {
                self.line = line;
                Ok(word)
            }
            None => Err(self.fault(format!("the file ends where {what} should be"))),
        }
    }
    pub(super) fn require(&mut self, word: &str) -> Result<(), FormatError> {
        let got = self.next(&format!("`{word}`"))?;
        if got.eq_ignore_ascii_case(word) {
            Ok(())
        } else {
            Err(self.fault(format!("`{got}`, expected `{word}`")))
        }
    }
    /// The words up to a brace, as one name: names may have spaces.
    pub(super) fn name(&mut self, what: &str) -> Result<String, FormatError> {
        let mut out = String::new();
        while self.peek() != Some("{") {
            if !out.is_empty() {
                out.push(' ');
            }
            out.push_str(self.next(what)?);
        }
        Ok(out)
    }
    /// A key of one or two words that ends in a colon, with or without spaces around it: `Frames:`, `Frame Time :0.03`.
    /// Returns what follows the colon in its own word, if anything.
    pub(super) fn key(&mut self, key: &str) -> Result<Option<&'a str>, FormatError> {
        let mut got = String::new();
        loop {
            let word = self.next(&format!("`{key}:`"))?;
            let (name, rest) = word
                .split_once(':')
                .map_or((word, None), |(n, r)| (n, Some(r)));
            if !got.is_empty() && !name.is_empty() {
                got.push(' ');
            }
            got.push_str(name);
            // A colon may be missing before the number.
            let is_key = got.eq_ignore_ascii_case(key);
            if let Some(rest) = rest {
                return match is_key {
                    true => Ok(Some(rest).filter(|r| !r.is_empty())),
                    false => Err(self.fault(format!("`{got}:`, expected `{key}:`"))),
                };
            }
            let begins = key
                .get(..got.len())
                .is_some_and(|k| k.eq_ignore_ascii_case(&got));
            if !begins {
                return Err(self.fault(format!("`{got}`, expected `{key}:`")));
            }
            if is_key && self.peek().is_none_or(|w| !w.starts_with(':')) {
                return Ok(None);
            }
        }
    }
    /// A word as a finite number.
    pub(super) fn to_number(&self, word: &str, what: &str) -> Result<f64, FormatError> {
        let value = word.parse::<f64>().ok().filter(|v| v.is_finite());
        value.ok_or_else(|| self.fault(format!("{what}: `{word}` is no finite number")))
    }
    pub(super) fn number(&mut self, what: &str) -> Result<f64, FormatError> {
        let word = self.next(what)?;
        self.to_number(word, what)
    }
    /// A word as a count.
    pub(super) fn to_count(&self, word: &str, what: &str) -> Result<usize, FormatError> {
        word.parse()
            .map_err(|_| self.fault(format!("{what}: `{word}` is no count")))
    }
    pub(super) fn count(&mut self, what: &str) -> Result<usize, FormatError> {
        let word = self.next(what)?;
        self.to_count(word, what)
    }
}

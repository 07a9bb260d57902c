//! Text of OBJ files as editors and exporters write it: ends of lines, continued lines.

use std::borrow::Cow;

/// Lines with their numbers from 1, without comments. They end with LF, CR or CR LF; one that ends with a backslash goes on in
/// the next one.
pub(super) fn lines(text: &str) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let mut rest = text;
    let mut number = 0;
    std::iter::from_fn(move || {
        if rest.is_empty() {
            return None;
        }
        number += 1;
        let first = number;
        let mut line = Cow::Borrowed(next_line(&mut rest));
        while let Some(start) = line.trim_end().strip_suffix('\\') {
            if rest.is_empty() {
                line = Cow::Owned(start.to_owned());
                break;
            }
            number += 1;
            line = Cow::Owned(format!("{start} {}", next_line(&mut rest)));
        }
        Some((first, line))
    })
}

/// Splits the first line off, without its end and its comment: from a `#` at its start or after a blank, as names have some.
fn next_line<'t>(rest: &mut &'t str) -> &'t str {
    let end = rest.find(['\n', '\r']).unwrap_or(rest.len());
    let (line, after) = rest.split_at(end);
    let after = after.strip_prefix("\r\n").or(after.get(1..));
    *rest = after.unwrap_or_default();
    let is_comment = |at: usize| {
        line[..at]
            .chars()
            .next_back()
            .is_none_or(char::is_whitespace)
    };
    let comment = line.match_indices('#').find(|(at, _)| is_comment(*at));
    comment.map_or(line, |(at, _)| &line[..at])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_end_and_go_on_in_every_way() {
        let all = |text: &str| -> Vec<(usize, String)> {
            lines(text).map(|(n, l)| (n, l.trim().to_owned())).collect()
        };
        for text in ["a\nb\n\nc", "a\rb\r\rc\r", "a\r\nb\r\n\r\nc\r\n"] {
            let wanted = [(1, "a"), (2, "b"), (3, ""), (4, "c")].map(|(n, l)| (n, l.to_owned()));
            assert_eq!(all(text), wanted, "{text:?}");
        }
        assert_eq!(
            all("f 1 \\\n2 \\ \r\n3\nb"),
            [(1, "f 1  2  3".to_owned()), (4, "b".into())]
        );
        assert_eq!(all("f 1 \\"), [(1, "f 1".to_owned())]);
        assert_eq!(
            all("# a \\\nv 1 # b\n"),
            [(1, String::new()), (2, "v 1".into())]
        );
        assert_eq!(
            all("usemtl cloth#1 # red"),
            [(1, "usemtl cloth#1".to_owned())]
        );
    }
}

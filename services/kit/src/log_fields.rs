//! Fields of a log line without control characters: names from outside neither forge lines nor steer a terminal.

use std::fmt;
use tracing_subscriber::field::RecordFields;
use tracing_subscriber::fmt::FormatFields;
use tracing_subscriber::fmt::format::{DefaultFields, Writer};

/// Fields and message as tracing formats them, each control character escaped as in a Rust literal: `\n`, `\u{1b}`.
#[derive(Debug, Default)]
pub(crate) struct EscapedFields(DefaultFields);

impl<'w> FormatFields<'w> for EscapedFields {
    fn format_fields<R: RecordFields>(&self, mut writer: Writer<'w>, fields: R) -> fmt::Result {
        let mut plain = String::new();
        self.0.format_fields(Writer::new(&mut plain), fields)?;
        for c in plain.chars() {
            if c.is_control() {
                write!(writer, "{}", c.escape_default())?;
            } else {
                writer.write_char(c)?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io;
    use std::sync::{Arc, Mutex, PoisonError};

    #[derive(Clone, Default)]
    struct Sink(Arc<Mutex<Vec<u8>>>);

    impl io::Write for Sink {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            all.extend_from_slice(bytes);
            Ok(bytes.len())
        }
        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_name_with_control_characters_stays_one_line() {
        let sink = Sink::default();
        let out = sink.clone();
        let subscriber = tracing_subscriber::fmt()
            .fmt_fields(EscapedFields::default())
            .with_ansi(false)
            .with_writer(move || out.clone())
            .finish();
        let name = "a\n2026 ERROR forged\r\x1b[2J\u{9b}K\t.obj";
        tracing::subscriber::with_default(subscriber, || {
            let span = tracing::info_span!("garment", %name);
            let _inside = span.enter();
            tracing::warn!(file = %name, why = ?name, "{name} is left out");
        });
        let said = sink.0.lock().expect("not poisoned").clone();
        let said = String::from_utf8(said).expect("UTF-8");
        let line = said.strip_suffix('\n').expect("one line");
        assert!(!line.contains(char::is_control), "{line:?}");
        assert_eq!(line.matches("\\n2026 ERROR forged\\r").count(), 4, "{line}");
    }
}

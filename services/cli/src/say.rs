//! Lines of commands that serve.

use std::fmt::Arguments;
use std::io::{self, Write};

/// Writes a line of a command that serves. A reader of standard output that has gone, as in `tryon up | head -1`, stops no
/// service.
pub(crate) fn say(line: Arguments<'_>) {
    let _: io::Result<()> = writeln!(io::stdout(), "{line}");
}

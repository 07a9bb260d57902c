//! Progress bar over the runs of a measurement.

use indicatif::{ProgressBar, ProgressStyle};
use std::time::Duration;

/// Progress bar over runs; silent when standard error is no terminal.
pub(crate) fn progress(runs: Option<u64>, what: &'static str) -> ProgressBar {
    let (bar, template) = match runs {
        Some(n) => (
            ProgressBar::new(n),
            "{prefix} {bar:32} {pos}/{len} runs, {per_sec}, {eta} left {msg}",
        ),
        None => (
            ProgressBar::new_spinner(),
            "{prefix} {spinner} {pos} runs, {per_sec} {msg}",
        ),
    };
    let style =
        ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = bar.with_style(style).with_prefix(what);
    // Shown before the first one is done, which takes longest.
    bar.enable_steady_tick(Duration::from_secs(1));
    bar
}

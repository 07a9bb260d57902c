//! Progress bar of a simulation: steps of its drape, then frames with the time left.

use indicatif::{HumanDuration, ProgressBar, ProgressStyle};
use std::time::Duration;
use tryon_proto::v1::FollowSimulationResponse;

/// Bar of a drape, whose number of steps is not known.
const DRAPE: &str = "draping {spinner} {pos} steps {msg}";
/// Bar of frames whose number is not known.
const RECORDING: &str = "simulating {spinner} {pos} frames {msg}";
/// Bar of frames whose number is known.
const FRAMES: &str = "simulating {bar:32} {pos}/{len} frames {msg}";

/// Bar on standard error; silent when that is no terminal. It goes with its value.
#[derive(Debug)]
pub(super) struct FineProgress {
    bar: ProgressBar,
    template: &'static str,
    /// Motion of a vertex in the last step of the drape (m), while it is not at rest.
    moving: Option<f32>,
}

impl FineProgress {
    /// Before the first message.
    pub(super) fn new() -> Self {
        let bar = ProgressBar::new_spinner();
        bar.enable_steady_tick(Duration::from_secs(1));
        let mut progress = Self {
            bar,
            template: "",
            moving: None,
        };
        progress.switch(DRAPE);
        progress
    }

    /// Shows the step or frame of a message.
    pub(super) fn show(&mut self, message: &FollowSimulationResponse) {
        if message.positions.is_empty() {
            if let Some(step) = &message.drape {
                let moved = step.motion * 1e3;
                let text = format!("{} vertices, moved {moved:.1} mm", step.vertex_count);
                self.bar.set_message(text);
                self.bar.inc(1);
                self.moving = (!step.settled).then_some(step.motion);
            }
            return;
        }
        if let Some(motion) = self.moving.take() {
            let moved = motion * 1e3;
            let text =
                format!("tryon: the cloth is not at rest: a vertex moves {moved:.1} mm in a step");
            self.bar.suspend(|| eprintln!("{text}"));
        }
        if message.frame_count > 0 {
            self.bar.set_length(u64::from(message.frame_count));
            self.switch(FRAMES);
        } else {
            self.switch(RECORDING);
        }
        self.bar.set_position(u64::from(message.frame) + 1);
        self.bar.set_message(time_left(message.seconds_left));
    }

    fn switch(&mut self, template: &'static str) {
        if self.template != template {
            let style = ProgressStyle::with_template(template);
            self.bar
                .set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
            self.template = template;
        }
    }
}

impl Drop for FineProgress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// Time left, in words; empty where it is not known.
fn time_left(seconds: f32) -> String {
    match Duration::try_from_secs_f32(seconds) {
        Ok(left) if !left.is_zero() => format!("{} left", HumanDuration(left)),
        _ => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_that_is_not_known_is_not_shown() {
        assert_eq!(time_left(90.0), "2 minutes left");
        for unknown in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            assert_eq!(time_left(unknown), "");
        }
    }
}

//! `tryon camera view`: a camera live in the terminal, or as a picture.

use super::frames::{ArrivedFrame, Frames, ensure_frames};
use crate::args::CameraViewArgs;
use crate::depth_picture::{DepthColorSettings, beside, depth_colors};
use crate::terminal_picture::{Style, picture};
use anyhow::{Context, Result};
use std::io::{IsTerminal, Write, stdout};
use std::path::Path;
use std::process::ExitCode;
use std::time::{Duration, Instant};
use tryon::formats::image::write_png_rgb;
use tryon::geometry::camera::RgbdFrame;
use tryon::inspection::{DepthHistogram, FrameTimes, HoleShares, InspectionSettings};

/// Width of the picture in the terminal, characters.
const COLUMNS: usize = 64;
/// Time between two pictures in a terminal.
const REDRAW: Duration = Duration::from_millis(100);
/// Time between two lines where standard output is no terminal, by the frames' clock (s).
const LINE_EVERY: f64 = 1.0;
/// Frames over which the rate is measured.
const RATE_FRAMES: usize = 60;
/// Time before a picture of a camera is taken, in which its exposure settles (s).
const SETTLE: f64 = 1.0;

/// Runs the command.
///
/// # Errors
/// A source that cannot be opened or gives no frame, a picture that cannot be written.
pub(super) fn run(args: &CameraViewArgs) -> Result<ExitCode> {
    let seconds = args.seconds.or(args.out.is_some().then_some(SETTLE));
    let mut frames = Frames::open(&args.from, seconds)?;
    let mut view = View::new(args.out.is_none());
    let mut last = None;
    while let Some(next) = frames.next()? {
        if view.is_drawn && stdout().is_terminal() && !frames.is_live() {
            view.wait_for(&next.frame);
        }
        view.show(&next)?;
        last = Some(next.frame);
    }
    let last = ensure_frames(&args.from.source, last)?;
    view.end(&last)?;
    if let Some(path) = &args.out {
        write_picture(path, &last)?;
        println!("{}", path.display());
    }
    Ok(ExitCode::SUCCESS)
}

/// Writes depth in colours beside the colour image, or alone without one.
fn write_picture(path: &Path, frame: &RgbdFrame) -> Result<()> {
    let settings = DepthColorSettings::default();
    let depth = depth_colors(&frame.depth, &settings);
    let picture = match &frame.color {
        Some(color) => beside(&depth, color, settings.line),
        None => depth,
    };
    write_png_rgb(path, &picture).with_context(|| format!("cannot write {}", path.display()))
}

/// Display in the terminal.
struct View {
    /// Pictures are drawn, not just counted.
    is_drawn: bool,
    style: Style,
    begun: Instant,
    /// Capture time of the first frame (ns).
    first_ns: Option<u64>,
    drawn: Option<Instant>,
    /// Time of the last line by the frames' clock (s).
    line_at: Option<f64>,
    /// Capture and arrival times of the newest frames.
    times: Vec<(u64, Option<u64>)>,
    /// Lines of the last picture, over which the next is drawn.
    lines: usize,
}

impl View {
    fn new(is_drawn: bool) -> Self {
        let has_colors = stdout().is_terminal() && std::env::var_os("NO_COLOR").is_none();
        Self {
            is_drawn,
            style: if has_colors {
                Style::HalfBlocks
            } else {
                Style::Characters
            },
            begun: Instant::now(),
            first_ns: None,
            drawn: None,
            line_at: None,
            times: Vec::new(),
            lines: 0,
        }
    }

    /// Waits for the time at which a recorded frame is due.
    #[expect(
        clippy::disallowed_methods,
        reason = "a recording is shown at its pace, in this thread"
    )]
    fn wait_for(&mut self, frame: &RgbdFrame) {
        let first = *self.first_ns.get_or_insert(frame.time_ns);
        let due = Duration::from_nanos(frame.time_ns.saturating_sub(first));
        // A gap in a recording is no reason to stand still.
        let wait = due.saturating_sub(self.begun.elapsed());
        std::thread::sleep(wait.min(Duration::from_secs(1)));
    }

    /// Shows a frame where one is due: as a picture in a terminal, else as a line.
    fn show(&mut self, next: &ArrivedFrame) -> Result<()> {
        if self.times.len() == RATE_FRAMES {
            self.times.remove(0);
        }
        self.times.push((next.frame.time_ns, next.arrival_ns));
        if !self.is_drawn {
            return Ok(());
        }
        if stdout().is_terminal() {
            if self.drawn.is_none_or(|d| d.elapsed() >= REDRAW) {
                self.drawn = Some(Instant::now());
                self.draw(&next.frame)?;
            }
            return Ok(());
        }
        let first = *self.first_ns.get_or_insert(next.frame.time_ns);
        let at = next.frame.time_ns.saturating_sub(first) as f64 * 1e-9;
        if self.line_at.is_none_or(|last| at >= last + LINE_EVERY) {
            self.line_at = Some(at);
            println!("{at:6.1} s  {}", self.line(&next.frame));
        }
        Ok(())
    }

    /// Shows the last frame where pictures are drawn.
    fn end(&mut self, last: &RgbdFrame) -> Result<()> {
        if self.is_drawn {
            self.draw(last)?;
        }
        Ok(())
    }

    fn draw(&mut self, frame: &RgbdFrame) -> Result<()> {
        let mut out = String::new();
        if self.lines > 0 && stdout().is_terminal() {
            // Up to the first line of the picture before.
            out.push_str(&format!("\x1b[{}A", self.lines));
        }
        out.push_str(&picture(&frame.depth, COLUMNS, self.style));
        out.push_str(&self.line(frame));
        // The line before may have been longer.
        out.push_str(if stdout().is_terminal() {
            "\x1b[K\n"
        } else {
            "\n"
        });
        self.lines = out.matches('\n').count();
        let mut to = stdout().lock();
        to.write_all(out.as_bytes())?;
        Ok(to.flush()?)
    }

    /// Rate, holes and nearest surface.
    fn line(&self, frame: &RgbdFrame) -> String {
        let settings = InspectionSettings::default();
        let mut times = FrameTimes::default();
        for (capture, arrival) in &self.times {
            times.add(*capture, *arrival);
        }
        let rate = if self.times.len() < 2 {
            "first frame".to_owned()
        } else {
            format!("{:4.1} frames a second", times.report(&settings).rate)
        };
        let holes = 100.0 * HoleShares::of(&frame.depth).middle;
        let mut histogram = DepthHistogram::default();
        histogram.add(&frame.depth);
        let nearest = match histogram.range(&settings) {
            Some(range) => format!("nearest {:.2} m", range.nearest),
            None => "no depth at all".into(),
        };
        format!("{rate}, {holes:.0} % holes in the middle, {nearest}")
    }
}

//! A recording, checked frame by frame and copied to MCAP or a folder. A copy that was stopped continues.

mod journal;
mod partial_copy;

use crate::input;
use crate::recording::RecordingArgs;
use anyhow::{Result, ensure};
use indicatif::ProgressBar;
use journal::Origin;
use partial_copy::PartialCopy;
use std::path::Path;
use tryon::formats::RgbdSource;

/// Frames of a recording so far.
#[derive(Clone, Copy, Debug, Default)]
struct FrameCounts {
    /// Read, bad ones included.
    read: u64,
    bad: u64,
}

/// Reads a recording to its end and writes its frames to `out`, an `.mcap` file or a folder. Bad frames are named on stderr
/// and left out.
///
/// # Errors
/// A recording without a readable frame, a copy that exists or was begun from another recording, or one that cannot be
/// written: what was written stays, and the same command continues it.
pub(super) fn convert(input: &Path, options: &RecordingArgs, out: Option<&Path>) -> Result<()> {
    let mut source = options.open(input)?;
    let origin = Origin::of(input, options)?;
    let copy = out.map(|out| PartialCopy::open(out, &origin, source.calibration()));
    let mut copy = copy.transpose()?;
    let bar = input::progress(source.len().map(|n| n as u64), "checking");
    let mut counts = FrameCounts::default();
    if let Some(copy) = &copy {
        counts = pass_over(source.as_mut(), copy, &bar)?;
    }
    copy_frames(source.as_mut(), copy.as_mut(), &mut counts, &bar)?;
    bar.finish_and_clear();

    let is_readable = counts.bad < counts.read.max(1);
    match copy {
        Some(copy) if is_readable => copy.finish()?,
        Some(copy) => copy.abandon()?,
        None => {}
    }
    let k = source.calibration().depth;
    let FrameCounts { read, bad } = counts;
    println!(
        "recording: {read} frames, {bad} of them bad, {}×{}",
        k.width, k.height
    );
    ensure!(is_readable, "{}: no frame is readable", input.display());
    Ok(())
}

/// Passes over the frames that the copy was made of.
fn pass_over(
    source: &mut dyn RgbdSource,
    copy: &PartialCopy,
    bar: &ProgressBar,
) -> Result<FrameCounts> {
    let (read, written) = (copy.read(), copy.frames());
    for _ in 0..read {
        // A bad frame was named by the run that met it.
        let is_end = source.skip_frame().is_ok_and(|is_there| !is_there);
        ensure!(!is_end, "the recording ends before its partial copy");
        bar.inc(1);
    }
    if written > 0 {
        let part = copy.path().display();
        bar.suspend(|| eprintln!("tryon: {written} frames were in {part} already: continued"));
    }
    Ok(FrameCounts {
        read,
        bad: read - written,
    })
}

fn copy_frames(
    source: &mut dyn RgbdSource,
    mut copy: Option<&mut PartialCopy>,
    counts: &mut FrameCounts,
    bar: &ProgressBar,
) -> Result<()> {
    loop {
        let frame = source.next_frame();
        counts.read += u64::from(!matches!(frame, Ok(None)));
        match frame {
            Ok(None) => return Ok(()),
            Ok(Some(frame)) => {
                if let Some(copy) = &mut copy {
                    copy.write(&frame, counts.read)?;
                }
            }
            Err(e) => {
                counts.bad += 1;
                bar.suspend(|| eprintln!("tryon: {e}"));
            }
        }
        bar.inc(1);
    }
}

//! Findings about the stream: rate, clock, noise.

use super::{BLIND, grade};
use crate::finding::{Finding, Rating};
use crate::inspector::InspectionReport;
use crate::settings::FindingLimits;

/// Frames a second, jitter, lost and unreadable frames.
pub(super) fn rate(report: &InspectionReport, limits: &FindingLimits) -> Finding {
    const WHAT: &str = "rate";
    let t = &report.timing;
    if t.frames < 2 {
        return Finding::note(WHAT, "one picture only: rate and noise are not measured");
    }
    let measured = format!(
        "{:.1} frames a second, {:.1} ms jitter",
        t.rate,
        1e3 * t.jitter
    );
    let [good, usable] = limits.rate;
    let slow = grade(-t.rate, [-good, -usable]);
    let lost = grade(t.lost, limits.lost);
    let uneven = grade(t.jitter * t.rate, limits.jitter);
    let unreadable = if report.unreadable > 0 {
        Rating::Note
    } else {
        Rating::Good
    };
    let worst = slow.max(lost).max(uneven).max(unreadable);
    let why = if unreadable == worst && unreadable != Rating::Good {
        format!(": {} frames could not be read", report.unreadable)
    } else if worst == Rating::Good {
        String::new()
    } else if slow == worst {
        ": choose a mode of 30 a second, or a USB 3 port".into()
    } else if lost == worst {
        format!(
            ", {:.0} % of them lost: give the camera a USB port of its own, without a hub or a long cable",
            100.0 * t.lost
        )
    } else {
        ": they come unevenly; close other programs, or give the camera a USB port of its own"
            .into()
    };
    Finding::new(WHAT, worst, measured + &why)
}

/// Faults of the camera's clock, and the spread of delays.
pub(super) fn clock(report: &InspectionReport) -> Finding {
    const WHAT: &str = "clock";
    let t = &report.timing;
    let faults = [
        (t.backwards, "ran backwards"),
        (t.repeated, "stood still"),
        (t.jumps, "jumped"),
    ];
    let told: Vec<String> = (faults.iter())
        .filter(|(count, _)| *count > 0)
        .map(|(count, what)| format!("{what} {count} times"))
        .collect();
    if !told.is_empty() {
        let told = told.join(", ");
        let why = format!(
            "the camera's clock {told} in {} frames: update its firmware or driver",
            t.frames
        );
        return Finding::note(WHAT, why);
    }
    Finding::good(
        WHAT,
        match t.delay_spread {
            Some(spread) => format!("runs evenly; frames arrive within {:.0} ms", 1e3 * spread),
            None => "runs evenly".into(),
        },
    )
}

/// Noise against the sensor's model.
pub(super) fn noise(report: &InspectionReport, limits: &FindingLimits) -> Finding {
    const WHAT: &str = "noise";
    if report.holes.whole > limits.blind {
        // A moving person alone would pass for noise.
        return Finding::note(WHAT, BLIND);
    }
    let Some(n) = &report.noise else {
        let why = "not measured: it needs two frames, and a wall or a person that faces the camera";
        return Finding::note(WHAT, why);
    };
    if n.sigma == 0.0 {
        let why = "the picture does not change at all from frame to frame: a still recording, or a camera that hangs";
        return Finding::note(WHAT, why);
    }
    let measured = format!(
        "{:.1} mm at {:.1} m, {:.1} times what such a sensor has",
        1e3 * n.sigma,
        n.depth,
        n.ratio
    );
    let verdict = grade(n.ratio, limits.noise);
    let remedy = match verdict {
        Rating::Good => "",
        _ => {
            ": look for sunlight, a second depth camera that shines into the picture, or a dirty window before the lens"
        }
    };
    Finding::new(WHAT, verdict, measured + remedy)
}

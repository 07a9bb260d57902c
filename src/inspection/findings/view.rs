//! Findings about the picture: holes, sunlight, the floor's surface, things too near.

use super::{BLIND, grade};
use crate::finding::{Finding, Rating};
use crate::inspector::InspectionReport;
use crate::settings::FindingLimits;

fn percent(share: f64) -> String {
    format!("{:.0} %", 100.0 * share)
}

/// Pixels without depth in the middle.
pub(super) fn holes(report: &InspectionReport, limits: &FindingLimits) -> Finding {
    const WHAT: &str = "holes";
    let h = &report.holes;
    if h.whole > limits.blind {
        let why = format!(
            "{} of the picture has no depth: is the lens covered, is everything too near or too far, or was the background \
             removed from this recording?",
            percent(h.whole)
        );
        return Finding::bad(WHAT, why);
    }
    let measured = format!("{} of the picture's middle has no depth", percent(h.middle));
    let verdict = grade(h.middle, limits.holes);
    let remedy = match verdict {
        Rating::Good => "",
        _ => ": look for glass, mirrors, sunlight, shiny or black things there, and clean the lens",
    };
    Finding::new(WHAT, verdict, measured + remedy)
}

/// Washed-out colour in the holes.
pub(super) fn sunlight(report: &InspectionReport, limits: &FindingLimits) -> Finding {
    const WHAT: &str = "sunlight";
    let [least, times] = limits.washed_out;
    let has_holes = grade(report.holes.whole, limits.holes) != Rating::Good;
    match &report.hole_colors {
        Some(c) if c.washed_out >= least && c.washed_out >= times * c.washed_out_elsewhere => {
            let why = format!(
                "{} of the places without depth are washed out: sun or a lamp shines there; shade the window, or turn the \
                 camera away from it",
                percent(c.washed_out)
            );
            let is_bad = grade(report.holes.middle, limits.holes) == Rating::Bad;
            Finding::new(WHAT, if is_bad { Rating::Bad } else { Rating::Note }, why)
        }
        _ if report.holes.whole > limits.blind => Finding::note(WHAT, BLIND),
        None if has_holes => Finding::note(
            WHAT,
            "not measured without colour on the pixels of depth; if the sun shines into the picture, shade the window",
        ),
        _ => Finding::good(WHAT, "no sign of it"),
    }
}

/// Holes in the lower part that the middle does not have.
pub(super) fn floor_surface(report: &InspectionReport, limits: &FindingLimits) -> Finding {
    const WHAT: &str = "floor surface";
    let h = &report.holes;
    if h.whole > limits.blind {
        return Finding::note(WHAT, BLIND);
    }
    let measured = format!(
        "{} of the picture's lower part has no depth",
        percent(h.lower)
    );
    let verdict = if h.lower - h.middle < limits.floor_excess {
        Rating::Good
    } else {
        grade(h.lower, limits.floor_holes)
    };
    if verdict == Rating::Good {
        return Finding::good(WHAT, measured);
    }
    let is_dark = |c: &crate::HoleColors| c.lower_brightness < limits.dark;
    let remedy = match &report.hole_colors {
        Some(c) if is_dark(c) => {
            "the dark floor swallows the camera's light; lay a lighter, matt mat there"
        }
        Some(_) => "the floor reflects like a mirror, or is too near; lay a matt mat there",
        None => "the floor is dark or shiny, or too near; lay a light, matt mat there",
    };
    Finding::new(WHAT, verdict, format!("{measured}: {remedy}"))
}

/// Readings that are too near.
pub(super) fn distance(report: &InspectionReport, limits: &FindingLimits) -> Finding {
    const WHAT: &str = "distance";
    let Some(r) = &report.range else {
        return Finding::bad(WHAT, "nothing in view has depth: is the lens covered?");
    };
    let measured = format!("surfaces from {:.1} m to {:.1} m", r.nearest, r.farthest);
    let verdict = grade(r.too_near, limits.too_near);
    let remedy = match verdict {
        Rating::Good => String::new(),
        _ => format!(
            "; {} of the picture is nearer than the camera measures well: clear the space before the lens",
            percent(r.too_near)
        ),
    };
    Finding::new(WHAT, verdict, measured + &remedy)
}

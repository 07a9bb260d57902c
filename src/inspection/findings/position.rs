//! Findings about the camera's position: floor, tilt and roll, room for a person.

use super::grade;
use crate::finding::{Finding, Rating};
use crate::inspector::InspectionReport;
use crate::person_fit::{FitRange, tilt_for};
use crate::place::PlaceReport;
use crate::placement::CameraPlacement;
use crate::settings::{FindingLimits, InspectionSettings, PersonSize};
use tryon_geometry::camera::{Intrinsics, PictureTurn};

/// Distance for which a tilt is advised, beyond the nearest at which anything fits (m).
const COMFORTABLE: f64 = 2.5;

/// Floor, height, tilt and roll.
pub(super) fn floor(report: &InspectionReport, limits: &FindingLimits) -> Finding {
    const WHAT: &str = "floor";
    let Some(p) = &report.place.placement else {
        return Finding::note(WHAT, no_floor(report.place.looks_turned));
    };
    let tilt = grade(p.down_deg.abs(), limits.tilt);
    let roll = grade(p.roll_deg.abs(), limits.roll);
    let remedy = if roll > tilt {
        let way = if p.roll_deg > 0.0 { "left" } else { "right" };
        format!(": roll it back to the {way}, so that it stands straight")
    } else if tilt > Rating::Good {
        ": so steep a camera sees people from above; hang it lower, or farther away, and level"
            .into()
    } else {
        String::new()
    };
    Finding::new(WHAT, tilt.max(roll), pose(p) + &remedy)
}

fn pose(p: &CameraPlacement) -> String {
    let lean = |degrees: f64, [over, under]: [&str; 2]| {
        let side = if degrees < 0.0 { under } else { over };
        format!("{:.1}° {side}", degrees.abs())
    };
    format!(
        "the camera is {:.2} m above it, tilted {}, rolled {}",
        p.height,
        lean(p.down_deg, ["down", "up"]),
        lean(p.roll_deg, ["to the right", "to the left"])
    )
}

fn no_floor(turned: Option<PictureTurn>) -> String {
    match turned {
        Some(turned) => format!(
            "none is found; the picture seems to lie on its side or head: set turned = {} (--turned {0}), or turn the camera",
            turned.degrees()
        ),
        None => "none is found: tilt the camera down until the floor before the person is in the picture, and clear it".into(),
    }
}

/// Distances at which a whole person is in view, and the space there.
pub(super) fn person(
    report: &InspectionReport,
    camera: &Intrinsics,
    limits: &FindingLimits,
    person: &PersonSize,
) -> Finding {
    const WHAT: &str = "person";
    let place = &report.place;
    let assumed = match place.placement {
        Some(_) => String::new(),
        None => format!(
            " if the camera is level and {:.1} m high",
            InspectionSettings::default().assumed_height
        ),
    };
    let Some(fit) = &place.person else {
        let advice = advice(place, camera, person);
        let why = format!(
            "nobody of {:.2} m is whole in the picture{assumed}: {advice}",
            person.height
        );
        return Finding::bad(WHAT, why);
    };
    let measured = format!(
        "somebody of {:.2} m is whole in the picture from {:.1} m to {:.1} m away{assumed}",
        person.height, fit.from, fit.to
    );
    // Of a picture without depth nothing is known but the camera's angles.
    let (verdict, remedy) = if report.holes.whole > limits.blind {
        (
            Rating::Note,
            "; nothing else can be judged without depth".into(),
        )
    } else {
        space(place, fit, limits)
    };
    Finding::new(WHAT, verdict, measured + &remedy)
}

/// Space between the nearest distance and the back of the room, and things before it.
fn space(place: &PlaceReport, fit: &FitRange, limits: &FindingLimits) -> (Rating, String) {
    let [good, usable] = limits.space;
    let space = place.room.map(|room| room - fit.from);
    let depth = space.map_or(Rating::Good, |s| grade(-s, [-good, -usable]));
    let blocked = grade(place.in_the_way, limits.in_the_way);
    if depth > Rating::Good && depth >= blocked {
        let room = place.room.unwrap_or(0.0);
        let missing = fit.from + good - room;
        let remedy = format!(
            "; but the view ends {room:.1} m away: move the camera back by {missing:.1} m, or stand it upright (portrait)"
        );
        return (depth, remedy);
    }
    match (blocked, place.nearest_thing) {
        (Rating::Good, _) | (_, None) => (Rating::Good, String::new()),
        (_, Some(nearest)) => {
            let remedy = format!(
                "; something {nearest:.1} m away is before that: clear it away, or step back to {:.1} m",
                fit.from + 0.2
            );
            // People walk away: the place itself may be right.
            (Rating::Note, remedy)
        }
    }
}

/// Tilt that lets a person fit, if one does.
fn advice(place: &PlaceReport, camera: &Intrinsics, person: &PersonSize) -> String {
    let assumed = InspectionSettings::default().assumed_height;
    let (height, down) = place
        .placement
        .map_or((assumed, 0.0), |p| (p.height, p.down_deg));
    let wanted = tilt_for(camera, height, COMFORTABLE, person).to_degrees();
    let by = wanted - down;
    let way = if by > 0.0 { "down" } else { "up" };
    match crate::person_fit(camera, height, wanted.to_radians(), person) {
        Some(fit) => format!(
            "tilt it {way} by {:.0}°; then it is whole from {:.1} m",
            by.abs(),
            fit.from
        ),
        None => "stand the camera upright (portrait), or use one with a wider view".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::person_fit;

    fn advised(height: f64, down_deg: f64, camera: &Intrinsics) -> String {
        let place = PlaceReport {
            placement: Some(CameraPlacement {
                height,
                down_deg,
                roll_deg: 0.0,
            }),
            ..PlaceReport::default()
        };
        advice(&place, camera, &PersonSize::default())
    }

    #[test]
    fn the_advice_leads_to_a_place_that_fits() {
        let k = Intrinsics::KINECT_V1;
        let person = PersonSize::default();
        for (height, down) in [(1.0, -30.0), (1.0, 40.0), (1.8, -10.0)] {
            assert_eq!(person_fit(&k, height, f64::to_radians(down), &person), None);
            let words = advised(height, down, &k);
            let degrees = words.split(['y', '°']).nth(1).expect("by N°").trim();
            let by: f64 = degrees.parse().expect("a number");
            let by = if words.contains("down by") { by } else { -by };
            let fit = person_fit(&k, height, f64::to_radians(down + by), &person);
            assert!(fit.is_some(), "{height} {down}: {words}");
        }
        let narrow = Intrinsics { fx: 4000.0, ..k };
        assert!(advised(1.0, 0.0, &narrow).contains("wider view"));
    }

    #[test]
    fn poses_are_said_with_their_sides() {
        let p = CameraPlacement {
            height: 1.234,
            down_deg: -3.04,
            roll_deg: -2.0,
        };
        let words = "the camera is 1.23 m above it, tilted 3.0° up, rolled 2.0° to the left";
        assert_eq!(pose(&p), words);
        assert!(no_floor(Some(PictureTurn::Quarter)).contains("turned = 90 (--turned 90)"));
    }

    #[test]
    fn a_short_room_and_things_in_the_way_are_told() {
        let fit = FitRange { from: 2.3, to: 4.5 };
        let place = |room, in_the_way| PlaceReport {
            room: Some(room),
            in_the_way,
            nearest_thing: Some(0.9),
            ..PlaceReport::default()
        };
        let limits = FindingLimits::default();
        let told = |p| space(&p, &fit, &limits);
        assert_eq!(told(place(4.0, 0.0)), (Rating::Good, String::new()));
        let (verdict, words) = told(place(2.0, 0.0));
        assert!(
            verdict == Rating::Bad && words.contains("back by 0.8 m"),
            "{words}"
        );
        let (verdict, words) = told(place(4.0, 0.5));
        assert!(
            verdict == Rating::Note && words.contains("step back to 2.5 m"),
            "{words}"
        );
    }
}

//! Findings about a camera and its place, in sentences that somebody in a shop can act on.

mod delivery;
mod position;
mod view;

use crate::finding::{Finding, Rating};
use crate::inspector::InspectionReport;
use crate::settings::{FindingLimits, PersonSize};
use tryon_geometry::camera::Intrinsics;

/// Judges a report of a camera: one finding each for rate, clock, holes, sunlight, dark floor, noise, distance, floor, and
/// room for a person.
pub fn judge(
    report: &InspectionReport,
    camera: &Intrinsics,
    limits: &FindingLimits,
    person: &PersonSize,
) -> Vec<Finding> {
    vec![
        delivery::rate(report, limits),
        delivery::clock(report),
        delivery::noise(report, limits),
        view::holes(report, limits),
        view::sunlight(report, limits),
        view::floor_surface(report, limits),
        view::distance(report, limits),
        position::floor(report, limits),
        position::person(report, camera, limits, person),
    ]
}

/// Judgement of a part of a picture that has next to no depth anywhere.
const BLIND: &str = "not judged: most of the picture has no depth";

/// Grade of a measurement whose larger values are worse, by the limits of good and of usable.
fn grade(value: f64, [good, usable]: [f64; 2]) -> Rating {
    if value <= good {
        Rating::Good
    } else if value <= usable {
        Rating::Note
    } else {
        Rating::Bad
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{InspectionSettings, Inspector, SensorModel};
    use tryon_geometry::camera::{Calibration, RgbdFrame};
    use tryon_synth::{Actor, Routine, Sequence, Setting};

    /// Findings about a synthetic room whose frames are `changed` by number.
    fn found(routine: Routine, changed: impl Fn(&mut RgbdFrame, u64)) -> Vec<Finding> {
        let setting = Setting {
            routine,
            ..Setting::default()
        };
        let camera = setting.camera;
        let sequence = Sequence::new(Actor::default(), setting);
        let calibration = Calibration::registered(camera);
        let mut inspector = Inspector::new(&calibration, InspectionSettings::default());
        for i in 0..4 {
            let mut frame = sequence.frame(i).0;
            changed(&mut frame, i);
            inspector.add(&frame, None);
        }
        let person = PersonSize::default();
        let report = inspector.report(SensorModel::StructuredLight, &person);
        let report = report.expect("frames");
        judge(&report, &camera, &FindingLimits::default(), &person)
    }

    fn of<'a>(all: &'a [Finding], what: &str) -> (Rating, &'a str) {
        let finding = all.iter().find(|f| f.what == what).expect("judged");
        (finding.verdict, &finding.detail)
    }

    /// Takes the depth of pixels and gives them a colour, by column and row.
    fn punch(frame: &mut RgbdFrame, color: [u8; 3], is_hole: impl Fn(usize, usize) -> bool) {
        let (pixels, _) = (frame.color.as_mut().expect("colour").data_mut()).as_chunks_mut::<3>();
        let depth = frame.depth.data_mut().iter_mut();
        for (i, (reading, pixel)) in depth.zip(pixels).enumerate() {
            if is_hole(i % 640, i / 640) {
                (*reading, *pixel) = (0, color);
            }
        }
    }

    #[test]
    fn a_good_place_has_nothing_to_do() {
        for routine in [Routine::Empty, Routine::Still] {
            let all = found(routine, |_, _| {});
            assert!(all.iter().all(|f| f.verdict == Rating::Good), "{all:#?}");
        }
    }

    #[test]
    fn sunlight_is_told_from_dark_floors_and_glass() {
        // The middle of the picture, washed out.
        let sun = found(Routine::Empty, |f, _| {
            punch(f, [255; 3], |u, v| (100..540).contains(&u) && v < 300);
        });
        let (verdict, words) = of(&sun, "sunlight");
        assert!(
            verdict == Rating::Bad && words.contains("shade the window"),
            "{words}"
        );
        assert_eq!(of(&sun, "holes").0, Rating::Bad);

        let glass = found(Routine::Empty, |f, _| {
            punch(f, [90; 3], |u, v| {
                (200..400).contains(&u) && (120..220).contains(&v)
            });
        });
        assert_eq!(of(&glass, "sunlight").0, Rating::Good);
        let (verdict, words) = of(&glass, "holes");
        assert!(
            verdict == Rating::Note && words.contains("glass"),
            "{words}"
        );

        for (color, word) in [([20; 3], "lighter, matt mat"), ([130; 3], "mirror")] {
            let floor = found(Routine::Empty, |f, _| punch(f, color, |_, v| v > 370));
            let (verdict, words) = of(&floor, "floor surface");
            assert!(verdict == Rating::Bad && words.contains(word), "{words}");
            assert_eq!(of(&floor, "holes").0, Rating::Good);
        }
    }

    #[test]
    fn a_hand_before_the_lens_and_a_covered_one_are_told() {
        let hand = found(Routine::Empty, |f, _| {
            for (i, reading) in f.depth.data_mut().iter_mut().enumerate() {
                *reading = if i % 640 < 200 { 420 } else { *reading };
            }
        });
        let (verdict, words) = of(&hand, "distance");
        assert!(
            verdict == Rating::Bad && words.contains("clear the space"),
            "{words}"
        );

        let covered = found(Routine::Empty, |f, _| punch(f, [0; 3], |_, _| true));
        for what in ["holes", "distance"] {
            let (verdict, words) = of(&covered, what);
            assert!(
                verdict == Rating::Bad && words.contains("covered"),
                "{words}"
            );
        }
        for what in ["sunlight", "floor surface", "person", "noise", "floor"] {
            assert_eq!(of(&covered, what).0, Rating::Note, "{what}");
        }
    }

    #[test]
    fn clocks_and_rates_are_judged() {
        let slow = found(Routine::Empty, |f, i| f.time_ns = i * 100_000_000);
        assert_eq!(of(&slow, "rate").0, Rating::Bad);
        let lost = found(Routine::Empty, |f, i| {
            f.time_ns = [0, 33, 66, 165][i as usize] * 1_000_000;
        });
        let (verdict, words) = of(&lost, "rate");
        assert!(
            verdict == Rating::Bad && words.contains("33 % of them lost"),
            "{words}"
        );
        let back = found(Routine::Empty, |f, i| {
            f.time_ns = [9, 40, 5, 36][i as usize] * 1_000_000
        });
        let (verdict, words) = of(&back, "clock");
        assert!(
            verdict == Rating::Note && words.contains("ran backwards 1 times"),
            "{words}"
        );
    }

    #[test]
    fn noise_of_sunlight_is_above_the_sensors() {
        // Rows are shifted by 5 % of the depth from frame to frame.
        let noisy = found(Routine::Empty, |f, i| {
            for (k, reading) in f.depth.data_mut().iter_mut().enumerate() {
                let sign = ((k as u64 + i) % 2) as f32 - 0.5;
                *reading = (f32::from(*reading) * (1.0 + 0.036 * sign)) as u16;
            }
        });
        let (verdict, words) = of(&noisy, "noise");
        assert!(
            verdict >= Rating::Note && words.contains("sunlight"),
            "{words}"
        );
        let frozen = found(Routine::Empty, |f, _| {
            f.depth.data_mut().fill(2000);
        });
        assert!(of(&frozen, "noise").1.contains("a camera that hangs"));
    }
}

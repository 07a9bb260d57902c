//! Unit of a body from its stature, and the limits of a person's stature and volume.

use tryon_formats::mesh_frame::{IMPERIAL_UNITS, METRIC_UNITS, MeshFrame, unit_name};

/// Statures of people, metres: from the newborn to the tallest.
pub(super) const STATURE: [f64; 2] = [0.4, 2.6];
/// Volume over the cube of the stature: from the starved (0.006) to a body mass index of 80 (0.05).
const BULK: [f64; 2] = [0.005, 0.06];
/// Statures of grown people, metres.
const GROWN: [f64; 2] = [1.1, 2.6];

/// Metres in a unit of the file, from its stature in that unit: the metric unit that makes it a person's, or else inches or
/// feet. A child in the one that is grown in the other is ambiguous.
///
/// # Errors
/// No unit makes it a person's, two do, or the stated one does not.
pub fn unit_of_stature(stature: f64, stated: &MeshFrame) -> Result<f64, String> {
    let is_person = |unit: f64| (STATURE[0]..=STATURE[1]).contains(&(stature * unit));
    let [low, high] = STATURE;
    let option = stated.options.unit;
    if let Some(unit) = stated.metres_per_unit {
        let metres = stature * unit;
        return if is_person(unit) {
            Ok(unit)
        } else {
            Err(format!(
                "stature {metres:.3} m by `{option} {}`, expected {low} to {high} m; {}",
                unit_name(unit),
                proposal(stature, option)
            ))
        };
    }
    let is_grown = |unit: f64| (GROWN[0]..=GROWN[1]).contains(&(stature * unit));
    let metric = METRIC_UNITS.into_iter().find(|u| is_person(*u));
    let imperial = IMPERIAL_UNITS.into_iter().find(|u| is_person(*u));
    match (metric, imperial) {
        (Some(unit), None) | (None, Some(unit)) => Ok(unit),
        (Some(unit), Some(other)) if is_grown(unit) || !is_grown(other) => Ok(unit),
        _ => Err(format!(
            "stature {stature:.3} in the file's unit, expected {low} to {high} m; {}",
            proposal(stature, option)
        )),
    }
}

/// The options that would make a stature a person's.
fn proposal(stature: f64, option: &str) -> String {
    let fitting = METRIC_UNITS
        .iter()
        .chain(&IMPERIAL_UNITS)
        .filter(|u| (STATURE[0]..=STATURE[1]).contains(&(stature * **u)));
    let options: Vec<String> = fitting
        .map(|u| format!("`{option} {}` ({:.2} m)", unit_name(*u), stature * u))
        .collect();
    match options.len() {
        0 => "no unit makes it a person's".into(),
        _ => format!("say {}", options.join(" or ")),
    }
}

/// Note on a body that is not in metres.
pub(super) fn unit_note(stature: f64, unit: f64) -> Option<String> {
    ((unit - 1.0).abs() > 1e-9).then(|| {
        format!(
            "in {}: stature {stature:.1} is {:.2} m",
            unit_name(unit),
            stature * unit
        )
    })
}

/// Checks the volume of a body (m³) for its stature (m).
///
/// # Errors
/// The volume and the expected one.
pub(super) fn check_volume(volume: f64, stature: f64) -> Result<(), String> {
    let [low, high] = BULK.map(|b| b * stature.powi(3));
    if (low..=high).contains(&volume) {
        return Ok(());
    }
    Err(format!(
        "volume {volume:.4} m³ for a stature of {stature:.2} m, expected {low:.4} to {high:.4} m³: the surface is open, doubled or no body"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit(stature: f64, metres_per_unit: Option<f64>) -> Result<f64, String> {
        let stated = MeshFrame {
            metres_per_unit,
            ..MeshFrame::default()
        };
        unit_of_stature(stature, &stated)
    }

    #[test]
    fn units_are_recognised_or_asked_for() {
        for (stature, right) in [
            (1.7, 1.0),
            (0.9, 1.0),
            (17.0, 0.1),
            (170.0, 0.01),
            (1700.0, 0.001),
        ] {
            assert_eq!(unit(stature, None), Ok(right));
        }
        // A person of 66 inches or a child of 66 cm; of 5.6 feet or 56 cm.
        for (stature, names) in [(66.0, ["cm", "inch"]), (5.6, ["dm", "foot"])] {
            let why = unit(stature, None).expect_err("two units");
            assert!(
                names.iter().all(|n| why.contains(&format!("--unit {n}"))),
                "{why}"
            );
        }
        assert_eq!(unit(66.0, Some(0.0254)), Ok(0.0254));
        assert!(
            unit(170.0, Some(1.0))
                .expect_err("a giant")
                .contains("--unit cm")
        );
        assert!(unit(0.01, None).expect_err("an ant").contains("no unit"));
    }

    #[test]
    fn volumes_of_people_pass() {
        for (volume, stature) in [(0.065, 1.7), (0.045, 1.75), (0.2, 1.6), (0.0034, 0.5)] {
            assert!(check_volume(volume, stature).is_ok());
        }
        assert!(check_volume(59_430.0, 1.7).is_err() && check_volume(-0.065, 1.7).is_err());
    }
}

//! Distances at which a standing person is whole in the picture, and the tilt that suits a distance.

use crate::settings::PersonSize;
use serde::Serialize;
use std::f64::consts::FRAC_PI_2;
use tryon_geometry::camera::Intrinsics;

/// Distances along the floor (m).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FitRange {
    /// Nearest.
    pub from: f64,
    /// Farthest.
    pub to: f64,
}

/// Angles from the optical axis to the upper and the lower edge of the picture (rad).
fn edges(camera: &Intrinsics) -> [f64; 2] {
    [
        ((camera.cy + 0.5) / camera.fy).atan(),
        ((f64::from(camera.height) - 0.5 - camera.cy) / camera.fy).atan(),
    ]
}

/// Distances at which head, feet and elbows are in the picture of a camera `height` above the floor (m) that is tilted by
/// `down` below the horizontal (rad) and not rolled; `None` where there is none.
pub fn person_fit(
    camera: &Intrinsics,
    height: f64,
    down: f64,
    person: &PersonSize,
) -> Option<FitRange> {
    let [above, below] = edges(camera);
    let (mut from, mut to) = (0.0f64, person.farthest);

    // Feet: a ray of the lower edge meets the floor before them.
    let feet = below + down;
    if feet <= 0.0 {
        return None;
    }
    if feet < FRAC_PI_2 {
        from = from.max(height / feet.tan());
    }

    // Head: a ray of the upper edge passes over it.
    let (rise, over) = ((above - down).tan(), person.height - height);
    if rise > 0.0 {
        from = from.max(over / rise);
    } else if over < 0.0 {
        // The camera hangs higher than the head and sees it below that ray only near by; level, everywhere.
        if rise < 0.0 {
            to = to.min(over / rise);
        }
    } else {
        return None;
    }

    // Elbows to both sides, at half the height: so far along the optical axis.
    let half = (camera.cx + 0.5).min(f64::from(camera.width) - 0.5 - camera.cx) / camera.fx;
    let depth = 0.5 * person.width / half.max(f64::MIN_POSITIVE);
    let lower = height - 0.5 * person.height;
    from = from.max((depth - lower * down.sin()) / down.cos());
    (from < to).then_some(FitRange { from, to })
}

/// Tilt below the horizontal at which feet and head are as far from the picture's edges, for a person at `distance` (m):
/// radians.
pub fn tilt_for(camera: &Intrinsics, height: f64, distance: f64, person: &PersonSize) -> f64 {
    let [above, below] = edges(camera);
    let feet = (height / distance).atan();
    let head = ((person.height - height) / distance).atan();
    // Margins: below + down − feet and above − down − head.
    0.5 * (above - below + feet - head)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;
    use tryon_synth::Setting;

    const PERSON: PersonSize = PersonSize {
        height: 1.95,
        width: 1.2,
        farthest: 4.5,
    };

    /// True if head, feet and elbows of somebody at `distance` are drawn inside the picture, by projection.
    fn is_whole(k: &Intrinsics, height: f64, down: f64, distance: f64) -> bool {
        let camera_from_world = Setting::tilted(height, down.to_degrees(), 0.0).inverse();
        let drawn = |x: f64, y: f64| {
            let p = camera_from_world.point(&Point3::new(x, y, -distance));
            let pixel = k.project(&p.cast());
            p.z > 0.0
                && (-0.5..f64::from(k.width) - 0.5).contains(&f64::from(pixel.x))
                && (-0.5..f64::from(k.height) - 0.5).contains(&f64::from(pixel.y))
        };
        drawn(0.0, 0.0) && drawn(0.0, 1.95) && drawn(-0.6, 0.975) && drawn(0.6, 0.975)
    }

    #[test]
    fn a_level_camera_at_half_height_has_the_closed_form() {
        let k = Intrinsics::KINECT_V1;
        // 0.975 m above the axis at half of 480 pixels: 0.975 · 525 / 240.
        let fit = person_fit(&k, 0.975, 0.0, &PERSON).expect("fits");
        assert!((fit.from - 0.975 * 525.0 / 240.0).abs() < 1e-9, "{fit:?}");
        assert_eq!(fit.to, 4.5);
        assert!(tilt_for(&k, 0.975, 2.5, &PERSON).abs() < 1e-9);
    }

    #[test]
    fn ranges_are_those_of_projected_people() {
        let portrait = Intrinsics {
            width: 480,
            height: 640,
            ..Intrinsics::KINECT_V1
        };
        for k in [Intrinsics::KINECT_V1, portrait] {
            let k = Intrinsics {
                cx: f64::from(k.width) / 2.0 - 0.5,
                cy: f64::from(k.height) / 2.0 + 9.5,
                ..k
            };
            for (height, down) in [
                (1.0, 0.05),
                (1.4, 0.2),
                (2.3, 0.45),
                (2.2, 0.62),
                (0.4, -0.2),
            ] {
                let fit = person_fit(&k, height, down, &PERSON);
                for i in 1..90 {
                    let distance = 0.05 * f64::from(i);
                    let near = fit.is_some_and(|f| {
                        (distance - f.from).abs() < 0.01 || (distance - f.to).abs() < 0.01
                    });
                    let fits = fit.is_some_and(|f| f.from < distance && distance < f.to);
                    let whole = is_whole(&k, height, down, distance);
                    assert!(near || fits == whole, "{height} {down} {distance}: {fit:?}");
                }
            }
        }
    }

    #[test]
    fn the_tilt_that_is_advised_lets_a_person_fit() {
        let k = Intrinsics {
            width: 480,
            height: 640,
            cx: 239.5,
            cy: 319.5,
            ..Intrinsics::KINECT_V1
        };
        for height in [0.5, 1.0, 1.8, 2.2] {
            let down = tilt_for(&k, height, 2.5, &PERSON);
            let fit = person_fit(&k, height, down, &PERSON).expect("fits");
            assert!(fit.from < 2.5 && fit.to > 2.5, "{height}: {down} {fit:?}");
        }
        let up = std::f64::consts::FRAC_PI_4;
        assert_eq!(person_fit(&k, 1.0, -up, &PERSON), None, "no feet");
        assert_eq!(person_fit(&k, 1.0, up, &PERSON), None, "no head");
    }
}

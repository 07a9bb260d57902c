//! Part of the captured picture that a cropped one shows: it follows the person, and rests while the person stays near its
//! middle.

use super::input::Input;
use super::settings::FocusSettings;
use serde::{Deserialize, Serialize};
use tryon_geometry::math::P3;

/// One in so many vertices tells where a body is.
const VERTEX_STEP: usize = 16;

/// Place of a person on the captured picture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Focus {
    /// Middle of the body and top of the head, shares of the picture's width and height.
    pub(crate) at: [f64; 2],
    /// The person left the middle, by axis, and the picture follows.
    is_moving: [bool; 2],
    /// Capture time, nanoseconds.
    time_ns: u64,
}

impl Focus {
    /// The focus of the next picture; the old one where nobody is tracked.
    pub(crate) fn next(
        old: Option<Self>,
        input: &Input<'_>,
        settings: &FocusSettings,
    ) -> Option<Self> {
        let (seen, time_ns) = (place(input), input.frame.time_ns);
        match (old, seen) {
            (Some(old), Some(seen)) => Some(old.toward(seen, time_ns, settings)),
            (old, None) => old,
            (None, Some(at)) => Some(Self {
                at,
                is_moving: [false; 2],
                time_ns,
            }),
        }
    }

    fn toward(mut self, seen: [f64; 2], time_ns: u64, settings: &FocusSettings) -> Self {
        // A clock that runs backwards has begun anew.
        let seconds = time_ns.saturating_sub(self.time_ns) as f64 * 1e-9;
        self.time_ns = time_ns;
        let share = 1.0 - (-seconds / settings.glide).exp();
        for (k, seen) in seen.into_iter().enumerate() {
            let away = seen - self.at[k];
            self.is_moving[k] = if self.is_moving[k] {
                away.abs() > settings.arrived
            } else {
                away.abs() > settings.rest
            };
            if self.is_moving[k] {
                self.at[k] += share * away;
            }
        }
        self
    }
}

/// Middle of the tracked body and top of its head on the captured picture, shares of width and height; `None` without one.
fn place(input: &Input<'_>) -> Option<[f64; 2]> {
    let body = input.body?;
    let calibration = input.calibration;
    let camera = calibration.color.unwrap_or(calibration.depth);
    let seen = |p: &P3| {
        let p = match calibration.color {
            Some(_) => calibration.color_from_depth.point(&p.cast()).cast(),
            None => *p,
        };
        (p.z > 0.0).then(|| {
            let q = camera.project(&p);
            [f64::from(q.x), f64::from(q.y)]
        })
    };
    let mut sum = [0.0, 0.0];
    let mut top = f64::INFINITY;
    for [u, v] in body.vertices.iter().step_by(VERTEX_STEP).filter_map(seen) {
        sum = [sum[0] + u, sum[1] + 1.0];
        top = top.min(v);
    }
    let at = [
        sum[0] / sum[1] / f64::from(camera.width),
        top / f64::from(camera.height),
    ];
    at.iter().all(|c| c.is_finite()).then_some(at)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::viewport::Viewport;
    use crate::{Framing, OutputFrame};
    use tryon_geometry::camera::{Calibration, DepthImage, Intrinsics, RgbdFrame};

    fn focus() -> Focus {
        Focus {
            at: [0.5, 0.2],
            is_moving: [false; 2],
            time_ns: 0,
        }
    }

    #[test]
    fn a_person_who_sways_moves_no_picture_and_one_who_walks_is_followed() {
        let settings = FocusSettings::default();
        let mut now = focus();
        for k in 1..60u64 {
            let sway = 0.5 + 0.9 * settings.rest * (k as f64 * 0.3).sin();
            now = now.toward([sway, 0.2], k * 33_000_000, &settings);
        }
        assert_eq!(now.at, [0.5, 0.2]);
        let mut steps = Vec::new();
        for k in 60..200u64 {
            let before = now.at[0];
            now = now.toward([0.8, 0.2], k * 33_000_000, &settings);
            steps.push(now.at[0] - before);
        }
        assert!((now.at[0] - 0.8).abs() < settings.arrived, "{now:?}");
        assert!(steps.iter().all(|s| (0.0..0.05).contains(s)), "{steps:?}");
        assert_eq!(now.at[1], 0.2);
    }

    #[test]
    fn a_crop_has_the_person_in_its_middle_and_ends_with_the_captured_picture() {
        let settings = FocusSettings::default();
        let camera = Intrinsics::KINECT_V1;
        let frame = RgbdFrame {
            sequence: 0,
            time_ns: 0,
            depth: DepthImage::empty(camera.width, camera.height),
            color: None,
        };
        let input = Input {
            frame: &frame,
            calibration: &Calibration::registered(camera),
            garments: &[],
            body: None,
            output: Some(OutputFrame {
                size: [270, 480],
                framing: Framing::Cover,
            }),
        };
        for (at, middle) in [(0.4, 256.0), (0.6, 384.0), (0.05, 135.0), (1.4, 505.0)] {
            let focus = Focus {
                at: [at, 0.2],
                ..focus()
            };
            let viewport = Viewport::new(&input, Some(&focus), &settings);
            let [left, right] = [0, 269].map(|u| viewport.color_at(0, u));
            assert!((0.5 * (left + right) + 0.5 - middle).abs() < 1e-9, "{at}");
            assert_eq!(viewport.color_at(1, 0), 0.0);
        }
    }

    #[test]
    fn pictures_of_one_exposure_show_the_same_part() {
        let settings = FocusSettings::default();
        let once = focus().toward([0.9, 0.5], 40_000_000, &settings);
        assert_eq!(once.toward([0.9, 0.5], 40_000_000, &settings).at, once.at);
        let anew = once.toward([0.9, 0.5], 1, &settings);
        assert_eq!(anew.at, once.at);
    }
}

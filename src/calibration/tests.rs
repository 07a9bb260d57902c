//! Synthetic people before two cameras: the estimate against the truth, and recordings that yield none.

use super::{ExtrinsicAxis, Extrinsics, ExtrinsicsError, ExtrinsicsSettings, calibrate};
use nalgebra::{UnitQuaternion, Vector3};
use tryon_formats::{CameraFile, FormatError, RgbdSource};
use tryon_geometry::camera::{Calibration, ColorImage, Intrinsics, NoiseModel, RgbdFrame};
use tryon_geometry::math::Rigid;
use tryon_synth::{Actor, Routine, SeparateColor, Sequence, Setting, SynthSource};

/// Goals of the product: translation (m), rotation (rad), time (s).
const GOALS: (f64, f64, f64) = (0.004, 0.2 * std::f64::consts::PI / 180.0, 0.003);

/// Colour camera 5 cm beside that of depth, turned by 2° and late by 37 ms.
fn beside() -> SeparateColor {
    let rotation = Vector3::new(1.5, -1.2, 0.6).map(f64::to_radians);
    SeparateColor {
        camera: Intrinsics {
            fx: 560.0,
            fy: 560.0,
            cx: 322.0,
            ..Intrinsics::KINECT_V1
        },
        color_from_depth: Rigid::from_parts(
            Vector3::new(-0.05, 0.004, 0.003),
            UnitQuaternion::from_scaled_axis(rotation),
        ),
        delay: 0.037,
    }
}

/// `frames` frames of a person, stated to be taken by two cameras in one place.
fn recording(setting: Setting, frames: u64) -> SynthSource {
    let sequence = Sequence::new(Actor::default(), setting);
    let stated = Calibration {
        color_from_depth: Rigid::identity(),
        ..sequence.calibration().clone()
    };
    SynthSource::new(sequence, Some(frames)).stating(stated)
}

fn before_two_cameras(routine: Routine, noise: NoiseModel) -> Setting {
    Setting {
        routine,
        noise,
        color_camera: Some(beside()),
        ..Setting::default()
    }
}

fn estimate(source: &mut dyn RgbdSource) -> Result<Extrinsics, ExtrinsicsError> {
    calibrate(source, &ExtrinsicsSettings::default())
}

fn refusal(source: &mut dyn RgbdSource) -> ExtrinsicsError {
    estimate(source).expect_err("must be refused")
}

#[test]
fn a_walk_gives_the_extrinsics_and_the_time_offset() {
    for (noise, frames) in [(NoiseModel::KinectV1, 300), (NoiseModel::TimeOfFlight, 240)] {
        let mut source = recording(before_two_cameras(Routine::Walk, noise), frames);
        let found = estimate(&mut source).expect("a walk");
        let truth = beside();
        let off = found.color_from_depth.inverse() * truth.color_from_depth;
        let off = off.iso();
        let time = found.color_time_offset_s - truth.delay;
        assert!(
            off.translation.vector.norm() < GOALS.0,
            "{noise:?}: {found:?}"
        );
        assert!(off.rotation.angle() < GOALS.1, "{noise:?}: {found:?}");
        assert!(time.abs() < GOALS.2, "{noise:?}: {found:?}");
        // The deviations stated are of the size of the errors.
        let stated = Vector3::from(found.deviations.translation).norm();
        assert!(off.translation.vector.norm() < 4.0 * stated && stated < GOALS.0);
    }
}

#[test]
fn somebody_who_only_walks_across_leaves_an_axis_unknown() {
    let setting = before_two_cameras(Routine::LeaveAndReturn, NoiseModel::KinectV1);
    let e = refusal(&mut recording(setting, 330));
    let ExtrinsicsError::Unobservable {
        axis,
        deviation,
        most,
    } = &e
    else {
        panic!("{e}");
    };
    assert!(
        matches!(axis, ExtrinsicAxis::Down | ExtrinsicAxis::Right),
        "{e}"
    );
    assert!(
        deviation > most && e.to_string().contains("walk towards the camera"),
        "{e}"
    );
}

#[test]
fn nobody_and_somebody_who_stands_are_told() {
    for routine in [Routine::Empty, Routine::Still] {
        let e = refusal(&mut recording(
            before_two_cameras(routine, NoiseModel::KinectV1),
            60,
        ));
        assert!(
            matches!(
                e,
                ExtrinsicsError::Nobody {
                    with_person: 0,
                    frames: 60,
                    ..
                }
            ),
            "{e}"
        );
    }
}

#[test]
fn few_frames_and_registered_color_are_told() {
    let walk = before_two_cameras(Routine::Walk, NoiseModel::None);
    let e = refusal(&mut recording(walk.clone(), 20));
    assert!(
        matches!(e, ExtrinsicsError::TooFewFrames { got: 20, .. }),
        "{e}"
    );
    let without = Setting {
        color: false,
        ..walk.clone()
    };
    let e = refusal(&mut recording(without, 40));
    assert!(
        matches!(e, ExtrinsicsError::TooFewFrames { got: 0, .. }),
        "{e}"
    );
    let registered = Setting {
        color_camera: None,
        ..walk
    };
    let e = refusal(&mut recording(registered, 40));
    assert!(matches!(e, ExtrinsicsError::Registered), "{e}");
}

/// Colours of another source, changed.
struct Recolored<F> {
    source: SynthSource,
    change: F,
}

impl<F: Fn(u64, &mut [u8]) + Send> RgbdSource for Recolored<F> {
    fn calibration(&self) -> &Calibration {
        self.source.calibration()
    }
    fn camera_file(&self) -> CameraFile {
        self.source.camera_file()
    }
    fn len(&self) -> Option<usize> {
        self.source.len()
    }
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, FormatError> {
        let Some(mut frame) = self.source.next_frame()? else {
            return Ok(None);
        };
        frame.color = frame.color.and_then(|color| {
            let mut data = color.data().to_vec();
            (self.change)(frame.sequence, &mut data);
            ColorImage::new(color.width(), color.height(), data).ok()
        });
        Ok(Some(frame))
    }
    fn rewind(&mut self) -> Result<(), FormatError> {
        self.source.rewind()
    }
}

#[test]
fn darkness_and_a_picture_without_the_person_are_told() {
    let walk = || recording(before_two_cameras(Routine::Walk, NoiseModel::KinectV1), 150);
    let darken = |_: u64, data: &mut [u8]| data.iter_mut().for_each(|c| *c /= 16);
    let e = refusal(&mut Recolored {
        source: walk(),
        change: darken,
    });
    assert!(matches!(e, ExtrinsicsError::TooDark { .. }), "{e}");
    // Noise without a person.
    let noise = |frame: u64, data: &mut [u8]| {
        let mut state = frame + 1;
        for c in data {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            *c = 90 + (state >> 61) as u8;
        }
    };
    let e = refusal(&mut Recolored {
        source: walk(),
        change: noise,
    });
    assert!(matches!(e, ExtrinsicsError::NotMet { .. }), "{e}");
}

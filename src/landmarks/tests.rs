//! The converted model against LiteRT and on real recordings; skipped without its file.

use crate::crop::{CropBorder, CropForm, crop};
use crate::network::LandmarkNetwork;
use crate::{LandmarkLifter, Landmarker, PersonRegion, PoseLandmarks, model_file, shared_model};
use serde_json::Value;
use std::path::Path;
use tryon_formats::{RgbdFolder, RgbdSource, open_recording, shared_data};
use tryon_geometry::camera::{ColorImage, RgbdFrame};
use tryon_geometry::math::V3;

/// Side of a rolled image.
const ROLLED_PIXELS: u32 = 600;

/// A landmarker, unless the model is missing.
fn landmarker() -> Option<Landmarker> {
    shared_model().map(|file| Landmarker::open(file).expect("the model"))
}

/// All frames of a recording of the shared data, with what lifts its landmarks.
fn recording(name: &str) -> Option<(Vec<RgbdFrame>, LandmarkLifter)> {
    let mut source = RgbdFolder::open(&shared_data(Path::new("rgbd").join(name))?).expect(name);
    let lifter = LandmarkLifter::new(source.calibration().clone());
    let frames = std::iter::from_fn(|| source.next_frame().transpose());
    Some((frames.map(|frame| frame.expect(name)).collect(), lifter))
}

/// Image of a camera that is rolled against the picture: a square region of it.
fn rolled(image: &ColorImage, region: &PersonRegion) -> ColorImage {
    let form = CropForm {
        pixels: ROLLED_PIXELS as usize,
        range: [0.0, 255.0],
        border: CropBorder::Black,
    };
    let mut planes = Vec::new();
    crop(image, region, &form, &mut planes);
    let pixels = planes.len() / 3;
    let bytes = (0..pixels).flat_map(|k| [0, 1, 2].map(|c| planes[c * pixels + k].round() as u8));
    ColorImage::new(ROLLED_PIXELS, ROLLED_PIXELS, bytes.collect()).expect("its size")
}

/// Largest difference from LiteRT's values, and the largest of them.
fn difference(found: &[f32], expected: &Value) -> (f64, f64) {
    let step = expected["step"].as_u64().expect("a step") as usize;
    let values = expected["values"].as_array().expect("values");
    assert_eq!(found.iter().step_by(step).count(), values.len());
    let pairs = found.iter().step_by(step).zip(values);
    pairs.fold((0.0, 1.0), |(far, most), (found, value)| {
        let value = value.as_f64().expect("a number");
        (
            f64::max(far, (f64::from(*found) - value).abs()),
            f64::max(most, value.abs()),
        )
    })
}

/// LiteRT's outputs for the image of `tools/landmarks/converter/check.py`.
#[test]
fn networks_compute_what_lite_rt_computes() {
    let Some(file) = shared_model() else { return };
    let network = LandmarkNetwork::load(model_file::read(&file).expect("the model"));
    let network = network.expect("its graphs");
    let expected: Value =
        serde_json::from_str(include_str!("testdata/lite_rt.json")).expect("JSON");
    let image = |n: usize, low: f32| -> Vec<f32> {
        let pattern = |c: usize, y: usize, x: usize| (7 * c + 13 * y + 29 * x + y * x / 16) % 256;
        let place = |k: usize| pattern(k / (n * n), k / n % n, k % n) as f32;
        (0..3 * n * n)
            .map(|k| low + (1.0 - low) * place(k) / 255.0)
            .collect()
    };
    let found = network.detect(&image(224, -1.0)).expect("it runs");
    let seen = network.landmarks(&image(256, 0.0)).expect("it runs");
    for (name, values) in [
        ("boxes", &found.boxes),
        ("scores", &found.scores),
        ("screen", &seen.screen),
        ("presence", &vec![seen.presence]),
        ("world", &seen.world),
    ] {
        let graph = if values.len() > 200 {
            "detector"
        } else {
            "landmarks"
        };
        let (far, most) = difference(values, &expected[format!("{graph}.{name}")]);
        eprintln!("{name}: {far:.1e} of {most:.3}");
        assert!(far < 1e-4 * most, "{name}: {far} of {most}");
    }
}

#[test]
fn images_of_any_size_give_nobody_and_no_panic() {
    let Some(mut landmarker) = landmarker() else {
        return;
    };
    for [w, h] in [[0, 0], [1, 1], [1, 700], [700, 1], [3, 2], [640, 480]] {
        let image = ColorImage::filled(w, h, [90, 110, 70]);
        assert_eq!(landmarker.find(&image).expect("it runs"), None, "{w}×{h}");
        landmarker.follow(PersonRegion {
            centre: [f32::NAN, 1e30],
            side: f32::INFINITY,
            roll: -1e30,
        });
        landmarker.find(&image).expect("it runs");
    }
}

/// Errors of the trunk's yaw on `uva_turn`, degrees, from the smallest; the known turn of a man who fills the picture from
/// head to waist. Each frame anew, unless the man is followed.
fn yaw_errors(is_followed: bool) -> Option<Vec<f64>> {
    let (mut landmarker, (frames, mut lifter)) = (landmarker()?, recording("uva_turn")?);
    let poses = std::fs::read(shared_data("rgbd/uva_turn/poses.json")?).expect("readable");
    let poses: Value = serde_json::from_slice(&poses).expect("JSON");
    let mut errors = Vec::new();
    for (frame, rotation) in frames.iter().zip(poses["R"].as_array().expect("rotations")) {
        // The front lies at −z of frame 0, whose rotation is the identity: the last row of each, turned over.
        let front = |k: usize| -rotation[2][k].as_f64().expect("a number");
        let truth = front(0).atan2(-front(2));
        if !is_followed {
            landmarker.forget();
        }
        let color = frame.color.as_ref().expect("colour");
        let pose = landmarker.find(color).expect("it runs").expect("a man");
        let lifted = lifter.lift(&frame.depth, &pose).expect("sizes");
        let yaw = lifted.trunk.yaw(&V3::new(0.0, -1.0, 0.0)).expect("a trunk");
        let error = (yaw - truth).sin().atan2((yaw - truth).cos()).to_degrees();
        assert!(
            lifted.size.is_some_and(|size| (0.6..1.3).contains(&size)),
            "{:?}",
            lifted.size
        );
        errors.push(error.abs());
    }
    errors.sort_by(f64::total_cmp);
    Some(errors)
}

#[test]
fn the_yaw_of_a_turning_man_is_his() {
    for is_followed in [false, true] {
        let Some(errors) = yaw_errors(is_followed) else {
            return;
        };
        assert_eq!(errors.len(), 50);
        let (median, most) = (errors[25], errors[49]);
        eprintln!("followed {is_followed}: median {median:.1}°, largest {most:.1}°");
        assert!(median < 8.0 && most < 40.0, "{median}°, {most}°");
    }
}

/// Distances between the landmarks that are seen in the upright picture and those of a rolled one, shares of the region's
/// side, from the smallest.
fn distances(upright: &PoseLandmarks, pose: &PoseLandmarks, camera: &PersonRegion) -> Vec<f32> {
    let pairs = upright.landmarks.iter().zip(&pose.landmarks);
    let mut far: Vec<f32> = pairs
        .filter(|(want, _)| want.visibility.min(want.presence) > 0.5)
        .map(|(want, got)| {
            let share = got.pixel.map(|c| (c + 0.5) / ROLLED_PIXELS as f32 - 0.5);
            let at = camera.pixel(share);
            (at[0] - want.pixel[0]).hypot(at[1] - want.pixel[1]) / upright.region.side
        })
        .collect();
    far.sort_by(f32::total_cmp);
    far
}

#[test]
fn people_are_found_at_any_roll() {
    let Some(mut landmarker) = landmarker() else {
        return;
    };
    for name in ["autumn_still", "depthkit_still", "uva_turn"] {
        let Some((frames, _)) = recording(name) else {
            return;
        };
        let image = frames[0].color.as_ref().expect("colour");
        landmarker.forget();
        let upright = landmarker.find(image).expect("it runs").expect("upright");
        for degrees in (30..360).step_by(30) {
            let camera = PersonRegion {
                centre: [image.width(), image.height()].map(|n| 0.5 * n as f32),
                side: image.width().max(image.height()) as f32,
                roll: (degrees as f32).to_radians(),
            };
            landmarker.forget();
            let found = landmarker.find(&rolled(image, &camera)).expect("it runs");
            let pose = found.unwrap_or_else(|| panic!("{name}: nobody at {degrees}°"));
            let far = distances(&upright, &pose, &camera);
            let (median, most) = (far[far.len() / 2], far[far.len() - 1]);
            eprintln!(
                "{name} {degrees}°: {median:.3}, largest {most:.3} of {}",
                far.len()
            );
            assert!(
                median < 0.02 && most < 0.15,
                "{name} at {degrees}°: {far:?}"
            );
        }
    }
}

/// A figure drawn on a mug is found, and is too small for a person.
#[test]
fn a_figure_on_a_mug_has_no_joints() {
    let (Some(mut landmarker), Some(file)) = (
        landmarker(),
        shared_data("rgbd/k4a_recording/recording.mkv"),
    ) else {
        return;
    };
    let mut source = open_recording(&file).expect("a recording");
    let frame = source.next_frame().expect("readable").expect("a frame");
    let color = frame.color.as_ref().expect("colour");
    if let Some(pose) = landmarker.find(color).expect("it runs") {
        let mut lifter = LandmarkLifter::new(source.calibration().clone());
        let lifted = lifter.lift(&frame.depth, &pose).expect("sizes");
        eprintln!("size {:?}", lifted.size);
        assert!(lifted.joints.iter().all(Option::is_none), "{lifted:?}");
    }
}

/// Colour waits on another thread than frames.
#[test]
fn a_landmarker_moves_between_threads() {
    fn assert_send<T: Send>() {}
    assert_send::<Landmarker>();
    assert_send::<LandmarkLifter>();
}

#[test]
fn a_frame_gives_the_same_bits_again() {
    let (Some(mut first), Some(mut second)) = (landmarker(), landmarker()) else {
        return;
    };
    let Some((frames, mut lifter)) = recording("depthkit_still") else {
        return;
    };
    let image = frames[0].color.as_ref().expect("colour");
    let [a, b] = [&mut first, &mut second].map(|l| l.find(image).expect("it runs"));
    assert_eq!(a, b);
    let pose = a.expect("a person");
    let [a, b] = [(); 2].map(|()| lifter.lift(&frames[0].depth, &pose));
    assert_eq!(a, b);
}

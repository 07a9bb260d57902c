//! Garments off the person in whole pictures: shares, parts, intervals, pictures without a measurement.

use crate::{
    Appearance, BodyView, Config, GarmentView, Input, Limbs, Model, OffPerson, State, Workspace,
    render,
};
use tryon_body::parts::BodyPart;
use tryon_geometry::camera::{Calibration, ColorImage, DepthImage, Intrinsics, RgbdFrame};
use tryon_geometry::math::P3;
use tryon_geometry::mesh::Face;

/// Columns of the person at 2 m, metres; a wall is behind.
const PERSON: [f32; 2] = [-0.2, 0.1];
/// Columns of the garment, 5 cm in front, metres.
const GARMENT: [f32; 2] = [-0.2, 0.3];
/// Share of the garment beyond 4 cm from the person, by hand.
const SHARE: f32 = 0.327;
const FACES: [Face; 2] = [[0, 1, 2], [0, 2, 3]];
const MS: u64 = 1_000_000;

/// A rectangle of cloth before a person and beside it.
struct BesidePerson {
    frame: RgbdFrame,
    calibration: Calibration,
    garment: [P3; 4],
    appearance: Appearance,
    body: Vec<P3>,
    limbs: Limbs,
}

impl BesidePerson {
    fn new() -> Self {
        let camera = Intrinsics::KINECT_V1;
        let depth = (0..camera.width * camera.height).map(|i| {
            let x = camera.unproject((i % camera.width) as f32, 0.0, 2.0).x;
            if (PERSON[0]..PERSON[1]).contains(&x) {
                2000
            } else {
                3500
            }
        });
        let depth = DepthImage::new(camera.width, camera.height, depth.collect());
        // The trunk's vertices, then a column of the left arm at the person's edge.
        let column = |x: f32| (0..30).map(move |k| P3::new(x, 0.02 * k as f32 - 0.3, 2.0));
        let columns = [-0.2, -0.1, 0.0, 0.08];
        let parts = [BodyPart::Trunk, BodyPart::LeftArm];
        let parts = (0..120).map(|v| parts[usize::from(v >= 90)]).collect();
        Self {
            frame: RgbdFrame {
                sequence: 0,
                time_ns: 0,
                depth: depth.expect("size"),
                color: Some(ColorImage::filled(camera.width, camera.height, [90; 3])),
            },
            calibration: Calibration::registered(camera),
            garment: quad(GARMENT, 0.3),
            appearance: Appearance::default(),
            body: columns.into_iter().flat_map(column).collect(),
            limbs: Limbs {
                parts,
                ..Limbs::default()
            },
        }
    }

    fn measure(&self, state: &mut State, config: &Config, has_body: bool) -> Option<OffPerson> {
        let garment = GarmentView {
            vertices: &self.garment,
            faces: &FACES,
            uv: &[],
            normals: &[],
            places: &[],
            appearance: &self.appearance,
        };
        let body = BodyView {
            vertices: &self.body,
            faces: &[],
            limbs: &self.limbs,
        };
        let input = Input {
            frame: &self.frame,
            calibration: &self.calibration,
            garments: &[garment],
            body: has_body.then_some(body),
            output: None,
        };
        let model = Model::new(config.clone());
        let drawn = render(&model, state, &input, &mut Workspace::default());
        let report = drawn.expect("drawn").1;
        let is_timed = report.stages_ms.iter().any(|s| s.0 == "off person");
        assert!(is_timed || report.off_person.is_none());
        report.off_person
    }

    fn first(&self, has_body: bool) -> Option<OffPerson> {
        self.measure(&mut State::default(), &Config::default(), has_body)
    }
}

/// A rectangle 1.95 m away that faces the camera, metres.
fn quad([left, right]: [f32; 2], half: f32) -> [P3; 4] {
    [
        [left, half, 1.95],
        [right, half, 1.95],
        [right, -half, 1.95],
        [left, -half, 1.95],
    ]
    .map(P3::from)
}

#[test]
fn a_garment_partly_beside_the_person_is_measured_by_share_and_part() {
    let mut scene = BesidePerson::new();
    let alone = scene.first(false).expect("measured");
    assert!((alone.share - SHARE).abs() < 0.01, "{alone:?}");
    assert!(alone.garment_pixels > 20_000 && alone.parts == [0.0; 5]);
    assert_eq!(alone.hanging_parts().count(), 0, "parts are unknown");

    let tracked = scene.first(true).expect("measured");
    let arm = tracked.parts[BodyPart::LeftArm as usize];
    assert!(
        (tracked.share - SHARE).abs() < 0.01 && (arm - tracked.share).abs() < 1e-3,
        "{tracked:?}"
    );
    assert!(tracked.hanging_parts().eq([BodyPart::LeftArm]));

    scene.garment = quad(PERSON, 0.3);
    assert_eq!(scene.first(true).map(|o| o.share), Some(0.0));
}

#[test]
fn pictures_with_too_little_of_it_are_not_measured() {
    let mut scene = BesidePerson::new();
    scene.garment = quad([-0.05, 0.05], 0.05);
    assert_eq!(scene.first(true), None, "a scrap of cloth");
    scene.garment = quad([-9.0, -8.0], 0.3);
    assert_eq!(scene.first(true), None, "outside of the picture");
    let mut scene = BesidePerson::new();
    scene.frame.depth.data_mut().fill(0);
    assert_eq!(scene.first(true), None, "no depth");
}

#[test]
fn measurements_keep_their_interval() {
    let mut scene = BesidePerson::new();
    let mut measured = |interval: f64, times: &[u64]| -> Vec<bool> {
        let mut state = State::default();
        let config = Config {
            off_person_interval: interval,
            ..Config::default()
        };
        let measured = times.iter().map(|ms| {
            scene.frame.time_ns = ms * MS;
            scene.measure(&mut state, &config, true).is_some()
        });
        measured.collect()
    };
    // The clock runs backwards before the last.
    let times = [1000, 1100, 1250, 50];
    assert_eq!(measured(0.2, &times), [true, false, true, true]);
    assert_eq!(measured(0.0, &times), [true; 4]);
    assert_eq!(measured(f64::INFINITY, &times), [false; 4]);
}

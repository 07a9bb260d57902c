//! Extrinsics and time offset from synthetic people who walk: errors against the truth, deviations stated, processor
//! time.
//!
//! `cargo bench -p tryon-calibration --bench calibration [-- CASE]`

#![allow(clippy::print_stdout)] // the table

use nalgebra::{UnitQuaternion, Vector3};
use std::sync::Arc;
use tryon_calibration::{ExtrinsicsSettings, calibrate};
use tryon_formats::{FormatError, RgbdSource};
use tryon_geometry::camera::{Calibration, ColorImage, Intrinsics, NoiseModel, RgbdFrame};
use tryon_geometry::math::{P3d, Rigid};
use tryon_synth::{Actor, Room, Routine, SeparateColor, Sequence, Setting};

/// A person, a walk and two cameras.
struct Case {
    name: &'static str,
    routine: Routine,
    seconds: f64,
    /// Coefficients of the body's shape, and clothes.
    shape: [f64; 4],
    appearance: u64,
    /// Start on the floor (x, z) and turn (degrees).
    home: [f64; 3],
    noise: NoiseModel,
    /// Size and focal length of colour.
    color: (u32, u32, f64),
    /// Translation (mm), rotation vector (degrees) and delay (ms) of colour.
    truth: ([f64; 3], [f64; 3], f64),
    /// Standard deviation of colour (levels).
    grain: f32,
    seed: u64,
}

const VGA: (u32, u32, f64) = (640, 480, 560.0);
const HD: (u32, u32, f64) = (1280, 720, 910.0);

const CASES: [Case; 11] = [
    Case {
        name: "structured light, 5 cm",
        routine: Routine::Walk,
        seconds: 15.8,
        shape: [0.0; 4],
        appearance: 0,
        home: [0.0, -2.4, 0.0],
        noise: NoiseModel::KinectV1,
        color: VGA,
        truth: ([-50.0, 2.0, 3.0], [0.5, -0.8, 0.3], 23.0),
        grain: 3.0,
        seed: 1,
    },
    Case {
        name: "time of flight, tilt 6 degrees",
        routine: Routine::Walk,
        seconds: 15.8,
        shape: [1.5, -1.0, 0.5, 0.0],
        appearance: 3,
        home: [0.1, -2.5, 10.0],
        noise: NoiseModel::TimeOfFlight,
        color: HD,
        truth: ([-32.0, -2.0, 4.0], [6.0, 0.2, -0.1], -61.0),
        grain: 4.0,
        seed: 2,
    },
    Case {
        name: "structured light, turned walk, 92 ms",
        routine: Routine::Walk,
        seconds: 15.8,
        shape: [-1.5, 1.0, 0.0, 1.0],
        appearance: 7,
        home: [-0.1, -2.7, 35.0],
        noise: NoiseModel::KinectV1,
        color: HD,
        truth: ([25.0, -12.0, 8.0], [-2.0, 1.5, -1.0], 92.0),
        grain: 3.0,
        seed: 3,
    },
    Case {
        name: "half a walk",
        routine: Routine::Walk,
        seconds: 8.0,
        shape: [0.5, 2.0, 0.0, 0.0],
        appearance: 11,
        home: [0.0, -2.4, 0.0],
        noise: NoiseModel::TimeOfFlight,
        color: VGA,
        truth: ([50.0, 0.0, 0.0], [0.0, 3.0, 0.0], -15.0),
        grain: 3.0,
        seed: 4,
    },
    Case {
        name: "leaves and comes back",
        routine: Routine::LeaveAndReturn,
        seconds: 12.0,
        shape: [0.0; 4],
        appearance: 5,
        home: [0.0, -2.4, 0.0],
        noise: NoiseModel::KinectV1,
        color: VGA,
        truth: ([-50.0, 0.0, 0.0], [0.0, -1.0, 0.5], 40.0),
        grain: 3.0,
        seed: 5,
    },
    Case {
        name: "stands",
        routine: Routine::Still,
        seconds: 6.0,
        shape: [0.0; 4],
        appearance: 0,
        home: [0.0, -2.4, 0.0],
        noise: NoiseModel::KinectV1,
        color: VGA,
        truth: ([-50.0, 0.0, 0.0], [0.0, -1.0, 0.5], 40.0),
        grain: 3.0,
        seed: 6,
    },
    Case {
        name: "unseen 1",
        routine: Routine::Walk,
        seconds: 15.8,
        shape: [2.0, 0.0, -1.0, 1.5],
        appearance: 19,
        home: [0.15, -2.6, -25.0],
        noise: NoiseModel::KinectV1,
        color: VGA,
        truth: ([-15.0, 8.0, -5.0], [-1.5, 2.5, 1.5], -85.0),
        grain: 5.0,
        seed: 17,
    },
    Case {
        name: "unseen 2",
        routine: Routine::Walk,
        seconds: 15.8,
        shape: [-2.0, -1.5, 1.0, 0.0],
        appearance: 23,
        home: [-0.2, -2.3, 160.0],
        noise: NoiseModel::TimeOfFlight,
        color: HD,
        truth: ([59.0, 15.0, 10.0], [3.0, -3.0, 2.0], 5.0),
        grain: 3.0,
        seed: 18,
    },
    Case {
        name: "unseen 3",
        routine: Routine::Walk,
        seconds: 11.0,
        shape: [1.0, 1.0, 1.0, -2.0],
        appearance: 31,
        home: [0.0, -2.8, 90.0],
        noise: NoiseModel::KinectV1,
        color: HD,
        truth: ([-75.0, -20.0, 0.0], [-4.0, 1.0, 0.0], 66.0),
        grain: 3.0,
        seed: 19,
    },
    Case {
        name: "held out 1",
        routine: Routine::Walk,
        seconds: 13.0,
        shape: [-0.7, 1.8, -1.2, 0.6],
        appearance: 41,
        home: [0.2, -2.5, -70.0],
        noise: NoiseModel::TimeOfFlight,
        color: HD,
        truth: ([68.0, -6.0, 12.0], [1.0, -2.0, -2.5], -97.0),
        grain: 4.0,
        seed: 101,
    },
    Case {
        name: "held out 2",
        routine: Routine::Walk,
        seconds: 15.8,
        shape: [1.2, -2.0, 0.3, -0.9],
        appearance: 53,
        home: [-0.1, -2.7, 200.0],
        noise: NoiseModel::KinectV1,
        color: VGA,
        truth: ([-62.0, 18.0, -9.0], [2.5, 1.8, 0.9], 51.0),
        grain: 4.0,
        seed: 102,
    },
];

/// Frames in memory, with a calibration that is not theirs.
struct Remembered {
    frames: Vec<RgbdFrame>,
    stated: Calibration,
    next: usize,
}

impl RgbdSource for Remembered {
    fn calibration(&self) -> &Calibration {
        &self.stated
    }
    fn len(&self) -> Option<usize> {
        Some(self.frames.len())
    }
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, FormatError> {
        self.next += 1;
        Ok(self.frames.get(self.next - 1).cloned())
    }
    fn rewind(&mut self) -> Result<(), FormatError> {
        self.next = 0;
        Ok(())
    }
}

impl Case {
    fn sequence(&self) -> Sequence {
        let (t, r, delay) = self.truth;
        let rotation = Vector3::from(r).map(f64::to_radians);
        let color_from_depth = Rigid::from_parts(
            Vector3::from(t) * 1e-3,
            UnitQuaternion::from_scaled_axis(rotation),
        );
        let (width, height, focal) = self.color;
        let camera = Intrinsics {
            width,
            height,
            fx: focal,
            fy: focal,
            cx: 0.5 * f64::from(width) + 3.0,
            cy: 0.5 * f64::from(height) - 4.0,
        };
        let [x, z, turn] = self.home;
        let setting = Setting {
            color_camera: Some(SeparateColor {
                camera,
                color_from_depth,
                delay: delay * 1e-3,
            }),
            home: P3d::new(x, 0.0, z),
            turn: turn.to_radians(),
            room: Some(Room {
                back_z: -4.4,
                ..Room::default()
            }),
            noise: self.noise,
            routine: self.routine,
            seed: self.seed,
            ..Setting::default()
        };
        let mut actor = Actor {
            appearance: self.appearance.into(),
            ..Actor::default()
        };
        actor.shape.coefficients = self.shape.to_vec();
        Sequence::new(actor, setting)
    }

    fn remembered(&self) -> Remembered {
        let sequence = Arc::new(self.sequence());
        let frames = (self.seconds * 30.0) as u64;
        let mut stated = sequence.calibration().clone();
        stated.color_from_depth = Rigid::identity();
        let frame = |i| {
            let (mut frame, _) = sequence.frame(i);
            frame.color = frame
                .color
                .map(|c| grainy(&c, self.grain, self.seed ^ i << 20));
            frame
        };
        Remembered {
            frames: (0..frames).map(frame).collect(),
            stated,
            next: 0,
        }
    }

    fn run(&self) {
        let mut source = self.remembered();
        let settings = ExtrinsicsSettings::default();
        let start = cpu_seconds();
        let found = calibrate(&mut source, &settings);
        let seconds = cpu_seconds() - start;
        let name = self.name;
        match found {
            Err(e) => println!("{name:<38} {seconds:5.1} s  {e}"),
            Ok(found) => {
                let truth = *self.sequence().calibration().color_from_depth.iso();
                let got = *found.color_from_depth.iso();
                let off = (got.translation.vector - truth.translation.vector) * 1e3;
                let turn = (got.rotation * truth.rotation.inverse())
                    .angle()
                    .to_degrees();
                let time = 1e3 * found.color_time_offset_s - self.truth.2;
                let d = found.deviations;
                println!(
                    "{name:<38} {seconds:5.1} s  {:5.2} mm ({:+.1} {:+.1} {:+.1}; stated {:.1} {:.1} {:.1})  {turn:.3}° (stated {:.3} {:.3} {:.3})  {time:+.2} ms (stated {:.2})  residual {:.2} px, {:.0} % met",
                    off.norm(),
                    off.x,
                    off.y,
                    off.z,
                    1e3 * d.translation[0],
                    1e3 * d.translation[1],
                    1e3 * d.translation[2],
                    d.rotation[0].to_degrees(),
                    d.rotation[1].to_degrees(),
                    d.rotation[2].to_degrees(),
                    1e3 * d.time,
                    found.residual,
                    100.0 * found.met,
                );
            }
        }
    }
}

/// Adds nearly normal noise (Irwin–Hall of four).
fn grainy(image: &ColorImage, sigma: f32, seed: u64) -> ColorImage {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let data = image.data().iter().map(|c| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        let sum: u64 = (0..4).map(|k| state >> (12 * k) & 0xfff).sum();
        let normal = (sum as f32 - 8190.0) / 2364.8;
        (f32::from(*c) + sigma * normal + 0.5).clamp(0.0, 255.0) as u8
    });
    let data = data.collect();
    ColorImage::new(image.width(), image.height(), data).unwrap_or_default()
}

/// Time on processors so far (s), of all threads: other programs run beside. 0 where the system doesn't say (Linux does).
fn cpu_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // After the name in brackets, fields 14 and 15 of proc(5) are the 11th and 12th: ticks of 1/100 s.
    let fields = stat.rsplit(')').next().unwrap_or_default();
    let ticks = fields.split_whitespace().skip(11).take(2);
    ticks.filter_map(|t| t.parse::<f64>().ok()).sum::<f64>() * 0.01
}

fn main() {
    let wanted: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| !a.starts_with('-'))
        .collect();
    for case in &CASES {
        if wanted.is_empty() || wanted.iter().any(|w| case.name.contains(w.as_str())) {
            case.run();
        }
    }
}

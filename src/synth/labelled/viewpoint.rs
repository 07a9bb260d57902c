//! Random cameras: distance, height, tilt, roll, framing, resolution and noise.

use crate::Setting;
use rand::Rng;
use rand_pcg::Pcg64Mcg;
use tryon_geometry::camera::{Intrinsics, NoiseModel};
use tryon_geometry::math::{Camera, Rigid, World};

/// Distances of whole bodies and of busts, metres.
const DISTANCES: [[f64; 2]; 2] = [[1.5, 4.0], [0.8, 2.0]];
/// Share of frames from the waist up.
const BUSTS: f64 = 0.25;
/// Heights of the camera, metres.
const HEIGHTS: [f64; 2] = [0.6, 2.2];
/// Share of images of coarse depth, and their steps, millimetres.
const QUANTISED: f64 = 0.3;
/// See [`QUANTISED`].
const QUANTA: [u16; 2] = [10, 20];
/// Largest tilt, degrees.
const TILT: f64 = 25.0;
/// Share of upright mounted cameras, and the largest roll of any, degrees.
const PORTRAIT: f64 = 0.2;
/// See [`PORTRAIT`].
const ROLL: f64 = 5.0;
/// Largest part of the half width of the image by which a person stands beside its middle.
const ASIDE: f64 = 0.5;

/// Depth cameras: width, height, focal length, time of flight.
const CAMERAS: [(u32, u32, f64, bool); 6] = [
    (320, 240, 285.7, false),
    (320, 240, 262.5, false),
    (640, 480, 525.0, false),
    (512, 424, 365.5, true),
    (320, 288, 252.0, true),
    (424, 240, 212.0, false),
];

/// Camera and place of the person.
#[derive(Clone, Copy, Debug)]
pub(super) struct Viewpoint {
    pub(super) camera: Intrinsics,
    pub(super) noise: NoiseModel,
    pub(super) world_from_camera: Rigid<World, Camera>,
    /// The person's pelvis on the floor: x and z, world, metres.
    pub(super) place: [f64; 2],
    /// Heights of the pelvis and the head, metres.
    pub(super) heights: [f64; 2],
    /// Step of the depth, millimetres, where it is coarse.
    pub(super) quantum: Option<u16>,
}

impl Viewpoint {
    /// A random viewpoint of a person whose pelvis and head are at these heights, metres.
    pub(super) fn draw([pelvis, head]: [f64; 2], rng: &mut Pcg64Mcg) -> Self {
        let (width, height, f, time_of_flight) = CAMERAS[rng.random_range(0..CAMERAS.len())];
        let noise = if time_of_flight {
            NoiseModel::TimeOfFlight
        } else {
            NoiseModel::KinectV1
        };
        let portrait = rng.random_bool(PORTRAIT);
        let quarter = if !portrait {
            0.0
        } else if rng.random_bool(0.5) {
            90.0
        } else {
            -90.0
        };
        let bust = rng.random_bool(BUSTS);
        let range = DISTANCES[usize::from(bust)];
        let distance: f64 = rng.random_range(range[0]..range[1]);
        let camera_height = rng.random_range(HEIGHTS[0]..HEIGHTS[1]);
        let aim = if bust {
            // The head hangs below the pelvis of a person who bends down.
            let share: f64 = rng.random_range(0.6..1.0);
            pelvis + (head - pelvis) * share
        } else {
            pelvis * rng.random_range(0.8..1.2)
        };
        let down: f64 = (camera_height - aim).atan2(distance).to_degrees();
        let down = (down + rng.random_range(-3.0..3.0)).clamp(-TILT, TILT);
        let roll = quarter + rng.random_range(-ROLL..ROLL);
        let across = if portrait { height } else { width };
        let aside = rng.random_range(-ASIDE..ASIDE) * distance * f64::from(across) / (2.0 * f);
        let coarse = rng.random_bool(QUANTISED);
        Self {
            heights: [pelvis, head],
            quantum: coarse.then(|| rng.random_range(QUANTA[0]..=QUANTA[1])),
            camera: Intrinsics {
                width,
                height,
                fx: f,
                fy: f,
                cx: f64::from(width) * 0.5 - 0.5,
                cy: f64::from(height) * 0.5 - 0.5,
            },
            noise,
            world_from_camera: Setting::tilted(camera_height, down, roll),
            place: [aside, -distance],
        }
    }
}

//! Random cameras: distance, height, tilt, roll, framing, resolution and noise.

use super::settings::LabelledSettings;
use crate::Setting;
use rand::Rng;
use rand_pcg::Pcg64Mcg;
use tryon_geometry::camera::{Intrinsics, NoiseModel};
use tryon_geometry::math::{Camera, Rigid, World};

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
    pub(super) fn draw(
        settings: &LabelledSettings,
        [pelvis, head]: [f64; 2],
        rng: &mut Pcg64Mcg,
    ) -> Self {
        let (width, height, f, time_of_flight) = CAMERAS[rng.random_range(0..CAMERAS.len())];
        let noise = if time_of_flight {
            NoiseModel::TimeOfFlight
        } else {
            NoiseModel::KinectV1
        };
        let portrait = rng.random_bool(settings.portrait);
        let quarter = if !portrait {
            0.0
        } else if rng.random_bool(0.5) {
            90.0
        } else {
            -90.0
        };
        let bust = rng.random_bool(settings.busts);
        let [near, far] = settings.distances[usize::from(bust)];
        let distance: f64 = rng.random_range(near..far);
        let [low, high] = settings.heights;
        let camera_height = rng.random_range(low..high);
        let aim = if bust {
            // The head hangs below the pelvis of a person who bends down.
            let share: f64 = rng.random_range(0.6..1.0);
            pelvis + (head - pelvis) * share
        } else {
            pelvis * rng.random_range(0.8..1.2)
        };
        let down: f64 = (camera_height - aim).atan2(distance).to_degrees();
        let down = (down + rng.random_range(-3.0..3.0)).clamp(-settings.tilt, settings.tilt);
        let roll = quarter + rng.random_range(-settings.roll..settings.roll);
        let across = if portrait { height } else { width };
        let aside =
            rng.random_range(-settings.aside..settings.aside) * distance * f64::from(across)
                / (2.0 * f);
        let coarse = rng.random_bool(settings.quantised);
        Self {
            heights: [pelvis, head],
            quantum: coarse.then(|| rng.random_range(settings.quanta[0]..=settings.quanta[1])),
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

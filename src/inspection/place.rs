//! The place of a camera: its pose, room for a person, things in the way, the back of the room.

use crate::person_fit::{FitRange, person_fit};
use crate::placement::{self, CameraPlacement};
use crate::settings::{InspectionSettings, PersonSize};
use serde::Serialize;
use tryon_geometry::camera::{DepthImage, Intrinsics, PictureTurn};
use tryon_geometry::math::V3;
use tryon_geometry::math::order_statistics::{median, quantile};
use tryon_geometry::spatial::OrganisedCloud;
use tryon_tracking::segment::ScenePlane;

/// Distance from the floor up to which a point belongs to it, share of its distance from the camera: three times the noise
/// of the Kinect v1 at 3 m, on top of [`FLOOR`].
const FLOOR_SHARE: f32 = 0.015;
/// Least distance from the floor that still belongs to it (m).
const FLOOR: f32 = 0.05;
/// Quantile of things in the way that counts as their distance.
const IN_FRONT: f64 = 0.1;

/// Place of a camera.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct PlaceReport {
    /// Pose over the floor, if a floor was found in at least half of the images.
    pub placement: Option<CameraPlacement>,
    /// Turn after which a floor is found, where none is found upright.
    pub looks_turned: Option<PictureTurn>,
    /// Distances at which a whole person is in view; without a floor, of a level camera at
    /// [`InspectionSettings::assumed_height`].
    pub person: Option<FitRange>,
    /// Share of the picture covered by things nearer than that, the floor left out.
    pub in_the_way: f64,
    /// Distance of these things along the floor (m).
    pub nearest_thing: Option<f64>,
    /// Distance of the back of the room along the floor (m).
    pub room: Option<f64>,
}

/// Inspects the place of a camera from depth images over some time.
pub fn inspect_place(
    camera: &Intrinsics,
    images: &[DepthImage],
    settings: &InspectionSettings,
    person: &PersonSize,
) -> PlaceReport {
    let clouds = images.iter().map(|i| placement::cloud(camera, i, settings));
    let clouds: Vec<OrganisedCloud> = clouds.collect();
    let floors: Vec<Option<ScenePlane>> = clouds.iter().map(placement::floor).collect();

    let poses: Vec<CameraPlacement> = (floors.iter().flatten())
        .map(CameraPlacement::over)
        .collect();
    let is_found = 2 * poses.len() >= floors.len();
    let pose = CameraPlacement::median(&poses).filter(|_| is_found);
    let height = pose.map_or(settings.assumed_height, |p| p.height);
    let down = pose.map_or(0.0, |p| p.down_deg.to_radians());
    let fit = person_fit(camera, height, down, person);

    let views: Vec<FloorDistances> = (clouds.iter().zip(&floors))
        .map(|(cloud, floor)| FloorDistances::new(cloud, floor.as_ref()))
        .collect();
    let nearer = fit.map_or(0.0, |f| f.from);
    let turned = images.first().filter(|_| pose.is_none());
    PlaceReport {
        placement: pose,
        looks_turned: turned.and_then(|i| placement::turn_with_floor(camera, i, settings)),
        person: fit,
        in_the_way: middle(views.iter().map(|v| v.covered(nearer))).unwrap_or(0.0),
        nearest_thing: middle(views.iter().filter_map(|v| v.distance(nearer))),
        room: middle(views.iter().filter_map(|v| v.back(settings.room_share))),
    }
}

fn middle(values: impl Iterator<Item = f64>) -> Option<f64> {
    median(&mut values.collect::<Vec<_>>())
}

/// Distances along the floor (m) of the cells of an image that show no floor, and of those in the middle half of its columns.
struct FloorDistances {
    all: Vec<f64>,
    middle: Vec<f64>,
    cells: usize,
}

impl FloorDistances {
    fn new(cloud: &OrganisedCloud, floor: Option<&ScenePlane>) -> Self {
        let columns = cloud.size().0;
        let mut view = Self {
            all: Vec::new(),
            middle: Vec::new(),
            cells: cloud.depth.len(),
        };
        for cell in (0..cloud.depth.len()).filter(|c| cloud.depth[*c] > 0.0) {
            let p = cloud.centre(cell);
            let is_floor = |f: &ScenePlane| f.distance(&p) < FLOOR + FLOOR_SHARE * p.coords.norm();
            if floor.is_some_and(is_floor) {
                continue;
            }
            let up = floor.map_or(-V3::y(), |f| f.normal.cast::<f32>());
            let distance = f64::from((p.coords - up * up.dot(&p.coords)).norm());
            view.all.push(distance);
            if (columns / 4..columns - columns / 4).contains(&(cell % columns)) {
                view.middle.push(distance);
            }
        }
        view
    }

    /// Share of the picture nearer than `limit`.
    fn covered(&self, limit: f64) -> f64 {
        let near = self.all.iter().filter(|d| **d < limit).count();
        near as f64 / self.cells.max(1) as f64
    }

    /// Distance of what is nearer than `limit`.
    fn distance(&self, limit: f64) -> Option<f64> {
        let near = self.all.iter().copied().filter(|d| *d < limit);
        quantile(&mut near.collect::<Vec<_>>(), IN_FRONT)
    }

    /// Distance of the back of the room.
    fn back(&self, share: f64) -> Option<f64> {
        quantile(&mut self.middle.clone(), share)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_geometry::math::{Camera, Rigid, World};
    use tryon_synth::{Actor, NoiseModel, Room, Routine, Sequence, Setting};

    /// Depth images of a synthetic room, one a second.
    fn images(setting: &Setting, number: u64) -> Vec<DepthImage> {
        let sequence = Sequence::new(Actor::default(), setting.clone());
        let image = |second| sequence.frame(30 * second).0.depth;
        (0..number).map(image).collect()
    }

    fn setting(pose: Rigid<World, Camera>, noise: NoiseModel, routine: Routine) -> Setting {
        Setting {
            world_from_camera: pose,
            noise,
            routine,
            color: false,
            ..Setting::default()
        }
    }

    fn inspect(setting: &Setting, number: u64) -> PlaceReport {
        let (settings, person) = Default::default();
        inspect_place(
            &setting.camera,
            &images(setting, number),
            &settings,
            &person,
        )
    }

    #[test]
    fn poses_are_those_of_the_scene() {
        for noise in [NoiseModel::KinectV1, NoiseModel::TimeOfFlight] {
            for (height, down, roll) in [
                (1.0, 3.0, 0.0),
                (0.8, 0.0, 3.0),
                (1.5, 12.0, -4.0),
                (2.1, 24.0, 2.0),
            ] {
                for routine in [Routine::Empty, Routine::Still] {
                    let pose = Setting::tilted(height, down, roll);
                    let place = inspect(&setting(pose, noise, routine), 3);
                    let got = place.placement.expect("a floor");
                    let errors = [
                        50.0 * (got.height - height),
                        2.0 * (got.down_deg - down),
                        2.0 * (got.roll_deg - roll),
                    ];
                    // 2 cm, half a degree.
                    let is_right = errors.iter().all(|e| e.abs() < 1.0);
                    assert!(is_right, "{noise:?} {height} {down} {roll}: {got:?}");
                }
            }
        }
    }

    #[test]
    fn people_too_near_are_in_the_way_and_the_wall_is_the_back() {
        let near = Setting {
            home: tryon_geometry::math::P3d::new(0.0, 0.0, -1.2),
            ..setting(
                Setting::tilted(1.0, 3.0, 0.0),
                NoiseModel::KinectV1,
                Routine::Still,
            )
        };
        let place = inspect(&near, 1);
        assert!(place.in_the_way > 0.1, "{place:?}");
        assert!(
            (1.0..1.3).contains(&place.nearest_thing.expect("a person")),
            "{place:?}"
        );

        let empty = setting(
            Setting::tilted(1.0, 3.0, 0.0),
            NoiseModel::KinectV1,
            Routine::Empty,
        );
        let place = inspect(&empty, 1);
        assert!(place.in_the_way < 0.02, "{place:?}");
        let wall = -empty.room.expect("a room").back_z;
        assert!(
            (place.room.expect("a wall") - wall).abs() < 0.15,
            "{place:?} {wall}"
        );
    }

    #[test]
    fn cameras_on_their_side_are_told_by_the_turn_that_finds_the_floor() {
        for (degrees, turned) in [
            (90.0, PictureTurn::Quarter),
            (270.0, PictureTurn::ThreeQuarters),
        ] {
            // Turned counter-clockwise, so that its picture needs the turn clockwise.
            let pose = Setting::tilted(1.0, 3.0, degrees);
            let mut scene = setting(pose, NoiseModel::KinectV1, Routine::Empty);
            // A side wall would pass for a floor.
            scene.room = Some(Room {
                left_x: f64::NEG_INFINITY,
                ..Room::default()
            });
            let place = inspect(&scene, 1);
            assert_eq!(place.placement, None);
            assert_eq!(place.looks_turned, Some(turned), "{degrees}");
        }
    }
}

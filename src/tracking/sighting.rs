//! The subject as a colour image shows them: yaw and joints that join what the part network sees.

use crate::segment::part_network::{JointProposal, PersonCells, PersonParts, YawBelief};
use crate::settings::SightingSettings;
use serde::{Deserialize, Serialize};
use tryon_body::TrunkSides;
use tryon_geometry::math::{P3d, V3};

/// A person found in the colour image of a frame, in the depth camera's frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ColorSighting {
    /// Time of the frame, nanoseconds.
    pub time_ns: u64,
    /// Shoulders and hips, metres.
    pub trunk: TrunkSides,
    /// Joints that depth shows.
    pub joints: Vec<JointProposal>,
}

impl ColorSighting {
    /// True for one of this person, young enough for a frame of that time.
    pub(crate) fn is_of(
        &self,
        person: &PersonCells<'_>,
        time_ns: u64,
        settings: &SightingSettings,
    ) -> bool {
        let age = time_ns.checked_sub(self.time_ns).map(|ns| ns as f64 * 1e-9);
        let Some(trunk) = self.middle().filter(|_| !person.cells.is_empty()) else {
            return false;
        };
        let off = (trunk - person.middle().cast::<f64>()).cast();
        age.is_some_and(|s| s <= settings.oldest) && level(&off, &person.up).norm() < settings.apart
    }

    /// Joins yaw and joints to what the part network saw of the same person.
    pub(crate) fn join(
        &self,
        person: &PersonCells<'_>,
        settings: &SightingSettings,
        parts: &mut PersonParts,
    ) {
        if let Some(yaw) = self.yaw(person, settings) {
            parts.yaw = parts.yaw.and(&yaw);
        }
        parts.joints.extend(&self.joints);
    }

    /// Belief in the yaw that it shows; `None` for a trunk without one.
    pub(crate) fn yaw(
        &self,
        person: &PersonCells<'_>,
        settings: &SightingSettings,
    ) -> Option<YawBelief> {
        let yaw = self.trunk.yaw(&person.up)? as f32;
        let deviation = settings.yaw_deviation;
        let cells = person.cells.len();
        Some(YawBelief::about(yaw, deviation, settings.least, cells))
    }

    /// Middle of the trunk's known sides.
    fn middle(&self) -> Option<P3d> {
        let pairs = [self.trunk.shoulders, self.trunk.hips];
        let points = || pairs.iter().flatten().flatten();
        let sum: nalgebra::Vector3<f64> = points().map(|p| p.coords).sum();
        (points().count() > 0).then(|| P3d::from(sum / points().count() as f64))
    }
}

/// Part of a vector across gravity.
fn level(v: &V3, up: &V3) -> V3 {
    v - up * up.dot(v)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::segment::part_network::YAW_BINS;
    use crate::start::person_cells;
    use crate::test_scene::{DepthScan, TestScene};
    use nalgebra::Vector3;

    /// A sighting of the scene's subject, as it stands, moved aside by `aside` metres.
    fn sighting(scene: &TestScene, aside: f64) -> ColorSighting {
        let joints = scene.joints(&scene.pose);
        let classes = &scene.model.part_classes;
        let at = |class: u8| {
            let place = classes.anchor_of(class, &joints).expect("an anchor");
            place + Vector3::x() * aside
        };
        use crate::part_classes::PartKind::{Hip, Shoulder};
        use tryon_body::parts::BodySide::{Left, Right};
        let pair = |kind: crate::part_classes::PartKind| {
            Some([at(kind.class(Left)), at(kind.class(Right))])
        };
        ColorSighting {
            time_ns: 1_000_000_000,
            trunk: TrunkSides {
                shoulders: pair(Shoulder),
                hips: pair(Hip),
            },
            joints: Vec::new(),
        }
    }

    #[test]
    fn sightings_of_others_and_old_ones_are_left() {
        let scene = TestScene::new(300, 480);
        let scan = DepthScan::new(&scene.model, &scene.depth(&scene.pose)).background_removed();
        let (observation, settings) = (scan.observation(), SightingSettings::default());
        let up = -Vector3::y();
        let person = person_cells(&observation, &up);
        let is_of =
            |aside: f64, time_ns: u64| sighting(&scene, aside).is_of(&person, time_ns, &settings);
        assert!(is_of(0.0, 1_000_000_000) && is_of(0.1, 1_200_000_000));
        assert!(!is_of(0.6, 1_000_000_000), "somebody beside");
        assert!(!is_of(0.0, 1_400_000_000), "too old");
        assert!(!is_of(0.0, 900_000_000), "of a later frame");
        let nobody = ColorSighting::default();
        assert!(!nobody.is_of(&person, 0, &settings));
    }

    #[test]
    fn a_sighting_decides_what_the_part_network_leaves_open() {
        let scene = TestScene::new(300, 480);
        let scan = DepthScan::new(&scene.model, &scene.depth(&scene.pose)).background_removed();
        let (observation, settings) = (scan.observation(), SightingSettings::default());
        let up = -Vector3::y();
        let person = person_cells(&observation, &up);
        let mut parts = PersonParts::default();
        // Front and back are as likely.
        parts.yaw.bins[0] = 0.5;
        parts.yaw.bins[YAW_BINS / 2] = 0.5;
        parts.yaw.cells = person.cells.len();
        sighting(&scene, 0.0).join(&person, &settings, &mut parts);
        assert!(parts.yaw.bins[0] > 0.98, "{:?}", parts.yaw.bins);
        // A trunk that nobody saw says nothing.
        let before = parts.yaw;
        ColorSighting::default().join(&person, &settings, &mut parts);
        assert_eq!(parts.yaw, before);
    }
}

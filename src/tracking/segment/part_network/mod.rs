//! Body parts, joints and yaw of a person from one depth image, by a convolutional network.
//!
//! The network sees the person's readings in an upright square window and gives, in a quarter of its resolution, a class for
//! each place, a heat map with depth for each class's anchor, and the yaw. `tools/part_network` trains it on synthetic people.
//!
//! Classes are numbers here; `tracking` holds their meaning.

mod class_map;
mod crop;
mod decode;
mod network;
mod yaw;

pub use class_map::ClassMap;
pub use crop::{CROP_CHANNELS, CROP_SIDE, PersonCells, PersonCrop};
pub use decode::JointProposal;
pub use network::{CLASSES, PartNetwork, PartNetworkError};
pub use yaw::{YAW_BINS, YawBelief};

/// Parts of one person as the network sees them, and its scratch.
#[derive(Clone, Debug, Default)]
pub struct PersonParts {
    /// Classes of the person's cells.
    pub map: ClassMap,
    /// Belief in the yaw.
    pub yaw: YawBelief,
    /// Proposed joints: at most two a class, the likelier first, classes ascending.
    pub joints: Vec<JointProposal>,
    picture: Vec<f32>,
}

impl PartNetwork {
    /// Classes of the cells, proposed joints and yaw of a person; nothing of one without a reading.
    pub fn infer(&self, person: &PersonCells<'_>, parts: &mut PersonParts) {
        let seen = PersonCrop::new(person).and_then(|crop| {
            crop.picture(person, &mut parts.picture);
            // A network that was read runs on every picture.
            Some((crop, self.run(&parts.picture).ok()?))
        });
        let Some((crop, output)) = seen else {
            let picture = std::mem::take(&mut parts.picture);
            *parts = PersonParts {
                picture,
                ..PersonParts::default()
            };
            return;
        };
        output.class_map(&crop, person, &mut parts.map);
        parts.yaw = YawBelief::of_logits(&output.yaw, person.cells.len());
        parts.joints = output.proposals(&crop, person, &parts.picture);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_geometry::camera::Intrinsics;
    use tryon_geometry::math::V3;
    use tryon_geometry::spatial::OrganisedCloud;

    #[test]
    fn nobody_has_no_parts() {
        let camera = Intrinsics {
            width: 32,
            height: 24,
            fx: 30.0,
            fy: 30.0,
            cx: 15.5,
            cy: 11.5,
        };
        let cloud = OrganisedCloud::new(&camera, None);
        let mut parts = PersonParts::default();
        for cells in [&[][..], &[3, 4]] {
            let up = V3::new(0.0, -1.0, 0.0);
            let nobody = PersonCells {
                cloud: &cloud,
                cells,
                up,
            };
            PartNetwork::embedded().infer(&nobody, &mut parts);
            assert!(parts.map.is_empty() && parts.joints.is_empty());
            assert_eq!(parts.yaw, YawBelief::default());
        }
    }
}

//! A subject's readings in one frame, as both eyes see them.

use crate::model::TrackerModel;
use crate::registration::Observation;
use crate::segment::part_network::{PersonCells, PersonParts, YawBelief};
use crate::sighting::ColorSighting;
use crate::start::{BodyProposals, person_cells};
use nalgebra::Vector3;

/// The readings of a subject and a sighting of it in colour.
#[derive(Clone, Copy)]
pub(super) struct SubjectView<'a> {
    pub model: &'a TrackerModel,
    pub observation: &'a Observation<'a>,
    /// Unit vector against gravity, camera frame.
    pub up: Vector3<f64>,
    /// Of this subject.
    pub sighting: Option<&'a ColorSighting>,
}

impl<'a> SubjectView<'a> {
    fn person(&self) -> PersonCells<'a> {
        person_cells(self.observation, &self.up)
    }

    /// Body parts, joints and yaw by the part network, joined with the sighting in colour.
    pub(super) fn see_parts(&self, parts: &mut PersonParts) {
        let person = self.person();
        self.model.part_network.infer(&person, parts);
        if let Some(sighting) = self.sighting {
            sighting.join(&person, &self.model.config.assess.sighting, parts);
        }
    }

    /// Poses and joints from what was seen.
    pub(super) fn proposals(&self, parts: &PersonParts) -> BodyProposals {
        BodyProposals::new(self.model, self.observation, &self.up, parts)
    }

    /// Yaw in colour alone.
    pub(super) fn yaw_in_color(&self) -> Option<YawBelief> {
        let settings = &self.model.config.assess.sighting;
        self.sighting?.yaw(&self.person(), settings)
    }
}

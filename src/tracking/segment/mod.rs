//! The pixels of the person: floor, background, nearest body, edges, body parts.

pub(crate) mod components;
pub(crate) mod edges;
pub(crate) mod expected_body;
pub(crate) mod extremities;
#[cfg(test)]
mod fixture;
pub(crate) mod hands;
pub mod part_network;
pub(crate) mod person;
mod plane_bands;
pub(crate) mod plane_search;
mod planes;
pub(crate) mod refusals;

pub use edges::{Contour, contour};
pub use extremities::{Extremity, extremities};
pub use person::{PersonChoice, PersonPrior, PersonSearch, SegmentScratch, find_person};
pub use plane_search::find_planes;
pub use planes::{ScenePlane, ScenePlanes};
pub use refusals::{CandidateBox, Refusal, Refusals};

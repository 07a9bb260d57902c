//! The pixels of the person: floor, background, nearest body, edges, body parts.

mod components;
mod edges;
mod expected_body;
mod extremities;
#[cfg(test)]
mod fixture;
mod hands;
pub mod part_forest;
mod person;
mod plane_bands;
mod plane_search;
mod planes;
mod refusals;

pub use edges::{Contour, contour};
pub use extremities::{Extremity, extremities};
pub use person::{PersonChoice, PersonPrior, PersonSearch, SegmentScratch, find_person};
pub use plane_search::find_planes;
pub use planes::{ScenePlane, ScenePlanes};
pub use refusals::{CandidateBox, Refusal, Refusals};

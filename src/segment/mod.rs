//! Which pixels are the person: floor, background, nearest body, edges.

mod edges;
mod extremities;
mod person;
mod planes;

pub use edges::{Contour, contour};
pub use extremities::{Extremity, extremities};
pub use person::{PersonSearch, Prior, SegmentScratch, find_person};
pub use planes::{Plane, ScenePlanes, find_planes};

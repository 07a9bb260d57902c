//! Tests of the whole solver: closed forms, measured fabrics, faults, extreme scenes.

use super::*;

mod drape_coefficient;
mod faults;
mod incline;
mod momentum;
mod sheets;
mod skips;
mod small_scenes;
mod static_drape;
mod stress;
mod twist;

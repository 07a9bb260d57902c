//! Run time against error: standard scenes, methods side by side, tables and plots behind `tryon bench`.
//!
//! A benchmark fills a [`Table`]; [`Table::write`] leaves it as CSV, JSON and one SVG plot per measure of error.

pub mod ablation;
pub mod cloth;
pub mod cloth_rest;
pub mod dance;
mod inside;
mod plot;
mod scene;
pub mod scenes;
mod spoil;
pub mod stills;
mod table;
pub mod tracking;

pub use inside::Solid;
pub use plot::run_time_against_error;
pub use scene::{Scene, SceneTruth};
pub use table::{EvaluateError, Row, Table};

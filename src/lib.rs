//! `tryon`: the library of a virtual try-on: tracking, cloth simulation, dressing and compositing.
//!
//! Synchronous code without network, clock or global state; the services are thin shells around its `step`
//! functions. A module uses only modules of strictly lower layers; `tests/tidy.rs` checks the layers below.
//!
//! Start at [`mirror`], the chain from a frame to a picture, or at its steps: [`tracking`], [`cloth`] and [`composite`].

// Layer 0
pub mod math;
pub mod par;
// Layer 1
pub mod camera;
pub mod linear;
pub mod mesh;
// Layer 2
pub mod formats;
pub mod raster;
pub mod spatial;
// Layer 3
pub mod body;
pub mod contact;
pub mod elastic;
pub mod garment;
pub mod registration;
pub mod segment;
// Layer 4
pub mod cloth;
pub mod clothcap;
pub mod composite;
pub mod tracking;
// Layer 5
pub mod dressing;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod offline;
pub mod session;
pub mod synth;
// Layer 6
pub mod mirror;
// Layer 7
pub mod evaluate;

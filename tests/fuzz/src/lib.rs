//! Fuzz targets for every decoder of outside data: structure-aware mutations of valid inputs, on stable Rust.
//!
//! A target is a decoder with seeds made by our own writers ([`targets`]). A campaign mutates seeds and corpus
//! ([`mutate`]) by random numbers of `arbtest`, and fails on a panic, on memory beyond the target's allowance per input
//! byte, on an abort, and on a time-out. Failing inputs are saved under `corpus/TARGET`, where `tests/regressions.rs`
//! replays them.

pub mod bundle;
pub mod campaign;
pub mod corpus;
pub mod execute;
pub mod mutate;
mod pack;
pub mod supervise;
pub mod targets;

/// Counts the bytes that decoders hold.
#[global_allocator]
static HEAP: peak_alloc::PeakAlloc = peak_alloc::PeakAlloc;

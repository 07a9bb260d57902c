//! One binary for the tests that cross modules or need real data.
#![allow(clippy::unwrap_used, clippy::expect_used)] // tests stop at the first fault
#![allow(clippy::print_stdout)] // and say what they measured

mod bending;
mod captured_garments;
mod cloth;
mod color;
mod common;
mod company;
mod dance;
mod dressing_meshes;
mod drift;
mod garment_capture;
mod garment_stream;
mod garments;
mod offline_outfit;
mod offline_steps;
mod on_person;
mod others;
mod returning;
mod room_light;
mod seat;
mod size;
mod sleep;
mod starts;
mod stress;
mod tracked;
mod tracking;
mod wear;

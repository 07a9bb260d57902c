//! One binary for the tests that cross modules or need real data.
#![allow(clippy::unwrap_used, clippy::expect_used)] // tests stop at the first fault

mod common;
<<<<<<< HEAD
mod garment_stream;
=======
mod garments;
>>>>>>> 50cedcc (Drape garments in small steps on a coarse mesh; draw five more; suggest sizes with rooms and hem)
mod tracking;

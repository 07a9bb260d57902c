//! Pictures of synthetic users with known truth.

pub(crate) mod fixture;
mod hands;
mod off_person;
mod own_clothes;
mod pictures;

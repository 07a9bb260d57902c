//! Garments made by others, as ours.

mod garmentcode;

pub use garmentcode::from_garmentcode;

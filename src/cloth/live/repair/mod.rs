//! Repair of worn garments: intersections, and bodies that teleport.

pub(crate) mod reference;
pub(crate) mod teleport;
pub(crate) mod untangle;
mod untangler;

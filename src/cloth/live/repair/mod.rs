//! Repair of worn garments: intersections, sleeves that lost their arm, and bodies that teleport.

pub(crate) mod reference;
pub mod sleeve_rings;
mod smooth_locally;
pub(crate) mod teleport;
pub(crate) mod untangle;
pub mod untangler;

//! Repair of worn garments: intersections, sleeves that lost their arm, and bodies that teleport.

pub(super) mod recover_sleeves;
pub(super) mod reference;
pub mod sleeve_rings;
mod smooth_locally;
pub(super) mod teleport;
pub(super) mod untangle;
pub mod untangler;

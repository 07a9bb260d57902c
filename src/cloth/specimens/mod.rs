//! Specimens of textile tests: strips, discs, and the closed form of a bent strip.

pub(crate) mod drape_disc;
pub(crate) mod elastica;
pub(crate) mod strip;

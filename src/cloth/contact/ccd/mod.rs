//! Continuous collision detection: first time of impact of vertex–face and edge–edge pairs, conservative in rounding.
//!
//! - [`time_of_impact`]`(&PairMotion, min_separation) -> Option<f64>` for one pair, [`has_impact`] for the yes or no;
//! - [`first_impact`]`(&[ContactPair], &StepMotion, Par) -> Option<FirstImpact>` for the candidates of a step.
//!
//! Method: time [0, 1] is covered from the left by certificates of separation. A fixed plane through the origin holds
//! over the span in which all corners of the moving difference of the pair lie beyond it; the plane of the pair itself
//! holds until the next root of the coplanarity cubic. Where neither gets further, the pair touches up to rounding.
//! Certificates are verified with forward error bounds, so no impact is missed; how they are found doesn't matter.
//! Kinetic separating planes stand beside conservative advancement (Mirtich 1996; Li et al. 2021, "Codimensional
//! Incremental Potential Contact", additive CCD), whose steps are bounded by speeds alone.

mod arithmetic;
mod closest_direction;
mod coplanarity;
mod pair_motion;
mod separating_plane;
mod step_bound;
mod time_of_impact;

pub use pair_motion::{PairKind, PairMotion};
pub use step_bound::{FirstImpact, StepMotion, first_impact};
pub use time_of_impact::{has_impact, time_of_impact};

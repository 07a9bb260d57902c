//! Assessment of a fitted pose: agreement with its frame, confidence of its joints, person or thing, front or back, seated or standing.

pub(crate) mod agreement;
pub(crate) mod confidence;
pub(crate) mod facing_belief;
pub(crate) mod person_evidence;
pub(crate) mod seat;

pub use agreement::Agreement;
pub(crate) use agreement::AgreementScratch;
pub(crate) use confidence::confidence;
pub use confidence::{ConfidenceReason, JointConfidence};
pub(crate) use facing_belief::{FacingBelief, FacingVerdict};
pub(crate) use person_evidence::{PersonBelief, PersonEvidence, Verdict};
pub(crate) use seat::{Seat, sits};

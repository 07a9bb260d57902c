//! How sure the girths are: the covariance of size along each girth's gradient.

use super::size::SizeEstimate;
use crate::model::TrackerModel;
use crate::state::TrackerState;
use nalgebra::DVector;

/// Standard deviations of the girths that sizes go by, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GirthDeviations {
    /// Of the chest.
    pub chest: f64,
    /// Of the natural waist.
    pub waist: f64,
    /// Of the hip.
    pub hip: f64,
}

impl SizeEstimate {
    /// Standard deviations of the girths; `None` before the first frame, and for a body that was measured before.
    pub(crate) fn girth_deviations(&self, model: &TrackerModel) -> Option<GirthDeviations> {
        let gradients = model.girth_gradients()?;
        let precision = self.precision(model)?.cholesky()?;
        // A coefficient's prior of `prior` per point stands for a variance of 1.
        let unit = model.config.shape.size.prior;
        let deviation = |g: &DVector<f64>| (unit * g.dot(&precision.solve(g))).sqrt();
        let [chest, waist, hip] = [0, 1, 2].map(|k| deviation(&gradients.girths[k]));
        Some(GirthDeviations { chest, waist, hip })
    }
}

impl TrackerState {
    /// Standard deviations of the subject's girths, as far as its frames so far show them; `None` before the first frame, for
    /// a body that was measured before, and for a template that a tape cannot measure.
    pub fn girth_deviations(&self, model: &TrackerModel) -> Option<GirthDeviations> {
        self.size.girth_deviations(model)
    }
}

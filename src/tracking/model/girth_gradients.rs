//! How girths change with size and shape, about the mean body.

use nalgebra::DVector;
use tryon_body::measure::{Measurements, measure};
use tryon_body::{BodyShape, Template};

/// Gradients of chest, natural waist and hip along the directions of size, metres per unit.
#[derive(Clone, Debug)]
pub(crate) struct GirthGradients {
    pub girths: [DVector<f64>; 3],
}

/// Step of the differences: of a coefficient, standard deviations, and of a bone's scale. A tape's levels jump by
/// millimetres, which a smaller step would take for slope.
const STEPS: [f64; 2] = [0.5, 0.02];

/// Chest, natural waist and hip, metres.
fn girths(of: &Measurements) -> [f64; 3] {
    [of.chest, of.natural_waist, of.hip]
}

impl GirthGradients {
    /// Central differences about the mean body along coefficients, and the scales of `bones`, one a direction; `None` for a
    /// template that a tape cannot measure.
    pub(crate) fn new(template: &Template, bones: &[Option<usize>]) -> Option<Self> {
        let mut gradients = [(); 3].map(|()| DVector::zeros(bones.len()));
        for (d, bone) in bones.iter().enumerate() {
            let step = STEPS[usize::from(bone.is_some())];
            let moved = |by: f64| {
                let mut shape = BodyShape::default();
                match bone {
                    None => {
                        shape.coefficients.resize(d + 1, 0.0);
                        shape.coefficients[d] = by;
                    }
                    Some(j) => {
                        shape.bone_scales.resize(template.skeleton().len(), 1.0);
                        shape.bone_scales[*j] += by;
                    }
                }
                measure(template, &template.personalise(&shape)).ok()
            };
            let [more, less] = [girths(&moved(step)?), girths(&moved(-step)?)];
            for (k, gradient) in gradients.iter_mut().enumerate() {
                gradient[d] = (more[k] - less[k]) / (2.0 * step);
            }
        }
        Some(Self { girths: gradients })
    }
}

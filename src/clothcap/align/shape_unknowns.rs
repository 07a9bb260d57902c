//! Shape coefficients and bone scales as unknowns of a fit.

use tryon_body::parts::BodySegment;
use tryon_body::{BodyShape, Template};

/// Standard deviation of the scale of a bone.
const SCALE_DEVIATION: f64 = 0.05;
/// Largest change of a bone's length.
const SCALES: [f64; 2] = [0.7, 1.4];
/// Largest shape coefficient, standard deviations.
const COEFFICIENT: f64 = 4.0;

/// A shape coefficient or the scale of a bone.
#[derive(Clone, Copy, Debug)]
pub(super) enum ShapeUnknown {
    Coefficient(usize),
    Bone(usize),
}

impl ShapeUnknown {
    pub(super) fn of(self, shape: &mut BodyShape) -> &mut f64 {
        match self {
            Self::Coefficient(d) => &mut shape.coefficients[d],
            Self::Bone(j) => &mut shape.bone_scales[j],
        }
    }
    /// Value, mean and standard deviation.
    pub(super) fn prior(self, shape: &BodyShape) -> (f64, f64, f64) {
        match self {
            Self::Coefficient(d) => (shape.coefficients[d], 0.0, 1.0),
            Self::Bone(j) => (shape.bone_scales[j], 1.0, SCALE_DEVIATION),
        }
    }
    pub(super) fn limits(self) -> [f64; 2] {
        match self {
            Self::Coefficient(_) => [-COEFFICIENT, COEFFICIENT],
            Self::Bone(_) => SCALES,
        }
    }
}

/// Shape unknowns of a stage.
pub(super) struct ShapeUnknowns {
    pub(super) all: Vec<ShapeUnknown>,
}

impl ShapeUnknowns {
    /// All coefficients and the scales of all bones with a length; `shape` gets an entry for each.
    pub(super) fn new(template: &Template, shape: &mut BodyShape, shaped: bool) -> Self {
        let skeleton = template.skeleton();
        let coefficients = template.shape_space().map_or(0, |s| s.names.len());
        shape.coefficients.resize(coefficients, 0.0);
        shape.bone_scales.resize(skeleton.len(), 1.0);
        if !shaped {
            return Self { all: Vec::new() };
        }
        let is_bone = |j: &usize| {
            let segment = template.parts().segment(*j);
            let ends = matches!(segment, BodySegment::Fingers | BodySegment::Toes);
            skeleton.joints()[*j].parent.is_some() && !ends
        };
        let bones = (0..skeleton.len()).filter(is_bone).map(ShapeUnknown::Bone);
        let mut all: Vec<_> = (0..coefficients).map(ShapeUnknown::Coefficient).collect();
        all.extend(bones);
        Self { all }
    }
    pub(super) fn len(&self) -> usize {
        self.all.len()
    }
}

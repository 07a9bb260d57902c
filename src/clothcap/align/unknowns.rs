//! Unknowns of the body model's fit with their priors: joint angles, shape coefficients, bone scales.

use crate::dense_equations::DenseEquations;
use crate::settings::ModelFitSettings;
use tryon_body::parts::BodySegment;
use tryon_body::{BodyShape, Template};

/// Priors of joint angles, shape `[angles]` each.
#[derive(Debug)]
pub(super) struct AnglePriors {
    /// Standard deviations about those of the start, radians.
    pub(super) deviations: Vec<f64>,
    /// Precisions about those of the rest pose: spine, neck and head straight.
    pub(super) straight: Vec<f64>,
}

impl AnglePriors {
    pub(super) fn new(template: &Template, settings: &ModelFitSettings) -> Self {
        use BodySegment::*;
        let skeleton = template.skeleton();
        let mut deviations = vec![settings.free_angles; skeleton.dofs()];
        let mut straight = vec![0.0; skeleton.dofs()];
        for (j, joint) in skeleton.joints().iter().enumerate() {
            let at = skeleton.dof_offset(j);
            let own = at..at + joint.motion.dofs();
            let precision = match template.parts().segment(j) {
                Neck | Head => settings.straight_head.powf(-2.0),
                Abdomen | Chest => settings.straight_spine.powf(-2.0),
                Collar | Hand | Fingers | Foot | Toes => 0.0,
                _ => continue,
            };
            deviations[own.clone()].fill(settings.stiff_angles);
            straight[own].fill(precision);
        }
        Self {
            deviations,
            straight,
        }
    }
}

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

    pub(super) fn limits(self, settings: &ModelFitSettings) -> [f64; 2] {
        match self {
            Self::Coefficient(_) => [-settings.most_coefficient, settings.most_coefficient],
            Self::Bone(_) => settings.scales,
        }
    }
}

pub(super) struct ShapeUnknowns {
    pub(super) all: Vec<ShapeUnknown>,
    /// Standard deviation of the scale of a bone.
    scale_deviation: f64,
}

impl ShapeUnknowns {
    /// All coefficients and the scales of all bones with a length, none unless `shaped`; `shape` gets an entry for each.
    pub(super) fn new(
        template: &Template,
        settings: &ModelFitSettings,
        shape: &mut BodyShape,
        shaped: bool,
    ) -> Self {
        let skeleton = template.skeleton();
        let coefficients = template.shape_space().map_or(0, |s| s.names.len());
        shape.coefficients.resize(coefficients, 0.0);
        shape.bone_scales.resize(skeleton.len(), 1.0);
        let is_bone = |j: &usize| {
            let segment = template.parts().segment(*j);
            let is_end = matches!(segment, BodySegment::Fingers | BodySegment::Toes);
            skeleton.joints()[*j].parent.is_some() && !is_end
        };
        let bones = (0..skeleton.len()).filter(is_bone).map(ShapeUnknown::Bone);
        let all = (0..coefficients).map(ShapeUnknown::Coefficient);
        Self {
            all: all.chain(bones).filter(|_| shaped).collect(),
            scale_deviation: settings.scale_deviation,
        }
    }

    /// Adds the prior of the shape, whose unknowns are the last ones of the equations.
    pub(super) fn add_prior(&self, system: &mut DenseEquations, shape: &BodyShape) {
        let first = system.g.len() - self.all.len();
        for (k, u) in self.all.iter().enumerate() {
            let (value, mean, deviation) = match *u {
                ShapeUnknown::Coefficient(d) => (shape.coefficients[d], 0.0, 1.0),
                ShapeUnknown::Bone(j) => (shape.bone_scales[j], 1.0, self.scale_deviation),
            };
            let w = 1.0 / (deviation * deviation);
            system.h[(first + k, first + k)] += w;
            system.g[first + k] += w * (mean - value);
        }
    }
}

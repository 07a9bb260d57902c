//! The rest body of the subject's size and shape, and the samples on it that the pose fit uses.

use super::tracker::TrackerModel;
use tryon_body::{BodyShape, RestBody};
use tryon_geometry::math::{P3, V3};

/// Samples of the personalised rest body.
#[derive(Clone, Debug, Default)]
pub(crate) struct RestSamples {
    pub positions: Vec<P3>,
    pub normals: Vec<V3>,
}

/// Personalised rest body, cached by shape.
#[derive(Clone, Debug, Default)]
pub(crate) struct PersonalBody {
    /// Shape of the cached body; `None` after [`PersonalBody::sketch`].
    shape: Option<BodyShape>,
    pub rest: RestBody,
    pub samples: RestSamples,
}

impl PersonalBody {
    /// Makes body and samples fit `shape`.
    pub(crate) fn update(&mut self, model: &TrackerModel, shape: &BodyShape) {
        let has_samples = self.samples.positions.len() == model.samples.len();
        if self.shape.as_ref() == Some(shape) && has_samples {
            return;
        }
        let same_base = self.shape.as_ref().is_some_and(|c| {
            c.coefficients == shape.coefficients && c.bone_scales == shape.bone_scales
        });
        if same_base && has_samples {
            let displacement = |i: usize| shape.displacements.get(i).copied().unwrap_or(0.0);
            let base = self.rest.base.iter().zip(&self.rest.normals).enumerate();
            self.rest.vertices = base.map(|(i, (p, n))| p + n * displacement(i)).collect();
        } else {
            self.rest = model.template.personalise(shape);
        }
        let surface = if model.config.displaced_pose {
            &self.rest.vertices
        } else {
            &self.rest.base
        };
        let samples = || model.samples.iter().map(|v| *v as usize);
        self.samples.positions = samples().map(|v| surface[v]).collect();
        self.samples.normals = samples().map(|v| self.rest.normals[v]).collect();
        self.shape = Some(shape.clone());
    }

    /// Moves only samples and joints to `shape`, at a tenth of the time: enough to search for a size. Normals, which
    /// hardly turn, and the other vertices stay until the next [`PersonalBody::update`].
    pub(crate) fn sketch(&mut self, model: &TrackerModel, shape: &BodyShape) {
        if model.config.displaced_pose {
            self.update(model, shape);
            return;
        }
        (self.samples.positions, self.rest.joints) =
            model.template.personalise_some(shape, &model.samples);
        self.shape = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_scene::TestScene;

    #[test]
    fn a_sketch_has_the_samples_and_joints_of_the_update() {
        let model = TestScene::new(200, 480).model;
        let scales = (0..model.parents.len()).map(|j| 1.0 + 0.01 * (j % 7) as f64);
        let shape = BodyShape {
            coefficients: vec![0.7, -1.2],
            bone_scales: scales.collect(),
            displacements: Vec::new(),
        };
        let mut body = PersonalBody::default();
        body.update(&model, &BodyShape::default());
        let normals = body.samples.normals.clone();
        body.sketch(&model, &shape);
        assert_eq!(body.samples.normals, normals, "normals stay");
        let sketched = (body.samples.positions.clone(), body.rest.joints.clone());
        body.update(&model, &shape);
        assert_eq!(
            sketched,
            (body.samples.positions.clone(), body.rest.joints.clone())
        );
        assert_ne!(body.samples.normals, normals, "an update turns normals");
        body.sketch(&model, &BodyShape::default());
        body.update(&model, &shape);
        let whole = model.template.personalise(&shape);
        assert_eq!(
            body.rest.vertices, whole.vertices,
            "no cache after a sketch"
        );
    }
}

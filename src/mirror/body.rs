//! Posed surface of one body, with its rest shape kept until the shape changes.

use std::sync::Arc;
use tryon_body::{BodyShape, BoneTransforms, Pose, RestBody, Template};
use tryon_geometry::math::P3;

/// Skinned surface of a tracked body and the buffers to pose it again.
#[derive(Debug, Default)]
pub struct PosedBody {
    rest: RestBody,
    shape: Option<Arc<BodyShape>>,
    bones: BoneTransforms,
    vertices: Vec<P3>,
}

impl PosedBody {
    /// A body whose rest shape is known.
    pub fn new(shape: Arc<BodyShape>, rest: RestBody) -> Self {
        Self {
            rest,
            shape: Some(shape),
            ..Self::default()
        }
    }

    /// Skins the body in exactly the tracked `pose`; `true` when the rest shape was computed anew.
    ///
    /// Shapes are compared by pointer. A body belongs to one template for its whole life.
    pub fn pose<F>(&mut self, template: &Template, shape: &Arc<BodyShape>, pose: &Pose<F>) -> bool {
        let is_known = self.shape.as_ref().is_some_and(|s| Arc::ptr_eq(s, shape));
        if !is_known {
            self.rest = template.personalise(shape);
            self.shape = Some(Arc::clone(shape));
        }
        template.skin_pose(&self.rest, pose, &mut self.bones, &mut self.vertices);
        !is_known
    }

    /// Rest shape of the last posed body.
    pub fn rest(&self) -> &RestBody {
        &self.rest
    }

    /// Vertices of the last posed body, frame of its pose, metres, shape `[body vertices]`.
    pub fn vertices(&self) -> &[P3] {
        &self.vertices
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_body::embedded;
    use tryon_geometry::math::{Body, Rigid, World};

    #[test]
    fn rest_pose_skins_to_the_rest_shape_of_each_shape() {
        let template = embedded::template();
        let pose = Pose::rest(template.skeleton(), Rigid::<World, Body>::identity());
        let plain = Arc::new(BodyShape::default());
        let tall = Arc::new(BodyShape {
            coefficients: vec![2.0],
            ..BodyShape::default()
        });
        let mut body = PosedBody::default();
        for (shape, is_new) in [(&plain, true), (&plain, false), (&tall, true)] {
            assert_eq!(body.pose(&template, shape, &pose), is_new);
            let rest = template.personalise(shape);
            let apart = |(a, b): (&P3, &P3)| (a - b).norm();
            let farthest =
                (rest.vertices.iter().zip(body.vertices()).map(apart)).fold(0.0, f32::max);
            assert!(farthest < 1e-5, "{farthest} m");
        }
    }
}

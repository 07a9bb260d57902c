//! The body template: mesh, skeleton, weights and shape space of one body.

use super::parts::BodyParts;
use super::{BodyError, Joint, PoseShapes, ShapeSpace, Skeleton, SkinWeights};
use nalgebra::Point3;
use std::sync::Arc;
use tryon_geometry::math::P3;
use tryon_geometry::mesh::{Topology, TriMesh};

/// A rigged body in its rest pose: y up, facing +z, metres. Immutable; share it by `Arc`.
#[derive(Clone, Debug)]
pub struct Template {
    name: String,
    mesh: TriMesh,
    topology: Topology,
    parts: BodyParts,
    skeleton: Skeleton,
    weights: SkinWeights,
    shape_space: Option<ShapeSpace>,
    /// Shared by the templates of one model's bodies: SMPL's are 17 MB.
    pose_shapes: Option<Arc<PoseShapes>>,
}

impl Template {
    /// Checks the sizes of all parts against each other.
    ///
    /// # Errors
    /// Names the vertex, joint or array that does not match.
    pub fn new(
        name: impl Into<String>,
        mesh: TriMesh,
        skeleton: Skeleton,
        weights: SkinWeights,
        shape_space: Option<ShapeSpace>,
    ) -> Result<Self, BodyError> {
        let (n, j) = (mesh.vertices().len(), skeleton.len());
        let array = |array: &str, why: String| BodyError::Array {
            array: array.into(),
            why,
        };
        if j == 0 {
            return Err(array("joints", "a body needs at least a root joint".into()));
        }
        if weights.joints.len() != n || weights.weights.len() != n {
            return Err(array(
                "weights",
                format!("{} rows for {n} vertices", weights.joints.len()),
            ));
        }
        if let Some(vertex) = weights
            .joints
            .iter()
            .position(|r| r.iter().any(|&k| usize::from(k) >= j))
        {
            return Err(BodyError::Vertex {
                vertex,
                why: format!("its skinning joint is out of range (0 to {})", j - 1),
            });
        }
        if let Some(s) = &shape_space {
            for (d, (v, q)) in s.vertices.iter().zip(&s.joints).enumerate() {
                if v.len() != n || q.len() != j {
                    return Err(array(
                        "shapedirs",
                        format!(
                            "direction {d} has {} vertices and {} joints",
                            v.len(),
                            q.len()
                        ),
                    ));
                }
            }
            if s.vertices.len() != s.joints.len() || s.names.len() != s.vertices.len() {
                return Err(array(
                    "shapedirs",
                    "names, vertices and joints differ in their number of directions".into(),
                ));
            }
        }
        let topology = Topology::new(&mesh)?;
        Ok(Self {
            name: name.into(),
            mesh,
            topology,
            parts: BodyParts::new(&skeleton),
            skeleton,
            weights,
            shape_space,
            pose_shapes: None,
        })
    }
    /// One body as a template of its own, without shape space, with its pose blend shapes: vertices of shape `[vertices]` and joints of shape `[joints]`
    /// of its rest pose, metres.
    ///
    /// # Errors
    /// As [`Template::new`].
    pub fn at_rest(
        &self,
        name: &str,
        vertices: Vec<P3>,
        joints: &[Point3<f64>],
    ) -> Result<Self, BodyError> {
        let moved = self.skeleton.joints().iter().zip(joints);
        let moved = moved.map(|(joint, rest)| Joint {
            rest: *rest,
            ..joint.clone()
        });
        let made = Self::new(
            name,
            self.mesh.with_vertices(vertices)?,
            Skeleton::new(moved.collect())?,
            self.weights.clone(),
            None,
        )?;
        Ok(Self {
            pose_shapes: self.pose_shapes.clone(),
            ..made
        })
    }
    /// The same body with pose blend shapes.
    ///
    /// # Errors
    /// Shapes of another number of vertices, or of more joints.
    pub fn with_pose_shapes(mut self, shapes: PoseShapes) -> Result<Self, BodyError> {
        let (vertices, joints) = (self.mesh.vertices().len(), self.skeleton.len());
        let is_empty = shapes.features() == 0;
        let fits = is_empty || shapes.vertices() == vertices;
        if !fits || shapes.turned_joints() >= joints {
            let why = format!("do not fit {vertices} vertices and {joints} joints");
            let array = "posedirs".into();
            return Err(BodyError::Array { array, why });
        }
        self.pose_shapes = (!is_empty).then(|| Arc::new(shapes));
        Ok(self)
    }

    /// Name.
    pub fn name(&self) -> &str {
        &self.name
    }
    /// Rest surface.
    pub fn mesh(&self) -> &TriMesh {
        &self.mesh
    }
    /// Connectivity of the surface.
    pub fn topology(&self) -> &Topology {
        &self.topology
    }
    /// Kinematic tree.
    pub fn skeleton(&self) -> &Skeleton {
        &self.skeleton
    }
    /// Segments and parts of the joints.
    pub fn parts(&self) -> &BodyParts {
        &self.parts
    }
    /// Skinning weights.
    pub fn weights(&self) -> &SkinWeights {
        &self.weights
    }
    /// Directions of body shape, if the template has any.
    pub fn shape_space(&self) -> Option<&ShapeSpace> {
        self.shape_space.as_ref()
    }
    /// Pose blend shapes, if the template has any.
    pub fn pose_shapes(&self) -> Option<&PoseShapes> {
        self.pose_shapes.as_deref()
    }
}

//! Motion of a point of a limb by the joint angles of that limb.

use crate::registration::{Dof, ROOT_UNKNOWNS};
use nalgebra::Vector3;
use tryon_geometry::math::P3d;

/// Joint angles of a limb and the motion that each of them gives to its points.
#[derive(Clone, Copy)]
pub struct LimbMotion<'a> {
    /// Joint angles of the limb.
    pub angles: &'a [usize],
    /// All degrees of freedom, as twists about `centre`.
    pub dofs: &'a [Dof],
    /// Origin of the twists.
    pub centre: &'a Vector3<f64>,
}

impl LimbMotion<'_> {
    /// Derivatives of `direction` · `point` by the angles, shape `[angles]`.
    pub(super) fn slopes(&self, point: &P3d, direction: &Vector3<f64>) -> Vec<f64> {
        let at = point.coords - self.centre;
        let twist = |a: &usize| &self.dofs[ROOT_UNKNOWNS + a].twist;
        let slope = |a| direction.dot(&twist(a).velocity_at(&at));
        self.angles.iter().map(slope).collect()
    }
}

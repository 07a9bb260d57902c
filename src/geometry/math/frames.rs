//! Coordinate frames as types: `camera_from_body: Rigid<Camera, Body>`, so that names and types cancel.

use nalgebra::{Isometry3, Matrix3, Point3, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use std::marker::PhantomData;
use std::ops::Mul;

/// The depth camera: x right, y down, z forward (OpenCV).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Camera;
/// The colour camera, same axes as [`Camera`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ColorCamera;
/// The room: y up, right-handed (glTF), gravity along −y.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct World;
/// The rest pose of the template: y up, facing +z, root at its own joint position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Body;

/// A rigid transform that takes coordinates of frame `B` to frame `A`.
#[derive(Serialize, Deserialize)]
#[serde(transparent)]
pub struct Rigid<A, B> {
    iso: Isometry3<f64>,
    #[serde(skip)]
    frames: PhantomData<fn(B) -> A>,
}

impl<A, B> Clone for Rigid<A, B> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<A, B> Copy for Rigid<A, B> {}
impl<A, B> PartialEq for Rigid<A, B> {
    fn eq(&self, other: &Self) -> bool {
        self.iso == other.iso
    }
}
impl<A, B> std::fmt::Debug for Rigid<A, B> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.iso.fmt(f)
    }
}
impl<A, B> Default for Rigid<A, B> {
    fn default() -> Self {
        Self::identity()
    }
}

impl<A, B> Rigid<A, B> {
    /// Both frames coincide.
    pub fn identity() -> Self {
        Self::new(Isometry3::identity())
    }
    /// Wraps a bare isometry whose frames the caller knows.
    pub fn new(iso: Isometry3<f64>) -> Self {
        Self {
            iso,
            frames: PhantomData,
        }
    }
    /// From a translation (metres) and a unit quaternion.
    pub fn from_parts(translation: Vector3<f64>, rotation: UnitQuaternion<f64>) -> Self {
        Self::new(Isometry3::from_parts(
            Translation3::from(translation),
            rotation,
        ))
    }
    /// The bare isometry, for inner loops.
    pub fn iso(&self) -> &Isometry3<f64> {
        &self.iso
    }
    /// The transform the other way.
    pub fn inverse(&self) -> Rigid<B, A> {
        Rigid::new(self.iso.inverse())
    }
    /// Maps a point.
    pub fn point(&self, p: &Point3<f64>) -> Point3<f64> {
        self.iso * p
    }
    /// Maps a direction.
    pub fn vector(&self, v: &Vector3<f64>) -> Vector3<f64> {
        self.iso * v
    }
    /// Maps points stored in f32 into `out`, computing in f32.
    pub fn points_f32(&self, points: &[Point3<f32>], out: &mut Vec<Point3<f32>>) {
        let iso: Isometry3<f32> = self.iso.cast();
        let r: Matrix3<f32> = iso.rotation.to_rotation_matrix().into_inner();
        let t = iso.translation.vector;
        out.clear();
        out.extend(points.iter().map(|p| Point3::from(r * p.coords + t)));
    }
    /// Has finite numbers only.
    pub fn is_finite(&self) -> bool {
        self.iso.translation.vector.iter().all(|v| v.is_finite())
            && self.iso.rotation.coords.iter().all(|v| v.is_finite())
    }
}

impl<A, B, C> Mul<Rigid<B, C>> for Rigid<A, B> {
    type Output = Rigid<A, C>;
    fn mul(self, rhs: Rigid<B, C>) -> Rigid<A, C> {
        Rigid::new(self.iso * rhs.iso)
    }
}

impl Rigid<World, Camera> {
    /// A level camera at `height` metres above the floor looking along the world's −z:
    /// the camera's y (down) is the world's −y, its z the world's −z.
    pub fn level(height: f64) -> Self {
        Self::from_parts(
            Vector3::new(0.0, height, 0.0),
            UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn level_camera_sees_the_world_upright() {
        let world_from_camera = Rigid::<World, Camera>::level(1.2);
        let p = world_from_camera.point(&Point3::new(0.1, 0.2, 3.0));
        assert!((p - Point3::new(0.1, 1.0, -3.0)).norm() < 1e-12);
        let back = world_from_camera.inverse().point(&p);
        assert!((back - Point3::new(0.1, 0.2, 3.0)).norm() < 1e-12);
    }
}

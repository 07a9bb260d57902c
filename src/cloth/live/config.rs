//! Settings of the real-time simulator.

use super::ClothError;
use crate::contact::{CollisionConfig, MapDetail};
use serde::{Deserialize, Serialize};
use tryon_geometry::math::{Camera, Rigid, V3d, World};
use tryon_geometry::par::Par;

/// Settings of the simulation of one outfit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Most substeps in 1/60 s. Triangles too stiff for these are softened; fewer strain cloth more, more cost time.
    pub most_steps: usize,
    /// Time ahead of the positions at which forces are evaluated, in substeps, 0 to 1: damps ringing.
    #[serde(rename = "ahead")]
    pub force_lookahead: f64,
    /// Vertices of a patch, the work of one thread. Changes bits, so it is a setting and not the machine's.
    pub patch: usize,
    /// Gravity, m/s².
    pub gravity: [f64; 3],
    /// Distance of the outermost layer from the skin, metres; the others lie evenly between.
    pub offset: f64,
    /// Horizontal viewing direction of the real camera, world x and z: its depth map is the fine one.
    pub camera_toward: [f32; 2],
    /// Resolution of the depth maps of the body.
    pub map_detail: MapDetail,
    /// Keep inner layers below outer ones.
    pub layers: bool,
    /// Keep the folds of a garment apart.
    pub self_collision: bool,
    /// Distance between cloth and cloth, metres.
    pub thickness: f64,
    /// Margin of the skin query beyond a garment's distance and motion, metres; larger while panels are sewn.
    pub reach: f64,
    /// Displacement between steps from which on body vertices are followed fully, metres; 0 for an exact body.
    #[serde(rename = "steady")]
    pub noise_deadband: f64,
    /// Let cloth sleep when it and the body are still.
    pub sleep: bool,
    /// Let islands of it sleep while others move, if it may sleep at all.
    pub sleep_regions: bool,
    /// Time between two intersection queries of a garment, s; 0 for none.
    pub untangle: f64,
    /// Least distance of two corners across an edge, over that of the flat sheet: ½ lets a fold close to 60°, 0 any.
    #[serde(rename = "sharpest")]
    pub min_fold_ratio: f64,
    /// Skip queries of vertices that cannot have come near skin or folds since their last one.
    #[serde(rename = "skip_far")]
    pub cull_distant: bool,
    /// Speed limit of cloth, m/s: keeps one bad frame from becoming many.
    pub max_speed: f32,
    /// Mean displacement of the body in a step beyond which it has teleported, metres.
    pub teleport: f64,
    /// Threads.
    #[serde(skip)]
    pub par: Par,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            most_steps: 72,
            force_lookahead: 0.25,
            patch: 6000,
            gravity: [0.0, -9.81, 0.0],
            offset: 0.005,
            camera_toward: [0.0, -1.0],
            map_detail: MapDetail::InView,
            layers: true,
            self_collision: true,
            thickness: 0.003,
            reach: 0.008,
            noise_deadband: 0.0,
            sleep: true,
            sleep_regions: true,
            untangle: 0.13,
            min_fold_ratio: 0.6,
            cull_distant: true,
            max_speed: 12.0,
            teleport: 0.2,
            par: Par::Rayon,
        }
    }
}

impl Config {
    /// For a body that is tracked by a camera.
    pub fn tracked() -> Self {
        /// 95 % of a standing body's vertices move less between frames (3 mm, Kinect v1 at 2.4 m), metres; 5 mm left twice
        /// the noise.
        const NOISE_DEADBAND: f64 = 8e-3;
        Self {
            noise_deadband: NOISE_DEADBAND,
            ..Self::default()
        }
    }
    /// The same for a camera with this pose. A vertical optical axis keeps the direction.
    #[must_use]
    pub fn seen_from(self, world_from_camera: &Rigid<World, Camera>) -> Self {
        /// Sine of the angle to the vertical below which the axis has no horizontal direction.
        const LEVEL: f64 = 1e-3;
        let axis = world_from_camera.vector(&V3d::z());
        if axis.x.hypot(axis.z) < LEVEL {
            return self;
        }
        Self {
            camera_toward: [axis.x as f32, axis.z as f32],
            ..self
        }
    }
    /// Distance of layer `order` of `count` from the skin, metres: evenly between the skin and the outermost layer.
    pub fn layer_offset(&self, order: usize, count: usize) -> f64 {
        self.offset * (order + 1) as f64 / count as f64
    }
    /// The body as cloth of these settings meets it: two layers fit between parts that press on each other.
    pub(crate) fn collision(&self) -> CollisionConfig {
        CollisionConfig {
            noise_deadband: self.noise_deadband,
            clearance: (2.0 * self.offset + self.thickness) as f32,
            par: self.par,
        }
    }
    /// Names the first setting out of range.
    pub fn check(&self) -> Result<(), ClothError> {
        let lengths = [self.noise_deadband, self.untangle];
        let faults = [
            (
                self.most_steps == 0 || self.patch == 0,
                "most_steps, patch",
                "both must be at least 1",
            ),
            (
                !(0.0..=1.0).contains(&self.force_lookahead),
                "ahead",
                "must be between 0 and 1 step",
            ),
            (
                !(self.offset.is_finite()
                    && self.teleport > 0.0
                    && lengths.iter().all(|l| *l >= 0.0)),
                "offset, teleport, steady, untangle",
                "they must be finite, teleport positive, steady and untangle not negative",
            ),
            (
                !(0.0..1.0).contains(&self.min_fold_ratio),
                "sharpest",
                "must be at least 0 and less than 1",
            ),
        ];
        let fault = faults.into_iter().find(|f| f.0);
        fault.map_or(Ok(()), |(_, field, why)| Err(ClothError::field(field, why)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;

    #[test]
    fn fine_map_faces_the_camera_and_a_vertical_axis_keeps_the_default() {
        let turned = |axis, angle: f64| -> Rigid<Camera, Camera> {
            Rigid::from_parts(V3d::zeros(), UnitQuaternion::from_axis_angle(&axis, angle))
        };
        let level = Rigid::<World, Camera>::level(1.2);
        let toward = |camera: Rigid<Camera, Camera>| {
            let [x, z] = Config::tracked().seen_from(&(level * camera)).camera_toward;
            [x / x.hypot(z), z / x.hypot(z)]
        };
        let close =
            |a: [f32; 2], b: [f32; 2]| (a[0] - b[0]).abs() < 1e-6 && (a[1] - b[1]).abs() < 1e-6;
        // Tilted down or mounted upright the camera faces −z, the default.
        let default = Config::default().camera_toward;
        let right = std::f64::consts::FRAC_PI_2;
        assert!(close(toward(turned(V3d::x_axis(), -0.3)), default));
        assert!(close(toward(turned(V3d::z_axis(), right)), default));
        // Turned to its right (about its own axis down) it faces +x.
        let (sin, cos) = 0.5f32.sin_cos();
        assert!(close(toward(turned(V3d::y_axis(), 0.5)), [sin, -cos]));
        // Straight down: no horizontal direction.
        assert!(close(toward(turned(V3d::x_axis(), -right)), default));
    }
}

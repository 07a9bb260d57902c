//! Settings of the real-time simulator.

use super::{
    ClothRepairSettings, CollisionConfig, MapDetail, MapSettings, SolverSettings,
    StillnessSettings, settings,
};
use tryon_geometry::math::{Camera, Rigid, V3d, World};
use tryon_geometry::par::Par;

settings! {
    /// Settings of the bending that a mesh carries.
    pub struct ResolutionSettings {
        /// Shortest bending length in edges. Smaller: folds sharper than the mesh, which crumple at every edge; larger:
        /// fabrics that all bend alike.
        pub edges: f64 = 0.5,
        /// Gravity (m/s²).
        pub gravity: f64 = 9.81,
    }

    /// Settings of the simulation of one outfit.
    pub struct Config {
        /// Most substeps in 1/60 s. Triangles too stiff for these are softened; fewer strain cloth more, more cost time.
        pub most_steps: usize = 72,
        /// Time ahead of the positions at which forces are evaluated, in substeps, 0 to 1: damps ringing.
        #[serde(rename = "ahead")]
        pub force_lookahead: f64 = 0.25,
        /// Vertices of a patch, the work of one thread. Changes bits, so it is a setting and not the machine's.
        pub patch: usize = 6000,
        /// Gravity, m/s².
        pub gravity: [f64; 3] = [0.0, -9.81, 0.0],
        /// Distance of the outermost layer from the skin, metres; the others lie evenly between.
        pub offset: f64 = 0.005,
        /// Horizontal viewing direction of the real camera, world x and z: its depth map is the fine one.
        pub camera_toward: [f32; 2] = [0.0, -1.0],
        /// Resolution of the depth maps of the body.
        pub map_detail: MapDetail = MapDetail::InView,
        /// Keep inner layers below outer ones.
        pub layers: bool = true,
        /// Keep the folds of a garment apart.
        pub self_collision: bool = true,
        /// Distance between cloth and cloth, metres.
        pub thickness: f64 = 0.003,
        /// Margin of the skin query beyond a garment's distance and motion, metres; larger while panels are sewn.
        pub reach: f64 = 0.008,
        /// Displacement between steps from which on body vertices are followed fully, metres; 0 for an exact body.
        #[serde(rename = "steady")]
        pub noise_deadband: f64 = 0.0,
        /// Let cloth sleep when it and the body are still.
        pub sleep: bool = true,
        /// Let islands of it sleep while others move, if it may sleep at all.
        pub sleep_regions: bool = true,
        /// Time between two intersection queries of a garment, s; 0 for none.
        pub untangle: f64 = 0.13,
        /// Skip queries of vertices that cannot have come near skin or folds since their last one.
        #[serde(rename = "skip_far")]
        pub cull_distant: bool = true,
        /// Speed limit of cloth, m/s: keeps one bad frame from becoming many.
        pub max_speed: f32 = 12.0,
        /// Mean displacement of the body in a step beyond which it has teleported, metres.
        pub teleport: f64 = 0.2,
        /// Threads.
        #[serde(skip)]
        pub par: Par = Par::Rayon,
        /// The collision body; its dead band, clearance and threads follow from the settings above.
        pub body: CollisionConfig = CollisionConfig::default(),
        /// Virtual depth maps.
        pub maps: MapSettings = MapSettings::default(),
        /// Division of time.
        pub time: LiveStepSettings = LiveStepSettings::default(),
        /// Contact.
        pub contact: ClothContactSettings = ClothContactSettings::default(),
        /// Explicit solver.
        pub solver: SolverSettings = SolverSettings::default(),
        /// Thresholds of sleep.
        pub stillness: StillnessSettings = StillnessSettings::default(),
        /// Repair.
        pub repair: ClothRepairSettings = ClothRepairSettings::default(),
    }

    /// Division of a step's time.
    pub struct LiveStepSettings {
        /// Range of time steps, s: shorter and longer ones are clamped.
        pub range: [f64; 2] = [1e-4, 0.1],
        /// Time between two contact queries, s: at 3 m/s a limb moves 25 mm, half the reach of a query.
        pub contact_interval: f64 = 1.0 / 120.0,
        /// The same for a body slower than `calm_speed`.
        pub calm_interval: f64 = 1.0 / 60.0,
        /// Speed of a calm body's fastest vertex, m/s.
        pub calm_speed: f32 = 1.0,
        /// Share of an interval by which a step may be longer without another one: 1/30 s are two calm intervals.
        pub interval_slack: f64 = 1e-3,
        /// Depth maps rendered a second, in turn: 15 of each direction. Twice as many cost time and keep cloth no higher.
        pub maps_per_second: f64 = 60.0,
    }

    /// Settings of contact with skin and cloth.
    pub struct ClothContactSettings {
        /// Friction on skin over the fabric's.
        pub skin_friction: f32 = 1.0,
        /// Rate at which anchors of strength ½ approach their target, 1/s.
        pub anchor_rate: f64 = 120.0,
        /// Largest distance at which skin is queried in an interval, metres.
        pub max_reach: f32 = 0.04,
        /// Clearance between two body parts below which cloth keeps to its own half, metres.
        pub shared_gap: f32 = 0.03,
        /// Its distance from the middle then, metres.
        pub middle_gap: f32 = 0.00125,
        /// Height above the skin to which cloth is projected, metres: less than a fabric's thickness.
        pub projected_height: f32 = 5e-4,
        /// Depth at which cloth above may hold what is below the skin, metres.
        pub max_held_depth: f32 = 1e-3,
        /// Depth in another body part beyond which cloth stays, metres: it may have come from the other side.
        pub max_other_depth: f32 = 0.01,
        /// Cloth with cloth, as it is worn.
        pub pairs: NearPairSettings = NearPairSettings::default(),
    }

    /// Settings of contact between near pairs of features of cloth.
    pub struct NearPairSettings {
        /// Largest distance of pairs at rest, in edge lengths: with 0.4 a dance has four times the crossings.
        pub reach_edges: f32 = 0.5,
        /// Largest distance of pairs that close fast, metres: folds meet at 1 m/s in an interval of 8 ms. 15 mm cost 2 % more.
        pub farthest: f32 = 0.012,
        /// The same of candidates, metres.
        pub farthest_candidate: f32 = 0.015,
        /// Distance by which candidates may approach beyond what their velocities say, metres.
        pub slack: f32 = 0.001,
        /// Cosine of the angle between a vertex' normal and a face around it above which cloth is flat there.
        pub flat: f32 = 0.5,
        /// Shortest distance that has a direction, metres.
        pub shortest: f32 = 1e-5,
        /// A corner with less barycentric weight has no part in a point.
        pub min_weight: f32 = 1e-4,
        /// Least squared sine of the angle between two edges of a pair: parallel ones are met by their ends.
        pub min_sine_squared: f32 = 1e-3,
        /// Longest time between two layings of the planes, s. With 8.3 ms crossings with the body rise, with 2.8 ms the time.
        pub block: f64 = 1.0 / 240.0,
        /// Distance left between both halves of a gap, metres: with 1 and 2 mm there are more crossings in a dance.
        pub gap: f32 = 0.0015,
        /// Cosine of the angle between like directions. With 0.95 there are more planes and as many crossings.
        pub alike: f32 = 0.9,
        /// Friction of cloth on cloth: below the measured 0.3, as planes that are renewed resist sliding already.
        pub friction: f32 = 0.1,
        /// Weight of the side that the body moves in the velocity of a pair's half-spaces, the other being 1. With 1 a leg's
        /// kick passes through a skirt.
        pub driven_weight: f32 = 20.0,
        /// Relaxation of each smoothing of velocities over neighbours: by super time stepping (Alexiades et al. 1996, damping
        /// 0.05, largest eigenvalue 1.5) four smooth as far as eleven means. Unsmoothed, a shirt and a skirt shake each other.
        pub smoothing: [f32; 4] = [7.738, 1.942, 0.943, 0.692],
    }
}

impl Config {
    /// For a body that is tracked by a camera.
    pub fn tracked() -> Self {
        Self {
            // 95 % of a standing body's vertices move less between frames (3 mm, Kinect v1 at 2.4 m); 5 mm left twice the noise.
            noise_deadband: 8e-3,
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
            ..self.body
        }
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

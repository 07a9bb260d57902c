//! Depth intervals in which a reading belongs to a plane of the scene.

use super::planes::{NOISE_PER_SQUARE_METRE, ScenePlane, ScenePlanes};
use crate::settings::PlaneSettings;
use nalgebra::Vector3;
use tryon_geometry::spatial::OrganisedCloud;

/// Depth interval of each plane along each cell's ray: the tolerances solved for z, once a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct PlaneBands {
    scene: ScenePlanes,
    settings: PlaneSettings,
    /// Focal lengths, size and stride of the grid that they hold for.
    layout: ([f32; 2], (usize, usize), u32),
    /// First and last depth, metres, shape `[cells]`; empty without a floor.
    pub floor: Vec<[f32; 2]>,
    /// The same for each background plane.
    pub background: Vec<Vec<[f32; 2]>>,
}

impl PlaneBands {
    /// Builds the bands for a scene and a grid unless they are current.
    pub(super) fn update(
        &mut self,
        scene: &ScenePlanes,
        cloud: &OrganisedCloud,
        settings: &PlaneSettings,
    ) {
        let layout = (cloud.focal(), cloud.size(), cloud.stride());
        if (&self.scene, &self.settings) == (scene, settings) && self.layout == layout {
            return;
        }
        let all = |plane: &ScenePlane, extra: f64| -> Vec<[f32; 2]> {
            let (columns, rows) = cloud.size();
            let ray = |i: usize| {
                cloud
                    .unproject((i % columns) as f32, (i / columns) as f32, 1.0)
                    .coords
                    .cast::<f64>()
            };
            (0..columns * rows)
                .map(|i| band(plane, &ray(i), extra, settings.floor_tolerance))
                .collect()
        };
        self.floor = scene.floor.map_or(vec![], |f| all(&f, 0.0));
        self.background = scene
            .background
            .iter()
            .map(|b| all(b, f64::from(settings.background_tolerance)))
            .collect();
        (self.scene, self.settings, self.layout) = (scene.clone(), *settings, layout);
    }
}

/// Depths z with |n · z r + o| below the tolerance or below `extra` (metres), for a ray r with z component 1.
fn band(plane: &ScenePlane, ray: &Vector3<f64>, extra: f64, tolerance: f32) -> [f32; 2] {
    let slope = -plane.normal.dot(ray);
    if slope <= f64::EPSILON {
        // The ray leaves the plane.
        return [f32::INFINITY, f32::NEG_INFINITY];
    }
    let (o, c) = (plane.offset, f64::from(tolerance));
    let k = f64::from(NOISE_PER_SQUARE_METRE) * slope / ray.norm();
    // o − slope z = c + k z² in front of the plane, = −(c + k z²) behind it.
    let near = (-slope + (slope * slope + 4.0 * k * (o - c)).max(0.0).sqrt()) / (2.0 * k);
    let inner = slope * slope - 4.0 * k * (o + c);
    let far = if inner < 0.0 {
        f64::INFINITY
    } else {
        (slope - inner.sqrt()) / (2.0 * k)
    };
    [
        near.min((o - extra) / slope) as f32,
        far.max((o + extra) / slope) as f32,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::segment::find_planes;
    use crate::segment::fixture::room;

    #[test]
    fn bands_match_the_tolerances_along_each_ray() {
        let cloud = room(0.15, true);
        let settings = PlaneSettings::default();
        let scene = find_planes(&cloud, &settings);
        let mut bands = PlaneBands::default();
        bands.update(&scene, &cloud, &settings);
        let (floor, wall) = (scene.floor.expect("floor"), scene.background[0]);
        let mut differ = 0;
        for i in 0..cloud.depth.len() {
            let (u, v) = ((i % cloud.size().0) as f32, (i / cloud.size().0) as f32);
            for step in 1..40 {
                let z = 0.2 * step as f32;
                let p = cloud.unproject(u, v, z);
                let inside = |[lo, hi]: [f32; 2]| z > lo && z < hi;
                let on_floor = floor.contains(&p, &settings);
                let on_wall = wall.distance(&p).abs()
                    < wall
                        .tolerance(&p, &settings)
                        .max(settings.background_tolerance);
                differ += usize::from(inside(bands.floor[i]) != on_floor);
                differ += usize::from(inside(bands.background[0][i]) != on_wall);
            }
        }
        assert!(
            differ < cloud.depth.len() * 40 / 10_000,
            "{differ} of {}",
            cloud.depth.len() * 40
        );
    }
}

//! Depth cameras around a standing subject, their frames fused to one cloud by a calibration with errors.

use super::depth_camera::{Backdrop, CleanView, DepthCamera};
use super::paint::PaintedSurface;
use super::points::{STRAY_LABEL, ScanPoints};
use super::random::{ScanSeed, gauss};
use super::settings::ScanSettings;
use nalgebra::{Translation3, UnitQuaternion};
use rand::Rng;
use rand::seq::index::sample;
use rand_pcg::Pcg64;
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use tryon_geometry::camera::NoiseModel;
use tryon_geometry::math::{P3, Rigid, V3, V3d, World};

/// Stages with random numbers of their own.
const POSES: u64 = 21;
const SILHOUETTES: u64 = 22;
const CHOICE: u64 = 23;
const EXPOSURES: u64 = 24;

/// Consumer depth cameras around the subject. Their fused cloud has no normals and no faces.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraRig {
    /// Number of cameras, evenly around.
    pub cameras: usize,
    /// Distances from the subject (m): drawn for each camera between both.
    pub distance: [f64; 2],
    /// Height of the cameras (m): they see no top of the head.
    pub height: f64,
    /// Noise of the depth images.
    pub noise: NoiseModel,
    /// Displacement of each camera's points by its wrong calibration (m), in a random direction.
    pub shift: f64,
    /// Turn of the same (rad), about a random axis through the subject.
    pub turn: f64,
    /// Largest gain of a colour channel of a camera beside 1: white balance.
    pub white_balance: f32,
    /// Largest gain of all channels of a camera beside 1: exposure.
    pub exposure: f32,
    /// Share of the pixels at silhouettes between near and far.
    pub flying: f64,
    /// Radius around the subject within which points are kept, floor included (m).
    pub radius: f32,
    /// Side of the cells whose points are one, their mean (m); 0 keeps all.
    pub cell: f32,
}

impl Default for CameraRig {
    /// Four cameras 1.5 m to 2.1 m away, whose depths err by 4 mm to 7 mm and whose poses by 8 mm and half a degree.
    fn default() -> Self {
        Self {
            cameras: 4,
            distance: [1.5, 2.1],
            height: 1.1,
            noise: NoiseModel::KinectV1,
            shift: 0.008,
            turn: 0.5f64.to_radians(),
            white_balance: 0.12,
            exposure: 0.0,
            flying: 0.3,
            radius: 0.8,
            cell: 0.0,
        }
    }
}

impl CameraRig {
    /// Fused cloud of at most `count` points.
    pub(super) fn scan(
        &self,
        painted: PaintedSurface<'_>,
        count: usize,
        seed: ScanSeed,
    ) -> ScanPoints {
        let center = painted.surface.center();
        let settings = &painted.surface.settings;
        let mut poses = seed.stage(POSES);
        let mut flights = seed.stage(SILHOUETTES);
        let mut exposures = seed.stage(EXPOSURES);
        let mut all = ScanPoints::default();
        for k in 0..self.cameras {
            let camera = self.camera(k, center, &mut poses);
            let gains =
                [(); 3].map(|()| 1.0 + self.white_balance * (2.0 * poses.random::<f32>() - 1.0));
            let exposure = 1.0 + self.exposure * (2.0 * exposures.random::<f32>() - 1.0);
            let gains = gains.map(|g| g * exposure);
            let error = self.error(settings, center, &mut poses);
            let mut clean = camera.view(painted, Backdrop::Floor);
            self.fly(settings, &mut clean, &mut flights);
            let number = seed.scan * self.cameras as u64 + k as u64;
            let depth = (camera.noise).apply(&camera.intrinsics, &clean.depth, seed.scene, number);
            let world = error * camera.world_from_camera;
            for (i, z) in depth.data().iter().enumerate().filter(|(_, z)| **z > 0) {
                let [u, v] = [i as u32 % depth.width(), i as u32 / depth.width()].map(|c| c as f32);
                let local = camera.intrinsics.unproject(u, v, f32::from(*z) * 1e-3);
                let p: P3 = world.point(&local.cast()).cast();
                let color = clean.color[i];
                let color = std::array::from_fn(|c| (f32::from(color[c]) * gains[c]).min(255.0));
                if (p - center).xz().norm() < self.radius {
                    all.push(p, V3::zeros(), color, clean.labels[i]);
                }
            }
        }
        if self.cell > 0.0 {
            all = self.thinned(&all);
        }
        let mut keep = vec![false; all.len()];
        let some = sample(&mut seed.stage(CHOICE), all.len(), count.min(all.len()));
        some.into_iter().for_each(|i| keep[i] = true);
        all.filtered(&keep)
    }

    /// Mean place and colour of the points in each cell, with the label of the first.
    fn thinned(&self, all: &ScanPoints) -> ScanPoints {
        let mut cells: BTreeMap<[i32; 3], (V3, [f32; 3], f32, u8)> = BTreeMap::new();
        for ((p, color), label) in all.points.iter().zip(&all.colors).zip(&all.labels) {
            let cell = [p.x, p.y, p.z].map(|c| (c / self.cell).floor() as i32);
            let empty = (V3::zeros(), [0.0; 3], 0.0, *label);
            let (place, sum, count, _) = cells.entry(cell).or_insert(empty);
            *place += p.coords;
            (0..3).for_each(|c| sum[c] += color[c]);
            *count += 1.0;
        }
        let mut out = ScanPoints::default();
        for (place, color, count, label) in cells.into_values() {
            out.push(
                P3::from(place / count),
                V3::zeros(),
                color.map(|c| c / count),
                label,
            );
        }
        out
    }

    /// Camera `k` where it is.
    fn camera(&self, k: usize, center: P3, rng: &mut Pcg64) -> DepthCamera {
        let [near, far] = self.distance;
        let away = near + (far - near) * rng.random::<f64>();
        let yaw = TAU * (k as f64 + 0.3 * rng.random::<f64>()) / self.cameras.max(1) as f64;
        let around: Rigid<World, World> = Rigid::from_parts(
            V3d::new(f64::from(center.x), 0.0, f64::from(center.z)),
            UnitQuaternion::from_axis_angle(&V3d::y_axis(), yaw),
        );
        let back: Rigid<World, World> =
            Rigid::from_parts(V3d::new(0.0, 0.0, away), UnitQuaternion::identity());
        DepthCamera {
            world_from_camera: around * back * Rigid::level(self.height),
            noise: self.noise,
            ..DepthCamera::default()
        }
    }

    /// Motion of a camera's points by its wrong calibration.
    fn error(&self, settings: &ScanSettings, center: P3, rng: &mut Pcg64) -> Rigid<World, World> {
        let mut direction = || {
            let v = V3::from_fn(|_, _| gauss(rng, 1.0)).cast::<f64>();
            v.try_normalize(0.0).unwrap_or_else(V3d::x)
        };
        let (shift, axis) = (direction() * self.shift, direction() * self.turn);
        let middle = (center.coords + V3::y() * settings.middle).cast::<f64>();
        let turn = UnitQuaternion::new(axis);
        Rigid::new(Translation3::from(middle + shift) * turn * Translation3::from(-middle))
    }

    /// Moves pixels at silhouettes between the surfaces before and behind them.
    fn fly(&self, settings: &ScanSettings, view: &mut CleanView, rng: &mut Pcg64) {
        let width = view.width;
        let before = view.depth.clone();
        for (i, &z) in before.iter().enumerate().filter(|(_, z)| z.is_finite()) {
            let beside = [i.wrapping_sub(1), i + 1, i.wrapping_sub(width), i + width];
            let far = beside.iter().filter_map(|j| before.get(*j));
            let far = far
                .map(|far| far.min(z + settings.background))
                .fold(z, f32::max);
            if far - z > settings.silhouette && rng.random::<f64>() < self.flying {
                view.depth[i] = z + (far - z) * rng.random::<f32>();
                if view.depth[i] - z > settings.flying_gap {
                    view.labels[i] = STRAY_LABEL;
                }
            }
        }
    }
}

//! Corruptions of a depth sequence: noise, lost readings, dropped frames, occlusion, clipping.

use super::{DepthScene, SceneTruth};
use rand::Rng;
use tryon_geometry::camera::DepthImage;

/// Seed of the corrupted pixels.
const SEED: u64 = 41;

impl DepthScene {
    fn each_pixel(&mut self, mut f: impl FnMut(&mut rand_pcg::Pcg32, &mut u16)) {
        for (i, frame) in self.frames.iter_mut().enumerate() {
            let mut rng = rand_pcg::Pcg32::new(SEED, i as u64);
            frame
                .depth
                .data_mut()
                .iter_mut()
                .for_each(|d| f(&mut rng, d));
        }
    }
    /// A share of all pixels becomes random, saturated, very near or missing, in equal parts.
    #[must_use]
    pub fn corrupted(mut self, share: f64) -> Self {
        self.each_pixel(|rng, d| {
            if rng.random::<f64>() < share {
                *d = match rng.random_range(0..4) {
                    0 => rng.random_range(300..6000),
                    1 => u16::MAX,
                    2 => 500,
                    _ => 0,
                };
            }
        });
        self
    }
    /// A share of all pixels gives no reading.
    #[must_use]
    pub fn thinned(mut self, share: f64) -> Self {
        self.each_pixel(|rng, d| {
            if rng.random::<f64>() < share {
                *d = 0;
            }
        });
        self
    }
    /// Only every n-th frame arrives, at its own time.
    #[must_use]
    pub fn every(mut self, n: usize) -> Self {
        let mut i = 0;
        self.frames.retain(|_| {
            i += 1;
            (i - 1) % n.max(1) == 0
        });
        self.truth = self.truth.into_iter().step_by(n.max(1)).collect();
        self
    }
    /// The frames of a range show nothing; their truth is empty.
    #[must_use]
    pub fn blind(mut self, range: std::ops::Range<usize>) -> Self {
        for i in range {
            if let Some(frame) = self.frames.get_mut(i) {
                frame.depth = DepthImage::empty(frame.depth.width(), frame.depth.height());
            }
            if let Some(truth) = self.truth.get_mut(i) {
                *truth = SceneTruth::default();
            }
        }
        self
    }
    /// Readings within `radius` (metres) of the line between two joints give no return, as black sleeves do. Frames without
    /// truth keep their readings, as do all frames if the scene lacks a joint.
    #[must_use]
    pub fn without_return(mut self, from: &str, to: &str, radius: f32) -> Self {
        let find = |n: &str| self.joint_names.iter().position(|m| m == n);
        let (Some(a), Some(b)) = (find(from), find(to)) else {
            return self;
        };
        let camera = self.calibration.depth;
        for (frame, truth) in self.frames.iter_mut().zip(&self.truth) {
            let (Some(a), Some(b)) = (truth.joints.get(a), truth.joints.get(b)) else {
                continue;
            };
            let (a, b) = (a.cast::<f32>(), b.cast::<f32>());
            let along = b - a;
            for (k, d) in frame
                .depth
                .data_mut()
                .iter_mut()
                .enumerate()
                .filter(|(_, d)| **d > 0)
            {
                let (u, v) = (k as u32 % camera.width, k as u32 / camera.width);
                let p = camera.unproject(u as f32, v as f32, f32::from(*d) * 1e-3);
                let t = ((p - a).dot(&along) / along.norm_squared().max(f32::MIN_POSITIVE))
                    .clamp(0.0, 1.0);
                if (p - (a + along * t)).norm() < radius {
                    *d = 0;
                }
            }
        }
        self
    }
    /// From frame `first` on, columns from this share of the width on give no reading.
    #[must_use]
    pub fn cut_beside(mut self, share: f64, first: usize) -> Self {
        for frame in self.frames.iter_mut().skip(first) {
            let w = frame.depth.width() as usize;
            let from = (share.clamp(0.0, 1.0) * w as f64) as usize;
            frame
                .depth
                .data_mut()
                .chunks_exact_mut(w)
                .for_each(|row| row[from..].fill(0));
        }
        self
    }
    /// Adds another scene of the same camera: the nearer reading of each pixel counts. Truth stays.
    #[must_use]
    pub fn with(mut self, other: &DepthScene) -> Self {
        for (frame, second) in self.frames.iter_mut().zip(&other.frames) {
            for (a, b) in frame.depth.data_mut().iter_mut().zip(second.depth.data()) {
                if *b > 0 && (*a == 0 || b < a) {
                    *a = *b;
                }
            }
        }
        self
    }
    /// Puts a ball of `radius` (metres) in front of a joint. Frames without truth keep their readings, as do all frames
    /// if the scene lacks the joint.
    #[must_use]
    pub fn holding(mut self, joint: &str, radius: f64) -> Self {
        let Some(j) = self.joint_names.iter().position(|m| m == joint) else {
            return self;
        };
        let camera = self.calibration.depth;
        for (frame, truth) in self.frames.iter_mut().zip(&self.truth) {
            let Some(hand) = truth.joints.get(j) else {
                continue;
            };
            let centre = hand.coords - hand.coords.normalize() * radius;
            for (k, d) in frame.depth.data_mut().iter_mut().enumerate() {
                let (u, v) = (k as u32 % camera.width, k as u32 / camera.width);
                let ray = camera
                    .unproject(u as f32, v as f32, 1.0)
                    .coords
                    .cast::<f64>();
                // Nearer root of |t ray − centre| = radius; t is the depth, as the ray has z = 1.
                let (a, b) = (ray.norm_squared(), ray.dot(&centre));
                let disc = b * b - a * (centre.norm_squared() - radius * radius);
                if disc > 0.0 {
                    let mm = ((b - disc.sqrt()) / a * 1e3).round();
                    if mm > 0.0 && mm < f64::from(u16::MAX) && (*d == 0 || mm < f64::from(*d)) {
                        *d = mm as u16;
                    }
                }
            }
        }
        self
    }
    /// Rows from this one on (as a share of the height) give no reading.
    #[must_use]
    pub fn cut_below(mut self, share: f64) -> Self {
        for frame in &mut self.frames {
            let (w, h) = (frame.depth.width() as usize, frame.depth.height() as usize);
            let from = (share.clamp(0.0, 1.0) * h as f64) as usize;
            frame.depth.data_mut()[from * w..].fill(0);
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_synth::{Actor, Routine, Sequence, Setting};

    #[test]
    fn shares_are_kept_and_truth_goes_along() {
        let setting = Setting {
            routine: Routine::Still,
            color: false,
            ..Setting::default()
        };
        let scene = DepthScene::synthetic("still", &Sequence::new(Actor::default(), setting), 5);
        let readings =
            |s: &DepthScene| s.frames[1].depth.data().iter().filter(|d| **d > 0).count() as f64;
        let all = readings(&scene);
        assert!((readings(&scene.clone().thinned(0.9)) / all - 0.1).abs() < 0.01);
        let corrupted = scene.clone().corrupted(0.1);
        let changed = corrupted.frames[0]
            .depth
            .data()
            .iter()
            .zip(scene.frames[0].depth.data())
            .filter(|(a, b)| a != b);
        assert!((changed.count() as f64 / (640.0 * 480.0) - 0.098).abs() < 0.02);
        let halved = scene.clone().every(2);
        assert_eq!(
            (
                halved.frames.len(),
                halved.truth.len(),
                halved.frames[1].sequence
            ),
            (3, 3, 2)
        );
        let blind = scene.clone().blind(1..3);
        assert!(
            readings(&blind) == 0.0
                && blind.truth[1].joints.is_empty()
                && !blind.truth[3].joints.is_empty()
        );
        let held = scene.clone().holding("left_wrist", 0.1);
        let new = held.frames[0]
            .depth
            .data()
            .iter()
            .zip(scene.frames[0].depth.data())
            .filter(|(a, b)| a != b)
            .count();
        assert!(
            (1_000..5_000).contains(&new),
            "a ball of 20 cm at 2.4 m covers some 1,900 pixels: {new}"
        );
        let both = scene.clone().with(&held);
        assert_eq!(
            both.frames[0].depth.data(),
            held.frames[0].depth.data(),
            "what is nearer hides what is behind"
        );
        let beside = scene.clone().cut_beside(0.5, 1);
        assert!(readings(&beside) < 0.7 * all && beside.frames[0].depth == scene.frames[0].depth);
        assert!(
            scene.cut_below(0.5).frames[0].depth.data()[640 * 400..]
                .iter()
                .all(|d| *d == 0)
        );
    }
}

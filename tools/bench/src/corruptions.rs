//! Corruptions of a depth sequence: noise, lost readings, dropped frames, occlusion, clipping.

use super::segment::distance_from_segment;
use super::{DepthScene, SceneTruth};
use rand::Rng;
use rand_pcg::Pcg32;
use tryon_geometry::camera::{DepthImage, Intrinsics};
use tryon_geometry::math::{P3, P3d};

/// Seed of the corrupted pixels.
const SEED: u64 = 41;

/// Visits the readings of an image; `f` receives the pixel's point at a depth (m), and the reading.
fn each_point(
    image: &mut DepthImage,
    camera: &Intrinsics,
    f: impl Fn(&dyn Fn(f32) -> P3, &mut u16),
) {
    for (k, d) in image.data_mut().iter_mut().enumerate() {
        let (u, v) = (k as u32 % camera.width, k as u32 / camera.width);
        f(&|z| camera.unproject(u as f32, v as f32, z), d);
    }
}

/// Takes away the readings within `radius` of a segment (camera frame, metres).
pub(crate) fn drop_returns(
    image: &mut DepthImage,
    camera: &Intrinsics,
    segment: &[P3; 2],
    radius: f32,
) {
    each_point(image, camera, |point, d| {
        if distance_from_segment(&point(f32::from(*d) * 1e-3), segment) < radius {
            *d = 0;
        }
    });
}

impl DepthScene {
    fn each_pixel(mut self, mut f: impl FnMut(&mut Pcg32, &mut u16)) -> Self {
        for (i, frame) in self.frames.iter_mut().enumerate() {
            let mut rng = Pcg32::new(SEED, i as u64);
            let pixels = frame.depth.data_mut().iter_mut();
            pixels.for_each(|d| f(&mut rng, d));
        }
        self
    }

    /// Changes depth images by the true places of some joints. Frames without truth keep their readings, as do all frames if
    /// the scene lacks a joint.
    fn each_image_by<const N: usize>(
        mut self,
        names: [&str; N],
        f: impl Fn(&[P3d; N], &mut DepthImage, &Intrinsics),
    ) -> Self {
        let find = |name: &str| self.joint_names.iter().position(|m| m == name);
        let found: Vec<usize> = names.iter().filter_map(|n| find(n)).collect();
        let Ok(joints) = <[usize; N]>::try_from(found) else {
            return self;
        };
        let camera = self.calibration.depth;
        for (frame, truth) in self.frames.iter_mut().zip(&self.truth) {
            if !truth.joints.is_empty() {
                f(&joints.map(|j| truth.joints[j]), &mut frame.depth, &camera);
            }
        }
        self
    }

    /// A share of all pixels becomes random, saturated, very near or missing, in equal parts.
    #[must_use]
    pub fn corrupted(self, share: f64) -> Self {
        self.each_pixel(|rng, d| {
            if rng.random::<f64>() < share {
                *d = match rng.random_range(0..4) {
                    0 => rng.random_range(300..6000),
                    1 => u16::MAX,
                    2 => 500,
                    _ => 0,
                };
            }
        })
    }

    /// A share of all pixels gives no reading.
    #[must_use]
    pub fn thinned(self, share: f64) -> Self {
        self.each_pixel(|rng, d| {
            if rng.random::<f64>() < share {
                *d = 0;
            }
        })
    }

    /// Only every n-th frame arrives, at its own time.
    #[must_use]
    pub fn every(mut self, n: usize) -> Self {
        self.frames = self.frames.into_iter().step_by(n.max(1)).collect();
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

    /// Readings within `radius` (metres) of the line between two joints give no return, as black sleeves do.
    #[must_use]
    pub fn without_return(self, from: &str, to: &str, radius: f32) -> Self {
        self.each_image_by([from, to], |ends, image, camera| {
            drop_returns(image, camera, &ends.map(|p| p.cast()), radius);
        })
    }

    /// Puts a ball of `radius` (metres) in front of a joint.
    #[must_use]
    pub fn holding(self, joint: &str, radius: f64) -> Self {
        self.each_image_by([joint], |[hand], image, camera| {
            let centre = hand.coords - hand.coords.normalize() * radius;
            each_point(image, camera, |point, d| {
                let ray = point(1.0).coords.cast::<f64>();
                // Nearer root of |t ray − centre| = radius; t is the depth, as the ray has z = 1.
                let (a, b) = (ray.norm_squared(), ray.dot(&centre));
                let disc = b * b - a * (centre.norm_squared() - radius * radius);
                if disc > 0.0 {
                    let mm = ((b - disc.sqrt()) / a * 1e3).round();
                    if mm > 0.0 && mm < f64::from(u16::MAX) && (*d == 0 || mm < f64::from(*d)) {
                        *d = mm as u16;
                    }
                }
            });
        })
    }

    /// From frame `first` on, columns from this share of the width on give no reading.
    #[must_use]
    pub fn cut_beside(mut self, share: f64, first: usize) -> Self {
        for frame in self.frames.iter_mut().skip(first) {
            let w = frame.depth.width() as usize;
            let from = (share.clamp(0.0, 1.0) * w as f64) as usize;
            let rows = frame.depth.data_mut().chunks_exact_mut(w);
            rows.for_each(|row| row[from..].fill(0));
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
        let depth = |s: &DepthScene, frame: usize| s.frames[frame].depth.data().to_vec();
        let readings = |s: &DepthScene| depth(s, 1).iter().filter(|d| **d > 0).count() as f64;
        let changed = |s: &DepthScene| {
            let (a, b) = (depth(s, 0), depth(&scene, 0));
            a.iter().zip(&b).filter(|(a, b)| a != b).count()
        };
        let all = readings(&scene);
        assert!((readings(&scene.clone().thinned(0.9)) / all - 0.1).abs() < 0.01);
        let share = changed(&scene.clone().corrupted(0.1)) as f64 / (640.0 * 480.0);
        assert!((share - 0.098).abs() < 0.02);
        let halved = scene.clone().every(2);
        let counts = (halved.frames.len(), halved.truth.len());
        assert_eq!((counts, halved.frames[1].sequence), ((3, 3), 2));
        let blind = scene.clone().blind(1..3);
        assert_eq!(readings(&blind), 0.0);
        assert!(blind.truth[1].joints.is_empty() && !blind.truth[3].joints.is_empty());
        let held = scene.clone().holding("left_wrist", 0.1);
        // A ball of 20 cm at 2.4 m covers some 1,900 pixels.
        assert!((1_000..5_000).contains(&changed(&held)));
        // Nearer readings hide those behind.
        assert_eq!(depth(&scene.clone().with(&held), 0), depth(&held, 0));
        let beside = scene.clone().cut_beside(0.5, 1);
        assert!(readings(&beside) < 0.7 * all && depth(&beside, 0) == depth(&scene, 0));
        let below = depth(&scene.clone().cut_below(0.5), 0);
        assert!(below[640 * 400..].iter().all(|d| *d == 0));
    }
}

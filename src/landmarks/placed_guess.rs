//! Size and depth of a person, from the network's guess, the landmarks' pixels and their readings.

use crate::reading_window::ReadingWindow;
use crate::{Landmark, LandmarkLiftSettings, PoseLandmarks};
use tryon_geometry::camera::{DepthImage, Intrinsics};
use tryon_geometry::math::order_statistics::median;

type V2 = nalgebra::Vector2<f32>;

/// Least number of landmarks with readings by which a person's depth is known.
const LEAST_READINGS: usize = 4;

/// The network's guess at its place in the colour camera's frame.
pub(crate) struct PlacedGuess {
    /// Size of the person over that of the guess.
    pub(crate) scale: f64,
    /// Depth of the surface before the guess' origin, metres.
    depth: f64,
    /// Half side of the squares from which depth is read, pixels.
    pub(crate) radius: f32,
}

impl PlacedGuess {
    /// `None` for a person without readings.
    pub(crate) fn new(
        pose: &PoseLandmarks,
        registered: &DepthImage,
        color: &Intrinsics,
        settings: &LandmarkLiftSettings,
    ) -> Option<Self> {
        let seen: Vec<&Landmark> = (pose.landmarks.iter())
            .filter(|landmark| is_seen(landmark, settings))
            .collect();
        let pixels_per_metre =
            spread(&seen, |l| l.pixel) / spread(&seen, |l| [l.guess.x, l.guess.y]);
        let radius = pixels_per_metre * settings.window;
        if !radius.is_finite() {
            return None;
        }
        let (mut readings, guesses): (Vec<f64>, Vec<f64>) = (seen.iter())
            .filter_map(|landmark| {
                let window = ReadingWindow::around(registered, landmark.pixel, radius)?;
                let reading = window.median(registered, 0.0..=f64::INFINITY, settings.share)?;
                Some((reading, f64::from(landmark.guess.z)))
            })
            .unzip();
        if readings.len() < LEAST_READINGS {
            return None;
        }
        let middle = median(&mut readings.clone())?;
        let scale = f64::from(pixels_per_metre) * middle / color.fx;
        for (reading, guess) in readings.iter_mut().zip(guesses) {
            *reading -= scale * guess;
        }
        let depth = median(&mut readings)?;
        Some(Self {
            scale,
            depth,
            radius,
        })
    }

    /// Depth at which a landmark's surface is expected, metres.
    pub(crate) fn depth(&self, landmark: &Landmark) -> f64 {
        self.depth + self.scale * f64::from(landmark.guess.z)
    }
}

/// Is visible, and in the picture, more likely than the settings ask.
pub(crate) fn is_seen(landmark: &Landmark, settings: &LandmarkLiftSettings) -> bool {
    landmark.visibility.min(landmark.presence) >= settings.visible
}

/// Root mean square distance of places from their mean.
fn spread(landmarks: &[&Landmark], place: impl Fn(&Landmark) -> [f32; 2]) -> f32 {
    let count = landmarks.len().max(1) as f32;
    let places = || landmarks.iter().map(|landmark| V2::from(place(landmark)));
    let mean = places().sum::<V2>() / count;
    let squares: f32 = places().map(|p| (p - mean).norm_squared()).sum();
    (squares / count).sqrt()
}

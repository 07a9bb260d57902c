//! Colours of a subject's clothes: after a loss they tell apart two people of one size.

use crate::model::TrackerModel;
use crate::registration::IndexImage;
use crate::settings::ClothesColorSettings;
use serde::{Deserialize, Serialize};
use tryon_body::parts::BodyPart;
use tryon_geometry::camera::RgbdFrame;
use tryon_geometry::spatial::{Label, OrganisedCloud};

/// Bins of brightness and of the shares of red and of green in it.
const BINS: [usize; 3] = [4, 8, 8];
/// Cells of a histogram.
const CELLS: usize = BINS[0] * BINS[1] * BINS[2];
/// Sum of the channels of white.
const BRIGHTEST: f32 = 3.0 * 255.0;
/// Shares of red and green that the bins span: even a saturated cloth keeps within them.
const SHARES: [f32; 2] = [0.1, 0.6];
/// Grey added to every colour, of 255: the hue of near black is noise.
const DARK: f32 = 24.0;

/// Shares of colours over trunk and head, and over the legs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct ClothesColors {
    trunk: ColorShares,
    legs: ColorShares,
}

/// Histogram of colours.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct ColorShares {
    /// Readings of a frame, running mean; 0 for a part that was never seen.
    readings: f32,
    /// Shares of the bins, sum 1; empty for a part that was never seen.
    shares: Vec<f32>,
}

impl ClothesColors {
    /// Colours of the readings that the drawn body covers; `None` without colour.
    pub(crate) fn of(
        model: &TrackerModel,
        frame: &RgbdFrame,
        grid: &OrganisedCloud,
        image: &IndexImage,
    ) -> Option<Self> {
        let color = frame.color.as_ref()?;
        let mut out = Self::default();
        for (k, &vertex) in image.index.iter().enumerate() {
            if vertex == IndexImage::NONE || grid.labels[k] != Label::Person {
                continue;
            }
            let part = model.parts[usize::from(model.bones[vertex as usize])];
            let shares = if part == BodyPart::Trunk as usize {
                &mut out.trunk
            } else if part == BodyPart::LeftLeg as usize || part == BodyPart::RightLeg as usize {
                &mut out.legs
            } else {
                continue;
            };
            if let Some(rgb) = model.calibration.color_at(color, &grid.points[k]) {
                shares.add(rgb);
            }
        }
        for part in [&mut out.trunk, &mut out.legs] {
            let readings = part.readings.max(1.0);
            part.shares.iter_mut().for_each(|s| *s /= readings);
        }
        Some(out)
    }

    /// Adds a frame to what was seen before.
    pub(crate) fn learn(&mut self, frame: &Self, settings: &ClothesColorSettings) {
        self.trunk.learn(&frame.trunk, settings);
        self.legs.learn(&frame.legs, settings);
    }

    /// Bhattacharyya coefficient of the colours, 0 to 1, by readings over the parts that both show; `None` where that is too
    /// little.
    pub(crate) fn likeness(&self, other: &Self, settings: &ClothesColorSettings) -> Option<f32> {
        let parts = [(&self.trunk, &other.trunk), (&self.legs, &other.legs)];
        let seen = parts.map(|(a, b)| (a.readings.min(b.readings), a.likeness(b)));
        let seen = seen.iter().filter(|s| s.0 >= settings.least_readings);
        let (readings, sum) = seen.fold((0.0, 0.0), |(n, sum), s| (n + s.0, sum + s.0 * s.1));
        (readings > 0.0).then(|| sum / readings)
    }
}

impl ColorShares {
    /// Adds a reading to the bins around its colour.
    fn add(&mut self, [r, g, b]: [u8; 3]) {
        let [r, g, b] = [r, g, b].map(f32::from);
        let sum = r + g + b;
        let share =
            |c: f32| ((c + DARK) / (sum + 3.0 * DARK) - SHARES[0]) / (SHARES[1] - SHARES[0]);
        let at = [sum / BRIGHTEST, share(r), share(g)];
        let mut low = [0; 3];
        let mut part = [0.0; 3];
        for d in 0..3 {
            let x = (at[d] * BINS[d] as f32 - 0.5).clamp(0.0, (BINS[d] - 1) as f32);
            low[d] = (x as usize).min(BINS[d] - 2);
            part[d] = x - low[d] as f32;
        }
        self.shares.resize(CELLS, 0.0);
        for corner in 0..8 {
            let step = [corner & 1, corner >> 1 & 1, corner >> 2];
            let [i, j, k] = [0, 1, 2].map(|d| low[d] + step[d]);
            let weight = [0, 1, 2].map(|d| if step[d] == 1 { part[d] } else { 1.0 - part[d] });
            self.shares[(i * BINS[1] + j) * BINS[2] + k] += weight.iter().product::<f32>();
        }
        self.readings += 1.0;
    }

    fn learn(&mut self, frame: &Self, settings: &ClothesColorSettings) {
        if frame.readings < settings.least_readings {
            return;
        }
        if self.shares.is_empty() {
            *self = frame.clone();
            return;
        }
        self.readings += settings.newest * (frame.readings - self.readings);
        for (kept, new) in self.shares.iter_mut().zip(&frame.shares) {
            *kept += settings.newest * (new - *kept);
        }
    }

    fn likeness(&self, other: &Self) -> f32 {
        let pairs = self.shares.iter().zip(&other.shares);
        pairs.map(|(a, b)| (a * b).sqrt()).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Somebody whose trunk and legs have these colours, in the light of `gain`.
    fn dressed(trunk: [u8; 3], legs: [u8; 3], gain: f32) -> ClothesColors {
        let mut out = ClothesColors::default();
        for (part, rgb) in [(&mut out.trunk, trunk), (&mut out.legs, legs)] {
            for k in 0..400 {
                // Folds are lighter and darker.
                let shade = gain * (0.7 + 0.6 * (k % 20) as f32 / 20.0);
                part.add(rgb.map(|c| (f32::from(c) * shade).min(255.0) as u8));
            }
            part.shares.iter_mut().for_each(|s| *s /= 400.0);
        }
        out
    }

    const RED: [u8; 3] = [170, 40, 50];
    const BLUE: [u8; 3] = [40, 60, 140];
    const GREY: [u8; 3] = [110, 110, 115];

    #[test]
    fn the_same_clothes_are_alike_in_less_light_and_others_are_not() {
        let settings = ClothesColorSettings::default();
        let like = |a: &ClothesColors, b: &ClothesColors| a.likeness(b, &settings).expect("seen");
        let first = dressed(RED, BLUE, 1.0);
        assert!(like(&first, &first) > 0.999);
        let darker = like(&first, &dressed(RED, BLUE, 0.8));
        let other = like(&first, &dressed(GREY, BLUE, 1.0));
        let stranger = like(&first, &dressed(BLUE, GREY, 1.0));
        assert!(
            darker > settings.least_likeness && darker > other,
            "{darker} {other}"
        );
        assert!(stranger < settings.least_likeness, "{stranger}");
    }

    #[test]
    fn what_was_hardly_seen_says_nothing() {
        let settings = ClothesColorSettings::default();
        let seen = dressed(RED, BLUE, 1.0);
        assert_eq!(seen.likeness(&ClothesColors::default(), &settings), None);
        let mut kept = seen.clone();
        kept.learn(&ClothesColors::default(), &settings);
        assert_eq!(kept, seen);
        kept.learn(&dressed(GREY, GREY, 1.0), &settings);
        assert!(kept.likeness(&seen, &settings).expect("seen") > 0.85);
        let sum: f32 = kept.trunk.shares.iter().sum();
        assert!((sum - 1.0).abs() < 1e-4);
    }
}

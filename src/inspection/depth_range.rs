//! Nearest, middle and farthest surface, by a histogram of readings.

use crate::settings::InspectionSettings;
use serde::Serialize;
use tryon_geometry::camera::DepthImage;

/// Width of a bin, millimetres.
const BIN_MM: usize = 10;
/// Bins of all 16-bit depths.
const BINS: usize = u16::MAX as usize / BIN_MM + 1;

/// Depths of the surfaces in view (m), and the share that is too near.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DepthRange {
    /// Nearest surface but for stray pixels.
    pub nearest: f64,
    /// Median.
    pub median: f64,
    /// Farthest surface but for stray pixels.
    pub farthest: f64,
    /// Share of the readings below [`InspectionSettings::too_near`].
    pub too_near: f64,
}

/// Counts of readings in steps of a centimetre.
#[derive(Clone, Debug)]
pub struct DepthHistogram {
    counts: Vec<u64>,
    total: u64,
}

impl Default for DepthHistogram {
    fn default() -> Self {
        Self {
            counts: vec![0; BINS],
            total: 0,
        }
    }
}

impl DepthHistogram {
    /// Adds the readings of an image.
    pub fn add(&mut self, depth: &DepthImage) {
        for reading in depth.data().iter().filter(|d| **d > 0) {
            self.counts[usize::from(*reading) / BIN_MM] += 1;
            self.total += 1;
        }
    }

    /// Depth below which a share of the readings lies (m), within a centimetre; `None` without readings.
    pub fn quantile(&self, share: f64) -> Option<f64> {
        let wanted = ((share * self.total as f64).ceil() as u64).max(1);
        let mut below = 0;
        let bin = self.counts.iter().position(|count| {
            below += count;
            below >= wanted
        })?;
        Some(((bin * BIN_MM) as f64 + 0.5 * BIN_MM as f64) * 1e-3)
    }

    /// Range of the readings; `None` without any.
    pub fn range(&self, settings: &InspectionSettings) -> Option<DepthRange> {
        let [near, far] = settings.range_shares;
        let bins = (settings.too_near * 1000.0) as usize / BIN_MM;
        let too_near: u64 = self.counts[..bins.min(BINS)].iter().sum();
        Some(DepthRange {
            nearest: self.quantile(near)?,
            median: self.quantile(0.5)?,
            farthest: self.quantile(far)?,
            too_near: too_near as f64 / self.total as f64,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_leave_stray_pixels_out() {
        // 10 stray readings of 1000 at 0.3 m, one at 9 m, the others from 1.0 to 1.98 m in steps of a millimetre.
        let mut readings = vec![300; 10];
        readings.push(9000);
        readings.extend(1000..1989);
        readings.extend([0; 500]);
        let mut histogram = DepthHistogram::default();
        histogram.add(&DepthImage::new(1500, 1, readings).expect("1500"));
        let range = histogram.range(&Default::default()).expect("readings");
        assert!((range.nearest - 0.3).abs() < 0.011, "{range:?}");
        assert!((range.median - 1.489).abs() < 0.011, "{range:?}");
        assert!((range.farthest - 1.979).abs() < 0.011, "{range:?}");
        assert_eq!(range.too_near, 0.01);
    }

    #[test]
    fn nothing_has_no_range() {
        let mut histogram = DepthHistogram::default();
        histogram.add(&DepthImage::empty(4, 3));
        assert_eq!(histogram.range(&Default::default()), None);
    }
}

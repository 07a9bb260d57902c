//! Relief and tone across seams and finished edges, by distance; averaged over a pixel, so that nothing shimmers.

use super::relief_curve::{bump, step};
use tryon_garment::Finish;

/// Distance between two entries, metres.
const STEP: f32 = 2.5e-4;
/// Entries: 64 mm.
const ENTRIES: usize = 257;
/// Distance of the first row of stitches inside the turned edge, and of two rows from each other, metres.
const ROWS: [f32; 2] = [2e-3, 6e-3];
/// Half width of a row of stitches, and of the step where a turned edge ends, metres.
const STITCH: f32 = 6e-4;
const SHOULDER: f32 = 8e-4;
/// Relief of a cut edge, of a ribbed and of a smooth band in units of the bulk, which is that of a hem's two layers: one layer
/// alone, and two with the seam's allowance between them, of stretched and of stiffened cloth.
const CUT: f32 = 0.3;
const RIBBED: f32 = 1.3;
const STIFFENED: f32 = 1.5;
/// Half width of the groove between two panels, and where a rib is sewn on, metres; of the dark line at its bottom there.
const GROOVE: [f32; 2] = [1e-3, 1.2e-3];
const GROOVE_LINE: f32 = 8e-4;
/// Row of stitches that holds a rib's allowance, beyond the seam, metres, and its share of a hem's: it lies under tension.
const RIB_ROW: f32 = 3e-3;
const RIB_PULL: [f32; 2] = [0.4, 0.5];
/// Waves of puckers along a hem and a rib, metres: two stitches and a half of 2.5 to 3 mm; and how far beyond a rib they lie.
const PUCKERS: [f32; 2] = [7e-3, 5e-3];
const RIB_PUCKERS: f32 = 2e-3;
/// Depth of stitches and of the groove of a seam in units of the bulk, and the light that their threads and grooves take.
const PULL: [f32; 2] = [0.7, 1.0];
const TAKEN: [f32; 2] = [0.22, 0.35];
/// Width over which the two layers of a seam's allowance lie below, metres.
const ALLOWANCE: f32 = 9e-3;
/// Radius of a folded edge, metres.
const FOLD: f32 = 1.2e-3;

/// Relief (metres) and tone by distance from an edge, metres.
#[derive(Clone, Debug)]
pub(crate) struct EdgeProfile {
    height: Vec<f32>,
    /// Integral of the light taken, metres.
    taken: Vec<f32>,
    /// Wave of the puckers along the edge, and distance at which they are strongest, metres; none at 0.
    pub(crate) pucker: [f32; 2],
    /// Distance up to which ribs run across; 0 without.
    pub(crate) ribs: f32,
}

impl EdgeProfile {
    /// Profile of a function from distance to relief and light taken.
    fn of(curve: impl Fn(f32) -> [f32; 2], pucker: [f32; 2], ribs: f32) -> Self {
        let mut sum = 0.0;
        let samples: Vec<[f32; 2]> = (0..ENTRIES).map(|k| curve(k as f32 * STEP)).collect();
        let taken = samples.iter().enumerate().map(|(k, s)| {
            if k > 0 {
                sum += 0.5 * STEP * (s[1] + samples[k - 1][1]);
            }
            sum
        });
        Self {
            taken: taken.collect(),
            height: samples.iter().map(|s| s[0]).collect(),
            pucker,
            ribs,
        }
    }

    /// Two panels sewn together: a groove between the layers of the allowance.
    pub(crate) fn seam(bulk: f32) -> Self {
        let curve = |d: f32| {
            let groove = bump(d, GROOVE[0]);
            let below = 0.5 * (1.0 - step(d - ALLOWANCE, 4.0 * SHOULDER));
            [
                bulk * (below - PULL[1] * groove),
                TAKEN[1] * bump(d, STITCH),
            ]
        };
        Self::of(curve, [0.0; 2], 0.0)
    }

    /// A free edge.
    pub(crate) fn free(finish: Finish, bulk: f32) -> Self {
        let fold = |d: f32| 1.0 - (1.0 - (d / FOLD).min(1.0)).powi(2);
        match finish {
            Finish::Raw => Self::of(|d| [CUT * bulk * fold(d), 0.0], [0.0; 2], 0.0),
            Finish::Hem { width, rows } => {
                let curve = move |d: f32| {
                    let layers = fold(d) * (1.0 - step(d - width, SHOULDER));
                    let row = |k: u8| bump(d - (width - ROWS[0] - ROWS[1] * f32::from(k)), STITCH);
                    let stitches: f32 = (0..rows).map(row).sum();
                    [bulk * (layers - PULL[0] * stitches), TAKEN[0] * stitches]
                };
                Self::of(curve, [PUCKERS[0], width - ROWS[0]], 0.0)
            }
            Finish::Rib { width } => {
                let curve = move |d: f32| {
                    let band = fold(d) * (1.0 - step(d - width, SHOULDER));
                    let groove = bump(d - width, GROOVE[1]);
                    let stitches = bump(d - (width + RIB_ROW), STITCH);
                    [
                        bulk * (RIBBED * band - PULL[1] * groove - RIB_PULL[0] * stitches),
                        TAKEN[1] * bump(d - width, GROOVE_LINE) + RIB_PULL[1] * TAKEN[0] * stitches,
                    ]
                };
                Self::of(curve, [PUCKERS[1], width + RIB_PUCKERS], width)
            }
            Finish::Band { width } => {
                let curve = move |d: f32| {
                    let band = fold(d) * (1.0 - step(d - width, SHOULDER));
                    let stitches = bump(d - ROWS[0], STITCH) + bump(d - (width - ROWS[0]), STITCH);
                    [
                        bulk * (STIFFENED * band
                            - PULL[0] * stitches
                            - PULL[1] * bump(d - width, STITCH)),
                        TAKEN[0] * stitches + TAKEN[1] * bump(d - width, STITCH),
                    ]
                };
                Self::of(curve, [0.0; 2], 0.0)
            }
        }
    }

    #[cfg(feature = "gpu")]
    pub(crate) fn rows(&self) -> impl Iterator<Item = [f32; 2]> + '_ {
        (self.height.iter().zip(&self.taken)).map(|(h, t)| [*h, *t])
    }

    /// Distance from which nothing is seen, metres.
    pub(crate) const REACH: f32 = STEP * (ENTRIES - 1) as f32;

    fn at(table: &[f32], x: f32) -> f32 {
        let x = (x / STEP).min((ENTRIES - 1) as f32);
        let k = (x as usize).min(ENTRIES - 2);
        let t = x - k as f32;
        table[k] + (table[k + 1] - table[k]) * t
    }

    /// Mean slope and mean light taken over `footprint` metres about a distance; both sides of the edge are alike.
    #[inline]
    pub(crate) fn mean(&self, distance: f32, footprint: f32) -> [f32; 2] {
        let f = footprint.max(STEP);
        let [lo, hi] = [distance - 0.5 * f, distance + 0.5 * f];
        let height = |x: f32| Self::at(&self.height, x.abs());
        let taken = |x: f32| Self::at(&self.taken, x.abs()).copysign(x);
        [(height(hi) - height(lo)) / f, (taken(hi) - taken(lo)) / f]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hem_has_a_shoulder_and_its_stitches_and_ends() {
        let hem = EdgeProfile::free(
            Finish::Hem {
                width: 0.02,
                rows: 2,
            },
            1e-3,
        );
        let slope = |d: f32| hem.mean(d, 5e-4)[0];
        assert!(slope(0.0005) > 0.3, "the fold rounds: {}", slope(0.0005));
        assert!(slope(0.02) < -0.3, "the layer below ends: {}", slope(0.02));
        assert!(hem.mean(0.018, 5e-4)[1] > 0.15 && hem.mean(0.012, 5e-4)[1] > 0.15);
        assert_eq!(hem.mean(0.05, 1e-3), [0.0, 0.0]);
        assert_eq!(hem.mean(10.0, 1e-3), [0.0, 0.0]);
    }

    #[test]
    fn means_over_wider_pixels_are_means_of_narrow_ones() {
        let seam = EdgeProfile::seam(1e-3);
        let wide = seam.mean(0.004, 0.008);
        let narrow: Vec<[f32; 2]> = (0..16)
            .map(|k| seam.mean(5e-4 * (k as f32 + 0.5), 5e-4))
            .collect();
        for c in 0..2 {
            let mean = narrow.iter().map(|n| n[c]).sum::<f32>() / 16.0;
            assert!((wide[c] - mean).abs() < 2e-3, "{c}: {} {mean}", wide[c]);
        }
        assert_eq!(seam.mean(0.0, 2e-3)[0], 0.0, "both sides are alike");
    }
}

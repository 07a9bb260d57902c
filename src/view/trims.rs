//! Trims of a garment prepared for shading: a tile of relief and tone for each, filtered as yarns are.

use super::cloth::ClothSample;
#[cfg(feature = "gpu")]
use super::cloth_tile::ClothTexel;
use super::cloth_tile::ClothTile;
use super::trim_relief::relief;
use std::sync::Arc;
use tryon_garment::{FabricLook, MAX_TRIMS, PlacedTrim};

/// Margin around a trim, metres: stitches and shade beside it.
const MARGIN: f32 = 6e-3;
/// Length of a texel, metres, and most texels a side: a power of two.
const TEXEL: f32 = 1e-3;
const MOST_TEXELS: usize = 256;

/// Trims of a garment.
#[derive(Clone, Debug)]
pub struct DrawnTrims {
    placed: Vec<PlacedTrim>,
    trims: Vec<DrawnTrim>,
}

impl PartialEq for DrawnTrims {
    fn eq(&self, other: &Self) -> bool {
        self.placed == other.placed
    }
}

#[derive(Clone, Debug)]
struct DrawnTrim {
    at: [f32; 2],
    /// Cosine and sine of its turn.
    axis: [f32; 2],
    /// Half of its sides with the margin, metres.
    half: [f32; 2],
    side: f32,
    tile: ClothTile,
}

impl DrawnTrims {
    /// Prepares the first [`MAX_TRIMS`] of a garment; `None` without any.
    pub fn new(placed: &[PlacedTrim], look: &FabricLook) -> Option<Arc<Self>> {
        let placed: Vec<PlacedTrim> = placed.iter().take(MAX_TRIMS).copied().collect();
        let trims: Vec<DrawnTrim> = placed.iter().map(|t| DrawnTrim::new(t, look)).collect();
        (!trims.is_empty()).then(|| Arc::new(Self { placed, trims }))
    }

    /// Trims whose circle meets the box of a triangle (texture space, metres), as bits.
    pub(crate) fn near(&self, corners: [[f32; 2]; 3]) -> u32 {
        let mut bits = 0;
        for (k, trim) in self.trims.iter().enumerate() {
            let reach = trim.half[0].hypot(trim.half[1]);
            let meets = (0..2).all(|c| {
                let [a, b, d] = corners.map(|p| p[c] - trim.at[c]);
                a.min(b).min(d) <= reach && a.max(b).max(d) >= -reach
            });
            bits |= u32::from(meets) << k;
        }
        bits
    }

    /// Adds those of `bits` at a place of the texture (metres), mean over about `footprint` metres.
    #[inline]
    pub(crate) fn add(&self, mut bits: u32, uv: [f32; 2], footprint: f32, out: &mut ClothSample) {
        while bits != 0 {
            let trim = &self.trims[bits.trailing_zeros() as usize];
            bits &= bits - 1;
            let [c, s] = trim.axis;
            let d = [uv[0] - trim.at[0], uv[1] - trim.at[1]];
            let own = [c * d[0] + s * d[1], c * d[1] - s * d[0]];
            if own[0].abs() >= trim.half[0] || own[1].abs() >= trim.half[1] {
                continue;
            }
            let t = trim
                .tile
                .nearest_level(own.map(|o| o + 0.5 * trim.side), footprint);
            out.slopes[0] += c * t[0] - s * t[1];
            out.slopes[1] += s * t[0] + c * t[1];
            out.tone *= 1.0 + t[2];
        }
    }

    /// Two numbers of four a trim (middle and axis; half sides, side and levels), then their texels in order.
    #[cfg(feature = "gpu")]
    pub(crate) fn texels(&self) -> impl Iterator<Item = ClothTexel> + '_ {
        let heads = self.trims.iter().flat_map(|t| {
            let levels = t.tile.levels() as f32;
            [
                [t.at[0], t.at[1], t.axis[0], t.axis[1]],
                [t.half[0], t.half[1], t.side, levels],
            ]
        });
        heads.chain(self.trims.iter().flat_map(|t| t.tile.texels()).copied())
    }

    #[cfg(feature = "gpu")]
    pub(crate) fn count(&self) -> usize {
        self.trims.len()
    }
}

impl DrawnTrim {
    fn new(placed: &PlacedTrim, look: &FabricLook) -> Self {
        let half = placed.size.map(|s| 0.5 * s + MARGIN);
        let side = 2.0 * half[0].max(half[1]);
        let wanted = (side / TEXEL) as usize;
        let texels = wanted.next_power_of_two().min(MOST_TEXELS);
        let points: Vec<[f32; 2]> = (0..texels * texels)
            .map(|i| {
                let at = [i % texels, i / texels]
                    .map(|c| ((c as f32 + 0.5) / texels as f32 - 0.5) * side);
                relief(placed.kind, placed.size, look.bulk, at)
            })
            .collect();
        let heights: Vec<f32> = points.iter().map(|p| p[0]).collect();
        let tones: Vec<f32> = points.iter().map(|p| p[1]).collect();
        let (s, c) = placed.turn.sin_cos();
        Self {
            at: placed.at,
            axis: [c, s],
            half,
            side,
            tile: ClothTile::of(&heights, &tones, texels, side),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_garment::TrimKind;

    fn slit(turn: f32) -> Arc<DrawnTrims> {
        let placed = PlacedTrim {
            kind: TrimKind::Slit,
            at: [0.3, 0.2],
            size: [0.12, 0.02],
            turn,
        };
        DrawnTrims::new(&[placed], &FabricLook::default()).expect("one trim")
    }

    fn tone(trims: &DrawnTrims, uv: [f32; 2], footprint: f32) -> f32 {
        let mut sample = ClothSample {
            tone: 1.0,
            ..ClothSample::default()
        };
        let bits = trims.near([uv; 3]);
        trims.add(bits, uv, footprint, &mut sample);
        sample.tone
    }

    #[test]
    fn a_turned_slit_is_dark_along_its_own_axis() {
        let (flat, upright) = (slit(0.0), slit(std::f32::consts::FRAC_PI_2));
        for (trims, along, across) in [
            (&flat, [0.33, 0.2], [0.3, 0.23]),
            (&upright, [0.3, 0.23], [0.33, 0.2]),
        ] {
            assert!(tone(trims, along, 1e-3) < 0.7);
            assert_eq!(tone(trims, across, 1e-3), 1.0);
        }
        assert_eq!(flat.near([[0.9, 0.9]; 3]), 0, "far away");
    }

    #[test]
    fn from_afar_a_slit_is_a_little_darkness() {
        let trims = slit(0.0);
        let far = tone(&trims, [0.3, 0.2], 0.05);
        assert!(far < 1.0 && far > 0.93, "{far}");
        assert!(DrawnTrims::new(&[], &FabricLook::default()).is_none());
    }
}

//! Relief and tone of a fabric over its pattern, as periodic tiles with levels of detail: means of slopes, and their variance as
//! roughness (Olano & Baker 2010).

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg32;
use std::f32::consts::TAU;
use tryon_garment::{FabricLook, Structure};

/// One texel: mean slopes along u and v, relative tone, mean of the squared slope of one axis.
pub(crate) type ClothTexel = [f32; 4];

/// Texels of a side of the finest level; powers of two, so that tiles repeat without a remainder.
const YARN_SIDE: usize = 128;
const SURFACE_SIDE: usize = 256;
/// Pitches of the yarns across their tile.
const PITCHES: usize = 8;
/// Side of the tile of the uneven surface, metres: 1.5 mm a texel.
const SURFACE: f32 = 0.384;
/// Wavelengths of the uneven surface in texels.
const FINE_WAVES: [usize; 2] = [2, 4];
/// Texels of a side of the tile of wrinkles, ridges across it, waves that make it up, and their spread about it across and
/// along the ridges: as many whole waves as the tile repeats.
const WRINKLE_SIDE: usize = 128;
const RIDGES: usize = 8;
const WRINKLE_WAVES: usize = 32;
const ACROSS: i32 = 2;
const ALONG: i32 = 2;
/// Light lost in the valleys between yarns, per relief over pitch.
const VALLEY: f32 = 0.9;

/// A periodic square.
#[derive(Clone, Debug)]
pub(crate) struct ClothTile {
    /// Side, metres.
    side: f32,
    /// Texels of the finest level in a metre.
    per_metre: f32,
    /// Finest first, each half as wide as the one before, shape `[side · side]`.
    levels: Vec<Vec<ClothTexel>>,
}

impl ClothTile {
    /// Yarns.
    pub(crate) fn yarns(look: &FabricLook) -> Self {
        let n = YARN_SIDE;
        let height = |i: usize| {
            let at = [i % n, i / n].map(|c| (c as f32 + 0.5) * PITCHES as f32 / n as f32);
            yarn_height(look.structure, at)
        };
        let heights: Vec<f32> = (0..n * n).map(height).collect();
        let mean = heights.iter().sum::<f32>() / heights.len() as f32;
        let tones = heights.iter().map(|h| VALLEY * look.relief * (h - mean));
        let tones: Vec<f32> = tones.collect();
        let side = look.pitch * PITCHES as f32;
        let scale = look.relief * look.pitch;
        let heights: Vec<f32> = heights.iter().map(|h| h * scale).collect();
        Self::of(&heights, &tones, n, side)
    }

    /// The uneven surface and tone of real cloth, at millimetres to centimetres.
    pub(crate) fn surface(look: &FabricLook) -> Self {
        let n = SURFACE_SIDE;
        let mut rng = Pcg32::seed_from_u64(look.structure as u64);
        let mut heights = noise(n, &FINE_WAVES, 1.0, &mut rng);
        scale_to_slope(&mut heights, n, look.unevenness);
        let mut tones = noise(n, &FINE_WAVES, 0.3, &mut rng);
        normalise(&mut tones, look.mottle);
        Self::of(&heights, &tones, n, SURFACE)
    }

    /// Ridges along v at this distance, of slopes with a root mean square of 1, in `RIDGES` of them a side.
    pub(crate) fn wrinkles(wave: f32) -> Self {
        let n = WRINKLE_SIDE;
        let mut rng = Pcg32::seed_from_u64(n as u64);
        let waves: Vec<[f32; 3]> = (0..WRINKLE_WAVES)
            .map(|_| {
                let across = RIDGES as i32 + rng.random_range(-ACROSS..=ACROSS);
                let along = rng.random_range(-ALONG..=ALONG);
                [across as f32, along as f32, rng.random_range(0.0..TAU)]
            })
            .collect();
        let height = |i: usize| -> f32 {
            let [x, y] = [i % n, i / n].map(|c| TAU * c as f32 / n as f32);
            waves
                .iter()
                .map(|[a, b, phase]| (a * x + b * y + phase).sin())
                .sum()
        };
        let mut heights: Vec<f32> = (0..n * n).map(height).collect();
        normalise(&mut heights, 1.0);
        let tones = heights.clone();
        let mut tile = Self::of(&heights, &tones, n, wave * RIDGES as f32);
        let squares = tile.levels[0].iter().map(|t| t[0] * t[0]).sum::<f32>();
        let rms = (squares / (n * n) as f32).sqrt().max(f32::MIN_POSITIVE);
        tile.scale_slopes(1.0 / rms);
        tile
    }

    fn scale_slopes(&mut self, gain: f32) {
        for t in self.levels.iter_mut().flatten() {
            *t = [t[0] * gain, t[1] * gain, t[2], t[3] * gain * gain];
        }
    }

    /// From heights (metres) and tones, shape `[n · n]`.
    pub(super) fn of(heights: &[f32], tones: &[f32], n: usize, side: f32) -> Self {
        let at = |x: usize, y: usize| heights[y % n * n + x % n];
        let per_metre = n as f32 / (2.0 * side);
        let texel = |i: usize| {
            let (x, y) = (i % n, i / n);
            let su = (at(x + 1, y) - at(x + n - 1, y)) * per_metre;
            let sv = (at(x, y + 1) - at(x, y + n - 1)) * per_metre;
            [su, sv, tones[i], 0.5 * (su * su + sv * sv)]
        };
        let mut levels = vec![(0..n * n).map(texel).collect::<Vec<_>>()];
        let mut n = n;
        while n > 1 {
            let fine = &levels[levels.len() - 1];
            let half = n / 2;
            let mean = |i: usize| -> ClothTexel {
                let first = i / half * 2 * n + i % half * 2;
                let four = [first, first + 1, first + n, first + n + 1];
                std::array::from_fn(|c| 0.25 * four.iter().map(|k| fine[*k][c]).sum::<f32>())
            };
            let next = (0..half * half).map(mean).collect();
            levels.push(next);
            n = half;
        }
        let per_metre = levels[0].len().isqrt() as f32 / side;
        Self {
            side,
            per_metre,
            levels,
        }
    }

    /// Mean over about `footprint` metres at a place of the pattern (metres), between two levels.
    #[inline]
    pub(crate) fn sample(&self, uv: [f32; 2], footprint: f32) -> ClothTexel {
        let level = self.level(footprint);
        let last = self.levels.len() - 1;
        let low = (level as usize).min(last);
        if low == last {
            return self.levels[last][0];
        }
        let t = level - low as f32;
        let [a, b] = [low, low + 1].map(|l| self.bilinear(l, uv));
        std::array::from_fn(|c| a[c] + (b[c] - a[c]) * t)
    }

    #[cfg(feature = "gpu")]
    pub(crate) fn side(&self) -> f32 {
        self.side
    }

    #[cfg(feature = "gpu")]
    pub(crate) fn levels(&self) -> usize {
        self.levels.len()
    }

    #[cfg(feature = "gpu")]
    pub(crate) fn texels(&self) -> impl Iterator<Item = &ClothTexel> {
        self.levels.iter().flatten()
    }

    /// Level whose texels are as wide as `footprint` metres, about: the binary logarithm with a straight mantissa.
    #[inline]
    fn level(&self, footprint: f32) -> f32 {
        let texels = (footprint * self.per_metre).max(1.0).to_bits();
        (texels >> 23) as f32 - 127.0 + (texels & 0x7f_ffff) as f32 / 8_388_608.0
    }

    /// As [`Self::sample`], of the nearest level: for waves of many texels, which two levels show alike, and for low relief.
    #[inline]
    pub(crate) fn nearest_level(&self, uv: [f32; 2], footprint: f32) -> ClothTexel {
        let level = self.level(footprint) + 0.5;
        self.bilinear((level as usize).min(self.levels.len() - 1), uv)
    }

    /// Mean of the whole tile.
    pub(crate) fn mean(&self) -> ClothTexel {
        self.levels[self.levels.len() - 1][0]
    }

    #[inline]
    fn bilinear(&self, level: usize, uv: [f32; 2]) -> ClothTexel {
        let n = 1usize << (self.levels.len() - 1 - level);
        let scale = self.per_metre / (1usize << level) as f32;
        let [(x0, tx), (y0, ty)] = uv.map(|c| {
            let at = c * scale - 0.5;
            // Rounds down; `floor` is a call where the processor's newer instructions aren't asked for.
            let low = at as i32 - i32::from(at < 0.0);
            (low as usize & (n - 1), at - low as f32)
        });
        let (x1, y1) = ((x0 + 1) & (n - 1), (y0 + 1) & (n - 1));
        let texels = &self.levels[level];
        let [a, b, c, d] =
            [[x0, y0], [x1, y0], [x0, y1], [x1, y1]].map(|[x, y]| &texels[y * n + x]);
        std::array::from_fn(|k| {
            let top = a[k] + (b[k] - a[k]) * tx;
            let bottom = c[k] + (d[k] - c[k]) * tx;
            top + (bottom - top) * ty
        })
    }
}

/// Height of the yarns at a place in pitches, 0 to 1.
fn yarn_height(structure: Structure, [x, y]: [f32; 2]) -> f32 {
    let [fx, fy] = [x, y].map(|c| c - c.floor());
    let [i, j] = [x, y].map(|c| c.floor() as i32);
    let round = |f: f32| (1.0 - (2.0 * f - 1.0).powi(2)).max(0.0).sqrt();
    match structure {
        Structure::Jersey | Structure::Rib => {
            // Two legs of each loop rise from the middle of the wale to its sides.
            let leg = (fx - 0.5).abs();
            let s = y * 4.0 / 3.0 + 1.2 * leg;
            let ridge = round(s - s.floor());
            let wale = 1.0 - (2.0 * leg).powi(4);
            let column = if structure == Structure::Rib && i % 2 != 0 {
                0.35
            } else {
                1.0
            };
            column * (0.55 * ridge + 0.45) * wale
        }
        Structure::Plain | Structure::Twill | Structure::Satin => {
            let is_warp = match structure {
                Structure::Plain => (i + j).rem_euclid(2) == 0,
                Structure::Twill => (i + j).rem_euclid(4) != 0,
                _ => (3 * i + j).rem_euclid(8) != 0,
            };
            let (across, along) = if is_warp { (fx, fy) } else { (fy, fx) };
            let arch = if structure == Structure::Plain {
                0.5
            } else {
                0.2
            };
            round(across) * (1.0 - arch * (1.0 - round(along)))
        }
        Structure::Fleece => {
            let wave = |a: f32, b: f32, c: f32| (TAU * (a * x + b * y + c)).sin();
            0.5 + 0.17 * (wave(1.0, 0.5, 0.1) + wave(-0.5, 1.0, 0.3) + wave(0.25, 0.75, 0.7))
        }
        Structure::Grain => {
            let jitter = |i: i32, k: i32| ((i * 7 + k * 13).rem_euclid(11)) as f32 / 11.0;
            let cells = (-1..=1).flat_map(|a| (-1..=1).map(move |b| [a, b]));
            let away = cells.map(|[a, b]| {
                let [ci, cj] = [
                    (i + a).rem_euclid(PITCHES as i32),
                    (j + b).rem_euclid(PITCHES as i32),
                ];
                let dx = fx - a as f32 - jitter(ci, cj);
                let dy = fy - b as f32 - jitter(cj, ci + 3);
                dx.hypot(dy)
            });
            1.0 - away.fold(1.0, f32::min)
        }
    }
}

/// Smooth periodic noise at wavelengths in texels; shorter waves are weaker by `roughness` an octave. Heights in metres.
fn noise(n: usize, waves: &[usize], roughness: f32, rng: &mut Pcg32) -> Vec<f32> {
    let mut out = vec![0.0; n * n];
    for (k, wave) in waves.iter().enumerate() {
        let gain = *wave as f32 * roughness.powi((waves.len() - 1 - k) as i32);
        for (sum, h) in out.iter_mut().zip(octave(n, *wave, rng)) {
            *sum += gain * h;
        }
    }
    out
}

/// Smooth periodic noise of one wavelength, within ±1.
fn octave(n: usize, wave: usize, rng: &mut Pcg32) -> Vec<f32> {
    let cells = n / wave;
    let lattice: Vec<f32> = (0..cells * cells)
        .map(|_| rng.random_range(-1.0..1.0))
        .collect();
    let height = |i: usize| {
        let [x, y] = [i % n, i / n].map(|c| c as f32 / wave as f32);
        let smooth = |t: f32| t * t * t * (t * (6.0 * t - 15.0) + 10.0);
        let (tx, ty) = (smooth(x.fract()), smooth(y.fract()));
        let at = |dx: usize, dy: usize| {
            lattice[(y as usize + dy) % cells * cells + (x as usize + dx) % cells]
        };
        let top = at(0, 0) + (at(1, 0) - at(0, 0)) * tx;
        let bottom = at(0, 1) + (at(1, 1) - at(0, 1)) * tx;
        top + (bottom - top) * ty
    };
    (0..n * n).map(height).collect()
}

/// Scales heights over the tile of the surface (metres) to a root mean square slope of one axis.
fn scale_to_slope(heights: &mut [f32], n: usize, slope: f32) {
    let step = SURFACE / n as f32;
    let squares = (0..n * n).map(|i| {
        let (x, y) = (i % n, i / n);
        let across = heights[y * n + (x + 1) % n] - heights[i];
        let along = heights[(y + 1) % n * n + x] - heights[i];
        0.5 * (across * across + along * along)
    });
    let rms = (squares.sum::<f32>() / (n * n) as f32).sqrt() / step;
    let gain = slope / rms.max(f32::MIN_POSITIVE);
    heights.iter_mut().for_each(|h| *h *= gain);
}

/// Gives numbers a mean of 0 and a root mean square of `rms`.
fn normalise(values: &mut [f32], rms: f32) {
    let n = values.len().max(1) as f32;
    let mean = values.iter().sum::<f32>() / n;
    let spread = (values.iter().map(|v| (v - mean).powi(2)).sum::<f32>() / n).sqrt();
    let gain = rms / spread.max(f32::MIN_POSITIVE);
    values.iter_mut().for_each(|v| *v = gain * (*v - mean));
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Structure; 7] = [
        Structure::Jersey,
        Structure::Rib,
        Structure::Plain,
        Structure::Twill,
        Structure::Satin,
        Structure::Fleece,
        Structure::Grain,
    ];

    fn look(structure: Structure) -> FabricLook {
        FabricLook {
            structure,
            ..FabricLook::default()
        }
    }

    #[test]
    fn every_structure_has_relief_that_ends_as_roughness() {
        for structure in ALL {
            let tile = ClothTile::yarns(&look(structure));
            let fine =
                tile.levels[0].iter().map(|t| t[3]).sum::<f32>() / tile.levels[0].len() as f32;
            let far = tile.sample([0.013, 0.4], 1.0);
            assert!(fine > 1e-3, "{structure:?}: {fine}");
            assert!((far[3] - fine).abs() < 1e-3 * fine, "{structure:?}");
            assert!(far[0].abs() < 1e-3 && far[1].abs() < 1e-3 && far[2].abs() < 1e-3);
        }
    }

    #[test]
    fn tiles_repeat_and_levels_are_means() {
        let look = FabricLook::default();
        for tile in [ClothTile::yarns(&look), ClothTile::surface(&look)] {
            let uv = [0.3 * tile.side, 0.7 * tile.side];
            let beside = [uv[0] - tile.side, uv[1] + 2.0 * tile.side];
            for footprint in [1e-5, 1e-3, 1e-2] {
                let [a, b] = [uv, beside].map(|uv| tile.sample(uv, footprint));
                assert!((0..4).all(|c| (a[c] - b[c]).abs() < 1e-3), "{a:?} {b:?}");
            }
        }
    }

    #[test]
    fn wrinkles_run_along_v_and_have_unit_slopes() {
        let tile = ClothTile::wrinkles(0.02);
        let n = tile.levels[0].len() as f32;
        let [across, along] = [0, 1].map(|c| {
            let squares = tile.levels[0].iter().map(|t| t[c] * t[c]).sum::<f32>();
            (squares / n).sqrt()
        });
        assert!(
            (across - 1.0).abs() < 1e-3 && along < 0.4,
            "{across} {along}"
        );
    }

    #[test]
    fn the_surface_is_as_uneven_and_mottled_as_its_look_says() {
        let look = FabricLook::default();
        let tile = ClothTile::surface(&look);
        let n = tile.levels[0].len() as f32;
        let slope = (tile.levels[0].iter().map(|t| t[3]).sum::<f32>() / n).sqrt();
        let expected = look.unevenness;
        let tone = (tile.levels[0].iter().map(|t| t[2] * t[2]).sum::<f32>() / n).sqrt();
        // Central differences miss some of the shortest waves.
        assert!(
            slope > 0.75 * expected && slope < expected,
            "{slope} {expected}"
        );
        assert!((tone - look.mottle).abs() < 1e-3);
    }
}

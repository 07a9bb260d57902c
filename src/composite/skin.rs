//! The colour of this shopper's skin against what else they wear, learnt from the pictures themselves.
//!
//! Two classes: forearms, as one normal distribution of brightness and chroma, and trunk and thighs, as a mixture of
//! [`KINDS`] of them (shirt, trousers, their shadows). Whether the forearms are skin at all is asked of the face and
//! the hands; whether colour tells skin from shirt, of the shirt.

use serde::{Deserialize, Serialize};

/// What is remembered between pictures: one colour a place of the body, so that a model is made of the last few
/// pictures, and a word once given is not taken back for a small change.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Colours by [`Source`] and slot; `None` = never seen.
    colors: [Vec<Option<[f32; 3]>>; 4],
    /// Pictures so far in which colours were taken.
    pictures: u32,
    /// Colour decided in the last picture.
    usable: bool,
}

/// Whose colour it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Source {
    Forearm,
    Hand,
    Face,
    Trunk,
}

/// Places of which colours are remembered.
pub(super) const SLOTS: [usize; 4] = [160, 64, 64, 320];
/// After the first picture, one place in so many is looked at in a picture.
const TURNS: usize = 4;

impl State {
    /// Forgets when nobody is tracked: the next one may be somebody else.
    pub(crate) fn keep_if(&mut self, tracked: bool) {
        if !tracked && self.pictures > 0 {
            *self = Self::default();
        }
    }

    /// Which of `vertices` to look at in this picture: slot and vertex.
    pub(super) fn due<'a>(
        &'a self,
        source: Source,
        vertices: &'a [u32],
    ) -> impl Iterator<Item = (usize, u32)> + use<'a> {
        let slots = SLOTS[source as usize].min(vertices.len());
        let (first, turn) = (self.pictures == 0, self.pictures as usize % TURNS);
        (0..slots)
            .filter(move |s| first || s % TURNS == turn)
            .map(move |s| (s, vertices[s * vertices.len() / slots]))
    }

    /// Remembers the sRGB colour of a place.
    pub(super) fn put(&mut self, source: Source, slot: usize, rgb: [u8; 3]) {
        let colors = &mut self.colors[source as usize];
        if colors.len() <= slot {
            colors.resize(slot + 1, None);
        }
        colors[slot] = Some(tone(rgb));
    }

    /// The model of what was seen, if it can tell skin from clothes. One call a picture, after its colours are in.
    pub(super) fn learn(&mut self) -> Option<Skin> {
        self.pictures = self.pictures.saturating_add(1);
        let seen = |s: Source| {
            self.colors[s as usize]
                .iter()
                .flatten()
                .copied()
                .collect::<Vec<_>>()
        };
        let (arms, trunk) = (seen(Source::Forearm), seen(Source::Trunk));
        let skin = Skin::fit(&arms, &trunk);
        let usable = skin.as_ref().is_some_and(|skin| {
            let share = |s: Source| {
                let colors = seen(s);
                let like = colors.iter().filter(|c| skin.likes(c)).count();
                if colors.len() < FEW {
                    0.0
                } else {
                    like as f32 / colors.len() as f32
                }
            };
            let (agree, mixed) = if self.usable {
                (AGREE[1], MIXED[1])
            } else {
                (AGREE[0], MIXED[0])
            };
            share(Source::Forearm) >= agree
                && share(Source::Face).max(share(Source::Hand)) >= agree
                && share(Source::Trunk) <= mixed
        });
        self.usable = usable;
        skin.filter(|_| usable)
    }
}

/// Fewer colours than this say nothing.
const FEW: usize = 12;
/// Share of the face or the hands that must look like the forearms: to begin, to go on.
const AGREE: [f32; 2] = [0.5, 0.4];
/// Share of the trunk that may look like them (a neckline, a hand where it was not expected): to begin, to go on.
const MIXED: [f32; 2] = [0.08, 0.14];

/// Brightness and the two chroma differences of an sRGB colour (ITU-R BT.601), each 0 to 255 wide.
#[inline]
pub(super) fn tone(rgb: [u8; 3]) -> [f32; 3] {
    let [r, g, b] = rgb.map(f32::from);
    let y = 0.299 * r + 0.587 * g + 0.114 * b;
    [y, 0.564 * (b - y), 0.713 * (r - y)]
}

/// Normal distribution of a colour, up to a constant.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Normal {
    mean: [f32; 3],
    /// Inverse of the lower triangular factor of the covariance: 00, 10, 11, 20, 21, 22.
    factor: [f32; 6],
    /// Logarithm of weight over root of determinant.
    log: f32,
}

/// Least standard deviations of a kind, grey levels: a sensor's noise and a fold's shading.
const FLOOR: [f32; 3] = [8.0, 2.5, 2.5];
/// Clothes of a colour nobody has seen yet are this likely everywhere, logarithm.
const UNSEEN: f32 = -18.0;
/// Kinds of clothes. Two miss the shadows of a bright shirt.
const KINDS: usize = 4;
/// Brightness counts this much when kinds are told apart: one cloth in light and shade is one or two kinds.
const BRIGHTNESS: f32 = 0.3;
/// Rounds of telling kinds apart.
const ROUNDS: usize = 6;

impl Normal {
    fn of(colors: &[[f32; 3]], weight: f32) -> Self {
        let n = colors.len().max(1) as f32;
        let mean = colors
            .iter()
            .fold([0.0; 3], |s, c| [s[0] + c[0], s[1] + c[1], s[2] + c[2]])
            .map(|s| s / n);
        let mut s = [0.0f32; 6];
        for c in colors {
            let d = [c[0] - mean[0], c[1] - mean[1], c[2] - mean[2]];
            let mut k = 0;
            for i in 0..3 {
                for j in 0..=i {
                    s[k] += d[i] * d[j] / n;
                    k += 1;
                }
            }
        }
        (s[0], s[2], s[5]) = (
            s[0] + FLOOR[0].powi(2),
            s[2] + FLOOR[1].powi(2),
            s[5] + FLOOR[2].powi(2),
        );
        // Cholesky; the floors keep the pivots positive.
        let l00 = s[0].sqrt();
        let (l10, l20) = (s[1] / l00, s[3] / l00);
        let l11 = (s[2] - l10 * l10).max(1.0).sqrt();
        let l21 = (s[4] - l20 * l10) / l11;
        let l22 = (s[5] - l20 * l20 - l21 * l21).max(1.0).sqrt();
        let (i0, i1, i2) = (1.0 / l00, 1.0 / l11, 1.0 / l22);
        let i10 = -l10 * i0 * i1;
        let factor = [
            i0,
            i10,
            i1,
            -(l20 * i0 + l21 * i10) * i2,
            -l21 * i1 * i2,
            i2,
        ];
        Self {
            mean,
            factor,
            log: (weight * i0 * i1 * i2).ln(),
        }
    }

    /// Logarithm of the density.
    #[inline]
    fn log(&self, c: &[f32; 3]) -> f32 {
        let d = [
            c[0] - self.mean[0],
            c[1] - self.mean[1],
            c[2] - self.mean[2],
        ];
        let f = &self.factor;
        let a = f[0] * d[0];
        let b = f[1] * d[0] + f[2] * d[1];
        let c = f[3] * d[0] + f[4] * d[1] + f[5] * d[2];
        self.log - 0.5 * (a * a + b * b + c * c)
    }
}

/// Tells skin from clothes.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Skin {
    skin: Normal,
    clothes: Vec<Normal>,
}

impl Skin {
    /// From tones of skin and of everything else; `None` when there are too few.
    fn fit(skin: &[[f32; 3]], clothes: &[[f32; 3]]) -> Option<Self> {
        if skin.len() < FEW || clothes.len() < FEW {
            return None;
        }
        // What lay beside a limb that is tracked a little off: farther from the median than most.
        let median = |k: usize| {
            let mut x: Vec<f32> = skin.iter().map(|c| c[k]).collect();
            let middle = x.len() / 2;
            *x.select_nth_unstable_by(middle, f32::total_cmp).1
        };
        let middle = [median(1), median(2)];
        let off = |c: &[f32; 3]| (c[1] - middle[0]).abs() + (c[2] - middle[1]).abs();
        let mut kept = skin.to_vec();
        kept.sort_by(|a, b| off(a).total_cmp(&off(b)));
        kept.truncate(skin.len() * 9 / 10);
        Some(Self {
            skin: Normal::of(&kept, 1.0),
            clothes: kinds(clothes),
        })
    }

    /// This tone is rather skin than anything else.
    #[inline]
    pub(super) fn likes(&self, c: &[f32; 3]) -> bool {
        let skin = self.skin.log(c);
        skin > UNSEEN && self.clothes.iter().all(|k| k.log(c) < skin)
    }
}

/// The kinds of clothes among these tones: farthest first, then nearest middle.
fn kinds(colors: &[[f32; 3]]) -> Vec<Normal> {
    let far = |a: &[f32; 3], b: &[f32; 3]| {
        (BRIGHTNESS * (a[0] - b[0])).powi(2) + (a[1] - b[1]).powi(2) + (a[2] - b[2]).powi(2)
    };
    let mut middles = vec![colors[0]];
    let mut nearest: Vec<f32> = colors.iter().map(|c| far(c, &middles[0])).collect();
    while middles.len() < KINDS {
        let Some(k) = (0..colors.len()).max_by(|&a, &b| nearest[a].total_cmp(&nearest[b])) else {
            break;
        };
        middles.push(colors[k]);
        nearest
            .iter_mut()
            .zip(colors)
            .for_each(|(n, c)| *n = n.min(far(c, &colors[k])));
    }
    let mut members = vec![Vec::new(); middles.len()];
    for _ in 0..ROUNDS {
        members.iter_mut().for_each(Vec::clear);
        for c in colors {
            let best = (0..middles.len())
                .min_by(|&a, &b| far(c, &middles[a]).total_cmp(&far(c, &middles[b])));
            members[best.unwrap_or(0)].push(*c);
        }
        for (m, of) in middles
            .iter_mut()
            .zip(&members)
            .filter(|(_, of)| !of.is_empty())
        {
            *m = Normal::of(of, 1.0).mean;
        }
    }
    let share = |of: &Vec<[f32; 3]>| of.len() as f32 / colors.len() as f32;
    members
        .iter()
        .filter(|of| of.len() >= SPECK)
        .map(|of| Normal::of(of, share(of)))
        .collect()
}

/// A kind with fewer tones is a speck or a finger that lay where it was not expected.
const SPECK: usize = 8;

//! Clothes of the person that new garments take the place of, and their colours.

use super::field::{BodyField, segment};
use crate::captured_pixels::CapturedPixels;
use crate::input::BodyView;
use crate::settings::OwnClothesSettings;
use crate::skin::{SkinClassifier, tone};
use crate::srgb::linear;
use tryon_body::parts::BodySegment;

/// Part of the person that a piece of clothing covers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Half {
    /// Trunk and arms.
    Upper,
    /// Hips and legs.
    Lower,
}

impl Half {
    /// Half that a segment belongs to; `None` for head, hands and feet.
    pub(super) fn of(segment: BodySegment) -> Option<Self> {
        use BodySegment::*;
        match segment {
            Abdomen | Chest | Collar | UpperArm | Forearm => Some(Self::Upper),
            Pelvis | Thigh | Shin => Some(Self::Lower),
            Neck | Head | Hand | Fingers | Foot | Toes => None,
        }
    }

    /// Segment whose colours are those of the clothes there: no arm swings before it.
    fn is_told_by(self, segment: BodySegment) -> bool {
        match self {
            Self::Upper => matches!(segment, BodySegment::Abdomen | BodySegment::Chest),
            Self::Lower => matches!(segment, BodySegment::Thigh),
        }
    }
}

/// Own clothes of one half, which a garment covers.
struct Replaced {
    half: Half,
    colors: SkinClassifier,
    beside_head: BesideHead,
    /// Median brightness of plain cloth; `None` of patterned cloth, whose brightness is not the light's.
    plain: Option<f32>,
}

/// Median brightness (0 to 255) of tones whose 90th percentile is less than `most` times the 10th; `None` of patterned cloth.
fn median_of_plain(tones: &[[f32; 3]], most: f32) -> Option<f32> {
    let mut brightness: Vec<f32> = tones.iter().map(|t| t[0].max(1.0)).collect();
    brightness.sort_by(f32::total_cmp);
    let at = |share: f32| {
        brightness
            .get((share * brightness.len() as f32) as usize)
            .copied()
    };
    let [low, middle, high] = [at(0.1)?, at(0.5)?, at(0.9)?];
    (high < most * low).then_some(middle)
}

/// Own clothes near the head, where hair falls over them.
enum BesideHead {
    /// The head shows no hair.
    AsElsewhere,
    /// Hair against clothes.
    ByColor(SkinClassifier),
    /// Hair has the colour of the clothes.
    Left,
}

impl BesideHead {
    /// From tones of hair and of clothes; takes hair that falls over the clothes out of theirs.
    fn of(hair: &[[f32; 3]], clothes: &mut Vec<[f32; 3]>, settings: &OwnClothesSettings) -> Self {
        let Some(colors) = SkinClassifier::fit(hair, clothes, &settings.colors) else {
            return Self::AsElsewhere;
        };
        let over = clothes.iter().filter(|t| colors.is_skin(t)).count();
        if (over as f32) < settings.hair_over * clothes.len() as f32 {
            clothes.retain(|t| !colors.is_skin(t));
        }
        let alike = hair.iter().filter(|t| colors.is_clothes(t)).count();
        if alike as f32 <= settings.like_hair * hair.len() as f32 {
            Self::ByColor(colors)
        } else {
            Self::Left
        }
    }
}

/// Captured tones of the body's cells.
#[derive(Default)]
struct SeenTones {
    tones: Vec<[f32; 3]>,
    cells: usize,
    /// Cells under a garment.
    dressed: usize,
}

/// Own clothes that are to disappear.
pub(super) struct OwnWorn {
    replaced: Vec<Replaced>,
}

impl OwnWorn {
    /// Colours of the clothes under garments, from those of the face; `is_dressed` tells whether a garment is drawn at a pixel.
    /// `None` when no half is covered, or the face was not seen, or clothes look like skin.
    pub(super) fn see(
        captured: &CapturedPixels<'_>,
        body: &BodyView<'_>,
        face: &[[u8; 3]],
        field: &BodyField,
        is_dressed: impl Fn([u32; 2]) -> bool,
        settings: &OwnClothesSettings,
    ) -> Option<Self> {
        let face_tones: Vec<[f32; 3]> = face.iter().map(|c| tone(*c)).collect();
        let tones_of = |is_wanted: &dyn Fn(BodySegment) -> bool| {
            let mut out = SeenTones::default();
            for i in 0..field.cells() {
                let near = field.at_cell(i).filter(|n| n.is_on);
                let Some(near) = near.filter(|n| segment(body, n.face).is_some_and(is_wanted))
                else {
                    continue;
                };
                let pixel @ [u, v] = field.pixel(i);
                let metres = captured.metres(u, v);
                out.cells += 1;
                out.dressed += usize::from(is_dressed(pixel));
                if metres > 0.0 && (metres - near.depth).abs() < settings.on_body {
                    out.tones.push(tone(captured.image.at(u, v)));
                }
            }
            out.thin(settings.most_tones)
        };
        let head = tones_of(&|s| s == BodySegment::Head).tones;
        let replaced = [Half::Upper, Half::Lower].into_iter().filter_map(|half| {
            let SeenTones {
                mut tones,
                cells,
                dressed,
            } = tones_of(&|s| half.is_told_by(s));
            let is_covered = cells > 0 && dressed as f32 > settings.covered * cells as f32;
            if !is_covered {
                return None;
            }
            let colors = SkinClassifier::fit(&face_tones, &tones, &settings.colors)?;
            // A bare trunk, or cloth of the colour of skin: nothing can be told apart.
            let alike = tones.iter().filter(|t| colors.is_skin(t)).count();
            if alike as f32 > settings.mixed * tones.len() as f32 {
                return None;
            }
            let hair: Vec<[f32; 3]> = (head.iter())
                .filter(|t| !colors.is_skin(t))
                .copied()
                .collect();
            let beside_head = BesideHead::of(&hair, &mut tones, settings);
            Some(Replaced {
                half,
                colors: SkinClassifier::fit(&face_tones, &tones, &settings.colors)?,
                beside_head,
                plain: median_of_plain(&tones, settings.plain),
            })
        });
        let replaced: Vec<Replaced> = replaced.collect();
        (!replaced.is_empty()).then_some(Self { replaced })
    }

    /// A colour is skin's.
    pub(super) fn is_skin(&self, rgb: [u8; 3]) -> bool {
        self.replaced.iter().all(|r| r.colors.is_skin(&tone(rgb)))
    }

    /// Light on plain cloth of a colour over the mean light on it, on that segment; `None` where it is patterned.
    pub(super) fn shade(&self, segment: BodySegment, color: [f32; 3]) -> Option<f32> {
        /// Least and greatest: stains and buttons are no light.
        const RANGE: [f32; 2] = [0.45, 1.35];
        let half = Half::of(segment);
        let own = self.replaced.iter().find(|r| Some(r.half) == half)?;
        let [y, ..] = tone(color.map(|c| c as u8));
        // Half of it, as a logarithm: the rest may be dye.
        let shade = (linear(y as u8) / linear(own.plain? as u8)).sqrt();
        Some(shade.clamp(RANGE[0], RANGE[1]))
    }

    /// A colour beside or on that segment is one of the own clothes that are to disappear.
    pub(super) fn is_own(&self, segment: BodySegment, rgb: [u8; 3], is_near_head: bool) -> bool {
        let half = Half::of(segment);
        let Some(own) = self.replaced.iter().find(|r| Some(r.half) == half) else {
            return false;
        };
        let tone = tone(rgb);
        let is_no_hair = match &own.beside_head {
            _ if !is_near_head => true,
            BesideHead::AsElsewhere => true,
            BesideHead::ByColor(colors) => colors.is_clothes(&tone),
            BesideHead::Left => false,
        };
        is_no_hair && own.colors.is_clothes(&tone)
    }
}

impl SeenTones {
    /// The same with at most so many tones.
    fn thin(self, most: usize) -> Self {
        let step = self.tones.len().div_ceil(most.max(1)).max(1);
        Self {
            tones: self.tones.into_iter().step_by(step).collect(),
            ..self
        }
    }
}

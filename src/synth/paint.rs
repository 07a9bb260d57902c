//! Paint of the synthetic actor: materials of its rest body.

use super::actor::ActorAppearance;
use super::figure::FigurePaint;
use super::figure_head::sculpt;
use super::material::{Exposure, SurfaceMaterial};
use super::rest_pose::rest_joint;
use super::settings::StreetClothes;
use super::street_clothes::put_on_coat;
use tryon_body::parts::BodySegment;
use tryon_body::{RestBody, Template};
use tryon_geometry::math::{P3, P3d, V3};

/// Paint of an actor.
#[derive(Clone, Debug)]
pub(super) enum Paint {
    Everyday(EverydayPaint),
    Figure(FigurePaint),
}

/// A posed body and its colours, in the frame of the camera that draws it.
#[derive(Clone, Copy)]
pub(super) struct PaintedBody<'a> {
    pub(super) template: &'a Template,
    pub(super) rest: &'a RestBody,
    pub(super) paint: &'a Paint,
    /// Posed joints, metres.
    pub(super) joints: &'a [P3d],
    /// Posed vertices, metres; empty when nobody is present.
    pub(super) vertices: &'a [P3],
}

/// Point of a face of the rest body.
#[derive(Clone, Copy, Debug)]
pub(super) struct FacePoint {
    /// Vertices of the face.
    pub(super) corners: [u32; 3],
    /// Their weights.
    pub(super) weights: [f32; 3],
    /// Position in the rest pose, metres.
    pub(super) rest: P3,
}

impl Paint {
    /// Paint of an appearance; the head of a figure replaces that of `rest`.
    pub(super) fn new(
        appearance: &ActorAppearance,
        template: &Template,
        rest: &mut RestBody,
    ) -> Self {
        match appearance {
            ActorAppearance::Everyday(number) => {
                Self::Everyday(EverydayPaint::new(template, rest, Colors::pick(*number)))
            }
            ActorAppearance::Street(clothes) => {
                put_on_coat(template, rest, clothes);
                Self::Everyday(EverydayPaint::dressed(template, rest, clothes))
            }
            ActorAppearance::Figure(settings) => {
                sculpt(template, rest, settings);
                Self::Figure(FigurePaint::new(template, rest, settings))
            }
        }
    }

    /// Material at a point.
    pub(super) fn material(&self, at: &FacePoint) -> SurfaceMaterial {
        match self {
            Self::Everyday(paint) => {
                let w = at.weights;
                let nearest = if w[0] >= w[1] && w[0] >= w[2] {
                    0
                } else {
                    1 + usize::from(w[2] > w[1])
                };
                paint.color(at.corners[nearest], &at.rest).into()
            }
            Self::Figure(paint) => paint.material(at.corners, at.weights),
        }
    }

    /// Share of ambient light at a vertex past folds of the body.
    pub(super) fn openness(&self, vertex: usize) -> f32 {
        match self {
            Self::Everyday(_) => Exposure::FULL.open,
            Self::Figure(paint) => paint.openness[vertex],
        }
    }
}

/// Colours of an actor, sRGB.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Colors {
    skin: [u8; 3],
    hair: [u8; 3],
    shirt: [u8; 3],
    legs: [u8; 3],
    shoes: [u8; 3],
}

/// Palettes of skin, hair, shirts and leggings, sRGB.
const SKIN: [[u8; 3]; 4] = [
    [226, 180, 152],
    [198, 146, 112],
    [146, 98, 70],
    [104, 68, 48],
];
const HAIR: [[u8; 3]; 4] = [[58, 40, 30], [28, 24, 22], [120, 84, 48], [90, 60, 42]];
const SHIRT: [[u8; 3]; 3] = [[150, 154, 160], [126, 140, 150], [168, 160, 150]];
const LEGS: [[u8; 3]; 3] = [[46, 48, 56], [54, 58, 78], [62, 54, 50]];

impl Colors {
    /// Colours of a seed.
    fn pick(seed: u64) -> Self {
        let at =
            |n: u64, len: usize| (seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> n) as usize % len;
        Self {
            skin: SKIN[at(60, SKIN.len())],
            hair: HAIR[at(50, HAIR.len())],
            shirt: SHIRT[at(40, SHIRT.len())],
            legs: LEGS[at(30, LEGS.len())],
            shoes: [206, 204, 198],
        }
    }
}

/// Regions of one colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PaintedRegion {
    Head,
    Trunk,
    UpperArm,
    LowerArm,
    Leg,
    Foot,
}

/// A painted template: region of each vertex and the landmarks that borders are measured from.
#[derive(Clone, Debug)]
pub(super) struct EverydayPaint {
    colors: Colors,
    regions: Vec<PaintedRegion>,
    neck: V3,
    head: V3,
    /// Head size against the embedded body's.
    size: f32,
    /// Foremost point of the face.
    nose: V3,
    ankle_y: f32,
    shoulder: V3,
    elbow: V3,
    wrist: V3,
    /// Ends of the sleeves along upper arm and forearm, shares of each.
    sleeves: [f32; 2],
    /// Height of the lower end of the top on the trunk, and of a coat on the legs (m).
    top_end: f32,
    coat_end: f32,
}

/// End of short sleeves along the upper arm, and of long ones along the forearm.
const SHORT_SLEEVE: f32 = 0.55;
const LONG_SLEEVE: f32 = 0.94;
/// Height of the top's hem above the hip joints (m).
const TOP_HEM: f32 = 0.025;

/// Half width of the skull at the ears, metres: skin farther out is ear.
const EAR: f32 = 0.074;
/// Length of the embedded body's head from the base of the skull to the crown, metres: unit of the face below.
const HEAD_LENGTH: f32 = 0.162;

impl EverydayPaint {
    fn new(template: &Template, rest: &RestBody, colors: Colors) -> Self {
        let weights = template.weights();
        let joint = |name: &str| rest_joint(template, rest, name);
        let parts = template.parts();
        let region = |i: usize| {
            use BodySegment::*;
            match parts.segment(weights.dominant(i)) {
                Neck | Head => PaintedRegion::Head,
                UpperArm => PaintedRegion::UpperArm,
                Forearm | Hand | Fingers => PaintedRegion::LowerArm,
                Thigh | Shin => PaintedRegion::Leg,
                Foot | Toes => PaintedRegion::Foot,
                Pelvis | Abdomen | Chest | Collar => PaintedRegion::Trunk,
            }
        };
        let regions: Vec<PaintedRegion> = (0..rest.vertices.len()).map(region).collect();
        let head = joint("head");
        let of_head = || {
            rest.vertices
                .iter()
                .zip(&regions)
                .filter(|(_, r)| **r == PaintedRegion::Head)
                .map(|(v, _)| v.coords)
        };
        let top = of_head().map(|v| v.y).fold(head.y, f32::max);
        let front = |a: V3, b: V3| if b.z > a.z { b } else { a };
        Self {
            colors,
            neck: joint("neck"),
            size: ((top - head.y) / HEAD_LENGTH).max(f32::EPSILON),
            nose: of_head().filter(|v| v.y > head.y - 0.02).fold(head, front),
            head,
            ankle_y: joint("left_ankle").y,
            shoulder: joint("left_shoulder"),
            elbow: joint("left_elbow"),
            wrist: joint("left_wrist"),
            sleeves: [SHORT_SLEEVE, f32::NEG_INFINITY],
            top_end: joint("left_hip").y + TOP_HEM,
            coat_end: f32::INFINITY,
            regions,
        }
    }

    /// Paint of other clothes; `rest` wears the coat.
    fn dressed(template: &Template, rest: &RestBody, clothes: &StreetClothes) -> Self {
        let colors = Colors {
            shirt: clothes.top,
            legs: clothes.trousers,
            ..Colors::pick(clothes.person)
        };
        let mut out = Self::new(template, rest, colors);
        if clothes.has_long_sleeves {
            out.sleeves = [f32::INFINITY, LONG_SLEEVE];
        }
        if clothes.coat[1] > 0.0 {
            out.coat_end = rest_joint(template, rest, "left_knee").y;
            out.top_end = out.coat_end;
        }
        out
    }

    /// Place along a bone of the left arm, mirrored for the right: 0 at its start, 1 at its end.
    fn along(&self, p: &P3, [from, to]: [V3; 2]) -> f32 {
        let d = to - from;
        (V3::new(p.x.abs(), p.y, p.z) - from).dot(&d) / d.norm_squared()
    }

    /// Colour at rest position `p`; `vertex` is one nearby.
    fn color(&self, vertex: u32, p: &P3) -> [u8; 3] {
        let c = &self.colors;
        match self.regions[vertex as usize] {
            PaintedRegion::Head => self.head_color(p),
            PaintedRegion::LowerArm => {
                let is_sleeve = self.along(p, [self.elbow, self.wrist]) < self.sleeves[1];
                if is_sleeve { c.shirt } else { c.skin }
            }
            PaintedRegion::Foot => c.shoes,
            PaintedRegion::Leg if p.y < self.ankle_y + 0.05 => c.shoes,
            PaintedRegion::Leg if p.y > self.coat_end => c.shirt,
            PaintedRegion::Leg => c.legs,
            PaintedRegion::UpperArm => {
                let is_sleeve = self.along(p, [self.shoulder, self.elbow]) < self.sleeves[0];
                if is_sleeve { c.shirt } else { c.skin }
            }
            PaintedRegion::Trunk => {
                // A round neckline, deeper in front.
                let (x, z) = (p.x - self.neck.x, p.z - self.neck.z);
                let depth = if z > 0.0 { 0.055 } else { 0.01 };
                let line = self.neck.y - depth + 0.9 * (x * x / 0.12);
                if p.y > line && x.abs() < 0.09 {
                    c.skin
                } else if p.y < self.top_end {
                    c.legs
                } else {
                    c.shirt
                }
            }
        }
    }

    fn head_color(&self, p: &P3) -> [u8; 3] {
        let c = &self.colors;
        // Face coordinates in units of the embedded head: x sideways, y up from the base of the skull, z from the nose.
        let (x, y) = (
            (p.x - self.head.x).abs() / self.size,
            (p.y - self.head.y) / self.size,
        );
        let z = (p.z - self.nose.z) / self.size;
        let hairline = if z > -0.085 {
            0.118 - 0.35 * x
        } else {
            0.118 - 0.35 * x - 1.9 * (-0.085 - z)
        };
        // Ears stand out of the hair.
        if y > hairline.max(-0.035) && x < EAR {
            return c.hair;
        }
        if z < -0.07 {
            return c.skin;
        }
        let spot = |at: [f32; 2], r: [f32; 2]| {
            ((x - at[0]) / r[0]).powi(2) + ((y - at[1]) / r[1]).powi(2) < 1.0
        };
        let eye_y = (self.nose.y - self.head.y) / self.size + 0.030;
        if spot([0.031, eye_y], [0.006, 0.006]) {
            return [46, 34, 30];
        }
        if spot([0.031, eye_y], [0.014, 0.007]) {
            return [232, 228, 222];
        }
        if spot([0.031, eye_y + 0.019], [0.018, 0.004]) {
            return c.hair;
        }
        if spot([0.0, eye_y - 0.068], [0.024, 0.007]) {
            return [
                c.skin[0] - c.skin[0] / 8,
                c.skin[1] / 2 + 12,
                c.skin[2] / 2 + 14,
            ];
        }
        c.skin
    }
}

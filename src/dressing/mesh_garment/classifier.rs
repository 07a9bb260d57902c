//! Classification of a piece of a mesh garment by the skin it lies over.

use super::file_part::{FilePart, PartRole};
use super::wrap::{ClothOverSkin, wrap};
use crate::file_frame::bounds;
use crate::settings::ClassifierSettings;
use tryon_body::parts::vertex_masks;
use tryon_body::{SkinBinding, SkinSearch, Template};
use tryon_formats::sewn_obj::SewnObj;
use tryon_garment::{GarmentKind, Region};
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::{Face, Topology};

/// Words of a fastening's name.
const FASTENINGS: [&str; 5] = ["button", "buckle", "zip", "rivet", "eyelet"];
/// Both legs.
pub(super) const LEGS: Region = Region::LEFT_LEG.with(Region::RIGHT_LEG);

/// The part of a piece that the body holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Support {
    /// Cloth over the shoulders.
    Shoulders,
    /// The uppermost opening.
    Opening,
}

/// Findings about a piece of cloth.
pub(super) struct PieceShape {
    pub(super) kind: GarmentKind,
    pub(super) support: Support,
    /// Body part below each vertex.
    pub(super) parts: Vec<u8>,
    /// Boundary loops wider than a slit.
    pub(super) openings: Vec<Vec<u32>>,
    /// It ends in a leg on either side.
    pub(super) has_legs: bool,
    /// Mean share of the way that it goes around the body.
    pub(super) wrap: f64,
}

/// The body that pieces are classified on.
pub(super) struct PieceClassifier<'a> {
    pub(super) template: &'a Template,
    settings: &'a ClassifierSettings,
    parts: Vec<u8>,
    skin: SkinSearch<'a>,
    /// Per body vertex: it belongs to the head, a hand or a foot.
    is_end: Vec<bool>,
    /// Heights, metres.
    shoulder: f32,
    knee: f32,
}

impl<'a> PieceClassifier<'a> {
    pub(super) fn new(template: &'a Template, settings: &'a ClassifierSettings) -> Self {
        let sk = template.skeleton();
        let segment = |i: usize| template.parts().segment(template.weights().dominant(i));
        let body = template.mesh().vertices();
        let height = |n: &str| sk.index(n).map(|j| sk.joints()[j].rest.y as f32);
        Self {
            parts: vertex_masks(template),
            skin: SkinSearch::new(template, body, 0.0),
            is_end: (0..body.len()).map(|i| segment(i).is_extremity()).collect(),
            shoulder: height("left_shoulder")
                .or_else(|| height("neck"))
                .unwrap_or(settings.default_shoulder),
            knee: height("left_knee").unwrap_or(f32::MIN),
            template,
            settings,
        }
    }
    /// Role of a part by its size and the skin below; a name helps to know larger fastenings. Socks count as shoes.
    pub(super) fn role(&self, piece: &SewnObj) -> PartRole {
        let Some((lo, hi)) = piece.obj.mesh.bounds() else {
            return PartRole::Fastening;
        };
        let is_named = FilePart::new(0, piece).is_named(&FASTENINGS);
        let smallest = match is_named {
            true => self.settings.smallest_named,
            false => self.settings.smallest,
        };
        if (hi - lo).amax() <= smallest {
            return PartRole::Fastening;
        }
        let v = piece.obj.mesh.vertices();
        let nearest = |p| self.skin.nearest(p, &V3::zeros(), self.settings.search);
        let over_ends = v
            .iter()
            .filter(|p| nearest(p).is_some_and(|(i, _)| self.is_end[i]))
            .count();
        match hi.y > self.knee && (over_ends as f64) < self.settings.accessory * v.len() as f64 {
            true => PartRole::Cloth,
            false => PartRole::Accessory,
        }
    }

    /// Classifies a piece of cloth with vertices `x` (m) bound to the body.
    pub(super) fn classify(
        &self,
        topology: &Topology,
        faces: &[Face],
        x: &[P3],
        binding: &SkinBinding,
    ) -> PieceShape {
        let settings = self.settings;
        let below = |i: usize| binding.vertices[i].first().map_or(0, |v| v.0 as usize);
        let parts: Vec<u8> = (0..x.len()).map(|i| self.parts[below(i)]).collect();
        let diameter = |l: &[u32]| {
            let (lo, hi) = bounds(l.iter().map(|v| &x[*v as usize]));
            (hi - lo).norm()
        };
        let openings: Vec<Vec<u32>> = topology
            .boundary_components()
            .into_iter()
            .filter(|l| diameter(l) > settings.opening)
            .collect();
        let over = |leg: Region, l: &[u32]| {
            let over = l.iter().filter(|v| parts[**v as usize] & leg.0 != 0);
            over.count() * 10 > l.len() * settings.hem_tenths
        };
        let has_hem = |leg: Region| openings.iter().any(|l| over(leg, l));
        let has_legs = has_hem(Region::LEFT_LEG) && has_hem(Region::RIGHT_LEG);
        let top = x.iter().map(|p| p.y).fold(f32::MIN, f32::max);
        let support = if top > self.shoulder - settings.near_shoulder {
            Support::Shoulders
        } else {
            Support::Opening
        };
        let over_legs =
            parts.iter().filter(|p| **p & LEGS.0 != 0).count() as f64 / parts.len().max(1) as f64;
        let kind = match support {
            Support::Shoulders if over_legs > settings.over_legs[0] => GarmentKind::Dress,
            Support::Opening if has_legs => GarmentKind::Trousers,
            Support::Opening if over_legs > settings.over_legs[1] => GarmentKind::Skirt,
            _ => GarmentKind::Top,
        };
        let height: Vec<f32> = (0..x.len())
            .map(|i| self.skin.height(&x[i], below(i)))
            .collect();
        let over_skin = ClothOverSkin {
            faces,
            x,
            over: &parts,
            height: &height,
        };
        PieceShape {
            wrap: wrap(self.template, &self.parts, &over_skin),
            kind,
            support,
            parts,
            openings,
            has_legs,
        }
    }
}

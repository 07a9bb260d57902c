//! Garment prior over body parts (ε of eq. 12, figure 4): regions in which a garment is likely, possible or impossible.

use serde::{Deserialize, Serialize};
use tryon_body::Template;
use tryon_body::parts::BodySegment;

/// Cost of an impossible label, nats: no colour outweighs it.
pub const IMPOSSIBLE: f32 = 60.0;

/// Place of a label on the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Slot {
    /// Skin and held things.
    Skin,
    /// Hair, down to the back.
    Hair,
    /// Garment of the torso.
    Top,
    /// Second garment of the torso: under the first one, or its sleeves.
    Under,
    /// Garment of the legs.
    Bottom,
    /// Garment of the feet.
    Shoes,
    /// Garment of torso and legs.
    OnePiece,
}

/// Region of the body that priors speak of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BodyRegion {
    /// Head with hair.
    Head,
    /// Neck.
    Neck,
    /// Chest and collars.
    Chest,
    /// Between chest and pelvis.
    Abdomen,
    /// Hips.
    Pelvis,
    /// Shoulder to elbow.
    UpperArm,
    /// Elbow to wrist.
    Forearm,
    /// Hand.
    Hand,
    /// Hip to knee.
    Thigh,
    /// Knee to ankle.
    Shin,
    /// Foot.
    Foot,
}

impl std::fmt::Display for BodyRegion {
    /// Its name in files.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.serialize(f)
    }
}

impl BodyRegion {
    /// All of them, downwards.
    pub const ALL: [Self; 11] = [
        Self::Head,
        Self::Neck,
        Self::Chest,
        Self::UpperArm,
        Self::Forearm,
        Self::Hand,
        Self::Abdomen,
        Self::Pelvis,
        Self::Thigh,
        Self::Shin,
        Self::Foot,
    ];

    fn of(segment: BodySegment) -> Self {
        match segment {
            BodySegment::Head => Self::Head,
            BodySegment::Neck => Self::Neck,
            BodySegment::Chest | BodySegment::Collar => Self::Chest,
            BodySegment::Abdomen => Self::Abdomen,
            BodySegment::Pelvis => Self::Pelvis,
            BodySegment::UpperArm => Self::UpperArm,
            BodySegment::Forearm => Self::Forearm,
            BodySegment::Hand | BodySegment::Fingers => Self::Hand,
            BodySegment::Thigh => Self::Thigh,
            BodySegment::Shin => Self::Shin,
            BodySegment::Foot | BodySegment::Toes => Self::Foot,
        }
    }

    /// Region of each vertex of a template, shape `[vertices]`.
    pub fn of_vertices(template: &Template) -> Vec<Self> {
        (0..template.mesh().vertices().len())
            .map(|v| Self::of(template.parts().segment(template.weights().dominant(v))))
            .collect()
    }

    /// Belongs to the torso.
    pub fn is_torso(self) -> bool {
        matches!(self, Self::Chest | Self::Abdomen)
    }
    /// Belongs to an arm above the hand.
    pub fn is_arm(self) -> bool {
        matches!(self, Self::UpperArm | Self::Forearm)
    }
}

impl Slot {
    /// Name in files and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Skin => "skin",
            Self::Hair => "hair",
            Self::Top => "top",
            Self::Under => "under",
            Self::Bottom => "bottom",
            Self::Shoes => "shoes",
            Self::OnePiece => "one_piece",
        }
    }

    /// Is worn: neither skin nor hair.
    pub fn is_garment(self) -> bool {
        !matches!(self, Self::Skin | Self::Hair)
    }

    /// Cost of the label in a region, nats.
    pub fn cost(self, region: BodyRegion) -> f32 {
        use BodyRegion::*;
        match (self, region) {
            (Self::Skin, Head | Hand | Neck) => 0.0,
            (Self::Skin, Forearm) => 0.3,
            (Self::Skin, UpperArm | Shin | Foot) => 0.6,
            (Self::Skin, Thigh) => 1.0,
            (Self::Skin, Chest | Abdomen | Pelvis) => 1.5,

            (Self::Hair, Head) => 0.0,
            (Self::Hair, Neck) => 0.3,
            (Self::Hair, Chest) => 1.5,
            (Self::Hair, UpperArm | Abdomen) => 4.0,
            (Self::Hair, _) => IMPOSSIBLE,

            (Self::Top | Self::Under, Chest | Abdomen | Pelvis) => 0.0,
            (Self::Top | Self::Under, UpperArm) => 0.2,
            (Self::Top | Self::Under, Forearm) => 0.4,
            (Self::Top | Self::Under, Neck) => 0.8,
            (Self::Top | Self::Under, Thigh) => 3.0,
            (Self::Top | Self::Under, Shin) => 8.0,
            (Self::Top | Self::Under, Head | Hand) => 6.0,
            (Self::Top | Self::Under, Foot) => IMPOSSIBLE,

            (Self::Bottom, Pelvis | Thigh) => 0.0,
            (Self::Bottom, Shin) => 0.3,
            (Self::Bottom, Abdomen) => 1.0,
            (Self::Bottom, Foot) => 2.0,
            (Self::Bottom, Chest) => 8.0,
            (Self::Bottom, _) => IMPOSSIBLE,

            (Self::Shoes, Foot) => 0.0,
            (Self::Shoes, Shin) => 2.0,
            (Self::Shoes, _) => IMPOSSIBLE,

            (Self::OnePiece, Chest | Abdomen | Pelvis | Thigh) => 0.0,
            (Self::OnePiece, UpperArm | Forearm | Shin) => 0.4,
            (Self::OnePiece, Neck) => 0.8,
            (Self::OnePiece, Head | Hand) => 6.0,
            (Self::OnePiece, Foot) => IMPOSSIBLE,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_body::embedded;

    #[test]
    fn every_region_has_a_likely_label_and_is_found_on_the_body() {
        let found = BodyRegion::of_vertices(&embedded::template());
        let slots = [Slot::Skin, Slot::Top, Slot::Bottom, Slot::Shoes];
        for region in BodyRegion::ALL {
            assert!(found.contains(&region), "{region:?}");
            let least = slots
                .map(|s| s.cost(region))
                .into_iter()
                .fold(f32::MAX, f32::min);
            assert!(least <= 0.5, "{region:?}: {least}");
        }
        assert_eq!(Slot::Shoes.cost(BodyRegion::Head), IMPOSSIBLE);
    }
}

//! Look of a fabric: its yarns, its surface, and how it is sewn.

use serde::{Deserialize, Serialize};

/// Interlacing of the yarns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Structure {
    /// Columns of loops, the right side of single jersey.
    #[default]
    Jersey,
    /// Columns of right and wrong loops in turns.
    Rib,
    /// One over, one under.
    Plain,
    /// Three over, one under, shifted by one each row: a diagonal.
    Twill,
    /// Long floats along the warp.
    Satin,
    /// Fibres raised over everything.
    Fleece,
    /// Grain of a hide.
    Grain,
}

/// How a free edge is finished.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "kind", deny_unknown_fields)]
pub enum Finish {
    /// Cut and left.
    Raw,
    /// Turned up by `width` metres, held by `rows` of stitches.
    Hem {
        /// Metres.
        width: f32,
        /// 1 or 2.
        rows: u8,
    },
    /// A ribbed band sewn on, `width` metres.
    Rib {
        /// Metres.
        width: f32,
    },
    /// A smooth band sewn on, `width` metres, stitched along both sides.
    Band {
        /// Metres.
        width: f32,
    },
}

/// Look of a fabric.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FabricLook {
    /// Interlacing.
    pub structure: Structure,
    /// Distance of two wales or warp yarns, metres.
    pub pitch: f32,
    /// Height of the relief over the pitch.
    pub relief: f32,
    /// Root mean square slope of the uneven surface, at wavelengths of 3 and 6 mm.
    pub unevenness: f32,
    /// Root mean square of the tone's variation by uneven yarns and dye, as a share.
    pub mottle: f32,
    /// Roughness of the highlight (GGX α), 0 to 1.
    pub roughness: f32,
    /// Reflectance of the fibres' surface at normal incidence.
    pub specular: f32,
    /// Strength of the sheen by fibres that stand off, 0 to 1.
    pub fuzz: f32,
    /// Relief of seams and edges, metres: what a few layers of this cloth raise.
    pub bulk: f32,
    /// Hems and cuffs.
    pub lower: Finish,
    /// Necklines and waists.
    pub upper: Finish,
}

//! Measures of a finished garment in one size, the input of size advice.

use super::settings::WornSizeSettings;
use tryon_body::measure::Measurements;
use tryon_garment::{GarmentKind, Material, Pattern, Placement, Size};

/// Height of the high point of the shoulder over stature: cervicale height 1.521 m at 1.756 m (ANSUR II, men; women's
/// 0.864), a finger below.
const SHOULDER_POINT: f64 = 0.862;
/// Height of the natural waist over stature (ANSUR II: waist height, natural indentation, 1.08 m at 1.756 m).
const WAIST_HEIGHT: f64 = 0.62;
/// Crotch of trousers below the body's, metres.
pub(super) const CROTCH_CLEARANCE: f64 = 0.012;
/// Height of the crotch point of trousers without an inseam, panel coordinates, metres.
pub(super) const DEFAULT_RISE: f64 = -0.29;

/// Place of the body from which a garment hangs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HangsFrom {
    /// High point of the shoulder.
    Shoulder,
    /// Natural waist.
    Waist,
    /// Crotch.
    Crotch,
}

impl HangsFrom {
    /// Height on a body, metres above the floor.
    pub fn height(self, body: &Measurements) -> f64 {
        match self {
            Self::Shoulder => SHOULDER_POINT * body.stature,
            Self::Waist => WAIST_HEIGHT * body.stature,
            Self::Crotch => body.inseam,
        }
    }
}

/// Lowest hem of a garment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hem {
    /// Place that it hangs from.
    pub from: HangsFrom,
    /// Length from there, metres.
    pub below: f64,
}

impl Hem {
    /// Height on a body, metres above the floor.
    pub fn height(&self, body: &Measurements) -> f64 {
        (self.from.height(body) - self.below).max(0.0)
    }
}

/// Measures of a finished garment in one size.
#[derive(Clone, Debug, PartialEq)]
pub struct FinishedGarment {
    /// Garment name.
    pub name: String,
    /// Kind of garment.
    pub kind: GarmentKind,
    /// Letter size.
    pub size: Size,
    /// Fabric.
    pub material: Material,
    /// Girths at chest, waist and hip, metres; 0 where it has none.
    pub girths: [f64; 3],
    /// Least ease there by design, and limits of the fit.
    pub settings: WornSizeSettings,
    /// Lowest hem; `None` for cloth that hangs from no place.
    pub hem: Option<Hem>,
}

impl From<&Pattern> for FinishedGarment {
    fn from(pattern: &Pattern) -> Self {
        Self {
            name: pattern.name.clone(),
            kind: pattern.kind,
            size: pattern.size,
            material: pattern.material.clone(),
            girths: pattern.finished,
            settings: WornSizeSettings::default(),
            hem: hem(pattern),
        }
    }
}

/// Lowest hem of a pattern.
fn hem(pattern: &Pattern) -> Option<Hem> {
    let lowest = |wanted: &dyn Fn(Placement) -> bool| {
        let panels = pattern.panels.iter().filter(|p| wanted(p.placement));
        panels
            .flat_map(|p| p.edges.iter().map(|e| e.from[1]))
            .reduce(f64::min)
    };
    let trunk = lowest(&|p| matches!(p, Placement::TrunkFront | Placement::TrunkBack));
    let skirt = lowest(&|p| matches!(p, Placement::SkirtFront | Placement::SkirtBack));
    let leg = lowest(&|p| matches!(p, Placement::LegFront(_) | Placement::LegBack(_)));
    let (from, below) = match (trunk, skirt, leg) {
        (Some(t), Some(s), _) => (HangsFrom::Shoulder, -t - s),
        (Some(t), None, _) => (HangsFrom::Shoulder, -t),
        (None, Some(s), _) => (HangsFrom::Waist, -s),
        (None, None, Some(l)) => (HangsFrom::Crotch, crotch(pattern) + CROTCH_CLEARANCE - l),
        (None, None, None) => return None,
    };
    Some(Hem { from, below })
}

/// Height of the inner corner of the crotch, the highest point of the inseam, in panel coordinates, metres.
fn crotch(pattern: &Pattern) -> f64 {
    let inner = pattern.panels.iter().filter_map(|p| {
        let inseam = p.edge("inseam")?;
        Some(p.edges[inseam].from[1].max(p.end(inseam)[1]))
    });
    inner.reduce(f64::max).unwrap_or(DEFAULT_RISE)
}

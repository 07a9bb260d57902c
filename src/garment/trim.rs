//! Trims: small pieces and stitched lines set on a panel. They have a look and no mechanics.

use super::GarmentError;
use serde::{Deserialize, Serialize};

/// Most trims of a garment.
pub const MAX_TRIMS: usize = 32;
/// Longest side of a trim, metres.
pub const MAX_TRIM_SIDE: f64 = 1.0;

/// Kind of a trim. Its local frame has x along the width and y along the height, up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TrimKind {
    /// Button with four holes; its diameter is the width.
    Button,
    /// Patch pocket with a pointed lower edge, open above.
    PatchPocket,
    /// Pouch across the front with slanted openings at both upper corners.
    Pouch,
    /// Slit along x between two turned edges: welt and side pockets, vents.
    Slit,
    /// Zip along y with its puller above.
    Zip,
    /// Double strip along y that carries buttons.
    Placket,
    /// Stitches of a trouser fly: along the right side, rounded to the lower left corner.
    Fly,
    /// Narrow strip along y, sewn on at both ends.
    Loop,
    /// Cord that hangs along y.
    Cord,
}

impl TrimKind {
    /// All kinds.
    pub const ALL: [Self; 9] = [
        Self::Button,
        Self::PatchPocket,
        Self::Pouch,
        Self::Slit,
        Self::Zip,
        Self::Placket,
        Self::Fly,
        Self::Loop,
        Self::Cord,
    ];
}

/// Trim of a pattern.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Trim {
    /// Panel that it is set on.
    pub panel: String,
    /// Kind.
    pub kind: TrimKind,
    /// Middle, panel coordinates, metres.
    pub at: [f64; 2],
    /// Width and height, metres.
    pub size: [f64; 2],
    /// Turn of its frame, counter-clockwise, radians.
    #[serde(default)]
    pub turn: f64,
}

/// Trim in texture space.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlacedTrim {
    /// Kind.
    pub kind: TrimKind,
    /// Middle, metres.
    pub at: [f32; 2],
    /// Width and height, metres.
    pub size: [f32; 2],
    /// Turn of its frame, counter-clockwise, radians.
    pub turn: f32,
}

impl Trim {
    /// Checks numbers and the panel's name.
    pub(super) fn check(&self, has_panel: impl Fn(&str) -> bool) -> Result<(), GarmentError> {
        let fault = |what: &str, why: &str| GarmentError::Field {
            field: format!("trims: {:?} on {}: {what}", self.kind, self.panel),
            why: why.into(),
        };
        if !has_panel(&self.panel) {
            return Err(fault("panel", "is not in the pattern"));
        }
        let is_side = |s: &f64| *s > 0.0 && *s <= MAX_TRIM_SIDE;
        if !self.size.iter().all(is_side) {
            return Err(fault("size", "needs sides of more than 0 and up to 1 m"));
        }
        if !(self.at.iter().all(|c| c.is_finite()) && self.turn.is_finite()) {
            return Err(fault("place", "must be finite"));
        }
        Ok(())
    }

    /// The trim at its place plus `offset` (metres).
    pub(super) fn placed(&self, offset: [f64; 2]) -> PlacedTrim {
        PlacedTrim {
            kind: self.kind,
            at: [0, 1].map(|k| (self.at[k] + offset[k]) as f32),
            size: self.size.map(|s| s as f32),
            turn: self.turn as f32,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{GarmentMesh, Pattern, Size, Triangulation, library};

    #[test]
    fn library_trims_lie_on_their_panels() {
        let mut count = 0;
        for name in library::names() {
            for size in Size::ALL {
                let pattern = library::pattern(name, size).expect("a pattern");
                let mesh = GarmentMesh::sew(&pattern, &Triangulation::default()).expect("sewn");
                for trim in &mesh.render.trims {
                    let away = |uv: &[f32; 2]| (uv[0] - trim.at[0]).hypot(uv[1] - trim.at[1]);
                    let nearest = mesh
                        .render
                        .uv
                        .iter()
                        .map(away)
                        .fold(f32::INFINITY, f32::min);
                    assert!(nearest < 0.03, "{name} {size}: {trim:?} is {nearest} m off");
                    count += 1;
                }
            }
        }
        assert!(count > 100, "{count}");
    }

    #[test]
    fn faults_name_trim_and_panel_and_json_keeps_trims() {
        let good = library::pattern("hoodie", Size::M).expect("a pattern");
        let back = Pattern::from_json(&good.to_json()).expect("read");
        assert_eq!((back.trims.len(), back.trims[0].kind), (3, TrimKind::Pouch));
        let fault = |change: &dyn Fn(&mut Trim)| {
            let mut bad = good.clone();
            change(&mut bad.trims[0]);
            bad.check().expect_err("a fault").to_string()
        };
        assert!(fault(&|t| t.panel = "moon".into()).contains("moon"));
        assert!(fault(&|t| t.size[1] = f64::NAN).contains("size"));
        assert!(fault(&|t| t.at[0] = f64::INFINITY).contains("place"));
        let mut many = good.clone();
        many.trims = vec![good.trims[0].clone(); MAX_TRIMS + 1];
        assert!(many.check().is_err());
    }
}

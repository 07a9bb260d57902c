//! Trims of garments on the wire.

use super::WireError;
use crate::v1;
use tryon_garment::{MAX_TRIM_SIDE, MAX_TRIMS, PlacedTrim, TrimKind};
use v1::GarmentTrimKind as Wire;

/// Kinds on the wire and in the domain.
const KINDS: [(Wire, TrimKind); 9] = [
    (Wire::Button, TrimKind::Button),
    (Wire::PatchPocket, TrimKind::PatchPocket),
    (Wire::Pouch, TrimKind::Pouch),
    (Wire::Slit, TrimKind::Slit),
    (Wire::Zip, TrimKind::Zip),
    (Wire::Placket, TrimKind::Placket),
    (Wire::Fly, TrimKind::Fly),
    (Wire::Loop, TrimKind::Loop),
    (Wire::Cord, TrimKind::Cord),
];

/// Message of a trim.
pub(super) fn to_wire(trim: &PlacedTrim) -> v1::GarmentTrim {
    let kind = KINDS.iter().find(|(_, kind)| *kind == trim.kind);
    v1::GarmentTrim {
        kind: kind.map_or(Wire::Unspecified, |(wire, _)| *wire).into(),
        at_u: trim.at[0],
        at_v: trim.at[1],
        width: trim.size[0],
        height: trim.size[1],
        turn: trim.turn,
    }
}

/// Trims of a topology. Kinds of a later contract are left out.
///
/// # Errors
/// Names the trim and its field.
pub(super) fn all_from_wire(trims: &[v1::GarmentTrim]) -> Result<Vec<PlacedTrim>, WireError> {
    let field = "garment_topology.trims";
    if trims.len() > MAX_TRIMS {
        let why = format!("{}, at most {MAX_TRIMS}", trims.len());
        return Err(WireError::new(field, why));
    }
    let mut out = Vec::with_capacity(trims.len());
    for (k, trim) in trims.iter().enumerate() {
        let fault = |name: &str, why: &str| WireError::new(format!("{field}[{k}].{name}"), why);
        let is_side = |s: f32| s > 0.0 && f64::from(s) <= MAX_TRIM_SIDE;
        for (name, side) in [("width", trim.width), ("height", trim.height)] {
            if !is_side(side) {
                return Err(fault(name, "must be more than 0 and up to 1 m"));
            }
        }
        let places = [
            ("at_u", trim.at_u),
            ("at_v", trim.at_v),
            ("turn", trim.turn),
        ];
        if let Some((name, _)) = places.into_iter().find(|(_, x)| !x.is_finite()) {
            return Err(fault(name, "must be finite"));
        }
        let kind = KINDS.iter().find(|(wire, _)| *wire == trim.kind());
        out.extend(kind.map(|(_, kind)| PlacedTrim {
            kind: *kind,
            at: [trim.at_u, trim.at_v],
            size: [trim.width, trim.height],
            turn: trim.turn,
        }));
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trim(kind: TrimKind) -> PlacedTrim {
        PlacedTrim {
            kind,
            at: [0.1, 0.2],
            size: [0.03, 0.04],
            turn: 0.5,
        }
    }

    #[test]
    fn every_kind_comes_back() {
        let trims = TrimKind::ALL.map(trim);
        let wire: Vec<_> = trims.iter().map(to_wire).collect();
        assert_eq!(all_from_wire(&wire).expect("trims"), trims);
    }

    #[test]
    fn faults_name_trim_and_field_and_later_kinds_are_left_out() {
        let good = to_wire(&trim(TrimKind::Zip));
        let mut wide = good;
        wide.width = 2.0;
        let mut lost = good;
        lost.at_v = f32::NAN;
        for (bad, name) in [(wide, "trims[1].width"), (lost, "trims[1].at_v")] {
            let fault = all_from_wire(&[good, bad]).expect_err(name);
            assert!(fault.to_string().contains(name), "{fault}");
        }
        let many = vec![good; MAX_TRIMS + 1];
        assert!(all_from_wire(&many).is_err());
        let mut later = good;
        later.kind = 99;
        assert_eq!(all_from_wire(&[later]).expect("none"), vec![]);
    }
}

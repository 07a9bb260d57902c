//! Garments off the person on the wire.

use crate::v1::{GarmentOffPerson, PartOffPerson};
use tryon_body::parts::BodyPart;

/// Wire message of the share of a garment's pixels that are off the person, and of those beside each [`BodyPart`].
pub fn off_person_to_wire(share: f32, parts: [f32; BodyPart::ALL.len()]) -> GarmentOffPerson {
    let parts = BodyPart::ALL.iter().zip(parts);
    let parts = parts.filter(|(_, share)| *share > 0.0);
    GarmentOffPerson {
        share,
        parts: parts
            .map(|(part, share)| PartOffPerson {
                part: part.name().to_owned(),
                share,
            })
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_without_cloth_beside_them_are_left_out() {
        let wire = off_person_to_wire(0.07, [0.01, 0.0, 0.06, 0.0, 0.0]);
        let parts = wire.parts.iter().map(|p| (&p.part[..], p.share));
        assert!(parts.eq([("trunk", 0.01), ("right arm", 0.06)]));
    }
}

//! Garments off the person on the wire.

use crate::v1::{GarmentOffPerson, PartOffPerson};
use tryon::body::parts::BodyPart;
use tryon::view::OffPerson;

/// Wire message of a measurement.
pub fn off_person_to_wire(off: &OffPerson) -> GarmentOffPerson {
    let parts = BodyPart::ALL.iter().zip(off.parts);
    let parts = parts.filter(|(_, share)| *share > 0.0);
    GarmentOffPerson {
        share: off.share,
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
        let wire = off_person_to_wire(&OffPerson {
            share: 0.07,
            parts: [0.01, 0.0, 0.06, 0.0, 0.0],
            garment_pixels: 9000,
        });
        let parts = wire.parts.iter().map(|p| (&p.part[..], p.share));
        assert!(parts.eq([("trunk", 0.01), ("right arm", 0.06)]));
    }
}

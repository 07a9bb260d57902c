//! Garments off the person: the newest measurement of an outfit, its metrics, its place in pictures.

use tryon::view::OffPerson;
use tryon_proto::convert::off_person::off_person_to_wire;
use tryon_proto::v1::{DegradedReason, Picture};

/// Newest measurement, held between measurements for the outfit that it was made of.
#[derive(Default)]
pub(crate) struct NewestOffPerson {
    /// Revision of the outfit.
    revision: u64,
    newest: Option<OffPerson>,
}

impl NewestOffPerson {
    /// Takes the measurement of a picture of an outfit, if one was due; the newest of that outfit.
    pub(crate) fn update(
        &mut self,
        revision: u64,
        measured: Option<OffPerson>,
    ) -> Option<OffPerson> {
        if let Some(off) = &measured {
            record(off);
        }
        let kept = self.newest.filter(|_| self.revision == revision);
        (self.revision, self.newest) = (revision, measured.or(kept));
        self.newest
    }
}

/// Records shares as `tryon_garment_off_person`, measurements with a part that hangs off as `tryon_pictures_off_person`.
fn record(off: &OffPerson) {
    metrics::histogram!("tryon_garment_off_person").record(f64::from(off.share));
    let hangs = u64::from(off.hanging_parts().next().is_some());
    metrics::counter!("tryon_pictures_off_person").increment(hangs);
}

/// Sets the measurement of a live picture, and the reason while a part hangs off.
pub(crate) fn describe(picture: &mut Picture, off: Option<&OffPerson>) {
    picture.off_person = off.map(|off| off_person_to_wire(off.share, off.parts));
    if off.is_some_and(|o| o.hanging_parts().next().is_some()) {
        picture.set_reason(DegradedReason::GarmentOffPerson);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at_the_left_arm(share: f32) -> OffPerson {
        OffPerson {
            share,
            parts: [0.0, share, 0.0, 0.0, 0.0],
            garment_pixels: 9000,
        }
    }

    #[test]
    fn a_measurement_is_held_for_its_outfit_only() {
        let mut newest = NewestOffPerson::default();
        let [first, second] = [0.1, 0.2].map(at_the_left_arm);
        assert_eq!(newest.update(1, None), None);
        assert_eq!(newest.update(1, Some(first)), Some(first));
        assert_eq!(newest.update(1, None), Some(first));
        assert_eq!(newest.update(2, None), None);
        assert_eq!(newest.update(1, None), None);
        assert_eq!(newest.update(2, Some(second)), Some(second));
    }

    #[test]
    fn a_part_that_hangs_off_is_the_reason_of_a_picture() {
        let described = |off: Option<OffPerson>| {
            let mut picture = Picture::default();
            describe(&mut picture, off.as_ref());
            (picture.reason(), picture.off_person)
        };
        let (reason, wire) = described(Some(at_the_left_arm(0.1)));
        assert_eq!(reason, DegradedReason::GarmentOffPerson);
        assert_eq!(wire.expect("measured").parts[0].part, "left arm");
        let (reason, wire) = described(Some(at_the_left_arm(0.01)));
        assert!(reason == DegradedReason::Unspecified && wire.is_some());
        assert_eq!(described(None), (DegradedReason::Unspecified, None));
    }
}

//! Sizes that were chosen for a person: they stay while that person wears the outfit, whatever is restarted.

use crate::library::Library;
use tryon_proto::convert::WireError;
use tryon_proto::v1::{GarmentChoice, KnownSizes};

/// Sizes of one outfit for one person whose size had settled.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct ChosenSizes {
    /// Revision of the outfit.
    revision: u64,
    /// Tracking's number of the person.
    subject: u64,
    /// One for each choice; empty for a garment that is made to measure.
    sizes: Vec<String>,
}

impl ChosenSizes {
    /// Sizes of an outfit on a person.
    pub(crate) fn new(revision: u64, subject: u64, sizes: Vec<String>) -> Self {
        Self {
            revision,
            subject,
            sizes,
        }
    }

    /// They are of that outfit on that person.
    pub(crate) fn is_of(&self, revision: u64, subject: u64) -> bool {
        (self.revision, self.subject) == (revision, subject)
    }

    /// Sizes that the caller remembers, for the first outfit of a session.
    ///
    /// # Errors
    /// Names the field of the request.
    pub(crate) fn from_wire(
        known: Option<&KnownSizes>,
        choices: &[GarmentChoice],
        library: &Library,
    ) -> Result<Option<Self>, WireError> {
        let Some(known) = known else {
            return Ok(None);
        };
        let fault =
            |f: &str, why: &str| WireError::new(format!("dress_request.known_sizes.{f}"), why);
        if known.subject == 0 {
            return Err(fault("subject", "from 1 on"));
        }
        if known.sizes.len() != choices.len() {
            let why = format!("{} sizes for {} garments", known.sizes.len(), choices.len());
            return Err(fault("sizes", &why));
        }
        let sizes = Self::new(1, known.subject, known.sizes.clone());
        for (i, choice) in sizes.fill(choices).into_iter().enumerate() {
            let checked = library.check(&[choice]);
            checked.map_err(|e| fault(&format!("sizes[{i}]"), &e.why))?;
        }
        Ok(Some(sizes))
    }

    /// The choices, with these sizes where they leave the size open.
    pub(crate) fn fill(&self, choices: &[GarmentChoice]) -> Vec<GarmentChoice> {
        let filled = choices.iter().zip(&self.sizes).map(|(choice, size)| {
            let mut choice = choice.clone();
            if choice.size.is_empty() {
                choice.size.clone_from(size);
            }
            choice
        });
        filled.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn choice(garment: &str, size: &str) -> GarmentChoice {
        GarmentChoice {
            garment: garment.into(),
            size: size.into(),
            color_rgb: None,
            print: None,
        }
    }

    #[test]
    fn open_sizes_are_filled_and_bad_ones_name_their_field() {
        let library = Library::default();
        let choices = [choice("tshirt", ""), choice("trousers", "S")];
        let known = |subject, sizes: &[&str]| KnownSizes {
            subject,
            sizes: sizes.iter().map(|s| (*s).to_owned()).collect(),
        };
        let read = |k: &KnownSizes| ChosenSizes::from_wire(Some(k), &choices, &library);
        let sizes = read(&known(3, &["L", "M"])).expect("fine").expect("given");
        assert_eq!(
            sizes.fill(&choices),
            [choice("tshirt", "L"), choice("trousers", "S")]
        );
        for (bad, field) in [
            (known(0, &["L", "M"]), "subject"),
            (known(3, &["L"]), "sizes"),
            (known(3, &["huge", "M"]), "sizes[0]"),
        ] {
            let refused = read(&bad).expect_err(field);
            assert_eq!(refused.field, format!("dress_request.known_sizes.{field}"));
        }
        let none = ChosenSizes::from_wire(None, &choices, &library);
        assert_eq!(none, Ok(None));
    }
}

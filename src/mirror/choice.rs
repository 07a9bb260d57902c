//! Garments chosen for a person and the size in which each is worn.

use crate::body::measure::Measurements;
use crate::dressing::{GarmentSource, MeshGarment, suggest};
use crate::garment::{GarmentError, Pattern, Size, library};
use std::sync::Arc;

/// One garment chosen for a person.
#[derive(Clone, Debug)]
pub enum Choice {
    /// Garment of the library.
    Library {
        /// Name in the library.
        name: String,
        /// Size; `None` for the one that [`suggest`] finds for the body.
        size: Option<Size>,
    },
    /// Pattern in the size it was drawn in.
    Pattern(Box<Pattern>),
    /// Mesh made on another body.
    Mesh(Arc<MeshGarment>),
}

impl Choice {
    /// Garment of the library.
    ///
    /// # Errors
    /// Unknown name.
    pub fn library(name: &str, size: Option<Size>) -> Result<Self, GarmentError> {
        library::pattern(name, size.unwrap_or_default())?;
        Ok(Self::Library {
            name: name.to_owned(),
            size,
        })
    }

    /// The garment in the size in which this body wears it.
    ///
    /// # Errors
    /// Unknown name.
    pub fn sized(&self, body: &Measurements) -> Result<SizedGarment, GarmentError> {
        let cut = |pattern, notes| SizedGarment {
            item: WornItem::Pattern(pattern),
            notes,
        };
        Ok(match self {
            Self::Pattern(pattern) => cut(pattern.clone(), Vec::new()),
            Self::Mesh(mesh) => SizedGarment {
                item: WornItem::Mesh(Arc::clone(mesh)),
                notes: (mesh.notes.iter())
                    .map(|n| format!("{}: {n}", mesh.name))
                    .collect(),
            },
            Self::Library {
                name,
                size: Some(size),
            } => cut(Box::new(library::pattern(name, *size)?), Vec::new()),
            Self::Library { name, size: None } => {
                let found = suggest(name, body)?;
                let note = format!("{name}: {} ({})", found.size, found.reason);
                cut(Box::new(library::pattern(name, found.size)?), vec![note])
            }
        })
    }
}

/// Garment whose size is settled.
#[derive(Clone, Debug)]
pub struct SizedGarment {
    item: WornItem,
    /// Remarks for people: the suggested size with its reason, or the decisions taken for a mesh.
    pub notes: Vec<String>,
}

#[derive(Clone, Debug)]
enum WornItem {
    Pattern(Box<Pattern>),
    Mesh(Arc<MeshGarment>),
}

impl SizedGarment {
    /// Name of the garment.
    pub fn name(&self) -> &str {
        match &self.item {
            WornItem::Pattern(p) => &p.name,
            WornItem::Mesh(m) => &m.name,
        }
    }

    /// Pattern it is cut from; `None` for a mesh.
    pub fn pattern(&self) -> Option<&Pattern> {
        match &self.item {
            WornItem::Pattern(p) => Some(p),
            WornItem::Mesh(_) => None,
        }
    }

    pub(super) fn wear(&self) -> GarmentSource<'_> {
        match &self.item {
            WornItem::Pattern(p) => GarmentSource::Pattern(p),
            WornItem::Mesh(m) => GarmentSource::Mesh(m),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::measure::measure;
    use crate::body::{BodyShape, embedded};

    #[test]
    fn an_open_size_is_the_suggested_one_and_a_given_size_is_kept() {
        let template = embedded::template();
        let rest = template.personalise(&BodyShape::default());
        let body = measure(&template, &rest).expect("a body");
        let size = |choice: Choice| {
            let garment = choice.sized(&body).expect("known");
            (garment.pattern().expect("cut").size, garment.notes.len())
        };
        let open = Choice::library("tshirt", None).expect("known");
        let suggested = suggest("tshirt", &body).expect("known").size;
        assert_eq!(size(open), (suggested, 1));
        let given = Choice::library("tshirt", Some(Size::Xxl)).expect("known");
        assert_eq!(size(given), (Size::Xxl, 0));
        assert!(Choice::library("cape", None).is_err());
    }
}

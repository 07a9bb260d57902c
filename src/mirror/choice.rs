//! Garments chosen for a person and the size in which each is worn.

use std::sync::Arc;
use tryon_body::measure::Measurements;
use tryon_dressing::{FinishedGarment, GarmentSource, MeshGarment, suggest};
use tryon_garment::{FabricImage, GarmentError, Material, Pattern, Size, library};

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
    Mesh {
        /// Garment.
        garment: Arc<MeshGarment>,
        /// Size; `None` for the suggested one. A garment in one size is made to measure.
        size: Option<Size>,
    },
    /// Garment of the library or pattern, cut from another fabric than its own.
    InFabric {
        /// Garment.
        garment: Box<Choice>,
        /// Fabric.
        material: Box<Material>,
    },
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

    /// The garment cut from `material`; a mesh garment has its fabric from its making.
    #[must_use]
    pub fn in_fabric(self, material: &Material) -> Self {
        match self {
            Self::Mesh { .. } => self,
            _ => Self::InFabric {
                garment: Box::new(self),
                material: Box::new(material.clone()),
            },
        }
    }

    /// Mesh garment; a size is ignored by a garment in one size.
    pub fn mesh(garment: MeshGarment, size: Option<Size>) -> Self {
        Self::Mesh {
            garment: Arc::new(garment),
            size,
        }
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
            Self::Mesh { garment, size } => sized_mesh(garment, *size, body),
            Self::InFabric { garment, material } => {
                let mut sized = garment.sized(body)?;
                if let WornItem::Pattern(pattern) = &mut sized.item {
                    pattern.material = (**material).clone();
                }
                sized
            }
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

/// A mesh garment in a size, the suggested one without; made to measure where it comes in one size.
fn sized_mesh(garment: &Arc<MeshGarment>, size: Option<Size>, body: &Measurements) -> SizedGarment {
    let name = &garment.name;
    let mut notes: Vec<String> = garment
        .notes
        .iter()
        .map(|n| format!("{name}: {n}"))
        .collect();
    let suggested = garment.suggest(body).filter(|_| size.is_none());
    if let Some(found) = &suggested {
        notes.push(format!("{name}: {} ({})", found.size, found.reason));
    }
    let size = size.or(suggested.map(|s| s.size));
    let sized = size.and_then(|s| garment.in_size(s)).map(Arc::new);
    SizedGarment {
        item: WornItem::Mesh(sized.unwrap_or_else(|| Arc::clone(garment))),
        notes,
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

    /// Measures in its size; `None` for a mesh that is made to measure.
    pub fn finished(&self) -> Option<FinishedGarment> {
        match &self.item {
            WornItem::Pattern(p) => Some(FinishedGarment::from(&**p)),
            WornItem::Mesh(m) => m.finished(),
        }
    }

    /// Size that it comes in; `None` for a mesh that is made to measure.
    pub fn size(&self) -> Option<Size> {
        self.finished().map(|f| f.size)
    }

    /// Colour unless another is chosen, sRGB: its own, or the library's for its name.
    pub fn color(&self) -> [u8; 3] {
        let own = match &self.item {
            WornItem::Pattern(_) => None,
            WornItem::Mesh(m) => m.color,
        };
        own.unwrap_or_else(|| library::dye(self.name()))
    }

    /// Image that it shows unless another colour is chosen.
    pub fn image(&self) -> Option<&Arc<FabricImage>> {
        match &self.item {
            WornItem::Pattern(_) => None,
            WornItem::Mesh(m) => m.image.as_ref(),
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
    use tryon_body::measure::measure;
    use tryon_body::{BodyShape, embedded};

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

//! Garments to sheets of cloth around the canonical body.

use super::body_sections::BodySections;
use super::error::DressError;
use super::finished::FinishedGarment;
use super::mesh_garment::MeshGarment;
use super::options::DressOptions;
use super::place::{PlacedBody, place};
use super::suggest::check_wearable;
use tryon_body::Template;
use tryon_body::measure::Measurements;
use tryon_garment::{AnchorKind, GarmentMesh, Pattern, Size, library};
use tryon_geometry::math::P3;

/// A garment to put on.
#[derive(Clone, Copy, Debug)]
pub enum GarmentSource<'a> {
    /// Cut from a pattern.
    Pattern(&'a Pattern),
    /// A mesh made on another body.
    Mesh(&'a MeshGarment),
}

impl GarmentSource<'_> {
    fn layer(&self) -> u8 {
        match self {
            Self::Pattern(p) => p.layer,
            Self::Mesh(m) => m.layer(),
        }
    }
}

/// A sheet of cloth and its start.
pub(super) struct PlacedSheet {
    pub(super) garment: GarmentMesh,
    /// Start positions, frame of the canonical body, metres.
    pub(super) positions: Vec<P3>,
}

impl PlacedSheet {
    fn is_rigid(&self) -> bool {
        let mut anchors = self.garment.anchors.iter();
        anchors.any(|a| a.kind == AnchorKind::Rigid)
    }
}

/// The body that garments are sewn around.
pub(super) struct Sewing<'a> {
    pub(super) template: &'a Template,
    pub(super) sections: &'a BodySections,
    /// Without them any size is worn.
    pub(super) measures: Option<&'a Measurements>,
    pub(super) options: &'a DressOptions,
}

impl Sewing<'_> {
    /// Sheets of all garments, innermost first; rigid accessories are innermost, as cloth goes over them.
    pub(super) fn sew(
        &self,
        garments: &[GarmentSource<'_>],
    ) -> Result<Vec<PlacedSheet>, DressError> {
        let mut order: Vec<&GarmentSource<'_>> = garments.iter().collect();
        order.sort_by_key(|g| g.layer());
        let mut sheets: Vec<PlacedSheet> = Vec::new();
        for garment in order {
            match garment {
                GarmentSource::Pattern(p) => sheets.push(self.sew_pattern(p, sheets.len())?),
                GarmentSource::Mesh(m) => {
                    if let Some(finished) = m.finished() {
                        self.check(&finished, |s| m.finished_in(s))?;
                    }
                    sheets.extend(
                        m.retargeted(self.template, self.sections)
                            .into_iter()
                            .map(|(garment, positions)| PlacedSheet { garment, positions }),
                    )
                }
            }
        }
        sheets.sort_by_key(|s| !s.is_rigid());
        Ok(sheets)
    }
    /// Checks that the body can wear a garment, where that is asked for.
    fn check(
        &self,
        garment: &FinishedGarment,
        of_size: impl Fn(Size) -> Option<FinishedGarment>,
    ) -> Result<(), DressError> {
        let measures = self.measures.filter(|_| !self.options.any_size);
        let checked = measures.map(|m| check_wearable(garment, of_size, m));
        Ok(checked.unwrap_or(Ok(()))?)
    }
    /// A pattern around the body and `inner` garments.
    fn sew_pattern(&self, pattern: &Pattern, inner: usize) -> Result<PlacedSheet, DressError> {
        let in_settings = |g| FinishedGarment {
            settings: self.options.stages.size,
            ..g
        };
        let of_size = |s| {
            let other = library::pattern(&pattern.name, s).ok()?;
            Some(in_settings(FinishedGarment::from(&other)))
        };
        self.check(&in_settings(FinishedGarment::from(pattern)), of_size)?;
        let mesh = GarmentMesh::sew(pattern, &self.options.triangulation)?;
        let body = PlacedBody {
            template: self.template,
            sections: self.sections,
            pattern,
            settings: &self.options.stages.place.over(inner),
        };
        Ok(PlacedSheet {
            positions: place(&body, &mesh),
            garment: mesh,
        })
    }
}

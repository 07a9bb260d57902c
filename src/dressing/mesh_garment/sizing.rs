//! Sizes of a mesh garment: its own is the size of the body it was made on, the others follow by grading.

use super::grading::{Grading, LimbAxes};
use super::piece::GarmentPiece;
use crate::body_sections::{BodySections, SectionStack};
use crate::finished::{FinishedGarment, HangsFrom, Hem};
use crate::settings::{MeshGarmentSettings, WornSizeSettings};
use crate::suggest::{Suggestion, body_girths, first_with_ease};
use tryon_body::measure::{Measurements, measure};
use tryon_body::parts::vertex_masks;
use tryon_body::{BodyShape, Template};
use tryon_garment::{GarmentKind, Material, Region, Size};
use tryon_geometry::math::P3;

/// Trunk and legs: the skin of the girths at waist and hip.
const BELOW: Region = Region::TRUNK.with(super::classifier::LEGS);

/// Cloth of a garment on the body it was made on.
pub(super) struct SourceCloth<'a> {
    pub(super) name: &'a str,
    pub(super) material: &'a Material,
    pub(super) pieces: &'a [GarmentPiece],
    /// Vertices of each piece off the skin, metres.
    pub(super) positions: &'a [Vec<P3>],
    pub(super) settings: &'a MeshGarmentSettings,
}

/// Sizes of one garment.
#[derive(Clone, Debug)]
pub(super) struct Sizing {
    /// Measures in its own size.
    own: FinishedGarment,
    /// Girths that grow by the table's steps: the garment's, or the body's where it has none, metres.
    girths: [f64; 3],
    /// Heights of hip, waist, chest and shoulders on the source body, metres.
    heights: [f64; 4],
    /// Length of the hem above the crotch and below it, metres.
    hem: [f64; 2],
    limbs: LimbAxes,
}

impl Sizing {
    /// Sizes of a garment with cloth; `None` where the body cannot be measured.
    pub(super) fn new(source: &Template, cloth: &SourceCloth<'_>) -> Option<Self> {
        let kind = kind(cloth.pieces)?;
        let rest = source.personalise(&BodyShape::default());
        let body = measure(source, &rest).ok()?;
        let floor = rest.vertices.iter().map(|p| p.y).fold(f32::MAX, f32::min);
        let settings = cloth.settings;
        let sections = BodySections::new(source, &rest, Some(&body), &settings.sections);
        let heights = heights(source, &sections, settings.chest);
        let [hip, waist, chest, _] = heights.map(|y| y as f32);
        let places = [(chest, Region::TRUNK), (waist, BELOW), (hip, BELOW)];
        let stacks = Stacks::cut(source, cloth);
        let skin = body_girths(&body);
        let girths: [f64; 3] = std::array::from_fn(|k| {
            let (y, region) = places[k];
            stacks
                .girth(y, region)
                .filter(|g| *g > settings.around * skin[k])
                .unwrap_or(0.0)
        });
        let worn = |k: usize| (girths[k] > 0.0).then_some(skin[k]);
        let size = match [worn(0), worn(1), worn(2)] {
            [None, None, None] => Size::nearest(skin.map(Some)),
            covered => Size::nearest(covered),
        };
        let lowest = cloth.positions.iter().flatten().map(|p| p.y);
        let lowest = f64::from(lowest.fold(f32::MAX, f32::min) - floor);
        let from = match kind {
            GarmentKind::Top | GarmentKind::Dress => HangsFrom::Shoulder,
            GarmentKind::Skirt => HangsFrom::Waist,
            GarmentKind::Trousers => HangsFrom::Crotch,
        };
        let least = settings.size.least_ease;
        let above = from.height(&body) - lowest.max(body.inseam);
        Some(Self {
            hem: [above, (body.inseam - lowest).max(0.0)],
            own: FinishedGarment {
                name: cloth.name.to_owned(),
                kind,
                size,
                material: cloth.material.clone(),
                settings: WornSizeSettings {
                    least_ease: std::array::from_fn(|k| least[k].min(girths[k] - skin[k])),
                    ..settings.size
                },
                girths,
                hem: Some(Hem {
                    from,
                    below: from.height(&body) - lowest,
                }),
            },
            girths: std::array::from_fn(|k| if girths[k] > 0.0 { girths[k] } else { skin[k] }),
            heights,
            limbs: LimbAxes::new(source),
        })
    }

    /// Size of the body it was made on.
    pub(super) fn size(&self) -> Size {
        self.own.size
    }

    /// Growth of chest, waist and hip from its own size, metres.
    fn steps(&self, size: Size) -> [f64; 3] {
        let [from, to] = [self.own.size, size].map(|s| s.row().body.girths());
        std::array::from_fn(|k| to[k] - from[k])
    }

    /// Grade from its own size.
    pub(super) fn grading(&self, size: Size) -> Grading<'_> {
        let rows = [self.own.size.row(), size.row()];
        let steps = self.steps(size);
        let [chest, waist, hip]: [f64; 3] =
            std::array::from_fn(|k| 1.0 + steps[k] / self.girths[k]);
        let shoulders = rows[1].shoulders / rows[0].shoulders;
        let scales = [hip, waist, chest, shoulders];
        Grading {
            limbs: &self.limbs,
            girths: std::array::from_fn(|k| (self.heights[k], scales[k])),
            rows,
        }
    }

    /// Measures in a size.
    pub(super) fn finished(&self, size: Size) -> FinishedGarment {
        let steps = self.steps(size);
        let [own, row] = [self.own.size, size].map(Size::row);
        let [above, below] = self.hem;
        let grown = above * row.trunk / own.trunk + below * row.inseam / own.inseam;
        let girth = |k: usize| match self.own.girths[k] {
            g if g > 0.0 => g + steps[k],
            _ => 0.0,
        };
        FinishedGarment {
            size,
            girths: std::array::from_fn(girth),
            hem: self.own.hem.map(|hem| Hem {
                below: grown,
                ..hem
            }),
            ..self.own.clone()
        }
    }

    /// The size of the body, or the first larger one with enough ease. The body it was made on gets its own size.
    pub(super) fn suggest(&self, body: &Measurements) -> Option<Suggestion> {
        let girths = body_girths(body);
        let covered: [Option<f64>; 3] =
            std::array::from_fn(|k| (self.own.girths[k] > 0.0).then_some(girths[k]));
        let size = match covered {
            [None, None, None] => Size::nearest(girths.map(Some)),
            covered => Size::nearest(covered),
        };
        let sizes = Size::ALL.into_iter().filter(|s| *s >= size);
        let sizes: Vec<FinishedGarment> = sizes.map(|s| self.finished(s)).collect();
        first_with_ease(&sizes, body)
    }
}

/// Kind of the whole: a top and trousers together are a suit. `None` without cloth.
fn kind(pieces: &[GarmentPiece]) -> Option<GarmentKind> {
    use GarmentKind::{Dress, Skirt, Top, Trousers};
    let kinds = pieces.iter().filter(|p| !p.is_rigid());
    kinds.map(|p| p.garment.kind).reduce(|a, b| match (a, b) {
        (Dress, _) | (_, Dress) => Dress,
        (Top, Skirt | Trousers) | (Skirt | Trousers, Top) => Dress,
        _ => a,
    })
}

/// Heights of hip, waist, chest and shoulders of a body at rest, metres; the chest is fullest within `chest`, shares of the
/// way from waist to shoulders.
fn heights(source: &Template, sections: &BodySections, chest: [f32; 2]) -> [f64; 4] {
    let joint = source.skeleton().index("left_shoulder");
    let waist = sections.heights.waist;
    let shoulder = joint.map_or(waist + 0.4, |j| source.skeleton().joints()[j].rest.y as f32);
    let [low, high] = chest.map(|t| waist + t * (shoulder - waist));
    let chest = sections.trunk.argmin(low..high, |s| -s.girth);
    [sections.heights.hip, waist, chest, shoulder].map(f64::from)
}

/// Cross-sections of the pieces of cloth.
struct Stacks(Vec<[(Region, SectionStack); 2]>);

impl Stacks {
    fn cut(source: &Template, cloth: &SourceCloth<'_>) -> Self {
        let masks = vertex_masks(source);
        let sheets = cloth.pieces.iter().zip(cloth.positions);
        let sheets = sheets.filter(|(p, _)| !p.is_rigid());
        let stacks = sheets.map(|(piece, x)| {
            let below = piece.binding.vertices.iter();
            let parts: Vec<u8> = below
                .map(|v| v.first().map_or(0, |v| masks[v.0 as usize]))
                .collect();
            let (faces, spacing) = (&piece.garment.faces, cloth.settings.sections.spacing);
            let cut = |region| SectionStack::cut(x, faces, &parts, region, spacing);
            [Region::TRUNK, BELOW].map(|region| (region, cut(region)))
        });
        Self(stacks.collect())
    }

    /// Smallest girth of the pieces around some parts at a height, metres.
    fn girth(&self, y: f32, region: Region) -> Option<f64> {
        let stacks = self.0.iter().flatten();
        let around = stacks.filter(|(r, s)| *r == region && s.covers(y));
        let girths = around.map(|(_, s)| f64::from(s.at(y).girth));
        girths.reduce(f64::min)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{FitClass, MeshGarment, SourceBody};
    use std::f32::consts::TAU;
    use std::sync::Arc;
    use tryon_body::embedded;
    use tryon_garment::size_table;
    use tryon_geometry::mesh::TriMesh;

    /// A tube around trunk and hips of the embedded body, 30 cm across.
    fn tube(body: &Arc<Template>) -> MeshGarment {
        let (n, rows) = (96u32, 50u32);
        let point = |k: u32| {
            let (a, t) = (
                TAU * (k % n) as f32 / n as f32,
                (k / n) as f32 / (rows - 1) as f32,
            );
            P3::new(0.2 * a.sin(), 0.85 + 0.5 * t, 0.2 * a.cos())
        };
        let at = |i: u32, j: u32| j * n + i % n;
        let quad = |k: u32| {
            let (i, j) = (k % n, k / n);
            let [a, b] = [at(i, j), at(i + 1, j)];
            [
                [a, b, at(i + 1, j + 1)],
                [a, at(i + 1, j + 1), at(i, j + 1)],
            ]
        };
        let faces = (0..n * (rows - 1)).flat_map(quad).collect();
        let mesh = TriMesh::new((0..n * rows).map(point).collect(), faces).expect("a tube");
        let cotton = Material::preset("cotton").expect("a preset");
        let body = SourceBody::of_template(Arc::clone(body));
        MeshGarment::on_body("tube", mesh, body, &cotton, &MeshGarmentSettings::default())
            .expect("a garment")
    }

    fn body(template: &Template) -> Measurements {
        let rest = template.personalise(&BodyShape::default());
        measure(template, &rest).expect("a body")
    }

    #[test]
    fn a_garment_has_the_size_of_its_body_and_grows_by_the_table() {
        let template = embedded::template();
        let (garment, body) = (tube(&template), body(&template));
        let own = garment.own_size().expect("sizes");
        let suggested = garment.suggest(&body).expect("sizes");
        assert_eq!(suggested.size, own);
        assert!(suggested.girths.iter().all(|g| g.fit != FitClass::Tight));

        let in_own = garment
            .in_size(own)
            .and_then(|g| g.finished())
            .expect("measures");
        assert!(
            (in_own.girths[0] - f64::from(TAU) * 0.2).abs() < 0.01,
            "{in_own:?}"
        );
        for row in size_table() {
            let sized = garment.in_size(row.size).and_then(|g| g.finished());
            let sized = sized.expect("measures");
            let steps = row.body.girths().into_iter().zip(own.row().body.girths());
            for (k, (wanted, from)) in steps.enumerate() {
                let grown = sized.girths[k] - in_own.girths[k];
                let step = if in_own.girths[k] > 0.0 {
                    wanted - from
                } else {
                    0.0
                };
                assert!((grown - step).abs() < 1e-9, "{} {k}: {grown}", row.size);
            }
        }
    }

    #[test]
    fn fuller_bodies_get_larger_sizes() {
        let template = embedded::template();
        let (garment, body) = (tube(&template), body(&template));
        let sizes = [0.8, 0.9, 1.0, 1.1, 1.25].map(|scale| {
            let fuller = Measurements {
                chest: body.chest * scale,
                natural_waist: body.natural_waist * scale,
                hip: body.hip * scale,
                ..body
            };
            garment.suggest(&fuller).expect("sizes").size
        });
        assert!(sizes.windows(2).all(|w| w[0] <= w[1]), "{sizes:?}");
        assert!(sizes[0] < sizes[2] && sizes[2] < sizes[4], "{sizes:?}");
    }
}

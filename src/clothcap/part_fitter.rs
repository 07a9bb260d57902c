//! Fit of all garments of an outfit to one segmented scan.

use super::CaptureError;
use super::align::{AlignedBody, QueryCounts, VertexCounts};
use super::captured_outfit::CapturedOutfit;
use super::multi::{ClothPart, LabelledScan, MultiCloth, PartFit, PartScan};
use super::part_colors::part_colors;
use super::scan::BodyScan;
use super::segmenter::SegmentedScan;
use super::settings::{PartFitConfig, TextureSettings};
use super::texture::TextureAtlas;
use super::topology::ClothTemplate;
use tryon_body::{BoneTransforms, PosedSkin};
use tryon_geometry::math::P3;

/// Garments on one scan.
#[derive(Debug, Default)]
pub(super) struct FittedParts {
    /// Posed vertices of each, world, metres.
    pub(super) vertices: Vec<Vec<P3>>,
    /// Mean distance of each one's scan points from it, metres.
    pub(super) errors: Vec<f64>,
    /// Mean distance of the scan's boundary points from each one's rings, metres.
    pub(super) boundary_errors: Vec<f64>,
    pub(super) queries: QueryCounts,
    pub(super) vertex_counts: VertexCounts,
}

/// Fit of all parts to one segmented scan.
pub(super) struct PartFitter<'a> {
    pub(super) fits: &'a mut Vec<PartFit>,
    pub(super) cloth: &'a ClothTemplate,
    pub(super) scan: &'a BodyScan,
    pub(super) segmented: &'a SegmentedScan,
    /// Vertex of the clothed template that each scan point lies near, shape `[points]`.
    pub(super) near: &'a [u32],
    pub(super) config: PartFitConfig,
    pub(super) texture: &'a TextureSettings,
}

impl PartFitter<'_> {
    /// Parts of the first scan, coupled to the body model (eq. 18), and the outfit that they make.
    pub(super) fn first(
        &mut self,
        body: AlignedBody,
    ) -> Result<(CapturedOutfit, FittedParts), CaptureError> {
        let segmented = self.segmented;
        let cloth = MultiCloth::new(self.cloth, &segmented.labelling);
        if cloth.parts.is_empty() {
            return Err(CaptureError::NoGarment);
        }
        let alignment = &segmented.alignment;
        let mut fitted = FittedParts::default();
        for part in &cloth.parts {
            let nodes = part.nodes.iter();
            let pick = |v: &[P3]| nodes.clone().map(|i| v[*i as usize]).collect::<Vec<_>>();
            let model = pick(&alignment.model);
            self.fit(part, &model, pick(&alignment.surface), &mut fitted)?;
        }
        let parts = cloth.parts.iter().zip(&fitted.vertices);
        let rest = parts.map(|(part, v)| rest(self.cloth, &alignment.bones, part, v));
        let evened = segmented.evened(self.scan);
        let grey = self.texture.grey;
        let colors = cloth.parts.iter();
        let colors = colors.map(|part| part_colors(part, segmented, evened, grey));
        let rest: Vec<Vec<P3>> = rest.collect();
        let [least, most] = self.texture.texels;
        let texel = (self.texture.texel * self.scan.color_spacing()).clamp(least, most);
        let atlases = cloth.parts.iter().zip(&rest);
        let atlases = atlases.map(|(part, rest)| TextureAtlas::new(rest, &part.faces, texel));
        let is_colored = !self.scan.colors.is_empty();
        let outfit = CapturedOutfit {
            atlases: atlases.filter(|_| is_colored).collect(),
            colors: colors.collect(),
            rest,
            labelling: segmented.labelling.clone(),
            body,
            cloth,
        };
        Ok((outfit, fitted))
    }

    /// Parts of a later scan, coupled to the posed multi-cloth template (eq. 21).
    pub(super) fn later(&mut self, outfit: &CapturedOutfit) -> Result<FittedParts, CaptureError> {
        let mut fitted = FittedParts::default();
        let bones = &self.segmented.alignment.bones;
        let skin = PosedSkin::new(self.cloth.template(), bones);
        for (part, rest) in outfit.cloth.parts.iter().zip(&outfit.rest) {
            let model = skin.pose(part.nodes.iter().map(|v| *v as usize), rest);
            self.fit(part, &model, model.clone(), &mut fitted)?;
        }
        Ok(fitted)
    }

    fn fit(
        &mut self,
        part: &ClothPart,
        model: &[P3],
        start: Vec<P3>,
        out: &mut FittedParts,
    ) -> Result<(), CaptureError> {
        let segmented = self.segmented;
        let labelled = LabelledScan {
            scan: self.scan,
            edges: &segmented.edges,
            labels: &segmented.labels,
            near: self.near,
        };
        let points = PartScan::new(&labelled, part.label, self.config.beside);
        let mut vertices = start;
        let k = out.vertices.len();
        if k == self.fits.len() {
            // The order of its faces must not depend on the scan at which a capture was continued.
            let template = self.cloth.template().mesh().vertices();
            let rest: Vec<P3> = part.nodes.iter().map(|v| template[*v as usize]).collect();
            self.fits.push(PartFit::new(part, &rest)?);
        }
        let report = self.fits[k].run(&points, model, &mut vertices, &self.config)?;
        out.vertices.push(vertices);
        out.errors.push(report.surface.error);
        out.boundary_errors.push(report.boundary_error);
        out.queries += report.surface.queries;
        out.vertex_counts += report.surface.vertices;
        Ok(())
    }
}

/// Rest vertices of a part from posed ones (eq. 15), metres.
pub(super) fn rest(
    cloth: &ClothTemplate,
    bones: &BoneTransforms,
    part: &ClothPart,
    posed: &[P3],
) -> Vec<P3> {
    let nodes = part.nodes.iter().map(|v| *v as usize);
    PosedSkin::new(cloth.template(), bones).unpose(nodes, posed)
}

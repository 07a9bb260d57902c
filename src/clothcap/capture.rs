//! Capture of a sequence: align → segment → fit the parts → undress, scan by scan.

use super::CaptureError;
use super::align::{
    AlignedBody, Alignment, AlignmentReport, ClothedTemplate, QueryCounts, SETTLED, Start,
};
use super::layers::clear_body;
use super::multi::{ClothPart, MultiCloth, PartFit, PartFitConfig, PartScan};
use super::part_colors::part_colors;
use super::retarget::{PenetrationSolver, SolidBody, pose_part};
use super::scan::{BodyScan, LeftOut};
use super::segment::{BodyRegion, LabelConfig, Labelling, unseen_regions};
use super::segmenter::{ScanSegmenter, SegmentedScan};
use super::texture::{GarmentTexture, ScanPaint, TextureAtlas};
use super::topology::ClothTemplate;
use super::undress::{
    ShapeScan, Undressed, Undresser, WornGarments, minimally_clothed, posed_under_cloth,
};
use super::unpose::unpose_shaped;
use crate::body::{BodyShape, BoneTransforms, Template};
use crate::math::{P3, V3};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Mean robust distance of a scan from the body model above which it says nothing of the subject's shape, metres.
const MISALIGNED: f64 = 0.03;
/// Side of a texel over the distance between the scan's colours, and its limits, metres.
const TEXEL: f32 = 0.5;
/// See [`TEXEL`].
const TEXELS: [f32; 2] = [0.001, 0.004];

/// Capture of one scan.
#[derive(Clone, Debug)]
pub struct FrameCapture {
    /// Single-mesh alignment.
    pub alignment: Alignment,
    /// Part of each scan point, shape `[points]`: 0 for skin and hair, then one a garment.
    pub labels: Vec<u8>,
    /// Posed vertices of each garment, world, metres.
    pub garments: Vec<Vec<P3>>,
    /// Body under the cloth.
    pub undressed: Undressed,
    /// Displacements of each garment from the undressed body in the rest pose (eq. 23), metres.
    pub displacements: Vec<Vec<V3>>,
    /// Report.
    pub report: FrameReport,
}

/// Report of one scan.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FrameReport {
    /// Single-mesh alignment.
    pub alignment: AlignmentReport,
    /// Mean distance of each garment's scan points from it, metres.
    pub part_errors: Vec<f64>,
    /// Mean distance of the scan's boundary points from each garment's rings, metres.
    pub boundary_errors: Vec<f64>,
    /// Nearest-point queries of the garments' fits.
    #[serde(default)]
    pub queries: QueryCounts,
    /// Rows of the scan's file that are no point.
    #[serde(default)]
    pub left_out: LeftOut,
    /// Regions of the body that hardly any point shows; they get no garment.
    #[serde(default)]
    pub unseen: Vec<BodyRegion>,
    /// The scan is the one before, but for its noise: the capture is a copy of that one's.
    #[serde(default)]
    pub repeated: bool,
}

/// Outfit found in the first scan.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct CapturedOutfit {
    /// Labels, slots and appearances.
    pub labelling: Labelling,
    /// Garments.
    pub cloth: MultiCloth,
    /// Rest vertices of each garment (L of eq. 15), metres.
    pub rest: Vec<Vec<P3>>,
    /// Colours of each garment's vertices, sRGB.
    pub colors: Vec<Vec<[u8; 3]>>,
    /// Texture coordinates of each garment; empty for scans without colours.
    #[serde(default)]
    pub atlases: Vec<TextureAtlas>,
    /// Minimally clothed shape with the first pose.
    pub body: AlignedBody,
}

/// Settings of a capture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CaptureConfig {
    /// Segmentation.
    pub labels: LabelConfig,
    /// Fit of the parts.
    pub parts: PartFitConfig,
    /// Nothing is skipped: every point is searched in every iteration, every turn tried.
    pub without_skips: bool,
    /// Shape of the subject from a scan in minimal clothing; without it the clothed scans give it.
    pub minimal: Option<BodyShape>,
}

/// Captures the scans of one subject in one outfit, in order.
#[derive(Debug)]
pub struct OutfitCapture {
    template: Arc<Template>,
    config: CaptureConfig,
    segmenter: ScanSegmenter,
    undresser: Undresser,
    solid: SolidBody,
    outfit: Option<CapturedOutfit>,
    /// Further scans that the minimally clothed shape is fitted to.
    shape_scans: Vec<BodyScan>,
    /// Systems of the outfit's garments, kept from scan to scan.
    fits: Vec<PartFit>,
    solvers: Vec<PenetrationSolver>,
    /// Image of each atlas, from the scans so far.
    textures: Vec<GarmentTexture>,
}

impl OutfitCapture {
    /// Capture before the first scan.
    ///
    /// # Errors
    /// [`CaptureError::Solve`] for a template too large.
    pub fn new(template: Arc<Template>, config: CaptureConfig) -> Result<Self, CaptureError> {
        let segmenter = ScanSegmenter::new(template.clone(), config.labels.clone())?;
        Self::with_segmenter(template, config, segmenter)
    }

    fn with_segmenter(
        template: Arc<Template>,
        config: CaptureConfig,
        mut segmenter: ScanSegmenter,
    ) -> Result<Self, CaptureError> {
        if config.without_skips {
            segmenter.skip_nothing();
        }
        Ok(Self {
            segmenter,
            undresser: Undresser::new(template.clone())?,
            solid: SolidBody::new(&template)?,
            template,
            config,
            outfit: None,
            shape_scans: Vec::new(),
            fits: Vec::new(),
            solvers: Vec::new(),
            textures: Vec::new(),
        })
    }

    /// Capture that continues after a first scan; `last` is the body of the scan before.
    ///
    /// # Errors
    /// As [`OutfitCapture::new`].
    pub fn resume(
        template: Arc<Template>,
        config: CaptureConfig,
        outfit: CapturedOutfit,
        state: (ClothedTemplate, AlignedBody),
    ) -> Result<Self, CaptureError> {
        let (labels, first) = (config.labels.clone(), outfit.labelling.clone());
        let segmenter = ScanSegmenter::resume(template.clone(), labels, first, state)?;
        Ok(Self {
            outfit: Some(outfit),
            ..Self::with_segmenter(template, config, segmenter)?
        })
    }

    /// Template of the surface, with or without legs joined.
    pub fn cloth(&self) -> &ClothTemplate {
        self.segmenter.cloth()
    }

    /// Clothed template, once a scan is captured.
    pub fn clothed(&self) -> Option<&ClothedTemplate> {
        self.segmenter.clothed()
    }

    /// Outfit, once a scan is captured.
    pub fn outfit(&self) -> Option<&CapturedOutfit> {
        self.outfit.as_ref()
    }

    /// Image of each garment's texture; empty for scans without colours.
    pub fn textures(&self) -> &[GarmentTexture] {
        &self.textures
    }

    /// The same with the images of the scans before.
    #[must_use]
    pub fn with_textures(self, textures: Vec<GarmentTexture>) -> Self {
        Self { textures, ..self }
    }

    /// Starts the first scan at a person found before.
    pub fn start_at(&mut self, start: Start) {
        self.segmenter.start_at(start);
    }

    /// Scans beside the first one that the minimally clothed shape is fitted to, any of the sequence. Each costs its alignment
    /// and segmentation once more; it counts only before the first scan.
    pub fn add_shape_scan(&mut self, scan: BodyScan) {
        self.shape_scans.push(scan);
    }

    /// Captures the next scan: segment → fit the parts → undress → displacements.
    ///
    /// # Errors
    /// [`CaptureError::NoPerson`], or [`CaptureError::NoGarment`] if the first scan shows none.
    pub fn frame(&mut self, scan: &BodyScan) -> Result<FrameCapture, CaptureError> {
        let segmented = self.segmenter.step(scan)?;
        let covered = segmented.covered();
        let subject = match &self.outfit {
            Some(outfit) => outfit.body.clone(),
            None => self.subject((scan, &covered), &segmented)?,
        };

        // The first scan makes the outfit; nothing is skipped in it.
        let skips = self.outfit.is_some() && !self.config.without_skips;
        let parts = PartFitConfig {
            settled: if skips { SETTLED } else { 0.0 },
            ..self.config.parts
        };
        let mut fitter = PartFitter {
            fits: &mut self.fits,
            cloth: self.segmenter.cloth(),
            scan,
            segmented: &segmented,
            near: nearest_nodes(&segmented, self.segmenter.cloth()),
            config: &parts,
        };
        let alignment = &segmented.alignment;
        let (outfit, fitted, body) = match self.outfit.take() {
            Some(outfit) => {
                let fitted = fitter.later(&outfit)?;
                let start = AlignedBody {
                    pose: alignment.body.pose.clone(),
                    shape: subject.shape,
                };
                let body = posed_under_cloth(&self.template, scan, &covered, start)?;
                (outfit, fitted, body)
            }
            None => {
                let (outfit, fitted) = fitter.first(subject.clone())?;
                (outfit, fitted, subject)
            }
        };
        let worn = WornGarments {
            cloth: &outfit.cloth,
            vertices: &fitted.vertices,
        };
        let undressed = self.undresser.run((scan, &covered), worn, body)?;
        self.segmenter.follow(&undressed.body);
        let garments = self.freed(&outfit, &fitted.vertices, &undressed)?;
        self.paint(
            (segmented.evened(scan), &segmented.labels),
            &outfit,
            &fitted.vertices,
        );
        let out = FrameCapture {
            labels: segmented.parts(),
            displacements: displacements(
                self.segmenter.cloth(),
                &outfit.cloth,
                &garments,
                &undressed,
            ),
            report: FrameReport {
                alignment: alignment.report,
                part_errors: fitted.errors,
                boundary_errors: fitted.boundary_errors,
                queries: fitted.queries,
                left_out: scan.left_out,
                unseen: unseen_regions(
                    self.segmenter.cloth().template(),
                    &segmented.alignment.matches,
                ),
                repeated: false,
            },
            alignment: segmented.alignment,
            garments,
            undressed,
        };
        self.outfit = Some(outfit);
        Ok(out)
    }

    /// Minimally clothed body in the first scan: of the given shape, or of that which it and the scans beside it show.
    fn subject(
        &mut self,
        (scan, covered): (&BodyScan, &[bool]),
        first: &SegmentedScan,
    ) -> Result<AlignedBody, CaptureError> {
        if let Some(shape) = &self.config.minimal {
            let start = AlignedBody {
                shape: shape.clone(),
                ..first.alignment.body.clone()
            };
            return posed_under_cloth(&self.template, scan, covered, start);
        }
        let scans = std::mem::take(&mut self.shape_scans);
        let mut others: Vec<(SegmentedScan, &BodyScan)> = Vec::new();
        if let Some(clothed) = self.segmenter.clothed().filter(|_| !scans.is_empty()) {
            let state = (clothed.clone(), first.alignment.body.clone());
            let (labels, labelling) = (self.config.labels.clone(), first.labelling.clone());
            let mut segmenter =
                ScanSegmenter::resume(self.template.clone(), labels, labelling, state)?;
            // A scan of this sequence that shows nobody is reported where it is captured.
            let all = scans.iter().map(|s| (segmenter.step(s), s));
            let found = all.filter_map(|(segmented, s)| Some((segmented.ok()?, s)));
            let fits = |s: &SegmentedScan| s.alignment.report.model_error < MISALIGNED;
            others = found.filter(|(s, _)| fits(s)).collect();
        }
        let all = std::iter::once((first, scan)).chain(others.iter().map(|(s, b)| (s, *b)));
        let covered: Vec<Vec<bool>> = all.clone().map(|(s, _)| s.covered()).collect();
        let shape_scans: Vec<ShapeScan<'_>> = all
            .zip(&covered)
            .map(|((s, scan), covered)| ShapeScan {
                scan,
                covered,
                body: &s.alignment.body,
            })
            .collect();
        minimally_clothed(&self.template, &shape_scans)
    }

    /// Paints what no scan before showed of the garments with the points of their labels.
    fn paint(
        &mut self,
        (scan, labels): (&BodyScan, &[u8]),
        outfit: &CapturedOutfit,
        fitted: &[Vec<P3>],
    ) {
        if scan.colors.is_empty() {
            return;
        }
        for (k, atlas) in outfit.atlases.iter().enumerate() {
            let (part, vertices) = (&outfit.cloth.parts[k], &fitted[k]);
            let colors = &outfit.colors[k];
            if k == self.textures.len() {
                self.textures
                    .push(GarmentTexture::of_vertices(atlas, colors));
            }
            let own = |i: usize| labels[i] == part.label;
            let paint = ScanPaint::new(scan, own, (&part.faces, vertices));
            paint.apply(&mut self.textures[k], atlas, vertices, colors);
        }
    }

    /// Garments moved out of the undressed body where the fit left them inside, so that retargeting onto it moves nothing.
    fn freed(
        &mut self,
        outfit: &CapturedOutfit,
        fitted: &[Vec<P3>],
        undressed: &Undressed,
    ) -> Result<Vec<Vec<P3>>, CaptureError> {
        self.solid.place(&undressed.vertices)?;
        let mut out = fitted.to_vec();
        for part in &outfit.cloth.parts[self.solvers.len()..] {
            self.solvers.push(PenetrationSolver::new(part)?);
        }
        clear_body(&outfit.cloth, &mut self.solvers, &self.solid, &mut out)?;
        Ok(out)
    }
}

/// Garments on one scan.
#[derive(Debug, Default)]
struct FittedParts {
    vertices: Vec<Vec<P3>>,
    errors: Vec<f64>,
    boundary_errors: Vec<f64>,
    queries: QueryCounts,
}

/// Fit of all parts to one segmented scan.
struct PartFitter<'a> {
    /// Systems of the garments so far.
    fits: &'a mut Vec<PartFit>,
    cloth: &'a ClothTemplate,
    scan: &'a BodyScan,
    segmented: &'a SegmentedScan,
    /// Vertex of the clothed template that each scan point lies near, shape `[points]`.
    near: Vec<u32>,
    config: &'a PartFitConfig,
}

impl PartFitter<'_> {
    /// Parts of the first scan, coupled to the body model (eq. 18), and the outfit that they make.
    fn first(&mut self, body: AlignedBody) -> Result<(CapturedOutfit, FittedParts), CaptureError> {
        let segmented = self.segmented;
        let cloth = MultiCloth::new(self.cloth, &segmented.labelling);
        if cloth.parts.is_empty() {
            return Err(CaptureError::NoGarment);
        }
        let alignment = &segmented.alignment;
        let mut fitted = FittedParts::default();
        for part in &cloth.parts {
            let pick = |v: &[P3]| {
                part.nodes
                    .iter()
                    .map(|i| v[*i as usize])
                    .collect::<Vec<_>>()
            };
            let model = pick(&alignment.model);
            self.fit(part, &model, pick(&alignment.surface), &mut fitted)?;
        }
        let parts = cloth.parts.iter().zip(&fitted.vertices);
        let rest = parts.map(|(part, v)| rest(self.cloth, &alignment.bones, part, v));
        let colors = cloth
            .parts
            .iter()
            .map(|part| part_colors(part, segmented, segmented.evened(self.scan)));
        let rest: Vec<Vec<P3>> = rest.collect();
        let texel = TEXEL * self.scan.color_spacing();
        let atlases = cloth.parts.iter().zip(&rest);
        let atlases = atlases.map(|(part, rest)| {
            TextureAtlas::new(rest, &part.faces, texel.clamp(TEXELS[0], TEXELS[1]))
        });
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
    fn later(&mut self, outfit: &CapturedOutfit) -> Result<FittedParts, CaptureError> {
        let mut fitted = FittedParts::default();
        let bones = &self.segmented.alignment.bones;
        for (part, rest) in outfit.cloth.parts.iter().zip(&outfit.rest) {
            let model = pose_part(part, self.cloth.template(), bones, rest);
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
        let points = PartScan::new(
            (self.scan, &segmented.edges),
            (&segmented.labels, &self.near),
            part.label,
        );
        let mut vertices = start;
        let k = out.vertices.len();
        if k == self.fits.len() {
            // The order of its faces must not depend on the scan at which a capture was continued.
            let template = self.cloth.template().mesh().vertices();
            let rest: Vec<P3> = part.nodes.iter().map(|v| template[*v as usize]).collect();
            self.fits.push(PartFit::new(part, &rest)?);
        }
        let report = self.fits[k].run(&points, model, &mut vertices, self.config)?;
        out.vertices.push(vertices);
        out.errors.push(report.error);
        out.boundary_errors.push(report.boundary_error);
        out.queries += report.queries;
        Ok(())
    }
}

/// Vertex of the clothed template nearest to each scan point on the single mesh, shape `[points]`.
fn nearest_nodes(segmented: &SegmentedScan, cloth: &ClothTemplate) -> Vec<u32> {
    let faces = cloth.template().mesh().faces();
    let matches = segmented.alignment.matches.iter();
    matches
        .map(|m| faces[m.face as usize][m.nearest_corner()])
        .collect()
}

fn rest(cloth: &ClothTemplate, bones: &BoneTransforms, part: &ClothPart, posed: &[P3]) -> Vec<P3> {
    let nodes = part.nodes.iter().map(|v| *v as usize);
    unpose_shaped(cloth.template(), bones, nodes, posed)
}

/// Rest displacements of each garment from the undressed body (eq. 23).
fn displacements(
    surface: &ClothTemplate,
    cloth: &MultiCloth,
    garments: &[Vec<P3>],
    undressed: &Undressed,
) -> Vec<Vec<V3>> {
    let all = 0..undressed.vertices.len();
    let body = surface.extend(&unpose_shaped(
        surface.body(),
        &undressed.bones,
        all,
        &undressed.vertices,
    ));
    let parts = cloth.parts.iter().zip(garments);
    parts
        .map(|(part, vertices)| {
            let above = rest(surface, &undressed.bones, part, vertices);
            let below = part.nodes.iter().map(|v| body[*v as usize]);
            above.iter().zip(below).map(|(a, b)| a - b).collect()
        })
        .collect()
}

//! Capture of a sequence: align → segment → fit the parts → undress, scan by scan.

use super::CaptureError;
use super::align::{
    AlignedBody, Aligner, Alignment, AlignmentReport, ClothedTemplate, QueryCounts, Start,
    VertexCounts,
};
use super::captured_outfit::CapturedOutfit;
use super::layers::clear_body;
use super::multi::{ClothPart, MultiCloth, PartFit};
use super::part_fitter::{PartFitter, rest};
use super::retarget::{PenetrationSolver, SolidBody};
use super::scan::{BodyScan, LeftOut};
use super::segment::{BodyRegion, LabelConfig, unseen_regions};
use super::segmenter::{ScanSegmenter, SegmentedScan};
use super::settings::{
    AlignmentSettings, PartFitConfig, PenetrationSettings, TextureSettings, UndressSettings,
};
use super::texture::{GarmentTexture, ScanPaint};
use super::topology::ClothTemplate;
use super::undress::{CoveredScan, Undressed, Undresser};
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use tryon_body::{BodyShape, Template};
use tryon_geometry::math::{P3, V3};

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
    /// Vertices of the garments' fits.
    #[serde(default)]
    pub vertices: VertexCounts,
    /// Rows of the scan's file that are no point.
    #[serde(default)]
    pub left_out: LeftOut,
    /// Changes of the scan's surface.
    #[serde(default)]
    pub notes: Vec<String>,
    /// Regions of the body that hardly any point shows; they get no garment.
    #[serde(default)]
    pub unseen: Vec<BodyRegion>,
    /// The scan is the one before, but for its noise: the capture is a copy of that one's.
    #[serde(default)]
    pub repeated: bool,
}

/// Settings of the capture of an outfit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OutfitCaptureConfig {
    /// Segmentation.
    pub labels: LabelConfig,
    /// Fit of the parts.
    pub parts: PartFitConfig,
    /// Single-mesh alignment.
    pub align: AlignmentSettings,
    /// Body under the cloth.
    pub undress: UndressSettings,
    /// Garments moved out of the body.
    pub penetration: PenetrationSettings,
    /// Textures.
    pub texture: TextureSettings,
    /// Nothing is skipped: every point is searched in every iteration, every turn tried.
    pub without_skips: bool,
    /// Shape of the subject from a scan in minimal clothing; without it the clothed scans give it.
    pub minimal: Option<BodyShape>,
}

/// Captures the scans of one subject in one outfit, in order.
#[derive(Debug)]
pub struct OutfitCapture {
    template: Arc<Template>,
    config: OutfitCaptureConfig,
    segmenter: ScanSegmenter,
    undresser: Undresser,
    solid: SolidBody,
    outfit: Option<Arc<CapturedOutfit>>,
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
    pub fn new(template: Arc<Template>, config: OutfitCaptureConfig) -> Result<Self, CaptureError> {
        let aligner = Aligner::new(template.clone(), config.align)?;
        Self::with_aligner(template, config, aligner, None)
    }

    fn with_aligner(
        template: Arc<Template>,
        config: OutfitCaptureConfig,
        mut aligner: Aligner,
        outfit: Option<CapturedOutfit>,
    ) -> Result<Self, CaptureError> {
        if config.without_skips {
            aligner.skip_nothing();
        }
        let first = outfit.as_ref().map(|o| o.labelling.clone());
        let segmenter = ScanSegmenter::with_aligner(aligner, config.labels.clone(), first);
        let (model, undress, penetration) =
            (config.align.model, config.undress, config.penetration);
        Ok(Self {
            segmenter,
            undresser: Undresser::new(template.clone(), model, undress, penetration)?,
            solid: SolidBody::new(&template, penetration)?,
            template,
            config,
            outfit: outfit.map(Arc::new),
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
        config: OutfitCaptureConfig,
        outfit: CapturedOutfit,
        clothed: ClothedTemplate,
        last: AlignedBody,
    ) -> Result<Self, CaptureError> {
        let aligner = Aligner::resume(template.clone(), config.align, clothed, last)?;
        Self::with_aligner(template, config, aligner, Some(outfit))
    }

    /// Template of the surface, with or without legs joined.
    pub fn cloth(&self) -> &ClothTemplate {
        self.segmenter.cloth()
    }

    /// Clothed template, once a scan is captured.
    pub fn clothed(&self) -> Option<&ClothedTemplate> {
        self.segmenter.aligner.clothed()
    }

    /// Outfit, once a scan is captured.
    pub fn outfit(&self) -> Option<&CapturedOutfit> {
        self.outfit.as_deref()
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

    /// Captures the next scan: segment → fit the parts → undress → displacements. A scan that fails leaves the outfit as it
    /// was.
    ///
    /// # Errors
    /// [`CaptureError::NoPerson`], or [`CaptureError::NoGarment`] if the first scan shows none.
    pub fn frame(&mut self, scan: &BodyScan) -> Result<FrameCapture, CaptureError> {
        let segmented = self.segmenter.step(scan)?;
        let covered = CoveredScan {
            scan,
            covered: &segmented.covered(),
        };
        let subject = match &self.outfit {
            Some(outfit) => outfit.body.clone(),
            None => self.subject(&covered, &segmented)?,
        };

        let known = self.outfit.clone();
        if known.is_none() {
            self.fits.clear();
            self.solvers.clear();
        }
        // The first scan makes the outfit; nothing is skipped in it.
        let skips = known.is_some() && !self.config.without_skips;
        let cloth = self.segmenter.cloth();
        let parts = self.config.parts;
        let mut fitter = PartFitter {
            fits: &mut self.fits,
            cloth,
            scan,
            segmented: &segmented,
            near: &segmented.nearest_vertices(cloth),
            config: PartFitConfig {
                fit: parts.fit.skipping(skips),
                ..parts
            },
            texture: &self.config.texture,
        };
        let alignment = &segmented.alignment;
        let (outfit, fitted, body) = match known {
            Some(outfit) => {
                let fitted = fitter.later(&outfit)?;
                let start = AlignedBody {
                    pose: alignment.body.pose.clone(),
                    shape: subject.shape,
                };
                let body = self.undresser.posed_under_cloth(&covered, start, skips)?;
                (outfit, fitted, body)
            }
            None => {
                let (outfit, fitted) = fitter.first(subject.clone())?;
                (Arc::new(outfit), fitted, subject)
            }
        };
        let (parts, worn) = (&outfit.cloth, &fitted.vertices);
        let undressed = self.undresser.run(&covered, parts, worn, body, skips)?;
        self.segmenter.aligner.follow(&undressed.body);
        let garments = self.freed(&outfit, &fitted.vertices, &undressed)?;
        self.paint(scan, &segmented, &outfit, &fitted.vertices);
        let cloth = self.segmenter.cloth();
        let matches = &segmented.alignment.matches;
        let out = FrameCapture {
            labels: segmented.parts(),
            displacements: displacements(cloth, &outfit.cloth, &garments, &undressed),
            report: FrameReport {
                alignment: alignment.report,
                part_errors: fitted.errors,
                boundary_errors: fitted.boundary_errors,
                queries: fitted.queries,
                vertices: fitted.vertex_counts,
                left_out: scan.left_out,
                notes: scan.notes.clone(),
                unseen: unseen_regions(cloth.template(), matches, &self.config.labels.settings),
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
        scan: &CoveredScan<'_>,
        first: &SegmentedScan,
    ) -> Result<AlignedBody, CaptureError> {
        if let Some(shape) = &self.config.minimal {
            let start = AlignedBody {
                shape: shape.clone(),
                ..first.alignment.body.clone()
            };
            return self.undresser.posed_under_cloth(scan, start, false);
        }
        let scans = std::mem::take(&mut self.shape_scans);
        let mut others: Vec<(SegmentedScan, &BodyScan)> = Vec::new();
        if let Some(clothed) = self.clothed().filter(|_| !scans.is_empty()) {
            let (clothed, last) = (clothed.clone(), first.alignment.body.clone());
            let (template, config) = (self.template.clone(), &self.config);
            let aligner = Aligner::resume(template, config.align, clothed, last)?;
            let (labels, labelling) = (config.labels.clone(), first.labelling.clone());
            let mut segmenter = ScanSegmenter::with_aligner(aligner, labels, Some(labelling));
            // A scan of this sequence that shows nobody is reported where it is captured.
            let all = scans.iter().map(|s| (segmenter.step(s), s));
            let found = all.filter_map(|(segmented, s)| Some((segmented.ok()?, s)));
            let most = config.undress.misaligned;
            let fits = |s: &SegmentedScan| s.alignment.report.model_error < most;
            others = found.filter(|(s, _)| fits(s)).collect();
        }
        let covered: Vec<Vec<bool>> = others.iter().map(|(s, _)| s.covered()).collect();
        let beside = others.iter().zip(&covered);
        let beside = beside.map(|((_, scan), covered)| CoveredScan { scan, covered });
        let all: Vec<CoveredScan<'_>> = std::iter::once(*scan).chain(beside).collect();
        let bodies = std::iter::once(first).chain(others.iter().map(|(s, _)| s));
        let bodies = bodies.map(|s| s.alignment.body.clone()).collect();
        self.undresser.minimally_clothed(&all, bodies)
    }

    /// Paints what no scan before showed of the garments with the points of their labels.
    fn paint(
        &mut self,
        scan: &BodyScan,
        segmented: &SegmentedScan,
        outfit: &CapturedOutfit,
        fitted: &[Vec<P3>],
    ) {
        let scan = segmented.evened(scan);
        if scan.colors.is_empty() {
            return;
        }
        let settings = &self.config.texture.paint;
        for (k, atlas) in outfit.atlases.iter().enumerate() {
            let (part, vertices) = (&outfit.cloth.parts[k], &fitted[k]);
            let colors = &outfit.colors[k];
            if k == self.textures.len() {
                let texture = GarmentTexture::of_vertices(atlas, colors);
                self.textures.push(texture);
            }
            let own = |i: usize| segmented.labels[i] == part.label;
            let paint = ScanPaint::new(scan, own, &part.faces, vertices, settings);
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

/// Rest displacements of each garment from the undressed body (eq. 23).
fn displacements(
    surface: &ClothTemplate,
    cloth: &MultiCloth,
    garments: &[Vec<P3>],
    undressed: &Undressed,
) -> Vec<Vec<V3>> {
    let body = surface.extend(&undressed.rest(surface.body()));
    let displaced = |(part, vertices): (&ClothPart, &Vec<P3>)| {
        let above = rest(surface, &undressed.bones, part, vertices);
        let below = part.nodes.iter().map(|v| body[*v as usize]);
        above.iter().zip(below).map(|(a, b)| a - b).collect()
    };
    cloth.parts.iter().zip(garments).map(displaced).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_scans::TestScan;
    use tryon_body::embedded;

    /// A weight that is not a number fails the fit of the parts after the scan is segmented.
    #[test]
    fn a_scan_that_fails_leaves_the_outfit_to_the_next() {
        let scans = [0.6, 0.7].map(|yaw| TestScan::new(yaw, [40, 70, 160], [90, 90, 95]).scan());
        let config = OutfitCaptureConfig::default();
        let mut capture = OutfitCapture::new(embedded::template(), config).expect("a capture");
        capture.frame(&scans[0]).expect("captured");
        let outfit = capture.outfit.clone().expect("an outfit");
        let coupling = std::mem::replace(&mut capture.config.parts.coupling, f64::NAN);
        let fault = capture.frame(&scans[1]);
        assert!(matches!(fault, Err(CaptureError::Solve { .. })));
        assert!(Arc::ptr_eq(&outfit, capture.outfit.as_ref().expect("kept")));
        capture.config.parts.coupling = coupling;
        let next = capture.frame(&scans[1]).expect("captured");
        assert_eq!(next.garments.len(), outfit.cloth.parts.len());
        let nodes = |k: usize| outfit.cloth.parts[k].nodes.len();
        assert!((0..next.garments.len()).all(|k| next.garments[k].len() == nodes(k)));
    }
}

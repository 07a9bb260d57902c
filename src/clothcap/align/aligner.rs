//! Single-mesh alignment of a sequence: the first scan gives the clothed template, later ones are coupled to it.

use super::active_vertices::VertexCounts;
use super::arms::LostArms;
use super::free_surface::FreeSurface;
use super::legs::leg_topology;
use super::model_fit::{AlignedBody, ModelFit, PosedSurface};
use super::scan_pairing::{QueryCounts, SurfaceMatch};
use super::start::{Start, search_person};
use crate::CaptureError;
use crate::scan::BodyScan;
use crate::settings::{AlignmentSettings, SurfaceStage};
use crate::topology::{ClothTemplate, LegTopology};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;
use tryon_body::{BoneTransforms, Pose, PosedSkin, Template};
use tryon_geometry::math::{P3, Rigid, World};

/// Turns about the vertical between two scans that are tried, radians.
const TURNS: [f64; 3] = [FRAC_PI_2, PI, -FRAC_PI_2];

/// Alignment of one scan.
#[derive(Clone, Debug)]
pub struct Alignment {
    /// Body model.
    pub body: AlignedBody,
    /// Bones of its pose.
    pub bones: BoneTransforms,
    /// Posed surface that the free one is coupled to: body model, later clothed template. Shape `[vertices]`, world, metres.
    pub model: Vec<P3>,
    /// Free surface, shape `[vertices]`, world, metres.
    pub surface: Vec<P3>,
    /// Place of each scan point on it, shape `[points]`.
    pub matches: Vec<SurfaceMatch>,
    /// Report.
    pub report: AlignmentReport,
}

/// Report of one alignment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AlignmentReport {
    /// Mean robust distance of scan points from the body model, metres.
    pub model_error: f64,
    /// Mean distance of explained scan points from the free surface, metres.
    pub surface_error: f64,
    /// Share of scan points that the surface explains.
    pub explained: f64,
    /// The person was searched from nothing.
    pub searched: bool,
    /// Nearest-point queries of the free surface.
    #[serde(default)]
    pub queries: QueryCounts,
    /// Vertices of the free surface.
    #[serde(default)]
    pub vertices: VertexCounts,
    /// Turns about the vertical that were not tried, since the last pose fits.
    #[serde(default)]
    pub turns_skipped: usize,
}

/// Clothed template of the subject (eq. 8).
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ClothedTemplate {
    /// Rest vertices, shape `[vertices]`, metres.
    pub rest: Vec<P3>,
    /// Body of the first scan; its shape gives the joints.
    pub body: AlignedBody,
    /// Course of the cloth around the legs.
    #[serde(default)]
    pub legs: LegTopology,
}

/// Aligns the scans of one subject in order.
#[derive(Debug)]
pub struct Aligner {
    template: Arc<Template>,
    settings: AlignmentSettings,
    cloth: ClothTemplate,
    free: FreeSurface,
    clothed: Option<ClothedTemplate>,
    /// Person of the first scan, if found before.
    start: Option<Start>,
    last: Option<AlignedBody>,
    /// Settled points keep their faces, and turns are tried only where they may help.
    skips: bool,
}

impl Aligner {
    /// Aligner before the first scan.
    ///
    /// # Errors
    /// [`CaptureError::Solve`] for a template too large.
    pub fn new(template: Arc<Template>, settings: AlignmentSettings) -> Result<Self, CaptureError> {
        Ok(Self {
            cloth: ClothTemplate::new(&template, LegTopology::Apart)?,
            free: FreeSurface::new(&template, settings.surface)?,
            settings,
            template,
            clothed: None,
            start: None,
            last: None,
            skips: true,
        })
    }

    /// Aligner that continues after a first scan.
    ///
    /// # Errors
    /// As [`Aligner::new`].
    pub fn resume(
        template: Arc<Template>,
        settings: AlignmentSettings,
        clothed: ClothedTemplate,
        last: AlignedBody,
    ) -> Result<Self, CaptureError> {
        let mut out = Self::new(template, settings)?;
        out.cut(clothed.legs)?;
        Ok(Self {
            clothed: Some(clothed),
            last: Some(last),
            ..out
        })
    }

    /// Takes the surface of a topology.
    fn cut(&mut self, legs: LegTopology) -> Result<(), CaptureError> {
        if legs != self.cloth.legs() {
            self.cloth = ClothTemplate::new(&self.template, legs)?;
            self.free = FreeSurface::new(self.cloth.template(), self.settings.surface)?;
        }
        Ok(())
    }

    /// Template of the surface, with or without legs joined.
    pub fn cloth(&self) -> &ClothTemplate {
        &self.cloth
    }

    /// Clothed template, once a scan is aligned.
    pub fn clothed(&self) -> Option<&ClothedTemplate> {
        self.clothed.as_ref()
    }

    /// Skips nothing from now on: every point is searched in every iteration, every turn tried.
    pub fn skip_nothing(&mut self) {
        self.skips = false;
    }

    /// Starts the first scan at a person found before.
    pub fn start_at(&mut self, start: Start) {
        self.start = Some(start);
    }

    /// Starts the next scan in the pose of a body.
    pub(crate) fn follow(&mut self, body: &AlignedBody) {
        self.last = Some(body.clone());
    }

    /// Aligns the next scan.
    ///
    /// # Errors
    /// [`CaptureError::NoPerson`] if the scan shows none.
    pub fn align(&mut self, scan: &BodyScan) -> Result<Alignment, CaptureError> {
        let out = match self.clothed.take() {
            None => self.first(scan)?,
            Some(clothed) => {
                let result = self.later(scan, &clothed);
                self.clothed = Some(clothed);
                result?
            }
        };
        self.last = Some(out.body.clone());
        Ok(out)
    }

    fn first(&mut self, scan: &BodyScan) -> Result<Alignment, CaptureError> {
        let (template, settings) = (self.template.clone(), self.settings);
        let start = match self.start.take() {
            Some(start) => start,
            None => search_person(&template, scan, &settings)?,
        };
        let mut fit = ModelFit::new(&template, scan, settings.samples, &settings.model);
        let mut body = start.body;
        fit.run_all(&mut body, &settings.fine)?;
        let arms = LostArms::new(&template, scan, &settings.arms);
        if arms.search(&mut fit, &mut body)? {
            fit.run_all(&mut body, &settings.fine[1..])?;
        }
        self.cut(leg_topology(&template, scan, &body, &settings.legs)?)?;
        let template = self.cloth.template().clone();
        let mut fit = ModelFit::new(&template, scan, settings.samples, &settings.model);
        let report = AlignmentReport {
            searched: true,
            ..AlignmentReport::default()
        };
        let out = self.released(scan, &mut fit, body, report, &settings.surface.first)?;
        let nodes = 0..out.surface.len();
        self.clothed = Some(ClothedTemplate {
            legs: self.cloth.legs(),
            rest: PosedSkin::new(&template, &out.bones).unpose(nodes, &out.surface),
            body: out.body.clone(),
        });
        Ok(out)
    }

    /// Stage 2: pose by the clothed template, then the free surface coupled to it (eq. 9, 10).
    fn later(
        &mut self,
        scan: &BodyScan,
        clothed: &ClothedTemplate,
    ) -> Result<Alignment, CaptureError> {
        let template = self.cloth.template().clone();
        let settings = self.settings;
        let fit = ModelFit::new(&template, scan, settings.later_samples, &settings.model);
        let mut fit = fit.with_clothed(&clothed.rest).with_starts(self.skips);
        let mut report = AlignmentReport::default();
        let body = self.later_pose(scan, clothed, &mut fit, &mut report)?;
        self.released(scan, &mut fit, body, report, &settings.surface.later)
    }

    /// Pose by the clothed template, from that of the last scan.
    fn later_pose(
        &self,
        scan: &BodyScan,
        clothed: &ClothedTemplate,
        fit: &mut ModelFit<'_>,
        report: &mut AlignmentReport,
    ) -> Result<AlignedBody, CaptureError> {
        let settings = &self.settings;
        let last = &self.last.as_ref().unwrap_or(&clothed.body).pose;
        let mut body = self.turned(last, clothed, fit, report);
        fit.run_all(&mut body, &settings.later)?;
        let arms = LostArms::new(&self.template, scan, &settings.arms);
        if arms.search(fit, &mut body)? {
            fit.run(&mut body, &settings.later[1])?;
        }
        report.searched = !(fit.error(&body) < settings.lost);
        if report.searched {
            let found = search_person(&self.template, scan, settings)?;
            let mut other = AlignedBody {
                pose: found.body.pose,
                shape: clothed.body.shape.clone(),
            };
            fit.run_all(&mut other, &settings.later)?;
            if fit.error(&other) < fit.error(&body) {
                body = other;
            }
        }
        Ok(body)
    }

    /// Body of the first scan in the last pose, turned about the vertical to the direction that fits best: a back looks
    /// much like a front to closest points.
    fn turned(
        &self,
        last: &Pose<World>,
        clothed: &ClothedTemplate,
        fit: &mut ModelFit<'_>,
        report: &mut AlignmentReport,
    ) -> AlignedBody {
        let pelvis = last.root.point(&self.template.skeleton().joints()[0].rest);
        let turned = |turn: f64| {
            let axis = Vector3::y() * turn;
            let about = Isometry3::rotation_wrt_point(UnitQuaternion::new(axis), pelvis);
            AlignedBody {
                pose: Pose {
                    root: Rigid::new(about * last.root.iso()),
                    angles: last.angles.clone(),
                },
                shape: clothed.body.shape.clone(),
            }
        };
        let mut best = turned(0.0);
        let mut least = fit.error(&best);
        if self.skips && least < self.settings.facing {
            report.turns_skipped = TURNS.len();
            return best;
        }
        for turn in TURNS {
            let other = turned(turn);
            let error = fit.error(&other);
            if error < least {
                (best, least) = (other, error);
            }
        }
        best
    }

    /// Releases the surface from the model.
    fn released(
        &mut self,
        scan: &BodyScan,
        fit: &mut ModelFit<'_>,
        body: AlignedBody,
        report: AlignmentReport,
        stages: &[SurfaceStage],
    ) -> Result<Alignment, CaptureError> {
        let model_error = fit.error(&body);
        let PosedSurface { vertices, bones } = fit.posed(&body);
        let (model, mut surface) = (vertices.clone(), vertices);
        // The first scan makes the clothed template; nothing is skipped in it.
        let skips = self.skips && self.last.is_some();
        let fitted = self.free.run(scan, &model, &mut surface, stages, skips)?;
        let points = scan.points.len().max(1) as f64;
        Ok(Alignment {
            body,
            bones,
            model,
            surface,
            matches: self.free.matches().to_vec(),
            report: AlignmentReport {
                model_error,
                surface_error: fitted.error,
                explained: fitted.paired as f64 / points,
                queries: fitted.queries,
                vertices: fitted.vertices,
                ..report
            },
        })
    }
}

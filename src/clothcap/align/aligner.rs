//! Single-mesh alignment of a sequence: the first scan gives the clothed template, later ones are coupled to it.

use super::active_vertices::VertexCounts;
use super::arms::search_lost_arms;
use super::free_surface::{FreeSurface, SurfaceFitConfig};
use super::legs::leg_topology;
use super::model_fit::{AlignedBody, FitStage, ModelFit};
use super::scan_pairing::{QueryCounts, SurfaceMatch};
use super::start::{Start, find_person};
use crate::CaptureError;
use crate::scan::BodyScan;
use crate::topology::{ClothTemplate, LegTopology};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;
use tryon_body::{BoneTransforms, Pose, PosedSkin, Template};
use tryon_geometry::math::{P3, Rigid, World};

/// BodyScan points in a fit of the model.
const SAMPLES: usize = 6000;
/// BodyScan points in a fit of a later pose.
const LATER_SAMPLES: usize = 3000;
/// Stages of a later pose.
const LATER: [FitStage; 2] = [FitStage::posed(0.08, 8), FitStage::posed(0.03, 10)];
/// Turns about the vertical between two scans that are tried, radians.
const TURNS: [f64; 3] = [FRAC_PI_2, PI, -FRAC_PI_2];
/// Mean robust distance in the last pose below which no turn is tried, metres: a back is farther from a front.
const FACING: f64 = 0.02;
/// Mean robust distance above which a later pose is lost and the person is searched anew, metres.
const LOST: f64 = 0.03;

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

/// Body in a later scan.
struct LaterPose {
    body: AlignedBody,
    /// The person was searched from nothing.
    searched: bool,
    /// Turns about the vertical that were not tried.
    turns_skipped: usize,
}

/// Aligns the scans of one subject in order.
#[derive(Debug)]
pub struct Aligner {
    template: Arc<Template>,
    cloth: ClothTemplate,
    free: FreeSurface,
    clothed: Option<ClothedTemplate>,
    /// Person of the first scan, if found before.
    start: Option<Start>,
    /// Pose of the last scan.
    last: Option<AlignedBody>,
    /// Settled points keep their faces, and turns are tried only where they may help.
    skips: bool,
}

impl Aligner {
    /// Aligner before the first scan.
    ///
    /// # Errors
    /// [`CaptureError::Solve`] for a template too large.
    pub fn new(template: Arc<Template>) -> Result<Self, CaptureError> {
        Ok(Self {
            cloth: ClothTemplate::new(&template, LegTopology::Apart)?,
            free: FreeSurface::new(&template)?,
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
        clothed: ClothedTemplate,
        last: AlignedBody,
    ) -> Result<Self, CaptureError> {
        let mut out = Self::new(template)?;
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
            self.free = FreeSurface::new(self.cloth.template())?;
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
        let template = self.template.clone();
        let start = match self.start.take() {
            Some(start) => start,
            None => find_person(&template, scan)?,
        };
        let mut fit = ModelFit::new(&template, scan, SAMPLES);
        let mut body = start.body;
        for stage in &FitStage::FINE {
            fit.run(&mut body, stage)?;
        }
        if search_lost_arms(&template, scan, &mut fit, &mut body)? {
            for stage in &FitStage::FINE[1..] {
                fit.run(&mut body, stage)?;
            }
        }
        self.cut(leg_topology(&template, scan, &body)?)?;
        let template = self.cloth.template().clone();
        let mut fit = ModelFit::new(&template, scan, SAMPLES);
        let out = self.released(scan, &mut fit, body, &SurfaceFitConfig::default())?;
        let nodes = 0..out.surface.len();
        self.clothed = Some(ClothedTemplate {
            legs: self.cloth.legs(),
            rest: PosedSkin::new(&template, &out.bones).unpose(nodes, &out.surface),
            body: out.body.clone(),
        });
        Ok(Alignment {
            report: AlignmentReport {
                searched: true,
                ..out.report
            },
            ..out
        })
    }

    /// Stage 2: pose by the clothed template, then the free surface coupled to it (eq. 9, 10).
    fn later(
        &mut self,
        scan: &BodyScan,
        clothed: &ClothedTemplate,
    ) -> Result<Alignment, CaptureError> {
        let template = self.cloth.template().clone();
        let fit = ModelFit::new(&template, scan, LATER_SAMPLES).with_clothed(&clothed.rest);
        let mut fit = fit.with_starts(self.skips);
        let found = self.later_pose(scan, clothed, &mut fit)?;
        let out = self.released(scan, &mut fit, found.body, &SurfaceFitConfig::later())?;
        Ok(Alignment {
            report: AlignmentReport {
                searched: found.searched,
                turns_skipped: found.turns_skipped,
                ..out.report
            },
            ..out
        })
    }

    /// Pose by the clothed template, from that of the last scan.
    fn later_pose(
        &self,
        scan: &BodyScan,
        clothed: &ClothedTemplate,
        fit: &mut ModelFit<'_>,
    ) -> Result<LaterPose, CaptureError> {
        let last = &self.last.as_ref().unwrap_or(&clothed.body).pose;
        let (mut body, turns_skipped) = self.turned(last, clothed, fit);
        for stage in &LATER {
            fit.run(&mut body, stage)?;
        }
        if search_lost_arms(&self.template, scan, fit, &mut body)? {
            fit.run(&mut body, &LATER[1])?;
        }
        let searched = !(fit.error(&body) < LOST);
        if searched {
            let found = find_person(&self.template, scan)?;
            let mut other = AlignedBody {
                pose: found.body.pose,
                shape: clothed.body.shape.clone(),
            };
            for stage in &LATER {
                fit.run(&mut other, stage)?;
            }
            if fit.error(&other) < fit.error(&body) {
                body = other;
            }
        }
        Ok(LaterPose {
            body,
            searched,
            turns_skipped,
        })
    }

    /// Body of the first scan in the last pose, turned about the vertical to the direction that fits best: a back looks
    /// much like a front to closest points. Beside it the number of turns that were not tried.
    fn turned(
        &self,
        last: &Pose<World>,
        clothed: &ClothedTemplate,
        fit: &mut ModelFit<'_>,
    ) -> (AlignedBody, usize) {
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
        if self.skips && least < FACING {
            return (best, TURNS.len());
        }
        for turn in TURNS {
            let other = turned(turn);
            let error = fit.error(&other);
            if error < least {
                (best, least) = (other, error);
            }
        }
        (best, 0)
    }

    /// Releases the surface from the model.
    fn released(
        &mut self,
        scan: &BodyScan,
        fit: &mut ModelFit<'_>,
        body: AlignedBody,
        config: &SurfaceFitConfig,
    ) -> Result<Alignment, CaptureError> {
        let model_error = fit.error(&body);
        let (model, bones) = fit.posed(&body);
        let mut surface = model.clone();
        let mut config = config.clone();
        if !self.skips {
            (config.settled, config.still) = (0.0, 0.0);
        }
        let report = self.free.run(scan, &model, &mut surface, &config)?;
        let points = scan.points.len().max(1) as f64;
        Ok(Alignment {
            body,
            bones,
            model,
            surface,
            matches: self.free.matches().to_vec(),
            report: AlignmentReport {
                model_error,
                surface_error: report.error,
                explained: report.paired as f64 / points,
                searched: false,
                queries: report.queries,
                vertices: report.vertices,
                turns_skipped: 0,
            },
        })
    }
}

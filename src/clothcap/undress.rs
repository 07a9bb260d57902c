//! Body under the cloth (section 5.4): inside of all garments, tight to the visible skin, near the minimally clothed shape.

use super::CaptureError;
use super::align::{
    AlignedBody, EVEN_EDGE, FitStage, ModelFit, Pull, PullPlace, SETTLED, ScanPairing, ScanPoints,
    SurfaceFit, SurfaceTerms, fit_shared_shape,
};
use super::multi::MultiCloth;
use super::retarget::SolidBody;
use super::scan::BodyScan;
use std::sync::Arc;
use tryon_body::{BodyShape, BoneTransforms, Template};
use tryon_geometry::math::P3;
use tryon_geometry::par::{self, Par};

/// Scan points in the fit of the shape.
const SAMPLES: usize = 6000;
/// Stages of the shape's fit.
const STAGES: [FitStage; 2] = [
    FitStage::shaped(0.05, 10, FREEDOM),
    FitStage::shaped(0.03, 12, FREEDOM),
];
/// Freedom of the pose: the aligned one is right to a few degrees, and loose cloth does not hold limbs.
const FREEDOM: f64 = 0.1;
/// Scan points in the fit of a later pose.
const LATER_SAMPLES: usize = 3000;
/// Stage of a later pose.
const LATER: FitStage = FitStage {
    freedom: FREEDOM,
    ..FitStage::posed(0.03, 8)
};
/// Distance that the body keeps below cloth, metres.
const MARGIN: f32 = 0.003;
/// Coupling length to the minimally clothed shape, metres.
const COUPLING: f64 = 0.03;
/// Width of the kernel on skin, metres.
const SIGMA: f64 = 0.02;
/// Iterations of the free surface.
const ITERATIONS: usize = 6;
/// Most scan points in an iteration.
const POINTS: usize = 30_000;
/// Pull to the minimally clothed shape beside the data's.
const ANCHOR: f64 = 0.02;
/// Weight of a garment vertex that the body comes through, beside its area.
const PUSH: f64 = 4.0;

/// Body under the cloth of one scan.
#[derive(Clone, Debug)]
pub struct Undressed {
    /// Minimally clothed shape with its pose.
    pub body: AlignedBody,
    /// Bones of its pose.
    pub bones: BoneTransforms,
    /// Posed vertices, world, metres, shape `[vertices]`.
    pub vertices: Vec<P3>,
}

/// Scan that the minimally clothed shape is fitted to.
#[derive(Clone, Copy, Debug)]
pub(super) struct ShapeScan<'a> {
    /// Scan.
    pub(super) scan: &'a BodyScan,
    /// Points on garments, shape `[points]`.
    pub(super) covered: &'a [bool],
    /// Aligned body.
    pub(super) body: &'a AlignedBody,
}

/// Minimally clothed shape of the subject, with its pose in the first scan: inside of the cloth of all scans, tight where
/// any shows skin.
///
/// # Errors
/// [`CaptureError::Solve`].
pub(super) fn minimally_clothed(
    template: &Arc<Template>,
    scans: &[ShapeScan<'_>],
) -> Result<AlignedBody, CaptureError> {
    let fit = |s: &ShapeScan<'_>| ModelFit::new(template, s.scan, SAMPLES).with_covered(s.covered);
    let mut fits: Vec<ModelFit<'_>> = scans.iter().map(fit).collect();
    let mut bodies: Vec<AlignedBody> = scans.iter().map(|s| s.body.clone()).collect();
    for stage in &STAGES {
        fit_shared_shape(template, &mut fits, &mut bodies, stage)?;
    }
    bodies.into_iter().next().ok_or(CaptureError::NoGarment)
}

/// Shape of the subject from a scan in minimal clothing (section 5.4), `start` a person found in it.
///
/// # Errors
/// [`CaptureError::Solve`].
pub fn minimal_shape(
    template: &Arc<Template>,
    scan: &BodyScan,
    start: &AlignedBody,
) -> Result<BodyShape, CaptureError> {
    let mut body = start.clone();
    // All of it counts as skin: tight, on both sides.
    let skin = vec![false; scan.points.len()];
    let mut fit = ModelFit::new(template, scan, SAMPLES).with_covered(&skin);
    for stage in FitStage::FINE.iter().chain(&STAGES) {
        fit.run(&mut body, stage)?;
    }
    Ok(body.shape)
}

/// Minimally clothed body in a later scan, from the aligned pose: that one belongs to the clothed template, whose joints
/// lie elsewhere. The shape stays. With skips, searches start where the last ones ended.
///
/// # Errors
/// [`CaptureError::Solve`].
pub(super) fn posed_under_cloth(
    template: &Arc<Template>,
    scan: &BodyScan,
    covered: &[bool],
    start: AlignedBody,
    skips: bool,
) -> Result<AlignedBody, CaptureError> {
    let fit = ModelFit::new(template, scan, LATER_SAMPLES).with_covered(covered);
    let mut fit = fit.with_starts(skips);
    let mut body = start.clone();
    fit.run(&mut body, &LATER)?;
    Ok(AlignedBody {
        pose: body.pose,
        ..start
    })
}

/// Garments of one scan, posed.
#[derive(Clone, Copy, Debug)]
pub(super) struct WornGarments<'a> {
    /// Topology and body vertices.
    pub(super) cloth: &'a MultiCloth,
    /// Posed vertices of each, world, metres.
    pub(super) vertices: &'a [Vec<P3>],
}

impl WornGarments<'_> {
    /// Pulls of a body below the garments that it comes through.
    fn pushes(&self, solid: &SolidBody, weight: f64) -> Vec<Pull> {
        let mut pushes = Vec::new();
        for (part, own) in self.cloth.parts.iter().zip(self.vertices) {
            let mut hits = Vec::new();
            par::map_into(Par::Rayon, own.len(), 128, &mut hits, |i| {
                let hit = solid.below(&own[i], part.below[i]);
                (!part.hidden[i] && hit.signed_distance < MARGIN).then_some(hit)
            });
            pushes.extend(own.iter().zip(hits).filter_map(|(p, hit)| {
                let hit = hit?;
                Some(Pull {
                    at: PullPlace::Face(hit.face, hit.weights),
                    weight,
                    target: p - hit.normal * MARGIN,
                })
            }));
        }
        pushes
    }
}

/// Estimates bodies under the cloth of the scans of one subject.
#[derive(Debug)]
pub(super) struct Undresser {
    template: Arc<Template>,
    fit: SurfaceFit,
    pairing: ScanPairing,
    solid: SolidBody,
}

impl Undresser {
    /// Prepares the system of a template.
    ///
    /// # Errors
    /// [`CaptureError::Solve`] for a template too large.
    pub(super) fn new(template: Arc<Template>) -> Result<Self, CaptureError> {
        let (vertices, faces) = (template.mesh().vertices(), template.mesh().faces());
        let stage = "body under cloth";
        Ok(Self {
            fit: SurfaceFit::new(stage, vertices.len(), faces, |_| EVEN_EDGE, Vec::new())?,
            pairing: ScanPairing::new(faces, vertices, false),
            solid: SolidBody::new(&template)?,
            template,
        })
    }

    /// Body under the cloth of one scan, near the minimally clothed shape `body` in its pose. With skips, settled points
    /// keep their faces.
    ///
    /// # Errors
    /// [`CaptureError::Solve`].
    pub(super) fn run(
        &mut self,
        (scan, covered): (&BodyScan, &[bool]),
        garments: WornGarments<'_>,
        body: AlignedBody,
        skips: bool,
    ) -> Result<Undressed, CaptureError> {
        let (model, bones) = ModelFit::new(&self.template, scan, 1).posed(&body);
        let mut vertices = model.clone();
        let area = self.template.mesh().area();
        let vertex = area / model.len().max(1) as f64;
        let points = ScanPoints {
            left_out: covered,
            ..ScanPoints::of(scan, scan.points.len().div_ceil(POINTS))
        };
        let settled = if skips { SETTLED } else { 0.0 };
        self.pairing.begin(scan.points.len(), settled);
        let terms = SurfaceTerms {
            model: &model,
            coupling: COUPLING,
            smoothness: &[],
            anchor: ANCHOR * vertex,
            iterations: ITERATIONS,
            converged: 0.0,
            still: 0.0,
        };
        self.fit.run(&terms, &mut vertices, |x| {
            let matches = self.pairing.pair(&points, x, SIGMA);
            let mut pulls: Vec<Pull> = points.pulls(&matches, area).collect();
            self.solid.place_unseparated(x)?;
            pulls.extend(garments.pushes(&self.solid, PUSH * vertex));
            Ok(Some(pulls))
        })?;
        Ok(Undressed {
            body,
            bones,
            vertices,
        })
    }
}

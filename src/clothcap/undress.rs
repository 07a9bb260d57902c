//! Body under the cloth (section 5.4): inside of all garments, tight to the visible skin, near the minimally clothed shape.

use super::CaptureError;
use super::align::{
    AlignedBody, EVEN_EDGE, ModelFit, PosedSurface, Pull, PullPlace, ScanPairing, ScanPoints,
    SurfaceFit, SurfaceTerms, fit_shared_shape,
};
use super::multi::MultiCloth;
use super::retarget::SolidBody;
use super::scan::BodyScan;
use super::settings::{AlignmentSettings, ModelFitSettings, PenetrationSettings, UndressSettings};
use std::sync::Arc;
use tryon_body::{BodyShape, BoneTransforms, PosedSkin, Template};
use tryon_geometry::math::P3;
use tryon_geometry::par::{self, Par};

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

impl Undressed {
    /// Its vertices in the rest pose, metres.
    pub(super) fn rest(&self, template: &Template) -> Vec<P3> {
        let all = 0..self.vertices.len();
        PosedSkin::new(template, &self.bones).unpose(all, &self.vertices)
    }
}

/// Scan with the points that lie on garments.
#[derive(Clone, Copy, Debug)]
pub(super) struct CoveredScan<'a> {
    pub(super) scan: &'a BodyScan,
    /// Points on garments, shape `[points]`.
    pub(super) covered: &'a [bool],
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
    let (align, settings) = (AlignmentSettings::default(), UndressSettings::default());
    let mut body = start.clone();
    // All of it counts as skin: tight, on both sides.
    let skin = vec![false; scan.points.len()];
    let fit = ModelFit::new(template, scan, settings.samples, &align.model);
    let mut fit = fit.with_covered(&skin);
    fit.run_all(&mut body, &align.fine)?;
    fit.run_all(&mut body, &settings.stages)?;
    Ok(body.shape)
}

/// Pulls of a body to `margin` (m) below posed garments that it comes through; `vertices` are those of each, world, metres.
fn pushes(
    cloth: &MultiCloth,
    vertices: &[Vec<P3>],
    solid: &SolidBody,
    weight: f64,
    margin: f32,
) -> Vec<Pull> {
    let mut pushes = Vec::new();
    for (part, own) in cloth.parts.iter().zip(vertices) {
        let mut pulls = Vec::new();
        par::map_into(Par::Rayon, own.len(), 128, &mut pulls, |i| {
            let hit = solid.below(&own[i], part.below[i]);
            let is_through = !part.hidden[i] && hit.signed_distance < margin;
            is_through.then(|| Pull {
                at: PullPlace::Face(hit.face, hit.weights),
                weight,
                target: own[i] - hit.normal * margin,
            })
        });
        pushes.extend(pulls.into_iter().flatten());
    }
    pushes
}

/// Estimates bodies under the cloth of the scans of one subject.
#[derive(Debug)]
pub(super) struct Undresser {
    template: Arc<Template>,
    model: ModelFitSettings,
    settings: UndressSettings,
    fit: SurfaceFit,
    pairing: ScanPairing,
    solid: SolidBody,
}

impl Undresser {
    pub(super) fn new(
        template: Arc<Template>,
        model: ModelFitSettings,
        settings: UndressSettings,
        penetration: PenetrationSettings,
    ) -> Result<Self, CaptureError> {
        let (vertices, faces) = (template.mesh().vertices(), template.mesh().faces());
        let stage = "body under cloth";
        Ok(Self {
            fit: SurfaceFit::new(stage, vertices.len(), faces, |_| EVEN_EDGE, Vec::new())?,
            pairing: ScanPairing::new(faces, vertices, false),
            solid: SolidBody::new(&template, penetration)?,
            model,
            settings,
            template,
        })
    }

    /// Minimally clothed shape of the subject, with its pose in the first scan: inside of the cloth of all scans, tight on
    /// skin that any shows. `bodies` are the aligned ones, shape `[scans]`.
    pub(super) fn minimally_clothed(
        &self,
        scans: &[CoveredScan<'_>],
        mut bodies: Vec<AlignedBody>,
    ) -> Result<AlignedBody, CaptureError> {
        let settings = &self.settings;
        let fit = |s: &CoveredScan<'_>| self.model_fit(s, settings.samples);
        let mut fits: Vec<ModelFit<'_>> = scans.iter().map(fit).collect();
        for stage in &settings.stages {
            fit_shared_shape(&self.template, &self.model, &mut fits, &mut bodies, stage)?;
        }
        bodies.into_iter().next().ok_or(CaptureError::NoGarment)
    }

    fn model_fit(&self, scan: &CoveredScan<'_>, samples: usize) -> ModelFit<'_> {
        ModelFit::new(&self.template, scan.scan, samples, &self.model).with_covered(scan.covered)
    }

    /// Minimally clothed body in a later scan, from the aligned pose: that one belongs to the clothed template, whose joints
    /// lie elsewhere. The shape stays. With skips, searches start at the faces of the last ones.
    pub(super) fn posed_under_cloth(
        &self,
        scan: &CoveredScan<'_>,
        start: AlignedBody,
        skips: bool,
    ) -> Result<AlignedBody, CaptureError> {
        let settings = &self.settings;
        let fit = self.model_fit(scan, settings.later_samples);
        let mut body = start.clone();
        fit.with_starts(skips).run(&mut body, &settings.later)?;
        Ok(AlignedBody {
            pose: body.pose,
            ..start
        })
    }

    /// Body under the cloth of one scan, near the minimally clothed shape `body` in its pose. With skips, settled points
    /// keep their faces.
    pub(super) fn run(
        &mut self,
        scan: &CoveredScan<'_>,
        cloth: &MultiCloth,
        garments: &[Vec<P3>],
        body: AlignedBody,
        skips: bool,
    ) -> Result<Undressed, CaptureError> {
        let settings = &self.settings;
        let PosedSurface { vertices, bones } = body.posed(&self.template);
        let (model, mut vertices) = (vertices.clone(), vertices);
        let area = self.template.mesh().area();
        let vertex = area / model.len().max(1) as f64;
        let count = scan.scan.points.len();
        let points = ScanPoints {
            left_out: scan.covered,
            ..ScanPoints::of(scan.scan, count.div_ceil(settings.points))
        };
        let fit = settings.fit.skipping(skips);
        self.pairing.begin(count, &fit);
        let terms = SurfaceTerms {
            model: &model,
            coupling: settings.coupling,
            smoothness: &[],
            anchor: settings.anchor * vertex,
            iterations: settings.iterations,
            settings: &fit,
        };
        self.fit.run(&terms, &mut vertices, |x| {
            let matches = self.pairing.pair(&points, x, settings.sigma);
            self.solid.place_unseparated(x)?;
            let weight = settings.push * vertex;
            let pushes = pushes(cloth, garments, &self.solid, weight, settings.margin);
            Ok(Some(points.pulls(&matches, area).chain(pushes).collect()))
        })?;
        Ok(Undressed {
            body,
            bones,
            vertices,
        })
    }
}

//! Body under the cloth (section 5.4): inside of all garments, tight to the visible skin, near the minimally clothed shape.

use super::CaptureError;
use super::align::{
    AlignedBody, EVEN_EDGE, FaceCache, FitStage, ModelFit, QuadraticEnergy, QueryPoints,
    QuerySurface, SETTLED, Stencil, fit_shared_shape,
};
use super::multi::MultiCloth;
use super::retarget::SolidBody;
use super::scan::BodyScan;
use std::sync::Arc;
use tryon_body::{BodyShape, BoneTransforms, Template};
use tryon_geometry::math::P3;
use tryon_geometry::mesh::face_normal;
use tryon_geometry::par::{self, Par};
use tryon_geometry::spatial::Bvh;
use tryon_tracking::registration::GemanMcClure;

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
/// Smallest cosine between normals of a pair.
const NORMALS: f32 = 0.2;

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

/// Estimates bodies under the cloth of the scans of one subject.
#[derive(Debug)]
pub(super) struct Undresser {
    template: Arc<Template>,
    energy: QuadraticEnergy,
    edges: Vec<[u32; 2]>,
    bvh: Bvh,
    solid: SolidBody,
}

impl Undresser {
    /// Prepares the system of a template.
    ///
    /// # Errors
    /// [`CaptureError::Solve`] for a template too large.
    pub(super) fn new(template: Arc<Template>) -> Result<Self, CaptureError> {
        let mesh = template.mesh();
        let edges: Vec<[u32; 2]> = template.topology().edges().iter().map(|e| e.v).collect();
        let stencils = edges.iter().map(|e| Stencil::edge(*e, EVEN_EDGE)).collect();
        Ok(Self {
            energy: QuadraticEnergy::new(mesh.vertices().len(), stencils, mesh.faces())?,
            bvh: Bvh::new(mesh.faces(), mesh.vertices()),
            solid: SolidBody::new(&template)?,
            edges,
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
        let template = self.template.clone();
        let (model, bones) = ModelFit::new(&template, scan, 1).posed(&body);
        let mut vertices = model.clone();
        let settled = if skips { SETTLED } else { 0.0 };
        let mut cache = FaceCache::new(scan.points.len(), settled);
        for _ in 0..ITERATIONS {
            self.begin(&model);
            self.add_skin((scan, covered), &vertices, &mut cache);
            self.add_garments(garments, &vertices)?;
            vertices = self.energy.minimise("body under cloth")?;
        }
        Ok(Undressed {
            body,
            bones,
            vertices,
        })
    }

    fn area_of_vertex(&self) -> f64 {
        let mesh = self.template.mesh();
        mesh.area() / mesh.vertices().len().max(1) as f64
    }

    fn begin(&mut self, model: &[P3]) {
        self.energy.reset();
        for (k, e) in self.edges.iter().enumerate() {
            let d = (model[e[0] as usize] - model[e[1] as usize]).cast::<f64>();
            self.energy.add_stencil(k, COUPLING * COUPLING, d.into());
        }
        let anchor = ANCHOR * self.area_of_vertex();
        for (v, p) in model.iter().enumerate() {
            self.energy.add_vertex(v as u32, anchor, p);
        }
    }

    /// Pulls the body to the visible skin.
    fn add_skin(
        &mut self,
        (scan, covered): (&BodyScan, &[bool]),
        vertices: &[P3],
        cache: &mut FaceCache,
    ) {
        self.bvh.refit(vertices);
        cache.advance(self.bvh.faces(), vertices);
        let query = QuerySurface {
            tree: &self.bvh,
            vertices,
            around: self.template.topology().vertex_faces(),
        };
        let stride = scan.points.len().div_ceil(POINTS).max(1);
        let count = scan.points.len().div_ceil(stride);
        let points = QueryPoints {
            points: &scan.points,
            normals: &scan.normals,
            oriented: scan.oriented,
            stride,
            left_out: covered,
        };
        let kernel = GemanMcClure { sigma: SIGMA };
        let point = self.template.mesh().area() / count.max(1) as f64;
        for (i, of_scan, found) in cache.closest_each(&query, &points, NORMALS) {
            let Some(at) = found else {
                continue;
            };
            let own = face_normal(vertices, &self.bvh.faces()[at.face as usize]);
            let unit = own.try_normalize(f32::MIN_POSITIVE);
            if unit.is_some_and(|own| of_scan.agrees(&own, NORMALS)) {
                let weight = point * kernel.weight(f64::from(at.distance * at.distance));
                self.energy
                    .add_face_point(at.face, at.weights, weight, &scan.points[i]);
            }
        }
    }

    /// Pushes the body below garments that it comes through.
    fn add_garments(
        &mut self,
        garments: WornGarments<'_>,
        vertices: &[P3],
    ) -> Result<(), CaptureError> {
        self.solid.place_unseparated(vertices)?;
        let weight = PUSH * self.area_of_vertex();
        for (part, own) in garments.cloth.parts.iter().zip(garments.vertices) {
            let mut hits = Vec::new();
            par::map_into(Par::Rayon, own.len(), 128, &mut hits, |i| {
                let hit = self.solid.below(&own[i], part.below[i]);
                (!part.hidden[i] && hit.signed_distance < MARGIN).then_some(hit)
            });
            for (p, hit) in own.iter().zip(hits) {
                if let Some(hit) = hit {
                    let target = p - hit.normal * MARGIN;
                    self.energy
                        .add_face_point(hit.face, hit.weights, weight, &target);
                }
            }
        }
        Ok(())
    }
}

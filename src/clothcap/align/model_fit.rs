//! Pose, bone lengths and shape coefficients that explain a scan: eq. 3 with infinite coupling, and the poses of eq. 9.

use super::jacobian::{JacobianRows, Match};
use super::unknowns::{AnglePriors, ShapeUnknown, ShapeUnknowns};
use crate::CaptureError;
use crate::dense_equations::DenseEquations;
use crate::scalp::scalp;
use crate::scan::{BodyScan, agree};
use crate::settings::{FitStage, ModelFitSettings};
use nalgebra::DVector;
use serde::{Deserialize, Serialize};
use tryon_body::parts::BodySegment;
use tryon_body::{BodyShape, BoneTransforms, MovedRest, Pose, RestBody, Template, skin_moved};
use tryon_geometry::math::{P3, V3, World};
use tryon_geometry::par::{self, Par};
use tryon_geometry::spatial::{Bvh, WarmQuery};
use tryon_tracking::registration::{GemanMcClure, apply, linearise};

/// Name of the solve in faults.
pub(super) const STAGE: &str = "body model";

/// Posed and shaped body in the frame of the scan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AlignedBody {
    /// Pose.
    pub pose: Pose<World>,
    /// Shape coefficients and bone scales.
    pub shape: BodyShape,
}

impl AlignedBody {
    /// Surface and bones of the body without displacements.
    pub fn posed(&self, template: &Template) -> PosedSurface {
        let mut out = PosedSurface::default();
        out.place(template, &self.pose, &rest_of(template, &self.shape), None);
        out
    }
}

/// Rest body of a shape without displacements, metres.
fn rest_of(template: &Template, shape: &BodyShape) -> RestBody {
    let all: Vec<u32> = (0..template.mesh().vertices().len() as u32).collect();
    let (vertices, joints) = template.personalise_some(shape, &all);
    RestBody {
        vertices,
        joints,
        ..RestBody::default()
    }
}

/// Surface of a body in a pose.
#[derive(Clone, Debug, Default)]
pub struct PosedSurface {
    /// Vertices, metres, shape `[vertices]`.
    pub vertices: Vec<P3>,
    /// Bones of the pose.
    pub bones: BoneTransforms,
}

impl PosedSurface {
    /// Poses a rest body; `offsets` are its pose blend shapes if they are known, since shape leaves them as they are.
    fn place(
        &mut self,
        template: &Template,
        pose: &Pose<World>,
        rest: &RestBody,
        offsets: Option<&[V3]>,
    ) {
        let (out, bones) = (&mut self.vertices, &mut self.bones);
        pose.bones(template.skeleton(), rest, bones);
        match offsets {
            Some(offsets) => {
                let moved = MovedRest {
                    vertices: &rest.vertices,
                    offsets,
                };
                skin_moved(Par::Rayon, moved, template.weights(), bones, out);
            }
            None => template.pose_vertices(Par::Rayon, &rest.vertices, bones, out),
        }
    }
}

/// Fit of the body model to some points of a scan.
#[derive(Debug)]
pub struct ModelFit<'a> {
    template: &'a Template,
    settings: ModelFitSettings,
    /// Rest vertices that replace the template's: the clothed template of eq. 8.
    clothed: Option<&'a [P3]>,
    points: Vec<P3>,
    normals: Vec<V3>,
    oriented: bool,
    /// Points on cloth: the body lies inside, loosely; empty if none do.
    covered: Vec<bool>,
    stride: usize,
    /// Face on which each point lay last.
    near: Vec<Option<u32>>,
    /// Searches start there: of two faces equally near, another one may be found.
    starts_near: bool,
    bare: Vec<bool>,
    scalp: Vec<bool>,
    bvh: Bvh,
    /// Shape of the last pose and its rest body.
    rest: Option<(BodyShape, RestBody)>,
    posed: PosedSurface,
    angles: AnglePriors,
}

impl<'a> ModelFit<'a> {
    /// Prepares a fit to about `samples` evenly chosen points.
    pub fn new(
        template: &'a Template,
        scan: &BodyScan,
        samples: usize,
        settings: &ModelFitSettings,
    ) -> Self {
        let stride = (scan.points.len() / samples.max(1)).max(1);
        let mesh = template.mesh();
        let points: Vec<P3> = scan.points.iter().step_by(stride).copied().collect();
        Self {
            template,
            settings: *settings,
            clothed: None,
            near: vec![None; points.len()],
            starts_near: false,
            points,
            normals: scan.normals.iter().step_by(stride).copied().collect(),
            oriented: scan.oriented,
            covered: Vec::new(),
            stride,
            bare: bare_vertices(template),
            scalp: scalp(template),
            bvh: Bvh::new(mesh.faces(), mesh.vertices()),
            rest: None,
            posed: PosedSurface::default(),
            angles: AnglePriors::new(template, settings),
        }
    }

    /// The same with rest vertices of a clothed template; shape is then not fitted.
    pub fn with_clothed(mut self, rest: &'a [P3]) -> Self {
        self.clothed = Some(rest);
        self
    }

    /// The same with searches that start where the last one ended.
    pub(crate) fn with_starts(mut self, starts_near: bool) -> Self {
        self.starts_near = starts_near;
        self
    }

    /// The same with scan points on cloth, shape `[points]` of the scan: the body stays inside of them (section 5.4).
    pub fn with_covered(mut self, covered: &[bool]) -> Self {
        self.covered = covered.iter().step_by(self.stride).copied().collect();
        self
    }

    /// Rest body of a shape, metres.
    pub(super) fn rest(&self, shape: &BodyShape) -> RestBody {
        let Some(clothed) = self.clothed else {
            return rest_of(self.template, shape);
        };
        RestBody {
            vertices: clothed.to_vec(),
            joints: self.template.personalise_some(shape, &[]).1,
            ..RestBody::default()
        }
    }

    /// Surface and bones of a body.
    pub fn posed(&self, body: &AlignedBody) -> PosedSurface {
        let mut out = PosedSurface::default();
        out.place(self.template, &body.pose, &self.rest(&body.shape), None);
        out
    }

    /// Mean robust distance of all points from the surface, metres.
    pub fn error(&mut self, body: &AlignedBody) -> f64 {
        self.place(body);
        let sigma = self.settings.compared_sigma;
        let kernel = GemanMcClure { sigma };
        let value = |m: &Match| match m.weight > 0.0 {
            true => kernel.value(m.residual.norm_squared()),
            false => sigma * sigma,
        };
        let sum: f64 = self.matches(&kernel).iter().map(value).sum();
        (sum / self.points.len().max(1) as f64).sqrt()
    }

    /// Poses the surface that matches are searched on.
    pub(super) fn place(&mut self, body: &AlignedBody) {
        // Only few updates change the shape.
        let kept = self.rest.take().filter(|(shape, _)| *shape == body.shape);
        let (shape, rest) = kept.unwrap_or_else(|| (body.shape.clone(), self.rest(&body.shape)));
        self.posed.place(self.template, &body.pose, &rest, None);
        self.rest = Some((shape, rest));
        self.bvh.refit(&self.posed.vertices);
    }

    /// Matches of all points, shape `[points]`; weight 0 for points without one.
    pub(super) fn matches(&mut self, kernel: &GemanMcClure) -> Vec<Match> {
        let mut out = Vec::new();
        par::map_into(Par::Rayon, self.points.len(), 128, &mut out, |i| {
            self.pair(i, kernel).unwrap_or_default()
        });
        if self.starts_near {
            let found = self.near.iter_mut().zip(&out);
            let found = found.filter(|(_, m)| m.weight > 0.0);
            found.for_each(|(near, m)| *near = Some(m.face));
        }
        out
    }

    fn pair(&self, i: usize, kernel: &GemanMcClure) -> Option<Match> {
        let (p, settings) = (self.points[i], &self.settings);
        let surface = WarmQuery {
            tree: &self.bvh,
            vertices: &self.posed.vertices,
            around: self.template.topology().vertex_faces(),
        };
        let agrees = |own: &V3| agree(&self.normals[i], own, self.oriented, settings.normals);
        let (found, normal) = surface.closest(&p, self.near[i], agrees)?;
        let face = self.bvh.faces()[found.face as usize];
        let mut residual = (p - found.point).cast::<f64>();
        let mut weight = kernel.weight(residual.norm_squared());
        let is_outside = residual.dot(&normal.cast()) > 0.0;
        if self.covered.get(i).copied().unwrap_or(false) {
            residual -= normal.cast() * settings.thickness;
            weight *= if is_outside { settings.loose } else { 1.0 };
        } else if is_outside && self.scalp[face[0] as usize] && self.clothed.is_none() {
            // Hair stands off the skin as cloth does.
            weight *= settings.unknown;
        } else if self.bare[face[0] as usize] {
            weight *= settings.bare;
        } else if is_outside && self.covered.is_empty() && self.clothed.is_none() {
            weight *= settings.unknown;
        }
        Some(Match {
            face: found.face,
            corners: found.weights,
            point: found.point.coords.cast(),
            normal: normal.cast(),
            residual,
            weight,
        })
    }

    /// Runs some stages; `body` is start and result.
    ///
    /// # Errors
    /// As [`ModelFit::run`].
    pub fn run_all(
        &mut self,
        body: &mut AlignedBody,
        stages: &[FitStage],
    ) -> Result<(), CaptureError> {
        stages.iter().try_for_each(|stage| self.run(body, stage))
    }

    /// Runs one stage; `body` is start and result.
    ///
    /// # Errors
    /// [`CaptureError::Solve`] if the normal matrix is singular or not finite.
    pub fn run(&mut self, body: &mut AlignedBody, stage: &FitStage) -> Result<(), CaptureError> {
        let start = body.pose.clone();
        let shaped = stage.shape && self.clothed.is_none();
        let unknowns = ShapeUnknowns::new(self.template, &self.settings, &mut body.shape, shaped);
        let prior = Prior {
            start: &start,
            unknowns: &unknowns,
            freedom: stage.freedom,
        };
        let kernel = GemanMcClure { sigma: stage.sigma };
        for _ in 0..stage.iterations {
            self.place(body);
            let matches = self.matches(&kernel);
            let mut system = self.system(body, &prior, &matches);
            unknowns.add_prior(&mut system, &body.shape);
            system.damp(&self.settings);
            let update = system.solve(STAGE)?;
            if self.update(body, &unknowns, &update) < self.settings.converged {
                break;
            }
        }
        Ok(())
    }

    /// Normal equations of the matches with the prior of the pose.
    pub(super) fn system(
        &self,
        body: &AlignedBody,
        prior: &Prior<'_>,
        matches: &[Match],
    ) -> DenseEquations {
        let centre = self.posed.bones.joints[0].coords;
        let mut dofs = Vec::new();
        let skeleton = self.template.skeleton();
        linearise(skeleton, &self.posed.bones, &body.pose, &centre, &mut dofs);
        let fields = self.shape_fields(body, prior.unknowns);
        let rows = JacobianRows {
            template: self.template,
            tangential: self.settings.tangential,
            dofs: &dofs,
            fields: &fields,
            centre,
        };
        let n = dofs.len() + prior.unknowns.all.len();
        let DenseEquations { mut h, mut g } = rows.normal_equations(matches, n);
        let (count, deviation) = (self.points.len().max(1) as f64, self.settings.deviation);
        let per_point = self.settings.independent / count / (deviation * deviation);
        h *= per_point;
        g *= per_point;
        for (k, deviation) in self.angles.deviations.iter().enumerate() {
            let (i, w) = (6 + k, (deviation * prior.freedom).powi(-2));
            h[(i, i)] += w;
            g[i] += w * (prior.start.angles[k] - body.pose.angles[k]);
            h[(i, i)] += self.angles.straight[k];
            g[i] -= self.angles.straight[k] * body.pose.angles[k];
        }
        DenseEquations { h, g }
    }

    /// Displacement of each posed vertex per unit of each shape unknown.
    fn shape_fields(&self, body: &AlignedBody, unknowns: &ShapeUnknowns) -> Vec<Vec<V3>> {
        let mut moved = PosedSurface::default();
        let step = self.settings.shape_step;
        let offsets = self.template.pose_offsets(&self.posed.bones);
        let offsets = offsets.map_or_else(Vec::new, |o| o.all(Par::Rayon));
        let field = |u: &ShapeUnknown| {
            let mut shape = body.shape.clone();
            *u.of(&mut shape) += step;
            let rest = self.rest(&shape);
            moved.place(self.template, &body.pose, &rest, Some(&offsets));
            let pairs = moved.vertices.iter().zip(&self.posed.vertices);
            pairs.map(|(a, b)| (a - b) / step as f32).collect()
        };
        unknowns.all.iter().map(field).collect()
    }

    /// Applies an update; its size, metres.
    pub(super) fn update(
        &self,
        body: &mut AlignedBody,
        unknowns: &ShapeUnknowns,
        x: &DVector<f64>,
    ) -> f64 {
        let first = 6 + self.angles.deviations.len();
        let centre = self.posed.bones.joints[0].coords;
        let skeleton = self.template.skeleton();
        apply(skeleton, &mut body.pose, &centre, x);
        body.pose.clamp_to_limits(skeleton);
        let angles = x.rows(3, first - 3).amax() * self.settings.lever;
        let mut moved = x.rows(0, 3).amax().max(angles);
        for (k, u) in unknowns.all.iter().enumerate() {
            let [low, high] = u.limits(&self.settings);
            let value = u.of(&mut body.shape);
            *value = (*value + x[first + k]).clamp(low, high);
            moved = moved.max(self.settings.shape_lever * x[first + k].abs());
        }
        moved
    }
}

pub(super) struct Prior<'a> {
    pub(super) start: &'a Pose<World>,
    pub(super) unknowns: &'a ShapeUnknowns,
    pub(super) freedom: f64,
}

/// Vertices of head, hands and feet, which mostly are bare, shape `[vertices]`.
pub(super) fn bare_vertices(template: &Template) -> Vec<bool> {
    use BodySegment::*;
    let segment = |v: usize| template.parts().segment(template.weights().dominant(v));
    let is_bare = |v| matches!(segment(v), Head | Hand | Fingers | Foot | Toes);
    (0..template.mesh().vertices().len()).map(is_bare).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_body::{PoseShapes, embedded};
    use tryon_formats::PoseFeature;
    use tryon_geometry::math::Rigid;

    fn bent(template: &Template, elbow: f64) -> AlignedBody {
        let mut pose = Pose::<World>::rest(template.skeleton(), Rigid::identity());
        pose.set(template.skeleton(), "left_elbow", &[elbow]);
        pose.set(template.skeleton(), "right_hip", &[-0.4]);
        AlignedBody {
            pose,
            shape: BodyShape::default(),
        }
    }

    /// Mean distance of a fitted pose's vertices from the true ones, metres.
    fn error_of_pose(template: Template) -> f32 {
        let points = bent(&template, 0.9).posed(&template).vertices;
        let scan = BodyScan {
            normals: vec![V3::zeros(); points.len()],
            points,
            ..BodyScan::default()
        };
        let mut fit = ModelFit::new(&template, &scan, 3000, &ModelFitSettings::default());
        let mut found = bent(&template, 0.5);
        let stages = [0.08, 0.03].map(|sigma| FitStage::posed(sigma, 10));
        fit.run_all(&mut found, &stages).expect("solved");
        let error = |(a, b): (&P3, &P3)| (a - b).norm();
        let errors = fit.posed(&found).vertices;
        errors.iter().zip(&scan.points).map(error).sum::<f32>() / errors.len() as f32
    }

    /// The Jacobian leaves pose blend shapes out; smooth ones of a centimetre leave the pose right to 1 mm.
    #[test]
    fn a_pose_is_found_with_pose_blend_shapes() {
        let plain = (*embedded::template()).clone();
        let j = plain.skeleton().len();
        let rows = plain.mesh().vertices().iter();
        let smooth = |p: &P3| {
            let phase = 6.0 * p.x + 8.0 * p.y;
            (0..27 * (j - 1)).map(move |k| 0.005 * (phase + k as f32).sin())
        };
        let directions = rows.clone().flat_map(smooth).collect();
        let n = rows.len();
        let shapes = PoseShapes::new([n, j], PoseFeature::Matrix, directions).expect("sizes fit");
        let shaped = plain.clone().with_pose_shapes(shapes).expect("sizes fit");
        let (without, with) = (error_of_pose(plain), error_of_pose(shaped));
        assert!(without < 5e-4 && with < 1e-3, "{without} {with}");
    }
}

//! Pose, bone lengths and shape coefficients that explain a scan: eq. 3 with infinite coupling, and the poses of eq. 9.

use super::angle_priors::{angle_deviations, straight_precisions};
use super::body_equations::BodyEquations;
use super::jacobian::{JacobianRows, Match};
use super::scan_pairing::ScanNormal;
use super::shape_unknowns::ShapeUnknowns;
use crate::CaptureError;
use crate::scalp::scalp;
use crate::scan::BodyScan;
use nalgebra::DVector;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use tryon_body::parts::BodySegment;
use tryon_body::{BodyShape, BoneTransforms, MovedRest, Pose, RestBody, Template, skin_moved};
use tryon_geometry::math::{P3, V3, World};
use tryon_geometry::par::{self, Par};
use tryon_geometry::spatial::{Bvh, WarmQuery};
use tryon_tracking::registration::{GemanMcClure, apply, linearise};

/// Standard deviation of a scan point from the body, metres, and number of independent ones: neighbours share the cloth
/// between. Their ratio weighs data against priors.
const DEVIATION: f64 = 0.012;
/// See [`DEVIATION`].
const INDEPENDENT: f64 = 800.0;
/// Step of the difference quotient of a shape coefficient and of a bone's scale.
const STEP: f64 = 0.02;
/// Smallest cosine between normals of a pair, for oriented scans.
const NORMALS: f32 = 0.3;
/// Thickness of a fabric with the air below it where it lies on the body, metres.
const THICKNESS: f64 = 0.003;
/// Weight of cloth outside the body beside cloth inside of it: garments hang away from the body, never into it.
const LOOSE: f64 = 0.06;
/// The same before the garments are known. At 1 a body slides down until it fills wide trousers.
const UNKNOWN: f64 = 0.3;
/// Weight of heads, hands and feet, which mostly are bare, beside the rest (w of eq. 5).
const BARE: f64 = 2.0;
/// Update below which a stage ends, metres at a lever of 25 cm.
pub(super) const CONVERGED: f64 = 1e-4;
/// See [`CONVERGED`].
const LEVER: f64 = 0.25;

/// Posed and shaped body in the frame of the scan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AlignedBody {
    /// Pose.
    pub pose: Pose<World>,
    /// Shape coefficients and bone scales.
    pub shape: BodyShape,
}

/// Unknowns, kernel and length of one stage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitStage {
    /// Width of the Geman–McClure kernel, metres.
    pub sigma: f64,
    /// Most iterations.
    pub iterations: usize,
    /// Fit shape coefficients and bone scales too.
    pub shape: bool,
    /// Factor on the standard deviations of joint angles from those of the start.
    pub freedom: f64,
}

impl FitStage {
    /// Stages that compare starts.
    pub const START: [Self; 2] = [Self::stage(0.15, 6, false), Self::stage(0.08, 6, true)];
    /// Stages after the start.
    pub const FINE: [Self; 3] = [
        Self::stage(0.10, 10, true),
        Self::stage(0.05, 12, true),
        Self::stage(0.03, 12, true),
    ];

    /// Stage of pose and shape.
    pub const fn shaped(sigma: f64, iterations: usize, freedom: f64) -> Self {
        Self {
            freedom,
            ..Self::stage(sigma, iterations, true)
        }
    }

    /// Stage of the pose alone.
    pub const fn posed(sigma: f64, iterations: usize) -> Self {
        Self::stage(sigma, iterations, false)
    }

    const fn stage(sigma: f64, iterations: usize, shape: bool) -> Self {
        Self {
            sigma,
            iterations,
            shape,
            freedom: 1.0,
        }
    }
}

/// Report of one stage.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ModelFitReport {
    /// Iterations.
    pub iterations: usize,
    /// Last update fell below the bound.
    pub converged: bool,
    /// Mean robust distance of paired points from the surface, metres.
    pub error: f64,
    /// Points with a partner.
    pub paired: usize,
}

/// Fit of the body model to some points of a scan.
#[derive(Debug)]
pub struct ModelFit<'a> {
    template: &'a Arc<Template>,
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
    /// Vertices of head, hands and feet.
    bare: Vec<bool>,
    /// Vertices below hair.
    scalp: Vec<bool>,
    bvh: Bvh,
    /// Shape of the last pose and its rest body.
    rest: Option<(BodyShape, RestBody)>,
    posed: Vec<P3>,
    bones: BoneTransforms,
    deviations: Vec<f64>,
    straight: Vec<f64>,
}

impl<'a> ModelFit<'a> {
    /// Prepares a fit to about `samples` evenly chosen points.
    pub fn new(template: &'a Arc<Template>, scan: &BodyScan, samples: usize) -> Self {
        let stride = (scan.points.len() / samples.max(1)).max(1);
        let pick = |v: &[P3]| v.iter().step_by(stride).copied().collect::<Vec<_>>();
        let mesh = template.mesh();
        let points = pick(&scan.points);
        Self {
            template,
            clothed: None,
            near: vec![None; points.len()],
            starts_near: false,
            points,
            normals: scan.normals.iter().step_by(stride).copied().collect(),
            oriented: scan.oriented,
            covered: Vec::new(),
            stride,
            bare: (0..mesh.vertices().len())
                .map(|v| template.parts().segment(template.weights().dominant(v)))
                .map(is_bare)
                .collect(),
            scalp: scalp(template),
            bvh: Bvh::new(mesh.faces(), mesh.vertices()),
            rest: None,
            posed: Vec::new(),
            bones: BoneTransforms::default(),
            deviations: angle_deviations(template),
            straight: straight_precisions(template),
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
        let all: Vec<u32> = match self.clothed {
            Some(_) => Vec::new(),
            None => (0..self.template.mesh().vertices().len() as u32).collect(),
        };
        let (vertices, joints) = self.template.personalise_some(shape, &all);
        RestBody {
            vertices: self.clothed.map_or(vertices, <[P3]>::to_vec),
            joints,
            ..RestBody::default()
        }
    }

    /// Poses a body; `offsets` are its pose blend shapes where they are known, since shape leaves them as they are.
    fn pose_vertices(
        &self,
        body: &AlignedBody,
        offsets: Option<&[V3]>,
        (out, bones): (&mut Vec<P3>, &mut BoneTransforms),
    ) {
        let rest = &self.rest(&body.shape);
        self.pose_rest((body, rest), offsets, (out, bones));
    }

    fn pose_rest(
        &self,
        (body, rest): (&AlignedBody, &RestBody),
        offsets: Option<&[V3]>,
        (out, bones): (&mut Vec<P3>, &mut BoneTransforms),
    ) {
        body.pose.bones(self.template.skeleton(), rest, bones);
        match offsets {
            Some(offsets) => {
                let moved = MovedRest {
                    vertices: &rest.vertices,
                    offsets,
                };
                skin_moved(Par::Rayon, moved, self.template.weights(), bones, out);
            }
            None => self
                .template
                .pose_vertices(Par::Rayon, &rest.vertices, bones, out),
        }
    }

    /// Posed vertices of a body, metres.
    pub fn posed(&self, body: &AlignedBody) -> (Vec<P3>, BoneTransforms) {
        let (mut out, mut bones) = (Vec::new(), BoneTransforms::default());
        self.pose_vertices(body, None, (&mut out, &mut bones));
        (out, bones)
    }

    /// Mean robust distance of all points from the surface, metres.
    pub fn error(&mut self, body: &AlignedBody) -> f64 {
        const SIGMA: f64 = 0.10;
        self.place(body);
        let kernel = GemanMcClure { sigma: SIGMA };
        let sum: f64 = self
            .matches(&kernel)
            .iter()
            .map(|m| match m.weight > 0.0 {
                true => kernel.value(m.residual.norm_squared()),
                false => SIGMA * SIGMA,
            })
            .sum();
        (sum / self.points.len().max(1) as f64).sqrt()
    }

    /// Poses the surface that matches are searched on.
    pub(super) fn place(&mut self, body: &AlignedBody) {
        let mut posed = std::mem::take(&mut self.posed);
        let mut bones = std::mem::take(&mut self.bones);
        // Only few updates change the shape.
        let kept = self.rest.take().filter(|(shape, _)| *shape == body.shape);
        let (shape, rest) = kept.unwrap_or_else(|| (body.shape.clone(), self.rest(&body.shape)));
        self.pose_rest((body, &rest), None, (&mut posed, &mut bones));
        self.rest = Some((shape, rest));
        self.bvh.refit(&posed);
        (self.posed, self.bones) = (posed, bones);
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
        let p = self.points[i];
        let of_scan = ScanNormal {
            normal: self.normals[i],
            oriented: self.oriented,
        };
        let surface = WarmQuery {
            tree: &self.bvh,
            vertices: &self.posed,
            around: self.template.topology().vertex_faces(),
        };
        let (found, normal) =
            surface.closest(&p, self.near[i], |own| of_scan.agrees(own, NORMALS))?;
        let face = self.bvh.faces()[found.face as usize];
        let mut residual = (p - found.point).cast::<f64>();
        let mut weight = kernel.weight(residual.norm_squared());
        let is_outside = residual.dot(&normal.cast()) > 0.0;
        if self.covered.get(i).copied().unwrap_or(false) {
            residual -= normal.cast() * THICKNESS;
            weight *= if is_outside { LOOSE } else { 1.0 };
        } else if is_outside && self.scalp[face[0] as usize] && self.clothed.is_none() {
            // Hair stands off the skin as cloth does.
            weight *= UNKNOWN;
        } else if self.bare[face[0] as usize] {
            weight *= BARE;
        } else if is_outside && self.covered.is_empty() && self.clothed.is_none() {
            weight *= UNKNOWN;
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

    /// Runs one stage; `body` is start and result.
    ///
    /// # Errors
    /// [`CaptureError::Solve`] if the normal matrix is singular or not finite.
    pub fn run(
        &mut self,
        body: &mut AlignedBody,
        stage: &FitStage,
    ) -> Result<ModelFitReport, CaptureError> {
        let start = body.clone();
        let mut report = ModelFitReport::default();
        let shaped = stage.shape && self.clothed.is_none();
        let unknowns = ShapeUnknowns::new(self.template, &mut body.shape, shaped);
        let prior = Prior {
            start: &start.pose,
            unknowns: &unknowns,
            freedom: stage.freedom,
        };
        for _ in 0..stage.iterations {
            let update = self.newton_update(body, &prior, stage.sigma, &mut report)?;
            let moved = self.update(body, &unknowns, &update);
            if moved < CONVERGED {
                report.converged = true;
                break;
            }
        }
        Ok(report)
    }

    /// Gauss–Newton update of one iteration, which is counted in the report.
    fn newton_update(
        &mut self,
        body: &AlignedBody,
        prior: &Prior<'_>,
        sigma: f64,
        report: &mut ModelFitReport,
    ) -> Result<DVector<f64>, CaptureError> {
        let kernel = GemanMcClure { sigma };
        self.place(body);
        let matches = self.matches(&kernel);
        report.iterations += 1;
        report.paired = matches.iter().filter(|m| m.weight > 0.0).count();
        report.error = robust_mean(&matches, &kernel);
        let mut system = self.system(body, prior, &matches);
        system.add_shape_prior(&body.shape, prior.unknowns);
        system.solve()
    }

    /// Normal equations of the matches with the prior of the pose.
    pub(super) fn system(
        &self,
        body: &AlignedBody,
        prior: &Prior<'_>,
        matches: &[Match],
    ) -> BodyEquations {
        let centre = self.bones.joints[0].coords;
        let mut dofs = Vec::new();
        let skeleton = self.template.skeleton();
        linearise(skeleton, &self.bones, &body.pose, &centre, &mut dofs);
        let fields = self.shape_fields(body, prior.unknowns);
        let rows = JacobianRows {
            template: self.template,
            dofs: &dofs,
            fields: &fields,
            centre,
        };
        let n = dofs.len() + prior.unknowns.len();
        let (mut h, mut g) = rows.normal_equations(matches, n);
        let per_point = INDEPENDENT / self.points.len().max(1) as f64 / (DEVIATION * DEVIATION);
        h *= per_point;
        g *= per_point;
        for (k, deviation) in self.deviations.iter().enumerate() {
            let (i, w) = (6 + k, (deviation * prior.freedom).powi(-2));
            h[(i, i)] += w;
            g[i] += w * (prior.start.angles[k] - body.pose.angles[k]);
            h[(i, i)] += self.straight[k];
            g[i] -= self.straight[k] * body.pose.angles[k];
        }
        BodyEquations { h, g }
    }

    /// Displacement of each posed vertex per unit of each shape unknown.
    fn shape_fields(&self, body: &AlignedBody, unknowns: &ShapeUnknowns) -> Vec<Vec<V3>> {
        let (mut moved, mut bones) = (Vec::new(), BoneTransforms::default());
        let offsets = self.template.pose_offsets(&self.bones);
        let offsets = offsets.map_or_else(Vec::new, |o| o.all(Par::Rayon));
        unknowns
            .all
            .iter()
            .map(|u| {
                let mut changed = body.clone();
                *u.of(&mut changed.shape) += STEP;
                self.pose_vertices(&changed, Some(&offsets), (&mut moved, &mut bones));
                moved
                    .iter()
                    .zip(&self.posed)
                    .map(|(a, b)| (a - b) / STEP as f32)
                    .collect()
            })
            .collect()
    }

    /// Applies an update; its size, metres.
    pub(super) fn update(
        &self,
        body: &mut AlignedBody,
        unknowns: &ShapeUnknowns,
        x: &DVector<f64>,
    ) -> f64 {
        let first = 6 + self.deviations.len();
        let centre = self.bones.joints[0].coords;
        let skeleton = self.template.skeleton();
        apply(skeleton, &mut body.pose, &centre, x);
        body.pose.clamp_to_limits(skeleton);
        let angles = x.rows(3, first - 3).amax() * LEVER;
        let mut moved = x.rows(0, 3).amax().max(angles);
        for (k, u) in unknowns.all.iter().enumerate() {
            let [low, high] = u.limits();
            let value = u.of(&mut body.shape);
            *value = (*value + x[first + k]).clamp(low, high);
            moved = moved.max(0.02 * x[first + k].abs());
        }
        moved
    }
}

/// Prior of one stage.
pub(super) struct Prior<'a> {
    pub(super) start: &'a Pose<World>,
    pub(super) unknowns: &'a ShapeUnknowns,
    pub(super) freedom: f64,
}

/// Mostly bare: head, hands and feet.
pub(super) fn is_bare(segment: BodySegment) -> bool {
    use BodySegment::*;
    matches!(segment, Head | Hand | Fingers | Foot | Toes)
}

fn robust_mean(matches: &[Match], kernel: &GemanMcClure) -> f64 {
    let good = matches.iter().filter(|m| m.weight > 0.0);
    let (sum, n) = good.fold((0.0, 0usize), |(s, n), m| {
        (s + kernel.value(m.residual.norm_squared()), n + 1)
    });
    (sum / n.max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_body::{PoseShapes, embedded};
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
        let template = Arc::new(template);
        let unscanned = BodyScan::default();
        let (points, _) = ModelFit::new(&template, &unscanned, 1).posed(&bent(&template, 0.9));
        let scan = BodyScan {
            normals: vec![V3::zeros(); points.len()],
            points,
            ..unscanned
        };
        let mut fit = ModelFit::new(&template, &scan, 3000);
        let mut found = bent(&template, 0.5);
        for stage in [FitStage::posed(0.08, 10), FitStage::posed(0.03, 10)] {
            fit.run(&mut found, &stage).expect("solved");
        }
        let error = |(a, b): (&P3, &P3)| (a - b).norm();
        let errors = fit.posed(&found).0;
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
        let shapes = PoseShapes::new(n, j, directions).expect("sizes fit");
        let shaped = plain.clone().with_pose_shapes(shapes).expect("sizes fit");
        let (without, with) = (error_of_pose(plain), error_of_pose(shaped));
        assert!(without < 5e-4 && with < 1e-3, "{without} {with}");
    }
}

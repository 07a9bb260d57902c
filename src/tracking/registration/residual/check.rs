//! Finite-difference checks of residuals on a small posed chain.

use super::{
    EdgeResidual, LimbMotion, PointTerm, Residual, RowTerm, SurfaceMetric, SurfaceResidual,
};
use crate::registration::{Dof, ModelPoints, NormalEquations, Pair, ROOT_UNKNOWNS, is_ancestor};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use tryon_geometry::camera::Intrinsics;
use tryon_geometry::math::derivative_check::{DerivativeCheck, Derivatives, Rows};
use tryon_geometry::math::{P3, P3d, Twist, V3, exp_se3};
use tryon_geometry::spatial::OrganisedCloud;

/// Pelvis, hip (ball), ankle (hinge) and an end point, 2 m in front of the camera.
pub(super) struct Chain {
    pub joints: Vec<P3d>,
    pub parents: Vec<Option<usize>>,
    pub dofs: Vec<Dof>,
    pub centre: Vector3<f64>,
    /// All joint angles.
    pub angles: Vec<usize>,
}

impl Chain {
    pub(super) fn new() -> Self {
        let joints = [
            [0.02, -0.1, 2.0],
            [0.12, 0.1, 2.05],
            [0.15, 0.5, 1.95],
            [0.2, 0.55, 1.8],
        ];
        let joints: Vec<P3d> = joints.into_iter().map(P3d::from).collect();
        let centre = joints[0].coords;
        let axis = |k: usize| Vector3::from_fn(|r, _| f64::from(u8::from(r == k)));
        let mut dofs: Vec<Dof> = (0..ROOT_UNKNOWNS)
            .map(|k| {
                let unit = |first: usize| {
                    if (first..first + 3).contains(&k) {
                        axis(k - first)
                    } else {
                        Vector3::zeros()
                    }
                };
                let (linear, angular) = (unit(0), unit(3));
                let twist = Twist { linear, angular };
                Dof { bone: 0, twist }
            })
            .collect();
        let hinge = Vector3::new(0.6, 0.0, 0.8);
        for (bone, axis) in [(1, axis(0)), (1, axis(1)), (1, axis(2)), (2, hinge)] {
            let twist = Twist::revolute(axis, joints[bone].coords - centre);
            dofs.push(Dof { bone, twist });
        }
        Self {
            parents: vec![None, Some(0), Some(1), Some(2)],
            angles: (0..dofs.len() - ROOT_UNKNOWNS).collect(),
            joints,
            dofs,
            centre,
        }
    }

    /// The chain as a limb that all its angles move.
    pub(super) fn limb(&self) -> LimbMotion<'_> {
        LimbMotion {
            angles: &self.angles,
            dofs: &self.dofs,
            centre: &self.centre,
        }
    }

    /// The point `p` of a bone after the displacement `x` of all unknowns from the pose of the chain.
    fn displaced(&self, x: &[f64], bone: usize, p: &P3d) -> P3d {
        let mut q = p - self.centre;
        for (dof, x) in self.dofs.iter().zip(x).rev() {
            if is_ancestor(&self.parents, dof.bone, bone) {
                let twist = Twist {
                    linear: dof.twist.linear * *x,
                    angular: dof.twist.angular * *x,
                };
                q = exp_se3(&twist) * q;
            }
        }
        q + self.centre
    }

    /// All joints after the displacement `x`.
    pub(super) fn moved(&self, x: &[f64]) -> Vec<P3d> {
        let of = |(j, p): (usize, &P3d)| self.displaced(x, j, p);
        self.joints.iter().enumerate().map(of).collect()
    }

    /// Checks a residual of rows; `each` builds it at the displacement and weight given, and visits its terms.
    pub(super) fn check_rows(each: impl Fn(&Self, &[f64], f64, &mut dyn FnMut(&RowTerm<'_>))) {
        let chain = Self::new();
        let n = chain.angles.len();
        let terms = |x: &[f64], weight: f64| {
            let mut all = Vec::new();
            let full: Vec<f64> = [0.0; ROOT_UNKNOWNS].iter().chain(x).copied().collect();
            each(&chain, &full, weight, &mut |t| {
                let mut slopes = DVector::<f64>::zeros(n);
                for (&angle, &slope) in t.angles.iter().zip(t.slopes) {
                    slopes[angle] += slope;
                }
                all.push((t.residual, t.weight, slopes));
            });
            all
        };
        let evaluate = |x: &[f64], weight: f64| {
            let (frozen, now) = (terms(&vec![0.0; n], weight), terms(x, weight));
            let rows = Rows {
                residual: DVector::from_iterator(now.len(), now.iter().map(|t| t.0)),
                weights: DVector::from_iterator(frozen.len(), frozen.iter().map(|t| t.1)),
                jacobian: DMatrix::from_fn(frozen.len(), n, |r, k| -frozen[r].2[k]),
            };
            let size = ROOT_UNKNOWNS + n;
            let mut equations = NormalEquations {
                hessian: DMatrix::zeros(size, size),
                gradient: DVector::zeros(size),
                ..NormalEquations::default()
            };
            each(&chain, &vec![0.0; size], weight, &mut |t| {
                equations.add_row(t)
            });
            Derivatives {
                value: 0.5
                    * rows
                        .residual
                        .component_mul(&rows.weights)
                        .dot(&rows.residual),
                gradient: -equations.gradient.rows(ROOT_UNKNOWNS, n),
                hessian: Some(
                    equations
                        .hessian
                        .view((ROOT_UNKNOWNS, ROOT_UNKNOWNS), (n, n))
                        .into_owned(),
                ),
                rows: Some(rows),
            }
        };
        assert!(!terms(&vec![0.0; n], 1.0).is_empty(), "no rows");
        DerivativeCheck::default().run(&[vec![0.0; n]], evaluate);
    }
}

/// Points on the bones of a chain, and a reading for each.
pub(super) struct Scan {
    chain: Chain,
    grid: OrganisedCloud,
    points: Vec<P3d>,
    normals: Vec<V3>,
    bones: Vec<u8>,
}

/// Model positions are f32: a step this large keeps their rounding out of the differences.
const F32_CHECK: DerivativeCheck = DerivativeCheck {
    step: 4e-3,
    tolerance: 2e-3,
    floor: 1e-4,
};

impl Scan {
    /// Readings are off their points by `off` metres.
    fn new(off: f64) -> Self {
        let chain = Chain::new();
        let mut grid = OrganisedCloud::new(&Intrinsics::KINECT_V1, Some(4));
        let (mut points, mut normals, mut bones) = (Vec::new(), Vec::new(), Vec::new());
        for i in 0..12u8 {
            let t = 0.7 * f64::from(i);
            // The first point of each bone lies on the optical axis, where depth and range agree.
            let across = if i < 3 { 0.0 } else { 0.2 };
            let p = P3d::new(across * t.sin(), across * t.cos(), 1.9 + 0.01 * t);
            let direction = Vector3::new(0.3 * t.cos(), 0.4 * t.sin(), 1.0);
            let reading = p + direction.normalize() * off;
            grid.points[usize::from(i)] = reading.cast();
            grid.depth[usize::from(i)] = reading.z as f32;
            let normal = V3::new(t.sin() as f32, 0.5, -2.0).normalize();
            grid.normals[usize::from(i)] = V3::new(0.2, t.cos() as f32, -2.0).normalize();
            points.push(p);
            normals.push(normal);
            bones.push(i % 3);
        }
        Self {
            chain,
            grid,
            points,
            normals,
            bones,
        }
    }

    pub(super) fn surface(
        &self,
        model: &ModelPoints<'_>,
        robust: bool,
        weight: f64,
        visit: &mut dyn FnMut(&PointTerm),
    ) {
        let pair = |i: u32| Pair {
            model: i,
            cell: i,
            from_data: i.is_multiple_of(2),
        };
        let pairs: Vec<Pair> = (0..self.points.len() as u32).map(pair).collect();
        let surface = SurfaceResidual {
            model,
            grid: &self.grid,
            pairs: &pairs,
            both_ways: true,
            metric: SurfaceMetric {
                point_to_point: 0.1 * weight,
                point_to_plane: weight,
                robust,
                sigma: 0.05,
                pull_length: 0.12,
            },
        };
        surface.for_each(visit);
    }

    /// Each point with the cell of its reading.
    fn cells(&self, points: std::ops::Range<u32>) -> Vec<(u32, u32)> {
        points.map(|i| (i, i)).collect()
    }

    pub(super) fn edge(
        &self,
        model: &ModelPoints<'_>,
        weight: f64,
        visit: &mut dyn FnMut(&PointTerm),
    ) {
        let edge = EdgeResidual {
            model,
            grid: &self.grid,
            pairs: &self.cells(0..self.points.len() as u32),
            weight,
            sigma: 0.1,
        };
        edge.for_each(visit);
    }

    /// Checks a residual of points; `each` visits its terms for a posed model and a weight.
    pub(super) fn check_points(
        each: impl Fn(&Self, &ModelPoints<'_>, f64, &mut dyn FnMut(&PointTerm)),
    ) {
        let origin = vec![0.0; Chain::new().dofs.len()];
        let scan = Self::new(0.04);
        let evaluate = |x: &[f64], weight: f64| scan.derivatives(&each, x, weight);
        F32_CHECK.run(std::slice::from_ref(&origin), evaluate);
        let touching = Self::new(0.0);
        let evaluate = |x: &[f64], weight: f64| touching.derivatives(&each, x, weight);
        F32_CHECK.run_degenerate(&[origin], evaluate);
    }

    /// Terms of the model after the displacement `x`.
    fn terms(
        &self,
        each: &impl Fn(&Self, &ModelPoints<'_>, f64, &mut dyn FnMut(&PointTerm)),
        x: &[f64],
        weight: f64,
    ) -> Vec<PointTerm> {
        let points = self.points.iter().zip(&self.bones);
        let displaced = |(p, &b): (&P3d, &u8)| self.chain.displaced(x, usize::from(b), p).cast();
        let positions: Vec<P3> = points.map(displaced).collect();
        let model = ModelPoints {
            positions: &positions,
            normals: &self.normals,
            bones: &self.bones,
            parents: &self.chain.parents,
            spacing: 0.03,
        };
        let mut terms = Vec::new();
        each(self, &model, weight, &mut |t| terms.push(*t));
        assert!(!terms.is_empty(), "no terms");
        terms
    }

    /// Rows M^½ r with metric and weight of the undisplaced model.
    fn derivatives(
        &self,
        each: &impl Fn(&Self, &ModelPoints<'_>, f64, &mut dyn FnMut(&PointTerm)),
        x: &[f64],
        weight: f64,
    ) -> Derivatives {
        let (n, chain) = (x.len(), &self.chain);
        let frozen = self.terms(each, &vec![0.0; n], weight);
        let now = self.terms(each, x, weight);
        let mut equations = NormalEquations::default();
        equations.reset(chain.parents.len());
        let count = frozen.len();
        let mut rows = Rows {
            residual: DVector::zeros(3 * count),
            weights: DVector::zeros(3 * count),
            jacobian: DMatrix::zeros(3 * count, n),
        };
        let mut value = 0.0;
        for (i, (term, now)) in frozen.iter().zip(&now).enumerate() {
            equations.add_point(term, &chain.centre);
            value += 0.5 * term.weight * term.metric.squared(&now.residual);
            let root = square_root(&term.metric.matrix());
            rows.residual
                .rows_mut(3 * i, 3)
                .copy_from(&(root * now.residual));
            rows.weights.rows_mut(3 * i, 3).fill(term.weight);
            for (k, dof) in chain.dofs.iter().enumerate() {
                if is_ancestor(&chain.parents, dof.bone, term.bone) {
                    let moved = dof.twist.velocity_at(&(term.point - chain.centre));
                    rows.jacobian
                        .view_mut((3 * i, k), (3, 1))
                        .copy_from(&(-root * moved));
                }
            }
        }
        equations.assemble(&chain.parents, &chain.dofs);
        Derivatives {
            value,
            gradient: -equations.gradient,
            hessian: Some(equations.hessian),
            rows: Some(rows),
        }
    }
}

/// Symmetric square root of a positive semi-definite matrix.
fn square_root(m: &Matrix3<f64>) -> Matrix3<f64> {
    let eigen = m.symmetric_eigen();
    let roots = eigen.eigenvalues.map(|v| v.max(0.0).sqrt());
    eigen.eigenvectors * Matrix3::from_diagonal(&roots) * eigen.eigenvectors.transpose()
}

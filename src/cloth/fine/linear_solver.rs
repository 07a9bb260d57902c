//! Search direction of a Newton iteration: factorisation or preconditioned conjugate gradients.

use super::error::OfflineError;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use tryon_geometry::linear::{
    BlockJacobi, BlockMatrix, CoarseSpace, Factor, LinearError, RowSelection, SingleMatrix,
    StopCriterion, SymbolicFactor, TwoLevel, conjugate_gradient,
};
use tryon_geometry::math::V3d;
use tryon_geometry::par::Par;

/// Vertices of a patch of the coarse level.
const PATCH: usize = 48;

/// Solver of the Newton system.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum LinearMethod {
    /// Conjugate gradients with two levels: inverse diagonal blocks and patches of vertices.
    #[default]
    TwoLevel,
    /// Conjugate gradients with the inverse diagonal blocks as preconditioner.
    ConjugateGradient,
    /// Sparse Cholesky factorisation.
    Cholesky,
}

/// Linear system of a Newton iteration.
#[derive(Clone, Copy, Debug)]
pub(super) struct LinearSystem<'a> {
    /// Positions (m).
    pub(super) x: &'a [V3d],
    /// Gradient (N).
    pub(super) gradient: &'a [V3d],
    /// Hessian of shape, inertia, pins and obstacle (N/m).
    pub(super) shape: &'a BlockMatrix,
    /// Hessian of contact and friction (N/m); of size zero without contact.
    pub(super) contact: &'a BlockMatrix,
}

/// Solver of Newton systems and what it keeps between them.
#[derive(Debug)]
pub(super) struct DirectionSolver {
    pub(super) par: Par,
    /// Patches of the shape's graph, grown at the first use.
    coarse: Option<CoarseSpace>,
    /// Shape's matrix as the products read it.
    single: SingleMatrix,
    /// Rows that move; `None` for all.
    selection: Option<RowSelection>,
}

impl DirectionSolver {
    pub(super) fn new(par: Par) -> Self {
        Self {
            par,
            coarse: None,
            single: SingleMatrix::default(),
            selection: None,
        }
    }

    /// Leaves rows out of all systems that follow, as `asleep` says; empty for none.
    pub(super) fn select(&mut self, asleep: &[bool]) {
        let selection = asleep
            .contains(&true)
            .then(|| RowSelection::new(asleep.iter().map(|is_asleep| !is_asleep)));
        if selection != self.selection {
            self.selection = selection;
            self.coarse = None;
        }
    }

    /// Replaces `direction` with the Newton direction; returns products with the matrix.
    pub(super) fn solve(
        &mut self,
        how: (LinearMethod, StopCriterion),
        system: &LinearSystem<'_>,
        direction: &mut [V3d],
    ) -> Result<usize, OfflineError> {
        direction.fill(V3d::zeros());
        self.improve(how, system, direction)
    }

    /// Goes on from a `direction`, until the residual is that asked for.
    pub(super) fn improve(
        &mut self,
        how: (LinearMethod, StopCriterion),
        system: &LinearSystem<'_>,
        direction: &mut [V3d],
    ) -> Result<usize, OfflineError> {
        let Some(selection) = self.selection.take() else {
            return self.improve_all(how, system, direction);
        };
        let [shape, contact] = [system.shape, system.contact].map(|m| m.selected(&selection));
        let selected = LinearSystem {
            x: &selection.gather(system.x),
            gradient: &selection.gather(system.gradient),
            shape: &shape,
            contact: &contact,
        };
        let mut own = selection.gather(direction);
        let products = self.improve_all(how, &selected, &mut own);
        selection.scatter(&own, direction);
        self.selection = Some(selection);
        products
    }

    fn improve_all(
        &mut self,
        (method, stop): (LinearMethod, StopCriterion),
        system: &LinearSystem<'_>,
        direction: &mut [V3d],
    ) -> Result<usize, OfflineError> {
        let right: Vec<V3d> = system.gradient.iter().map(|g| -g).collect();
        let both = [system.shape, system.contact];
        let matrices = if system.contact.pattern().size() == 0 {
            &both[..1]
        } else {
            &both[..]
        };
        let par = self.par;
        if method != LinearMethod::Cholesky {
            self.single.copy(par, system.shape);
        }
        let single = &self.single;
        let apply = |x: &[V3d], y: &mut [V3d]| {
            y.fill(V3d::zeros());
            single.multiply_add(par, x, y);
            matrices[1..].iter().for_each(|m| m.multiply_add(par, x, y));
        };
        let mut fine = BlockJacobi::new(par, matrices);
        let report = match method {
            LinearMethod::Cholesky => return factorise(matrices, &right, direction).map(|()| 0),
            LinearMethod::ConjugateGradient => {
                conjugate_gradient(apply, &mut fine, &right, direction, (par, stop))
            }
            LinearMethod::TwoLevel => {
                let pattern = system.shape.pattern();
                let coarse = self
                    .coarse
                    .get_or_insert_with(|| CoarseSpace::new(pattern, PATCH));
                // The fine level works alone when rounding leaves the coarse matrix indefinite.
                coarse
                    .update(par, system.x, matrices)
                    .or_else(LinearError::unless_indefinite)?;
                let mut both = TwoLevel::new(fine, coarse);
                conjugate_gradient(apply, &mut both, &right, direction, (par, stop))
            }
        };
        Ok(report.iterations)
    }
}

fn factorise(
    matrices: &[&BlockMatrix],
    right: &[V3d],
    direction: &mut [V3d],
) -> Result<(), OfflineError> {
    let sum = BlockMatrix::sum(matrices)?;
    let (pattern, values) = sum.to_scalar()?;
    let mut factor = Factor::new(SymbolicFactor::new(Arc::new(pattern))?);
    factor.refactor(&values)?;
    let mut flat: Vec<f64> = right.iter().flat_map(|g| [g.x, g.y, g.z]).collect();
    factor.solve_vector(&mut flat);
    for (d, s) in direction.iter_mut().zip(flat.chunks_exact(3)) {
        *d = V3d::new(s[0], s[1], s[2]);
    }
    Ok(())
}

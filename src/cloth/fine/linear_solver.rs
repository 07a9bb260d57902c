//! Search direction of a Newton iteration: conjugate gradients with two levels, inverse diagonal blocks and patches.

use super::error::OfflineError;
use tryon_geometry::linear::{
    BlockJacobi, BlockMatrix, CgSettings, CoarseSpace, LinearError, RowSelection, SingleMatrix,
    TwoLevel, conjugate_gradient,
};
use tryon_geometry::math::V3d;
use tryon_geometry::par::Par;

/// Vertices of a patch of the coarse level.
const PATCH: usize = 48;

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
        settings: CgSettings,
        system: &LinearSystem<'_>,
        direction: &mut [V3d],
    ) -> Result<usize, OfflineError> {
        direction.fill(V3d::zeros());
        self.improve(settings, system, direction)
    }

    /// Goes on from a `direction`, until the residual is that asked for.
    pub(super) fn improve(
        &mut self,
        settings: CgSettings,
        system: &LinearSystem<'_>,
        direction: &mut [V3d],
    ) -> Result<usize, OfflineError> {
        let Some(selection) = self.selection.take() else {
            return self.improve_all(settings, system, direction);
        };
        let [shape, contact] = [system.shape, system.contact].map(|m| m.selected(&selection));
        let selected = LinearSystem {
            x: &selection.gather(system.x),
            gradient: &selection.gather(system.gradient),
            shape: &shape,
            contact: &contact,
        };
        let mut own = selection.gather(direction);
        let products = self.improve_all(settings, &selected, &mut own);
        selection.scatter(&own, direction);
        self.selection = Some(selection);
        products
    }

    fn improve_all(
        &mut self,
        settings: CgSettings,
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
        self.single.copy(par, system.shape);
        let single = &self.single;
        let apply = |x: &[V3d], y: &mut [V3d]| {
            y.fill(V3d::zeros());
            single.multiply_add(par, x, y);
            matrices[1..].iter().for_each(|m| m.multiply_add(par, x, y));
        };
        let fine = BlockJacobi::new(par, matrices);
        let pattern = system.shape.pattern();
        let coarse = self
            .coarse
            .get_or_insert_with(|| CoarseSpace::new(pattern, PATCH));
        // The fine level works alone when rounding leaves the coarse matrix indefinite.
        coarse
            .update(par, system.x, matrices)
            .or_else(LinearError::unless_indefinite)?;
        let mut both = TwoLevel::new(fine, coarse);
        let report = conjugate_gradient(apply, &mut both, &right, direction, settings);
        Ok(report.iterations)
    }
}

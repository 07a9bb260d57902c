//! Time integrators of one sheet among moving solids, behind one trait.

pub mod collider;
mod config;
mod environment;
mod explicit;
pub(crate) mod implicit;
mod single_patch;
mod xpbd;

pub use config::{Method, RunConfig};
pub use environment::Environment;

use super::{ClothError, Sheet};
use tryon_geometry::math::{P3, V3d};
use tryon_geometry::mesh::Face;

/// A sheet at the start of a simulation, which is its rest shape.
#[derive(Clone, Copy, Debug)]
pub struct SheetStart<'a> {
    /// Mechanical system.
    pub sheet: &'a Sheet,
    /// Triangles.
    pub faces: &'a [Face],
    /// Positions (m).
    pub positions: &'a [P3],
}

/// Counters of a solver since its start.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SolverReport {
    /// Substeps a frame.
    pub substeps: usize,
    /// Iterations a substep.
    pub iterations: usize,
    /// Numeric factorisations.
    pub factorisations: u64,
    /// Share of the membrane stiffness that is kept.
    pub softened: f64,
    /// Elements that keep less than 99 % of it.
    pub soft_elements: usize,
    /// Most vertices at once in contact with another fold.
    pub fold_contacts: usize,
    /// Queries for other folds that were skipped, because none could have come near.
    pub fold_searches_skipped: usize,
}

/// A time integrator with the state of its sheet.
pub trait Solver {
    /// Advances from frame `index − 1` to frame `index`; returns the time reached (s).
    ///
    /// # Errors
    /// A position that is not finite, by vertex.
    fn advance(&mut self, environment: &Environment<'_>, index: usize) -> Result<f64, ClothError>;
    /// Positions (m) and velocities (m/s), in the order of the sheet.
    fn state(&self) -> (Vec<V3d>, Vec<V3d>);
    /// Counters since the start.
    fn report(&self) -> SolverReport;
}

/// Solver of a configuration, at `rate` frames a second.
///
/// # Errors
/// A sheet without vertices or with an unusable mesh.
pub fn solver<'a>(
    start: SheetStart<'a>,
    environment: &Environment<'_>,
    config: &RunConfig,
    rate: f64,
) -> Result<Box<dyn Solver + 'a>, ClothError> {
    Ok(match config.method {
        Method::Explicit => Box::new(explicit::ExplicitSolver::new(
            start,
            environment,
            config,
            rate,
        )?),
        Method::QuasiNewton | Method::QuasiNewtonBdf2 => {
            Box::new(implicit::ImplicitSolver::new(start, config, rate)?)
        }
        Method::Xpbd => Box::new(xpbd::solver(start, environment, config, rate)?),
        Method::MassSpring => Box::new(implicit::mass_spring_solver(
            start,
            environment,
            config,
            rate,
        )?),
    })
}

/// Error of the first position that is not finite.
fn check_finite<const N: usize>(
    mut positions: impl Iterator<Item = [f64; N]>,
) -> Result<(), ClothError> {
    match positions.position(|p| !p.iter().all(|c| c.is_finite())) {
        Some(index) => Err(ClothError::NotFinite {
            what: "cloth vertex",
            index,
        }),
        None => Ok(()),
    }
}

//! Choice between the graphics card and the processor.

use super::adapter::GpuError;
use super::renderer::Renderer;

/// Preferred renderer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Prefer {
    /// A real card if there is one, else the processor.
    #[default]
    Auto,
    /// The processor.
    Cpu,
    /// Any adapter, software included.
    Gpu,
}

/// The renderer to use, warmed up; `None` = the processor (asked for, or nothing better than software was found:
/// lavapipe takes 3 to 4 times as long as [`crate::render`]).
///
/// # Errors
/// With [`Prefer::Gpu`], when there is no adapter or it fails. With [`Prefer::Auto`] a failing card means `None`.
pub fn choose(prefer: Prefer) -> Result<Option<Renderer>, GpuError> {
    match prefer {
        Prefer::Cpu => Ok(None),
        Prefer::Gpu => Renderer::new(true).map(Some),
        Prefer::Auto => Ok(Renderer::new(false).ok()),
    }
}

//! Repair of a triangle mesh to oriented manifold sheets: join → drop → split → orient → thin, with a report of each.
//!
//! Splitting follows "Cutting and Stitching: Converting Sets of Polygons to Manifold Surfaces" (Guéziec, Taubin, Lazarus & Horn
//! 2001): faces keep a common vertex if they are connected around it across edges of two faces.

mod degenerate;
mod double_layer;
mod manifold;
mod orientation;
mod report;
mod surface;
mod weld;

pub use report::{FaceFinding, MeshRepairReport};

use super::{Face, MeshError, MeshRepairSettings, Topology, TriMesh};
use surface::WorkingSurface;

/// Repaired mesh and the elements of the given one that its elements come from.
#[derive(Clone, Debug, PartialEq)]
pub struct RepairedMesh {
    /// Oriented manifold sheets: [`Topology::new`] accepts it.
    pub mesh: TriMesh,
    /// Given vertex of each vertex, shape `[vertices]`; of several that were joined the first. Copies of a vertex share it.
    pub vertex_source: Vec<u32>,
    /// Given face of each face, shape `[faces]`.
    pub face_source: Vec<u32>,
    /// Given corner of each corner, three times its face and its place there; shape `[faces]`.
    pub corner_source: Vec<Face>,
    /// Thickness of the closed double layers that were reduced to one sheet, median over their surface.
    pub thickness: Option<f32>,
    /// Changes.
    pub report: MeshRepairReport,
}

/// Repairs a mesh. Costs about a microsecond a face.
///
/// # Errors
/// [`MeshError::OneSided`] names a face of a surface with one side only (Möbius strip), which has no orientation.
pub fn repair(mesh: &TriMesh, settings: &MeshRepairSettings) -> Result<RepairedMesh, MeshError> {
    let mut report = MeshRepairReport::default();
    let mut surface = WorkingSurface::new(mesh);
    report.stray = surface.drop_unused();
    let tolerance = settings.weld * surface.size();

    weld::join(&mut surface, tolerance, &mut report);
    degenerate::drop_repeated(&mut surface, &mut report);
    degenerate::drop_needles(&mut surface, tolerance, &mut report);
    manifold::split(&mut surface, &mut report);
    orientation::orient(&mut surface, &mut report)?;
    let thickness = double_layer::thin(&mut surface, settings, &mut report);
    surface.drop_unused();

    let out = surface.finish(thickness, report)?;
    Topology::new(&out.mesh)?;
    Ok(out)
}

#[cfg(test)]
mod tests;

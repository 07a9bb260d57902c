//! One orientation of all faces of a sheet.

use super::MeshRepairReport;
use super::surface::WorkingSurface;
use crate::mesh::{MeshError, sides};

/// Reverses faces until neighbours have the same orientation; the majority of a sheet keeps its own.
///
/// # Errors
/// [`MeshError::OneSided`] names the given face at which the orientation contradicts itself.
pub(super) fn orient(
    surface: &mut WorkingSurface,
    report: &mut MeshRepairReport,
) -> Result<(), MeshError> {
    let neighbours = surface.neighbours();
    let mut is_known = vec![false; surface.faces.len()];
    let mut is_turned = vec![false; surface.faces.len()];
    for seed in 0..surface.faces.len() {
        if std::mem::replace(&mut is_known[seed], true) {
            continue;
        }
        let (mut sheet, mut at) = (vec![seed], 0);
        while at < sheet.len() {
            let i = sheet[at];
            at += 1;
            // Turning swaps the sides of a face, so neighbours are compared by their common edge.
            for &n in neighbours[i].iter().flatten() {
                let n = n as usize;
                let own = sides(&surface.faces[i].corners);
                let theirs = sides(&surface.faces[n].corners);
                // Faces of the same orientation run along their edge in opposite directions.
                let is_alike = !theirs.iter().any(|side| own.contains(side));
                if is_known[n] && !is_alike {
                    let face = surface.faces[n].face as usize;
                    return Err(MeshError::OneSided { face });
                }
                if !std::mem::replace(&mut is_known[n], true) {
                    if !is_alike {
                        surface.faces[n].turn();
                        is_turned[n] = true;
                    }
                    sheet.push(n);
                }
            }
        }
        if sheet.iter().filter(|i| is_turned[**i]).count() * 2 > sheet.len() {
            for i in sheet {
                surface.faces[i].turn();
                is_turned[i] = !is_turned[i];
            }
        }
    }
    report.turned = is_turned.iter().filter(|t| **t).count();
    Ok(())
}

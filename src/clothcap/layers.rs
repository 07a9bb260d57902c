//! Layers of an outfit: body below, hidden vertices of an inner garment between it and the garment above.

use super::CaptureError;
use super::multi::MultiCloth;
use super::retarget::{PenetrationSolver, RetargetReport, SolidBody};
use tryon_geometry::math::P3;

/// Moves posed garments out of a body: those seen with the least change of edges, then hidden vertices below the garments
/// above them. A garment that is free keeps its bits. Shape `[garments][vertices]`, metres.
pub(super) fn clear_body(
    cloth: &MultiCloth,
    solvers: &mut [PenetrationSolver],
    body: &SolidBody,
    garments: &mut [Vec<P3>],
) -> Result<Vec<RetargetReport>, CaptureError> {
    let mut reports = Vec::new();
    for (solver, vertices) in solvers.iter_mut().zip(garments.iter_mut()) {
        reports.push(solver.run(body, vertices)?);
    }
    tuck_hidden(cloth, garments, body.vertices());
    for ((solver, vertices), report) in solvers.iter().zip(garments).zip(&mut reports) {
        let inside = body.contains(vertices);
        solver.gather(body, vertices, inside);
        report.inside = body.contains(vertices).iter().filter(|b| **b).count();
    }
    Ok(reports)
}

/// Moves hidden vertices halfway below the garments above them. Shapes `[garments][vertices]` and `[body vertices]`, metres.
fn tuck_hidden(cloth: &MultiCloth, garments: &mut [Vec<P3>], body: &[P3]) {
    for (inner, part) in cloth.parts.iter().enumerate() {
        let hidden = part.nodes.iter().enumerate();
        for (i, node) in hidden.filter(|(i, _)| part.hidden[*i]) {
            let above = cloth.parts.iter().enumerate().filter(|(k, _)| *k != inner);
            let above = above.filter_map(|(k, part)| {
                let at = part.nodes.binary_search(node).ok()?;
                (!part.hidden[at]).then(|| garments[k][at])
            });
            let skin = body[part.below[i] as usize];
            let nearest = above.min_by(|a, b| (a - skin).norm().total_cmp(&(b - skin).norm()));
            if let Some(p) = nearest {
                garments[inner][i] = skin + (p - skin) * 0.5;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::multi::ClothPart;
    use crate::segment::Slot;

    #[test]
    fn hidden_vertices_lie_halfway() {
        let part = |slot, nodes: &[u32], hidden: &[bool]| ClothPart {
            slot,
            label: 2,
            nodes: nodes.to_vec(),
            below: nodes.to_vec(),
            faces: Vec::new(),
            rings: Vec::new(),
            hidden: hidden.to_vec(),
        };
        let cloth = MultiCloth {
            parts: vec![
                part(Slot::Top, &[1, 2], &[false, false]),
                part(Slot::Under, &[0, 1], &[false, true]),
            ],
            ..MultiCloth::default()
        };
        let z = |z: f32| P3::new(0.0, 0.0, z);
        let mut garments = vec![vec![z(0.02), z(0.03)], vec![z(0.05), z(0.07)]];
        tuck_hidden(&cloth, &mut garments, &[z(0.0); 3]);
        assert_eq!(garments, [vec![z(0.02), z(0.03)], vec![z(0.05), z(0.01)]]);
    }
}

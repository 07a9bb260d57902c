//! Simulations of a session's garments on the wire.

use super::garment::{MAX_GARMENTS, PlacedGarments, WornGarment, topology_from_wire};
use super::{WireError, bulk};
use crate::v1;
use std::sync::Arc;
use tryon_geometry::math::P3;

const POSITIONS: &str = "follow_simulation_response.positions";

/// Garments of a session's simulation on their finer meshes, inner layer first. Positions of a frame are those of their
/// vertices, one garment after the other.
///
/// # Errors
/// Names the field at fault; no garments are one, and vertices that do not add up to `vertex_count`.
pub fn garments_from_wire(r: &v1::StartSimulationResponse) -> Result<Vec<WornGarment>, WireError> {
    const FIELD: &str = "start_simulation_response.garments";
    let count = r.garments.len();
    if !(1..=MAX_GARMENTS).contains(&count) {
        let why = format!("{count}, but 1 to {MAX_GARMENTS} are needed");
        return Err(WireError::new(FIELD, why));
    }
    let mut garments = Vec::with_capacity(count);
    for (i, t) in r.garments.iter().enumerate() {
        let garment = topology_from_wire(t);
        garments.push(garment.map_err(|e| e.within(&format!("{FIELD}[{i}]")))?);
    }
    let vertices: usize = garments.iter().map(|g| g.vertices).sum();
    if vertices != r.vertex_count as usize {
        let why = format!(
            "{vertices} vertices, but vertex_count is {}",
            r.vertex_count
        );
        return Err(WireError::new(FIELD, why));
    }
    Ok(garments)
}

/// Positions of the frame of a message (m, world), shape `[vertices]`; `None` for a step of a drape.
///
/// # Errors
/// Names the field of the wrong size, or the vertex that is not finite.
pub fn positions_from_wire(
    r: &v1::FollowSimulationResponse,
    vertices: usize,
) -> Result<Option<Vec<P3>>, WireError> {
    if r.positions.is_empty() {
        return Ok(None);
    }
    let rows = bulk::read::<f32, 3>(POSITIONS, vertices, &r.positions)?;
    Ok(Some(rows.into_iter().map(P3::from).collect()))
}

/// Garments at the positions of a frame, shape `[vertices]` of all of them (m, world).
///
/// # Errors
/// Names the positions when they aren't those of these garments.
pub fn placed(garments: Vec<WornGarment>, positions: &[P3]) -> Result<PlacedGarments, WireError> {
    let vertices: usize = garments.iter().map(|g| g.vertices).sum();
    if vertices != positions.len() {
        let why = format!("{}, but there are {vertices} vertices", positions.len());
        return Err(WireError::new(POSITIONS, why));
    }
    let mut first = 0;
    let placed = garments.into_iter().map(|g| {
        let own = &positions[first..first + g.vertices];
        first += g.vertices;
        let drawn = g.drawn.iter().map(|&v| own[v as usize]).collect();
        (Arc::new(g), drawn)
    });
    Ok(placed.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A triangle.
    fn topology() -> v1::GarmentTopology {
        v1::GarmentTopology {
            garment: "flag".into(),
            vertex_count: 3,
            face_count: 1,
            faces: bulk::write([[0u32, 1, 2]].into_iter()),
            uvs: bulk::write([[0.0f32; 2]; 3].into_iter()),
            look: Some(v1::GarmentLook::default()),
            drawn_count: 3,
            drawn: bulk::write_flat(&[0u32, 1, 2]),
            ..Default::default()
        }
    }

    #[test]
    fn garments_whose_vertices_do_not_add_up_are_refused() {
        let start = |garments, vertex_count| v1::StartSimulationResponse {
            garments,
            vertex_count,
            ..Default::default()
        };
        let two = vec![topology(), topology()];
        let garments = garments_from_wire(&start(two.clone(), 6)).expect("fits");
        assert_eq!(garments.len(), 2);
        let refused = |r| garments_from_wire(&r).expect_err("refused").field;
        let field = "start_simulation_response.garments";
        assert_eq!(refused(start(two.clone(), 7)), field);
        assert_eq!(refused(start(Vec::new(), 0)), field);
        assert_eq!(refused(start(vec![topology(); 9], 27)), field);
        let mut broken = two;
        broken[1].look = None;
        let named = refused(start(broken, 6));
        assert_eq!(named, format!("{field}[1].garment_topology.look"));
    }

    #[test]
    fn garments_are_placed_one_after_the_other_with_their_seams_twice() {
        let seam = || {
            let mut g = topology_from_wire(&topology()).expect("a garment");
            g.drawn = vec![0, 1, 2, 2];
            g
        };
        let point = |k: u8| P3::new(f32::from(k), 0.0, 0.0);
        let all: Vec<P3> = (0..6).map(point).collect();
        let placed = |x: &[P3]| super::placed(vec![seam(), seam()], x);
        let drawn = placed(&all).expect("placed").into_iter().map(|(_, x)| x);
        let expected = [[0, 1, 2, 2].map(point), [3, 4, 5, 5].map(point)];
        assert_eq!(drawn.collect::<Vec<_>>(), expected);
        assert_eq!(placed(&all[1..]).expect_err("short").field, POSITIONS);
    }

    #[test]
    fn positions_of_another_size_are_refused() {
        let message = |positions| v1::FollowSimulationResponse {
            positions,
            ..Default::default()
        };
        let step = message(bulk::write_flat::<f32>(&[]));
        assert_eq!(positions_from_wire(&step, 2).expect("a step"), None);
        let frame = message(bulk::write(
            [[1.0f32, 2.0, 3.0], [4.0, 5.0, 6.0]].into_iter(),
        ));
        let read = positions_from_wire(&frame, 2).expect("a frame");
        let expected = [P3::new(1.0, 2.0, 3.0), P3::new(4.0, 5.0, 6.0)];
        assert_eq!(read.as_deref(), Some(&expected[..]));
        let field = "follow_simulation_response.positions";
        let short = positions_from_wire(&frame, 3).expect_err("short");
        assert_eq!(short.field, field);
        let nan = message(bulk::write([[1.0f32, f32::NAN, 3.0]].into_iter()));
        let nan = positions_from_wire(&nan, 1).expect_err("NaN");
        assert_eq!(nan.field, format!("{field}[0]"));
    }
}

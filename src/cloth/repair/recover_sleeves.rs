//! Puts sleeves that lost their arm around it again.

use crate::cloth::outfit_model::Model;
use crate::cloth::state::{GarmentState, State};
use crate::contact::SurfaceFrame;
use crate::math::{P3, V3};

/// Puts lost rings of sleeves around their arms at rest, on the body `skin` of the last step. Returns their number.
pub(in crate::cloth) fn recover_sleeves(
    model: &Model,
    state: &mut State,
    skin: &SurfaceFrame,
) -> usize {
    let arms = model.arms.lines(&skin.vertices);
    let mut count = 0;
    for (g, m) in state.garments.iter_mut().zip(&model.garments) {
        for sleeve in &m.sleeves {
            let lost = sleeve.lost_rings(&arms, |v| g.positions[v as usize]);
            count += lost.len();
            let (mut vertices, mut positions) = (Vec::new(), Vec::new());
            for ring in &lost {
                vertices.extend_from_slice(ring.vertices);
                let at = |v: &u32| ring.recovery * g.positions[*v as usize];
                positions.extend(ring.vertices.iter().map(at));
            }
            if !lost.is_empty() {
                place(model, &m.own, g, skin, &vertices, &positions);
            }
        }
    }
    if count > 0 {
        state.sleep.wake_all();
    }
    count
}

/// Puts vertices at rest at these positions, metres.
fn place(
    model: &Model,
    own: &[u8],
    g: &mut GarmentState,
    skin: &SurfaceFrame,
    vertices: &[u32],
    positions: &[P3],
) {
    let masks = vertices.iter().map(|v| &own[*v as usize]);
    let surface = model.collision.surface();
    let nearest = surface.nearest_vertices(model.config.par, skin, positions, masks);
    for ((v, to), near) in vertices.iter().zip(positions).zip(nearest) {
        let v = *v as usize;
        g.positions[v] = *to;
        g.velocities[v] = V3::zeros();
        g.nearest[v][0] = near;
    }
}

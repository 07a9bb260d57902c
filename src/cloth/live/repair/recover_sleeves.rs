//! Puts sleeves that lost their arm around it again.

use crate::contact::SurfaceFrame;
use crate::live::outfit_model::Model;
use crate::live::state::{GarmentState, State};
use tryon_geometry::math::{P3, V3};

/// Puts lost rings of sleeves around their arms at rest, on the body `skin` of the last step. Returns their number.
pub(in crate::live) fn recover_sleeves(
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
            let mut targets = Vec::new();
            for ring in &lost {
                let at = |v: &u32| (*v, ring.recovery * g.positions[*v as usize]);
                targets.extend(ring.vertices.iter().map(at));
            }
            if !targets.is_empty() {
                place(model, &m.own, g, skin, &targets);
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
    targets: &[(u32, P3)],
) {
    let (vertices, positions): (Vec<usize>, Vec<P3>) =
        targets.iter().map(|(v, to)| (*v as usize, *to)).unzip();
    let masks = vertices.iter().map(|v| &own[*v]);
    let surface = model.collision.surface();
    let nearest = surface.nearest_vertices(model.config.par, skin, &positions, masks);
    for ((v, to), near) in vertices.into_iter().zip(positions).zip(nearest) {
        g.positions[v] = to;
        g.velocities[v] = V3::zeros();
        g.nearest[v][0] = near;
    }
}

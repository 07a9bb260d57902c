//! Orientation, texture coordinates and joint weights of a piece of cloth.

use crate::settings::GarmentSurfaceSettings;
use tryon_body::{SkinBinding, Template};
use tryon_garment::GarmentMesh;
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::face_normal;

/// Turns the faces so that they look away from the skin.
pub(super) fn orient_outwards(g: &mut GarmentMesh, x: &[P3], binding: &SkinBinding) {
    let out: f32 = g
        .faces
        .iter()
        .map(|f| {
            let skin = f
                .iter()
                .fold(V3::zeros(), |s, v| s + binding.normal[*v as usize]);
            face_normal(x, f).dot(&skin)
        })
        .sum();
    if out >= 0.0 {
        return;
    }
    for f in g.faces.iter_mut().chain(&mut g.render.faces) {
        f.swap(1, 2);
    }
    // The other side of the paper.
    for r in &mut g.rest {
        *r = [r[0], r[2], r[1]].map(|p| [-p[0], p[1]]);
    }
    for c in g.corners.iter_mut().flatten() {
        c.1[0] = -c.1[0];
    }
}

/// Sets texture coordinates around the vertical, lengths at `radius` metres, on a mesh whose own are no lengths.
pub(super) fn unroll(g: &mut GarmentMesh, x: &[P3], radius: f32) {
    let at = |p: &P3| [p.x.atan2(p.z) * radius, p.y];
    g.uv = x.iter().map(at).collect();
    let drawn = g.render.vertex.iter();
    g.render.uv = drawn.map(|v| at(&x[*v as usize])).collect();
}

/// Lets a skirt below the crotch follow both legs, each the more the nearer it is.
///
/// The nearest skin alone would pull the middle of the skirt up between the legs.
pub(super) fn follow_both_legs(
    template: &Template,
    x: &[P3],
    binding: &mut SkinBinding,
    settings: &GarmentSurfaceSettings,
) {
    let sk = template.skeleton();
    let at = |n: &str| sk.index(n).map(|j| (j, sk.joints()[j].rest.cast::<f32>()));
    let side = |s: &str| Some([at(&format!("{s}_hip"))?, at(&format!("{s}_knee"))?]);
    let (Some(left), Some(right)) = (side("left"), side("right")) else {
        return;
    };
    let is_arm = |j| template.parts().segment(j).is_arm();
    let is_arm: Vec<bool> = (0..sk.len()).map(is_arm).collect();
    let smooth = |t: f32| t.clamp(0.0, 1.0).powi(2) * (3.0 - 2.0 * t.clamp(0.0, 1.0));
    for (p, row) in x.iter().zip(&mut binding.joints) {
        let arm: f32 = row
            .iter()
            .zip(&is_arm)
            .filter_map(|(w, a)| a.then_some(w))
            .sum();
        let legs = smooth((left[0].1.y - p.y) / settings.leg_fade) * (1.0 - arm);
        if legs <= 0.0 {
            continue;
        }
        for (w, _) in row.iter_mut().zip(&is_arm).filter(|(_, a)| !**a) {
            *w *= (1.0 - arm - legs) / (1.0 - arm);
        }
        let share = smooth(0.5 + 0.5 * p.x / left[0].1.x.abs().max(settings.least_hip));
        for ([hip, knee], w) in [(left, legs * share), (right, legs * (1.0 - share))] {
            let below = smooth(0.5 + (knee.1.y - p.y) / settings.knee);
            row[hip.0] += w * (1.0 - below);
            row[knee.0] += w * below;
        }
    }
}

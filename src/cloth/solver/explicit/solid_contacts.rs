//! Contact planes of solids and targets of pins near one patch.

use super::constraint::{ContactPlane, Pin};
use super::patch_state::PatchState;
use crate::cloth::solver::Environment;
use crate::cloth::solver::collider::Collider;
use crate::math::V3d;
use nalgebra::Point3;

/// Speed at which penetrations of solids recover at most (m/s). Faster throws cloth off.
pub(in super::super) const RECOVERY_SPEED: f32 = 1.0;
/// Clearance below which a solid counts as near, beyond twice the possible approach (m): a gain of 1 m/s in 1 ms is 1 mm.
const CLEARANCE: f64 = 2e-3;

/// Distance that each vertex may approach each solid before the next query (m).
#[derive(Debug, Default)]
pub(in super::super) struct SolidContacts(Vec<f32>);

impl SolidContacts {
    /// Replaces `planes` with those of the solids near each vertex, moving as the solids do for `span` seconds from `t`.
    pub(in super::super) fn find(
        &mut self,
        environment: &Environment<'_>,
        state: &PatchState,
        (t, span): (f64, f64),
        planes: &mut Vec<ContactPlane>,
    ) {
        planes.clear();
        let n = state.start.len();
        self.0.resize(n * environment.colliders.len(), 0.0);
        let all = environment.colliders.iter();
        for (collider, clear) in all.zip(self.0.chunks_mut(n.max(1))) {
            find_planes(
                collider,
                environment.offset,
                state,
                (t, span),
                clear,
                planes,
            );
        }
    }
}

fn find_planes(
    c: &Collider,
    offset: f64,
    state: &PatchState,
    (t, span): (f64, f64),
    clearance: &mut [f32],
    planes: &mut Vec<ContactPlane>,
) {
    let (now, then) = (c.placement(t), c.placement(t + span));
    let change = then * now.inverse();
    let fastest = c.shape.max_displacement(&now, &then) / span;
    for (i, clearance) in clearance.iter_mut().enumerate() {
        let v = state.velocity[i];
        let travel = ((f64::from(v.dot(v).sqrt()) + fastest) * span) as f32;
        if *clearance > travel {
            *clearance -= travel;
            continue;
        }
        let x = Point3::from(state.position(i).to_f64());
        let (d, normal) = c.shape.distance(&now.inverse_transform_point(&x).coords);
        let reach = offset + CLEARANCE + 2.0 * f64::from(travel);
        *clearance = (d - reach).max(0.0) as f32;
        if d > reach {
            continue;
        }
        let normal = now.rotation * normal;
        let on = x - normal * d;
        let velocity: V3d = (change * on - on) / span;
        planes.push(ContactPlane {
            vertex: i as u32,
            normal: normal.into(),
            offset: (normal.dot(&on.coords) + offset) as f32,
            velocity: velocity.into(),
            friction: c.friction as f32,
        });
    }
}

/// Replaces `out` with rigid pins that move evenly for `span` seconds from `t`; `pinned` as of
/// [`Environment::pins_among`].
pub(in super::super) fn moving_pins(
    environment: &Environment<'_>,
    pinned: &[(u32, V3d)],
    (t, span): (f64, f64),
    out: &mut Vec<Pin>,
) {
    out.clear();
    out.extend(pinned.iter().map(|(vertex, local)| {
        let [start, end] = [t, t + span].map(|t| environment.pin_target(local, t));
        Pin {
            vertex: *vertex,
            target: start.into(),
            velocity: ((end - start) / span).into(),
            stiffness: 1.0,
        }
    }));
}

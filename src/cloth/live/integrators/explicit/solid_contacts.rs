//! Contact planes of solids and targets of pins near one patch.

use crate::live::integrators::Environment;
use crate::live::integrators::collider::Collider;
use crate::live::solver::explicit::PatchState;
use crate::live::solver::explicit::{ContactPlane, Pin};
use nalgebra::{Isometry3, Point3};
use tryon_geometry::math::V3d;

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
            let motion = SolidMotion::new(collider, environment.offset, (t, span));
            motion.find_planes(state, clear, planes);
        }
    }
}

/// Motion of one solid during the `span` seconds until the next query.
struct SolidMotion<'a> {
    solid: &'a Collider,
    /// Distance that cloth keeps from it (m).
    offset: f64,
    /// Placement now.
    now: Isometry3<f64>,
    /// Displacement until the next query, in the world.
    change: Isometry3<f64>,
    /// Largest speed of its surface (m/s).
    fastest: f64,
    span: f64,
}

impl<'a> SolidMotion<'a> {
    fn new(solid: &'a Collider, offset: f64, (t, span): (f64, f64)) -> Self {
        let (now, then) = (solid.placement(t), solid.placement(t + span));
        Self {
            solid,
            offset,
            now,
            change: then * now.inverse(),
            fastest: solid.shape.max_displacement(&now, &then) / span,
            span,
        }
    }

    /// Adds the planes of the vertices near the solid; `clearance` is that of each vertex from it.
    fn find_planes(
        &self,
        state: &PatchState,
        clearance: &mut [f32],
        planes: &mut Vec<ContactPlane>,
    ) {
        let Self { now, span, .. } = *self;
        for (i, clearance) in clearance.iter_mut().enumerate() {
            let v = state.velocity[i];
            let travel = ((f64::from(v.dot(v).sqrt()) + self.fastest) * span) as f32;
            if *clearance > travel {
                *clearance -= travel;
                continue;
            }
            let x = Point3::from(state.position(i).to_f64());
            let local = now.inverse_transform_point(&x).coords;
            let (d, normal) = self.solid.shape.distance(&local);
            let reach = self.offset + CLEARANCE + 2.0 * f64::from(travel);
            *clearance = (d - reach).max(0.0) as f32;
            if d > reach {
                continue;
            }
            let normal = now.rotation * normal;
            let on = x - normal * d;
            let velocity: V3d = (self.change * on - on) / span;
            planes.push(ContactPlane {
                vertex: i as u32,
                normal: normal.into(),
                offset: (normal.dot(&on.coords) + self.offset) as f32,
                velocity: velocity.into(),
                friction: self.solid.friction as f32,
            });
        }
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

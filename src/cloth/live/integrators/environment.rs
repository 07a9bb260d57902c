//! Surroundings of a sheet: moving solids, pinned vertices and gravity.

use super::collider::Collider;
use nalgebra::{Isometry3, Point3};
use tryon_geometry::math::{P3, V3d};

/// Solids and pins around a sheet.
#[derive(Clone, Debug)]
pub struct Environment<'a> {
    /// Solid bodies.
    pub colliders: &'a [Collider],
    /// m/s².
    pub gravity: V3d,
    /// Distance that cloth keeps from solids (m).
    pub offset: f64,
    /// Collider that carries the pins; `None` holds them in the world.
    carrier: Option<usize>,
    /// Pinned vertices, sorted, with their positions in the carrier's frame (m).
    pins: Vec<(u32, V3d)>,
}

/// Placements of a solid at the begin and the end of a substep.
pub(super) struct Sweep {
    before: Isometry3<f64>,
    after: Isometry3<f64>,
}

impl<'a> Environment<'a> {
    /// Surroundings whose `pins` keep their `start` positions relative to the `carrier`.
    pub fn new(
        colliders: &'a [Collider],
        (pins, carrier): (&[u32], Option<usize>),
        start: &[P3],
        (gravity, offset): (V3d, f64),
    ) -> Self {
        let local = |v: &u32| {
            let p = start[*v as usize].coords.cast();
            let in_carrier = |c: usize| colliders[c].placement(0.0).inverse() * Point3::from(p);
            (*v, carrier.map_or(p, |c| in_carrier(c).coords))
        };
        let mut pins: Vec<(u32, V3d)> = pins.iter().map(local).collect();
        pins.sort_unstable_by_key(|p| p.0);
        pins.dedup_by_key(|p| p.0);
        Self {
            colliders,
            gravity,
            offset,
            carrier,
            pins,
        }
    }
    /// Vertices with pins among `vertices`: their index there, and their position in the carrier's frame (m).
    pub(super) fn pins_among(&self, vertices: &[u32]) -> Vec<(u32, V3d)> {
        let pin = |v: &u32| self.pins.binary_search_by_key(v, |p| p.0).ok();
        let all = (0u32..).zip(vertices);
        all.filter_map(|(i, v)| Some((i, self.pins[pin(v)?].1)))
            .collect()
    }
    /// Target of a pin at time `t` (m).
    pub(super) fn pin_target(&self, local: &V3d, t: f64) -> V3d {
        self.carrier.map_or(*local, |c| {
            (self.colliders[c].placement(t) * Point3::from(*local)).coords
        })
    }
    /// All pinned vertices and their targets at time `t` (m).
    pub(super) fn pin_targets(&self, t: f64) -> impl Iterator<Item = (usize, V3d)> {
        let all = self.pins.iter();
        all.map(move |(v, local)| (*v as usize, self.pin_target(local, t)))
    }
    /// Largest depth of a vertex in a solid at time `t` (m).
    pub fn deepest(&self, t: f64, x: &[V3d]) -> f64 {
        let depth = |c: &'a Collider| {
            let back = c.placement(t).inverse();
            x.iter()
                .map(move |p| -c.shape.distance(&(back * Point3::from(*p)).coords).0)
        };
        self.colliders.iter().flat_map(depth).fold(0.0, f64::max)
    }
    /// Motion of the solids in a substep of `h` that ends at `t`.
    pub(super) fn sweeps(&self, t: f64, h: f64) -> Vec<Sweep> {
        let sweep = |c: &Collider| Sweep {
            before: c.placement(t - h),
            after: c.placement(t),
        };
        self.colliders.iter().map(sweep).collect()
    }
    /// True if a point is nearer to a solid than the offset at the end of the substep.
    pub(super) fn touches(&self, sweeps: &[Sweep], p: &V3d) -> bool {
        let mut all = self.colliders.iter().zip(sweeps);
        all.any(|(c, s)| s.distance(c, p).0 < self.offset)
    }
    /// `x` pushed out of every solid, with Coulomb friction against the solid's own motion since `before`. The depth of the
    /// inertial position `y` stands for the normal force.
    pub(super) fn project(&self, sweeps: &[Sweep], before: &V3d, y: &V3d, mut x: V3d) -> V3d {
        for (c, s) in self.colliders.iter().zip(sweeps) {
            let (d, n) = s.distance(c, &x);
            if d >= self.offset {
                continue;
            }
            let normal = s.after.rotation * n;
            x += normal * (self.offset - d);
            let load = (self.offset - s.distance(c, y).0).max(0.0);
            let carried = (s.after * s.before.inverse() * Point3::from(*before)).coords;
            let slip = x - carried;
            let slip = slip - normal * slip.dot(&normal);
            let length = slip.norm();
            if length > 0.0 {
                x -= slip * (c.friction * load / length).min(1.0);
            }
        }
        x
    }
}

impl Sweep {
    /// Signed distance (m) and normal in the solid's frame, at the end of the substep.
    fn distance(&self, c: &Collider, p: &V3d) -> (f64, V3d) {
        let local = self.after.inverse_transform_point(&Point3::from(*p));
        c.shape.distance(&local.coords)
    }
}

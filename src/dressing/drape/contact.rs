//! Contact of a draped garment with skin below and garments above: one plane each for every vertex.

use super::context::{DrapeContext, OuterGarment};
use super::state::Drape;
use crate::plane::DrapePlane;
use crate::skin::Skin;
use tryon_cloth::contact::{ClosestPoint, Part};
use tryon_garment::Region;
use tryon_geometry::math::{P3, V3d};
use tryon_geometry::par::Par;

impl Drape {
    /// Finds the nearest body vertices among all.
    pub(crate) fn find_nearest(&mut self, skin: &Skin<'_>) {
        let points = self.positions();
        let other: Vec<Part> = self.own.iter().map(|o| Region::ALL.0 & !o).collect();
        let of = |masks: &[Part]| {
            skin.model
                .nearest_vertices(Par::Rayon, skin.frame(), &points, masks.iter())
        };
        let both = of(&self.own).into_iter().zip(of(&other));
        self.nearest = both.map(|(own, other)| [own, other]).collect();
    }
    /// Takes the nearest body vertices from a coarser drape of the same garment.
    pub(crate) fn find_nearest_from(&mut self, skin: &Skin<'_>, coarse: &Self) {
        self.fine = true;
        for (i, near) in self.nearest.iter_mut().enumerate() {
            let d = |k: usize| (coarse.x[k] - self.x[i]).norm_squared();
            let k = (0..coarse.x.len())
                .min_by(|a, b| d(*a).total_cmp(&d(*b)))
                .unwrap_or(0);
            *near = coarse.nearest[k];
            let masks = [self.own[i], Region::ALL.0 & !self.own[i]];
            // A walk stays within its parts: a vertex of others needs a full search.
            for (slot, mask) in near.iter_mut().zip(masks) {
                if skin.model.part(*slot) & mask == 0 {
                    let p = P3::from(self.x[i].cast::<f32>());
                    *slot = skin.model.nearest_vertex(skin.frame(), &p, mask);
                }
            }
        }
    }
    /// Finds the planes of skin and outer garments.
    pub(super) fn find_planes(&mut self, context: &DrapeContext<'_>) {
        for i in 0..self.x.len() {
            let found = self.closest(i, context.skin);
            self.nearest[i] = found.map(|c| c.vertex);
            self.planes[i] = self.skin_planes(i, &found, context);
        }
        self.outer_planes.clear();
        for (k, outer) in context.outer.iter().enumerate() {
            self.find_outer_planes(k, outer);
        }
    }
    /// ClosestPoint points of the own parts and of the others.
    fn closest(&self, i: usize, skin: &Skin<'_>) -> [ClosestPoint; 2] {
        let (p, near) = (self.point(i), self.nearest[i]);
        let masks = [self.own[i], Region::ALL.0 & !self.own[i]];
        let found = [
            skin.model
                .closest_across_parts(skin.frame(), &p, near[0], masks[0]),
            skin.model.closest(skin.frame(), &p, near[1], masks[1]),
        ];
        if self.fine {
            skin.nearer(&p, found, masks)
        } else {
            found
        }
    }
    /// Planes at the closest points. Where the body closes on itself the own part decides, and skin inside the body supports
    /// nothing.
    fn skin_planes(
        &self,
        i: usize,
        found: &[ClosestPoint; 2],
        context: &DrapeContext<'_>,
    ) -> [DrapePlane; 2] {
        let (skin, offset, settings) = (context.skin, context.offset, &self.settings.contact);
        let facing = found[0]
            .clearance_to(&found[1])
            .filter(|_| !found[1].on_part_boundary)
            .map(f64::from);
        let room = facing.unwrap_or(f64::INFINITY);
        let distance = found.map(|c| f64::from(c.signed_distance));
        let plane = |c: &ClosestPoint| DrapePlane {
            point: c.point.coords.cast(),
            normal: c.normal.cast(),
            height: offset,
            near: room >= 0.0
                && !c.on_part_boundary
                && !skin.is_interior(c)
                && f64::from(c.signed_distance) < settings.reach,
        };
        let [mut own, mut other] = [plane(&found[0]), plane(&found[1])];
        let untangles = self.untangler.is_some();
        let closed = -settings.closed..0.0;
        if self.fine && untangles && closed.contains(&room) && !found[0].on_part_boundary {
            // At most half-way into skin that lies in other skin; coarse cloth must pass through it on its way out.
            let held = !skin.is_interior(&found[0]);
            (own.near, own.height) = (held && distance[0] < settings.reach, 0.5 * room);
        }
        let halved = untangles && facing.is_some() && own.near && other.near;
        let kept = halved && own.keep_half(&mut other, &self.x[i], distance, room, settings);
        other.near &= kept || room >= 2.0 * offset;
        [own, other]
    }
    /// Appends the planes of an outer garment.
    fn find_outer_planes(&mut self, k: usize, outer: &OuterGarment) {
        let (model, frame, settings) = (&outer.model, &outer.frame, self.settings.contact);
        if self.nearest_outer.len() <= k {
            let nearest = |(x, own): (&V3d, &Part)| {
                model.nearest_vertex(frame, &P3::from(x.cast::<f32>()), *own)
            };
            self.nearest_outer
                .push(self.x.iter().zip(&self.own).map(nearest).collect());
        }
        for (i, near) in self.nearest_outer[k].iter_mut().enumerate() {
            let p = P3::from(self.x[i].cast::<f32>());
            let c = model.closest(frame, &p, *near, self.own[i]);
            *near = c.vertex;
            let Some(c) = model.cover(frame, &p, &c, settings.hem) else {
                continue;
            };
            let reached = c.signed_distance < settings.outer_reach
                && -f64::from(c.signed_distance) < settings.reach;
            if reached && self.pinned[i].is_none() {
                let plane = DrapePlane {
                    point: c.point.coords.cast(),
                    normal: -c.normal.cast::<f64>(),
                    height: settings.under,
                    near: true,
                };
                self.outer_planes.push((i as u32, plane));
            }
        }
    }
    /// Projects under outer garments, then out of the body; the planes of a vertex's own parts come last. Tangled cloth may be
    /// `sunk` under the skin (m).
    pub(super) fn project_contacts(&mut self, sunk: f64) {
        for k in 0..self.outer_planes.len() {
            let (i, p) = self.outer_planes[k];
            self.project_out(i as usize, &p, sunk);
        }
        for i in 0..self.x.len() {
            let [own, other] = self.planes[i];
            let pushed = self.project_out(i, &other, sunk) + self.project_out(i, &own, sunk);
            let up = self.x[i].y - self.before[i].y;
            if pushed > 0.0 && up > 0.0 && self.held_down[i] && self.pinned[i].is_none() {
                self.x[i].y -= up.min(self.settings.contact.held_down * pushed);
            }
        }
    }
    /// Moves a vertex above a plane; returns the distance (m).
    fn project_out(&mut self, i: usize, p: &DrapePlane, sunk: f64) -> f64 {
        let (plane_size, lift) = (self.settings.contact.plane_size, self.settings.contact.lift);
        let d = self.x[i] - p.point;
        let slack = self.slack[i];
        let allowed = if slack > 0.0 {
            (slack + sunk).min((p.height + sunk).max(0.0))
        } else {
            0.0
        };
        let gap = p.normal.dot(&d) - (p.height - allowed);
        if p.near && gap < 0.0 && d.norm_squared() < plane_size * plane_size {
            let push = (-gap).min(lift);
            self.x[i] += p.normal * push;
            return push;
        }
        0.0
    }
    /// Moves cloth deep under the skin to the skin.
    pub(crate) fn lift_deep(&mut self, skin: &Skin<'_>) {
        for i in 0..self.x.len() {
            let c = skin.closest(&self.point(i), self.nearest[i][0], self.own[i]);
            let deep = f64::from(c.signed_distance) < -self.settings.contact.deep
                && !c.on_part_boundary
                && !skin.is_interior(&c);
            if deep && self.pinned[i].is_none() {
                self.x[i] = c.point.coords.cast();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One vertex at a height above a horizontal plane through the origin that keeps 2 mm.
    fn above(height: f64, slack: f64) -> (Drape, DrapePlane) {
        let plane = DrapePlane {
            normal: V3d::y(),
            height: 0.002,
            near: true,
            ..DrapePlane::default()
        };
        let drape = Drape {
            x: vec![V3d::new(0.0, height, 0.0)],
            slack: vec![slack],
            ..Drape::default()
        };
        (drape, plane)
    }

    #[test]
    fn projection_moves_a_vertex_to_its_height_by_at_most_one_lift() {
        let (mut drape, plane) = above(-0.001, 0.0);
        assert!((drape.project_out(0, &plane, 0.0) - 0.003).abs() < 1e-12);
        assert!((drape.x[0].y - 0.002).abs() < 1e-12);
        assert_eq!(drape.project_out(0, &plane, 0.0), 0.0, "already there");
        let (mut drape, plane) = above(-0.05, 0.0);
        assert_eq!(
            drape.project_out(0, &plane, 0.0),
            drape.settings.contact.lift
        );
    }

    #[test]
    fn slack_vertices_may_sink_to_the_skin_and_no_deeper() {
        let (mut drape, plane) = above(-0.001, 0.005);
        drape.project_out(0, &plane, 0.0);
        assert!(drape.x[0].y.abs() < 1e-12, "{}", drape.x[0].y);
        let (mut drape, plane) = above(-0.001, 0.005);
        assert_eq!(drape.project_out(0, &plane, 0.002), 0.0, "sunk by 2 mm");
    }

    #[test]
    fn planes_out_of_reach_move_nothing() {
        let (mut drape, plane) = above(-0.001, 0.0);
        let ignored = DrapePlane {
            near: false,
            ..plane
        };
        assert_eq!(drape.project_out(0, &ignored, 0.0), 0.0);
        drape.x[0].x = drape.settings.contact.plane_size;
        assert_eq!(drape.project_out(0, &plane, 0.0), 0.0);
    }
}

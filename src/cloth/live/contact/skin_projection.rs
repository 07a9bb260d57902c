//! Projection of cloth that ends a step below the skin.

use super::chunk::ContactChunk;
use crate::contact::{CollisionBody, SearchExtent, SkinGrid, SurfaceFrame, SurfaceModel};
use crate::live::outfit_model::Model;
use crate::live::patch::{PatchWork, v4};
use tryon_geometry::math::P3;

/// The body at the end of a step.
pub(in crate::live) struct SkinProjection<'a> {
    pub(in crate::live) model: &'a Model,
    pub(in crate::live) body: &'a CollisionBody,
    pub(in crate::live) grid: &'a SkinGrid,
    /// Time since the contact planes were generated, s.
    pub(in crate::live) since_query: f32,
}

impl SkinProjection<'_> {
    /// Measures the penetration of a chunk and projects its vertices out of the skin.
    pub(in crate::live) fn project(&self, p: &PatchWork, c: &mut ContactChunk) {
        let (g, f) = c.model(self.model);
        c.projected.clear();
        let planes = std::mem::take(&mut c.body_planes);
        let mut constrained = planes.iter().map(|plane| plane.vertex as usize).peekable();
        for (j, i) in c.owned(f) {
            if p.pinned[i] {
                continue;
            }
            let mut is_constrained = p.overstretched[i];
            while constrained.next_if(|v| *v == i).is_some() {
                is_constrained = true;
            }
            // Far from skin at the last query, cloth may be below it now: taut cloth snaps back by 2 cm in an interval.
            if !is_constrained && c.clearance[j][0] <= 0.0 {
                continue;
            }
            let v = f.vertices[i] as usize;
            self.project_vertex(p, c, [j, i], [g.own[v], g.other[v]], is_constrained);
        }
        c.body_planes = planes;
    }

    /// Projects vertex `j` of the chunk, `i` of the patch, with these masks of its own and of other parts.
    fn project_vertex(
        &self,
        p: &PatchWork,
        c: &mut ContactChunk,
        [j, i]: [usize; 2],
        masks: [u8; 2],
        is_constrained: bool,
    ) {
        let (surface, skin) = (self.surface(), self.skin());
        let settings = &self.model.config.contact;
        let (height, max_other) = (settings.projected_height, settings.max_other_depth);
        let candidates = |x: &P3| self.grid.candidates(surface, skin, x, masks);
        let mut x = p.position(i);
        let mut near = candidates(&x);
        let is_below =
            near[0].is_below() || is_constrained && (near[1].is_below() || !near[0].is_near());
        if !is_below {
            return;
        }
        // Its own parts have the last word.
        for side in [1, 0].into_iter().filter(|s| masks[*s] != 0) {
            // Skin of other parts is far from most cloth.
            let reach = if side == 1 { max_other } else { f32::MAX };
            let extent = SearchExtent {
                mask: masks[side],
                reach,
            };
            let (vertex, walked) = surface.closest_within(skin, &x, c.nearest[j][side], extent);
            let found = near[side].or_nearer(surface, skin, &x, walked.ok(), masks[side]);
            c.nearest[j][side] = found.map_or(vertex, |hit| hit.vertex);
            let Some(hit) = found else { continue };
            let depth = -hit.signed_distance;
            if hit.on_part_boundary
                || hit.signed_distance >= height
                || side == 1 && depth > max_other
                || self
                    .body
                    .interior()
                    .covers(surface.faces()[hit.face as usize])
            {
                continue;
            }
            c.report.penetration = c.report.penetration.max(f64::from(depth));
            let target = v4(&(hit.point + hit.normal * height).coords);
            x = p.held_by_cloth(i, target, self.since_query).point();
            let mut left = surface.closest(skin, &x, hit.vertex, masks[side]);
            if -left.signed_distance > settings.max_held_depth {
                x = left.point - left.normal * settings.max_held_depth;
                left = surface.closest(skin, &x, left.vertex, masks[side]);
            }
            c.projected
                .push((i as u32, v4(&x.coords) - p.motion.start[i]));
            let left = f64::from(-left.signed_distance);
            c.report.penetration_left = c.report.penetration_left.max(left);
            near = candidates(&x);
        }
    }

    fn surface(&self) -> &SurfaceModel {
        self.model.collision.surface()
    }
    fn skin(&self) -> &SurfaceFrame {
        self.body.frame()
    }
}

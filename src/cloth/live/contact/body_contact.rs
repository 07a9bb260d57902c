//! Contact of garments with the body: half-space constraints for each vertex near skin.

use super::chunk::ContactChunk;
use crate::contact::{ClosestPoint, DepthMaps, Interior, SearchExtent, SurfaceFrame, SurfaceModel};
use crate::live::garment_model::GarmentModel;
use crate::live::outfit_model::Model;
use crate::live::patch::{PatchWork, v4};
use crate::live::solver::explicit::ContactPlane;
use crate::live::state::GarmentState;
use tryon_garment::Region;
use tryon_geometry::math::{P3, V3};

/// The body during one interval, and what its contact generation reads.
pub(in crate::live) struct BodyContacts<'a> {
    pub(in crate::live) model: &'a Model,
    pub(in crate::live) interior: &'a Interior,
    /// Body at the beginning of the interval.
    pub(in crate::live) now: &'a SurfaceFrame,
    /// Body at both ends of the step, `dt` seconds apart.
    pub(in crate::live) before: &'a [P3],
    pub(in crate::live) after: &'a [P3],
    pub(in crate::live) dt: f32,
    /// Fastest body vertex, m/s.
    pub(in crate::live) fastest: f32,
    /// Length of the interval, s.
    pub(in crate::live) span: f32,
    /// Steps so far.
    pub(in crate::live) frames: u64,
    /// Garments at the beginning of the step.
    pub(in crate::live) garments: &'a [GarmentState],
    /// Planes of the last interval move on: in half the intervals cloth slides too little to meet other skin.
    pub(in crate::live) follows_planes: bool,
    /// Depth maps, in the first interval of a step.
    pub(in crate::live) maps: Option<&'a DepthMaps>,
}

/// Query of one vertex.
struct VertexQuery {
    /// Vertex in the chunk and in the garment.
    j: usize,
    v: u32,
    x: P3,
    /// Its own body parts, and the others.
    masks: [u8; 2],
    /// Largest relative motion to skin in the interval, metres.
    travel: f32,
    /// Distance that it keeps from the skin, metres.
    offset: f32,
}

impl BodyContacts<'_> {
    /// Contact planes of a chunk in this interval.
    pub(in crate::live) fn generate(&self, p: &PatchWork, c: &mut ContactChunk) {
        let (g, f) = c.model(self.model);
        let offset = g.offset as f32;
        if !self.model.config.cull_distant {
            c.clearance.fill([0.0; 2]);
        }
        let last = std::mem::take(&mut c.body_planes);
        let friction = g.sheet.friction as f32 * self.model.config.contact.skin_friction;
        let mut last = last.iter().peekable();
        for (j, i) in c.range.clone().enumerate() {
            let mut own = std::iter::from_fn(|| last.next_if(|p| p.vertex as usize <= i))
                .filter(|p| p.vertex as usize == i)
                .peekable();
            // Contradicting planes would tear cloth: overstretched vertices hang on their neighbours.
            if p.pinned[i] || p.overstretched[i] {
                continue;
            }
            if self.follows_planes && own.peek().is_some() {
                let moved = own.map(|plane| plane.after(self.span));
                c.body_planes.extend(moved);
                continue;
            }
            let v = f.vertices[i];
            let speed = p.motion.velocity[i].dot(p.motion.velocity[i]).sqrt();
            let query = VertexQuery {
                j,
                v,
                x: p.position(i),
                masks: [g.own[v as usize], g.other[v as usize]],
                travel: (speed + self.fastest) * self.span,
                offset,
            };
            if let Some(maps) = self.maps {
                self.seed_from_maps(maps, &query, &mut c.nearest[j]);
                self.seed_from_neighbour(g, c.garment, &query, &mut c.nearest[j]);
            }
            let found = [0, 1].map(|side| self.closest_skin(g, &query, side, c));
            let (found, offsets) = self.share_gap(&query, found, c);
            for side in [1, 0] {
                if let Some(hit) = &found[side] {
                    let plane = self.plane(i as u32, hit, offsets[side], friction);
                    c.body_planes.push(plane);
                }
            }
        }
    }

    /// Closest skin of one kind of parts, if it constrains the vertex. Skips queries within the clearance of the last one.
    fn closest_skin(
        &self,
        g: &GarmentModel,
        q: &VertexQuery,
        side: usize,
        c: &mut ContactChunk,
    ) -> Option<ClosestPoint> {
        let mask = q.masks[side];
        if mask == 0 {
            return None;
        }
        let clearance = &mut c.clearance[q.j][side];
        if *clearance > q.travel {
            *clearance -= q.travel;
            c.report.searches_skipped += 1;
            return None;
        }
        let surface = self.surface();
        let reach = self.model.config.reach as f32;
        let wanted = (q.offset + reach + q.travel).min(self.model.config.contact.max_reach);
        let around = g.topology.surface.neighbours(q.v).iter();
        let nearest = &self.garments[c.garment].nearest;
        let starts = around.map(|w| nearest[*w as usize][side]);
        let start = c.nearest[q.j][side];
        let extent = SearchExtent {
            mask,
            reach: wanted,
        };
        let (near, hit) = surface.closest_multistart(self.now, &q.x, start, extent, starts);
        c.nearest[q.j][side] = near;
        let mut hit = match hit {
            Ok(hit) => hit,
            Err(beyond) => {
                *clearance = beyond + wanted - q.offset - reach;
                return None;
            }
        };
        *clearance = if hit.on_part_boundary {
            0.0
        } else {
            hit.signed_distance - q.offset - reach
        };
        if hit.on_part_boundary && side == 0 {
            // Beyond its own parts: the closest skin of any part.
            hit = surface.closest(self.now, &q.x, near, Region::ALL.0);
        }
        let is_interior = self.interior.covers(surface.faces()[hit.face as usize]);
        let constrains = !is_interior && !hit.on_part_boundary && hit.signed_distance < wanted;
        constrains.then_some(hit)
    }

    /// Offsets from its own and from other skin.
    ///
    /// Between skins that face each other cloth keeps to its own half, so that layers do not pass each other. Where the
    /// skins penetrate each other the vertex has no plane and hangs on its neighbours.
    fn share_gap(
        &self,
        q: &VertexQuery,
        found: [Option<ClosestPoint>; 2],
        c: &mut ContactChunk,
    ) -> ([Option<ClosestPoint>; 2], [f32; 2]) {
        let Some(own) = &found[0] else {
            return (found, [q.offset; 2]);
        };
        let gap = found[1].and_then(|other| own.clearance_to(&other));
        let settings = &self.model.config.contact;
        let Some(gap) = gap.filter(|gap| *gap < settings.shared_gap) else {
            return (found, [q.offset; 2]);
        };
        c.report.pinched += usize::from(gap < 2.0 * q.offset);
        if gap < 0.0 {
            return ([None, None], [q.offset; 2]);
        }
        let half = 0.5 * gap;
        let middle = settings.middle_gap.min(0.5 * half);
        (found, [q.offset.min(half - middle), half + middle])
    }

    /// Half-space at a closest point, moving with its triangle.
    fn plane(&self, vertex: u32, c: &ClosestPoint, offset: f32, friction: f32) -> ContactPlane {
        let corners = self.surface().faces()[c.face as usize];
        let velocity = (0..3).fold(V3::zeros(), |s, k| {
            let v = corners[k] as usize;
            s + (self.after[v] - self.before[v]) * (c.weights[k] / self.dt)
        });
        ContactPlane {
            vertex,
            normal: v4(&c.normal),
            offset: c.normal.dot(&c.point.coords) + offset,
            velocity: v4(&velocity),
            friction,
        }
    }

    /// Takes a cloth neighbour's nearest skin over where it is nearer: walks may end on the wrong finger.
    fn seed_from_neighbour(
        &self,
        g: &GarmentModel,
        garment: usize,
        q: &VertexQuery,
        near: &mut [u32; 2],
    ) {
        let around = g.topology.surface.neighbours(q.v);
        let Some(&w) = around.get(self.frames as usize % around.len().max(1)) else {
            return;
        };
        let seeds = self.garments[garment].nearest[w as usize];
        for (near, seed) in near.iter_mut().zip(seeds) {
            let square = |b: u32| (self.now.vertices[b as usize] - q.x).norm_squared();
            if seed != *near && square(seed) < square(*near) {
                *near = seed;
            }
        }
    }

    /// Takes nearer starts of the walks over from the depth maps.
    fn seed_from_maps(&self, maps: &DepthMaps, q: &VertexQuery, near: &mut [u32; 2]) {
        let square = |v: u32| (self.now.vertices[v as usize] - q.x).norm_squared();
        let mut best = near.map(square);
        for face in maps.proposals(&q.x) {
            let v = self.surface().faces()[face as usize][0];
            let d = square(v);
            for k in 0..2 {
                if d < best[k] && self.surface().part(v) & q.masks[k] != 0 {
                    best[k] = d;
                    near[k] = v;
                }
            }
        }
    }

    fn surface(&self) -> &SurfaceModel {
        self.model.collision.surface()
    }

    /// Body vertex at the end of the interval, metres.
    pub(super) fn at_interval_end(&self, v: usize) -> P3 {
        self.now.vertices[v] + (self.after[v] - self.before[v]) * (self.span / self.dt)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::live::contact::chunk::split;
    use crate::live::patch::begin;
    use crate::live::state::State;
    use crate::live::test_outfit::square_in_front;
    use tryon_geometry::spatial::Bvh;

    const SPAN: f32 = 1.0 / 120.0;

    /// Patches and chunks after some generations of contact with a body that moves by `motion` in an interval.
    struct Fixture {
        model: Model,
        state: State,
        body: Vec<P3>,
        patches: Vec<PatchWork>,
        chunks: Vec<ContactChunk>,
    }

    impl Fixture {
        fn new(gap: f32) -> Self {
            let (model, state, body) = square_in_front(8, gap);
            let (mut patches, mut chunks) = (Vec::new(), Vec::new());
            begin(&model, &state, &mut patches);
            split(&model, &state, &mut chunks);
            for p in &mut patches {
                p.pinned.resize(p.asleep.len(), false);
                p.overstretched.resize(p.asleep.len(), false);
            }
            Self {
                model,
                state,
                body,
                patches,
                chunks,
            }
        }

        fn generate(&mut self, motion: V3) {
            let mut now = SurfaceFrame::without_normals(self.body.clone());
            let surface = self.model.collision.surface();
            surface.update_normals(self.model.config.par, &mut now);
            let after: Vec<P3> = self.body.iter().map(|p| p + motion).collect();
            let contacts = BodyContacts {
                model: &self.model,
                interior: self.state.body.interior(),
                now: &now,
                before: &self.body,
                after: &after,
                dt: SPAN,
                fastest: motion.norm() / SPAN,
                span: SPAN,
                frames: 0,
                garments: &self.state.garments,
                follows_planes: false,
                maps: None,
            };
            for c in &mut self.chunks {
                contacts.generate(&self.patches[c.at], c);
            }
        }

        /// Position of a plane's vertex and height of it over the skin below the plane, metres.
        fn height(&self, c: &ContactChunk, plane: &ContactPlane) -> (P3, f32) {
            let x = self.patches[c.at].position(plane.vertex as usize);
            let offset = self.model.garments[c.garment].offset as f32;
            (x, plane.normal.dot(v4(&x.coords)) - (plane.offset - offset))
        }
    }

    #[test]
    fn planes_lie_at_the_closest_skin_and_move_with_it() {
        let mut f = Fixture::new(0.004);
        let motion = V3::new(0.0, 0.0, 0.002);
        f.generate(motion);
        let surface = f.model.collision.surface();
        let bvh = Bvh::new(surface.faces(), &f.body);
        let mut count = 0;
        for c in &f.chunks {
            for plane in &c.body_planes {
                let (x, height) = f.height(c, plane);
                let closest = bvh.closest(&f.body, &x).expect("a body");
                assert!(
                    (height - closest.distance).abs() < 1e-4,
                    "{height} m, {} m to the closest skin",
                    closest.distance
                );
                let slip = plane.velocity - v4(&(motion / SPAN));
                assert!(slip.dot(slip) < 1e-8);
                count += 1;
            }
        }
        assert!(count > 4, "{count} planes");
    }

    #[test]
    fn pinned_and_overstretched_vertices_have_no_plane() {
        let mut f = Fixture::new(0.004);
        f.patches[0].pinned.fill(true);
        f.generate(V3::zeros());
        assert!(f.chunks[0].body_planes.is_empty());
        f.patches[0].pinned.fill(false);
        f.patches[0].overstretched.fill(true);
        f.generate(V3::zeros());
        assert!(f.chunks[0].body_planes.is_empty());
    }

    #[test]
    fn distant_cloth_is_queried_once_and_again_when_the_body_may_have_come_near() {
        let mut f = Fixture::new(0.3);
        f.generate(V3::zeros());
        let skipped = |f: &Fixture| {
            f.chunks
                .iter()
                .map(|c| c.report.searches_skipped)
                .sum::<usize>()
        };
        assert_eq!(skipped(&f), 0);
        f.generate(V3::zeros());
        let first = skipped(&f);
        assert!(first >= f.state.garments[0].positions.len(), "{first}");
        f.generate(V3::new(0.0, 0.0, 1.0));
        assert_eq!(
            skipped(&f),
            first,
            "a body that moves by a metre may be anywhere"
        );
        assert!(f.chunks.iter().all(|c| c.body_planes.is_empty()));
    }
}

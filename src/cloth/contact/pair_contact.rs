//! Contact of cloth with cloth by near pairs of features: separating planes that are laid anew in each block of substeps.
//!
//! Each pair, vertex and face or edge and edge, has a direction, that of its closest points at the query. In each block the
//! gap between both sides along it is divided, and both halves become half-spaces that move at the pair's mean velocity
//! ("divide and truncate", Chen et al. 2025). Of the pairs of one vertex with like directions the narrowest counts.

use super::self_contact::SelfContactFrame;
use crate::cloth::outfit_model::Model;
use crate::cloth::patch::{PatchWork, v4};
use crate::cloth::solver::explicit::ContactPlane;
use crate::cloth::state::State;
use crate::math::{P3, V3};
use crate::mesh::Csr;
use crate::par::{self, Par};
use crate::spatial::{HashGrid, closest_on_triangle};

/// Vertices that one thread queries in a row.
const CHUNK: usize = 256;
/// Directions of a vertex.
const DIRECTIONS: usize = 8;
/// A corner with less barycentric weight has no part in a point.
const MIN_WEIGHT: f32 = 1e-4;
const NONE: u32 = u32::MAX;
/// Shortest distance that has a direction, metres.
const SHORTEST: f32 = 1e-5;
/// Least squared sine of the angle between two edges of a pair.
const MIN_SINE: f32 = 1e-3;

/// Settings under trial.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tune {
    pub on: bool,
    pub reach: f32,
    pub gap: f32,
    pub block: f32,
    pub alike: f32,
    pub friction: f32,
    pub edges: bool,
    pub heights: bool,
    pub smooth: bool,
    pub sleeves: bool,
    /// Largest reach of what closes fast, metres.
    pub farthest: f32,
    pub x: [f32; 4],
}

impl Default for Tune {
    fn default() -> Self {
        Self {
            on: false,
            reach: 0.5,
            gap: 0.0015,
            block: 1.0 / 240.0,
            alike: 0.9,
            friction: 0.1,
            edges: true,
            heights: true,
            smooth: true,
            sleeves: true,
            farthest: 0.015,
            x: [0.0; 4],
        }
    }
}

/// Two features; the first `below` vertices belong to the one, the others to the other, to which `normal` points.
#[derive(Clone, Copy, Debug, Default)]
struct Pair {
    vertices: [u32; 4],
    below: usize,
    normal: V3,
}

/// Middle between both sides along the normal, metres, and mean velocity, m/s.
#[derive(Clone, Copy, Debug, Default)]
struct Middle {
    height: f32,
    velocity: V3,
}

/// Nearest face of other cloth on one side of a vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Hit {
    garment: u32,
    face: u32,
}


#[derive(Debug, Default)]
struct Found {
    /// Near faces, vertex by vertex, and the end of those of each vertex.
    hits: Vec<Hit>,
    ends: Vec<u32>,
    pairs: Vec<Pair>,
}

/// Near pairs of an outfit and their planes.
#[derive(Debug, Default)]
pub(in crate::cloth) struct PairContacts {
    /// First vertex of each garment, and the end.
    first: Vec<u32>,
    owner: Vec<u32>,
    x: Vec<P3>,
    last: Vec<P3>,
    velocity: Vec<V3>,
    grid: HashGrid,
    found: Vec<Found>,
    hits: Vec<Hit>,
    ends: Vec<u32>,
    pairs: Vec<Pair>,
    middles: Vec<Middle>,
    /// Slots of each vertex, and vertex, direction of each slot.
    slots: Vec<[u32; DIRECTIONS]>,
    slot_vertex: Vec<u32>,
    slot_normal: Vec<V3>,
    incidences: Vec<(u32, u32)>,
    by_slot: Csr,
    /// Offset, metres, and velocity of the plane of each slot.
    planes: Vec<(f32, V3)>,
}

impl PairContacts {
    /// Takes positions over at the beginning of a block that follows another one after `span` seconds; 0: the first one.
    pub(in crate::cloth) fn gather(&mut self, model: &Model, patches: &[PatchWork], span: f32) {
        self.first.clear();
        self.first.push(0);
        for g in &model.garments {
            let n = g.sheet.mass.len() as u32;
            self.first.push(self.first[self.first.len() - 1] + n);
        }
        let n = self.first[model.garments.len()] as usize;
        if self.owner.len() != n {
            self.owner.clear();
            for (k, g) in model.garments.iter().enumerate() {
                self.owner.resize(self.owner.len() + g.sheet.mass.len(), k as u32);
            }
        }
        std::mem::swap(&mut self.x, &mut self.last);
        self.x.resize(n, P3::origin());
        self.velocity.resize(n, V3::zeros());
        let mut at = 0;
        for (k, g) in model.garments.iter().enumerate() {
            let base = self.first[k] as usize;
            for f in &g.patches {
                let p = &patches[at];
                at += 1;
                for i in 0..f.owned {
                    let v = base + f.vertices[i] as usize;
                    self.x[v] = p.position(i);
                    self.velocity[v] = if span > 0.0 {
                        (self.x[v] - self.last[v]) / span
                    } else {
                        p.velocity(i)
                    };
                }
            }
        }
    }

    /// Finds the near pairs.
    pub(in crate::cloth) fn query(
        &mut self,
        model: &Model,
        state: &State,
        sheets: &[SelfContactFrame],
        span: f32,
    ) {
        let tune = model.config.tune;
        let edge = model.garments.iter().map(|g| g.self_contact.edge());
        let edge = edge.fold(0.0, f32::max);
        let reach = tune.reach * edge;
        let farthest = reach.max(tune.farthest);
        let corner = farthest.hypot(edge / 3f32.sqrt());
        self.grid.fill(&self.x, 2.0 * corner);
        let n = self.x.len();
        let mut found = std::mem::take(&mut self.found);
        found.resize_with(n.div_ceil(CHUNK), Found::default);
        let search = Search {
            model,
            state,
            sheets,
            all: self,
            reach,
            farthest,
            span,
            corner,
        };
        par::for_chunks(model.config.par, &mut found, 1, |k, f| {
            search.faces(k * CHUNK..((k + 1) * CHUNK).min(n), &mut f[0]);
        });
        let mut hits = std::mem::take(&mut self.hits);
        hits.clear();
        let mut ends = std::mem::take(&mut self.ends);
        ends.clear();
        ends.push(0);
        for f in &found {
            let base = hits.len() as u32;
            hits.extend_from_slice(&f.hits);
            ends.extend(f.ends.iter().map(|e| base + e));
        }
        if tune.edges {
            let search = Search {
                model,
                state,
                sheets,
                all: self,
                reach,
                farthest,
                span,
                corner,
            };
            par::for_chunks(model.config.par, &mut found, 1, |k, f| {
                search.edges(&hits, &ends, k * CHUNK..((k + 1) * CHUNK).min(n), &mut f[0].pairs);
            });
        }
        self.hits = hits;
        self.ends = ends;
        self.pairs.clear();
        found.iter().for_each(|f| self.pairs.extend_from_slice(&f.pairs));
        self.found = found;
        self.assign(tune.alike);
    }

    /// Groups the directions of the pairs by vertex.
    fn assign(&mut self, alike: f32) {
        self.slots.clear();
        self.slots.resize(self.x.len(), [NONE; DIRECTIONS]);
        self.slot_vertex.clear();
        self.slot_normal.clear();
        self.incidences.clear();
        for (k, p) in self.pairs.iter().enumerate() {
            for (i, v) in p.vertices.iter().enumerate() {
                let n = if i < p.below { -p.normal } else { p.normal };
                let slots = &mut self.slots[*v as usize];
                let mut best = (alike, NONE);
                let mut chosen = NONE;
                for s in slots.iter_mut() {
                    if *s == NONE {
                        *s = self.slot_vertex.len() as u32;
                        self.slot_vertex.push(*v);
                        self.slot_normal.push(n);
                        chosen = *s;
                        break;
                    }
                    let dot = self.slot_normal[*s as usize].dot(&n);
                    if dot > alike {
                        chosen = *s;
                        break;
                    }
                    if dot > best.0 || best.1 == NONE {
                        best = (dot, *s);
                    }
                }
                let chosen = if chosen == NONE { best.1 } else { chosen };
                self.incidences.push((chosen, k as u32));
            }
        }
        self.by_slot = Csr::from_pairs(self.slot_vertex.len(), &self.incidences);
    }

    /// Lays the planes for a block of `span` seconds that begins `t` seconds after the query.
    pub(in crate::cloth) fn lay(&mut self, model: &Model, t: f32, span: f32) {
        let tune = model.config.tune;
        let par = model.config.par;
        let (x, velocity) = (&self.x, &self.velocity);
        let pairs = &self.pairs;
        par::map_into(par, pairs.len(), 1024, &mut self.middles, |k| {
            let p = &pairs[k];
            let (mut low, mut high) = (f32::NEG_INFINITY, f32::INFINITY);
            let mut sums = [V3::zeros(); 2];
            for (i, v) in p.vertices.iter().enumerate() {
                let v = *v as usize;
                let h = p.normal.dot(&x[v].coords);
                if i < p.below {
                    low = low.max(h);
                    sums[0] += velocity[v];
                } else {
                    high = high.min(h);
                    sums[1] += velocity[v];
                }
            }
            let below = p.below as f32;
            Middle {
                height: 0.5 * (low + high),
                velocity: sums[0] * (0.5 / below) + sums[1] * (0.5 / (4.0 - below)),
            }
        });
        let (middles, by_slot) = (&self.middles, &self.by_slot);
        let (vertices, normals) = (&self.slot_vertex, &self.slot_normal);
        par::map_into(par, vertices.len(), 512, &mut self.planes, |s| {
            let v = vertices[s] as usize;
            let n = normals[s];
            let mut best = (f32::NEG_INFINITY, 0.0, V3::zeros());
            for k in by_slot.row(s) {
                let (p, m) = (&pairs[*k as usize], &middles[*k as usize]);
                let is_below = p.vertices[..p.below].contains(&(v as u32));
                let side = if is_below { -1.0 } else { 1.0 };
                let above = side * (p.normal.dot(&x[v].coords) - m.height) - 0.5 * tune.gap;
                let above = above.max(0.0f32.min(-tune.x[2]));
                let rate = n.dot(&m.velocity);
                let tight = rate * span - above;
                if tight > best.0 {
                    best = (tight, above, m.velocity);
                }
            }
            let (_, above, u) = best;
            (n.dot(&x[v].coords) - above - n.dot(&u) * t, u)
        });
    }

    /// Planes of a patch.
    pub(in crate::cloth) fn planes(
        &self,
        model: &Model,
        garment: usize,
        patch: usize,
        p: &mut PatchWork,
    ) {
        let f = &model.garments[garment].patches[patch];
        let base = self.first[garment];
        p.cloth_planes.clear();
        for (i, v) in f.vertices.iter().enumerate() {
            if p.pinned[i] || p.overstretched[i] {
                continue;
            }
            for s in self.slots[(base + v) as usize] {
                if s == NONE {
                    break;
                }
                let (offset, u) = &self.planes[s as usize];
                p.cloth_planes.push(ContactPlane {
                    vertex: i as u32,
                    normal: v4(&self.slot_normal[s as usize]),
                    offset: *offset,
                    velocity: v4(u),
                    friction: model.config.tune.friction,
                });
            }
        }
    }

    /// Slots and velocity of a vertex.
    pub(in crate::cloth) fn describe(&self, g: usize, v: u32) -> String {
        let v = (self.first[g] + v) as usize;
        let slots = self.slots[v].iter().filter(|s| **s != NONE);
        let slots: Vec<String> = slots
            .map(|s| {
                let n = self.slot_normal[*s as usize];
                let k = self.by_slot.row(*s as usize).len();
                format!("{:.1?}x{k}", [n.x, n.y, n.z])
            })
            .collect();
        format!("v {:.2?} slots {slots:?}", self.velocity[v].as_slice())
    }

    /// Number of pairs, slots.
    pub(in crate::cloth) fn counts(&self) -> [usize; 2] {
        [self.pairs.len(), self.slot_vertex.len()]
    }
}

struct Search<'a> {
    model: &'a Model,
    state: &'a State,
    sheets: &'a [SelfContactFrame],
    all: &'a PairContacts,
    reach: f32,
    farthest: f32,
    /// Time until the next query, s.
    span: f32,
    corner: f32,
}

impl Search<'_> {
    /// Reach of what closes at this speed.
    fn reach_at(&self, closing: f32) -> f32 {
        (self.reach + closing.max(0.0) * self.span).min(self.farthest.max(self.reach))
    }

    /// Pairs of vertices and faces.
    fn faces(&self, range: std::ops::Range<usize>, out: &mut Found) {
        out.hits.clear();
        out.pairs.clear();
        out.ends.clear();
        let mut scratch = Vec::new();
        for v in range {
            self.vertex(v, out, &mut scratch);
            out.ends.push(out.hits.len() as u32);
        }
    }

    fn vertex(&self, v: usize, out: &mut Found, scratch: &mut Vec<Hit>) {
        let all = self.all;
        let own = all.owner[v];
        let base = all.first[own as usize];
        let m = &self.model.garments[own as usize].self_contact.surface;
        let local = v as u32 - base;
        let x = all.x[v];
        let ring = m.neighbours(local);
        let stuck = &self.state.garments[own as usize].intersecting;
        if stuck.binary_search(&local).is_ok() {
            return;
        }
        scratch.clear();
        all.grid.within(&x, self.corner, |w, _| {
            let other = all.owner[w as usize];
            if other == own && (w == v as u32 || ring.contains(&(w - base))) {
                return;
            }
            let g = &self.model.garments[other as usize].self_contact.surface;
            scratch.extend(g.faces_around(w - all.first[other as usize]).iter().map(|f| Hit {
                garment: other,
                face: *f,
            }));
        });
        if scratch.is_empty() {
            return;
        }
        scratch.sort_unstable_by_key(|h| (h.garment, h.face));
        scratch.dedup_by_key(|h| (h.garment, h.face));
        // Of the points on edges and corners the nearest counts.
        let mut nearest = (f32::INFINITY, None);
        for h in scratch.iter() {
            let g = &self.model.garments[h.garment as usize].self_contact.surface;
            let first = all.first[h.garment as usize];
            let corners = g.faces()[h.face as usize];
            let c = corners.map(|c| c + first);
            if c.contains(&(v as u32)) {
                continue;
            }
            let at = c.map(|c| all.x[c as usize]);
            let w = closest_on_triangle(&x, at);
            let point = at[0].coords * w[0] + at[1].coords * w[1] + at[2].coords * w[2];
            let n = point - x.coords;
            let d = n.norm();
            if d >= self.farthest.max(self.reach) {
                continue;
            }
            let n = n / d.max(SHORTEST);
            let u = (0..3).fold(V3::zeros(), |u, k| u + all.velocity[c[k] as usize] * w[k]);
            if d >= self.reach_at(n.dot(&(all.velocity[v] - u))) {
                continue;
            }
            if h.garment == own && corners.iter().any(|c| ring.contains(c)) {
                let normals = &self.sheets[own as usize].surface.normals;
                let face = corners.iter().fold(V3::zeros(), |s, c| s + normals[*c as usize]);
                if face.dot(&normals[local as usize]) >= 0.0 {
                    continue;
                }
            }
            out.hits.push(*h);
            if d <= SHORTEST {
                continue;
            }
            let pair = Pair {
                vertices: [v as u32, c[0], c[1], c[2]],
                below: 1,
                normal: n,
            };
            if w.iter().all(|w| *w > MIN_WEIGHT) {
                out.pairs.push(pair);
            } else if d < nearest.0 && !g.is_border_point(h.face, w) {
                nearest = (d, Some(pair));
            }
        }
        out.pairs.extend(nearest.1);
    }

    /// Two edges belong to one ring that is not folded.
    fn is_flat(&self, a: [u32; 2], b: [u32; 2]) -> bool {
        let all = self.all;
        let g = all.owner[a[0] as usize];
        if g != all.owner[b[0] as usize] {
            return false;
        }
        let base = all.first[g as usize];
        let surface = &self.model.garments[g as usize].self_contact.surface;
        let is_near = a.iter().any(|v| {
            let near = surface.neighbours(v - base);
            b.iter().any(|w| near.contains(&(w - base)))
        });
        let normals = &self.sheets[g as usize].surface.normals;
        let of = |e: [u32; 2]| normals[(e[0] - base) as usize] + normals[(e[1] - base) as usize];
        is_near && of(a).dot(&of(b)) >= 0.0
    }

    /// Pairs of edges.
    fn edges(&self, hits: &[Hit], ends: &[u32], range: std::ops::Range<usize>, out: &mut Vec<Pair>) {
        let all = self.all;
        let mut near: Vec<[u32; 2]> = Vec::new();
        for v in range {
            let own = all.owner[v] as usize;
            let base = all.first[own];
            let m = &self.model.garments[own].self_contact.surface;
            for w in m.neighbours(v as u32 - base) {
                let w = (w + base) as usize;
                if w < v {
                    continue;
                }
                near.clear();
                let of = |v: usize| &hits[ends[v] as usize..ends[v + 1] as usize];
                for h in of(v).iter().chain(of(w)) {
                    let g = &self.model.garments[h.garment as usize].self_contact.surface;
                    let base = all.first[h.garment as usize];
                    let c = g.faces()[h.face as usize].map(|c| c + base);
                    for e in [[c[0], c[1]], [c[1], c[2]], [c[2], c[0]]] {
                        let e = [e[0].min(e[1]), e[0].max(e[1])];
                        if !near.contains(&e) {
                            near.push(e);
                        }
                    }
                }
                for e in &near {
                    out.extend(self.edge_pair([v as u32, w as u32], *e));
                }
            }
        }
    }

    fn edge_pair(&self, a: [u32; 2], b: [u32; 2]) -> Option<Pair> {
        if a.iter().any(|v| b.contains(v)) {
            return None;
        }
        let x = &self.all.x;
        let [p, q] = a.map(|v| x[v as usize]);
        let [r, s] = b.map(|v| x[v as usize]);
        let (d1, d2, o) = (q - p, s - r, p - r);
        let (aa, ee, bb) = (d1.dot(&d1), d2.dot(&d2), d1.dot(&d2));
        let (c, f) = (d1.dot(&o), d2.dot(&o));
        let den = aa * ee - bb * bb;
        if den < MIN_SINE * aa * ee {
            return None;
        }
        let (s, t) = (bb * f - c * ee, aa * f - bb * c);
        if !(s > 0.0 && s < den && t > 0.0 && t < den) {
            return None;
        }
        let (s, t) = (s / den, t / den);
        let n = d2 * t - d1 * s - o;
        let d = n.norm();
        if d >= self.farthest || d <= SHORTEST {
            return None;
        }
        let u = &self.all.velocity;
        let [ua, ub] = [(a, s), (b, t)].map(|(v, w)| {
            u[v[0] as usize] * (1.0 - w) + u[v[1] as usize] * w
        });
        let near = d < self.reach_at(n.dot(&(ua - ub)) / d) && !self.is_flat(a, b);
        near.then(|| Pair {
            vertices: [a[0], a[1], b[0], b[1]],
            below: 2,
            normal: n / d,
        })
    }
}

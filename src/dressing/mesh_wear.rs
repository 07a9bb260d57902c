//! A mesh made elsewhere as something to wear: its pieces, what each is and hangs on, and the body they were made on.

use super::carry::{Bound, Carrier, bind};
use super::made_on::{MadeOn, WearError};
use crate::body::Template;
use crate::body::parts::vertex_masks;
use crate::formats::obj::ObjMesh;
use crate::formats::sewn_obj::SewnObj;
use crate::garment::import::{
    coarsen, from_mesh, median_edge, panels_in_metres, read_mesh, remesh, some_faces, split, unfold,
};
use crate::garment::{AnchorSet, GarmentKind, GarmentMesh, Material, Region, mesh_area};
use crate::math::{P3, V3};
use crate::mesh::{Topology, TriMesh, face_normal, vertex_normals};
use crate::par::Par;
use crate::spatial::PointTree;
use std::path::Path;
use std::sync::Arc;

/// A garment file and the body it was made on, ready for [`super::dress_all`].
#[derive(Clone, Debug)]
pub struct MeshWear {
    /// What it is called.
    pub name: String,
    /// What was found in the file and decided about it, for people.
    pub notes: Vec<String>,
    made_on: Arc<MadeOn>,
    /// Innermost first.
    parts: Vec<Part>,
}

/// What holds a piece.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Hangs {
    /// It goes over the shoulders.
    Shoulders,
    /// Its uppermost opening is held by the body.
    Opening,
}

#[derive(Clone, Debug)]
struct Part {
    garment: GarmentMesh,
    /// On the body it was made on, metres.
    positions: Vec<P3>,
    bound: Bound,
    /// Panels keep their shape and are graded to the body's size; other meshes are fitted to the body, as their makers'
    /// programs do.
    as_cut: bool,
}

/// A piece smaller than this in every direction is a button or a buckle, metres.
const SMALL: f32 = 0.08;
/// From this share of vertices over head, hands or feet on a piece is no cloth.
const MOSTLY: f64 = 0.85;
/// Cloth starts at least this far above the skin, metres …
const ABOVE: f32 = 0.006;
/// … where skin is this near, metres.
const NEAR: f32 = 0.04;
/// Panels whose edges are shorter than this times what is asked for are made coarser: `dress_knife` with its edges of 6 mm
/// took 4.5 s to put on and could not be simulated in time.
const FINER: f64 = 0.7;
/// Triangles of parts that are no cloth smaller than this are left out, m².
const NO_AREA: f64 = 2e-8;

impl MeshWear {
    /// Reads a garment (`.obj`, `.glb`, `.gltf`, `.mhclo`) made on `body` (see [`MadeOn::read`]); without one a guess is
    /// made. Meshes that are no flat panels get triangles with edges of `edge` metres, flat panels where theirs are shorter.
    ///
    /// # Errors
    /// A fault of one of the files, by its edge, face or vertex.
    pub fn read(
        path: &Path,
        body: Option<&Path>,
        material: &Material,
        edge: f64,
    ) -> Result<Self, WearError> {
        Self::on(path, body.map(MadeOn::read).transpose()?, material, edge)
    }
    /// As [`Self::read`], on a body that has been read.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn on(
        path: &Path,
        body: Option<MadeOn>,
        material: &Material,
        edge: f64,
    ) -> Result<Self, WearError> {
        let file = read_mesh(path, body.as_ref().map(|b| b.file.as_slice()))?;
        let mut sewn = file.sewn;
        let is_bound = path.extension().is_some_and(|e| e == "mhclo");
        let raw = sewn.obj.mesh.vertices().to_vec();
        let made_on = match body {
            // A binding to vertices that the body lacks: the positions in the file, moved over its skin.
            Some(b) if is_bound && !file.bound => b.beneath(&raw)?,
            Some(b) => b,
            None => MadeOn::guess(&raw)?,
        };
        let unit = made_on.unit();
        let fault = |why| WearError::Piece { piece: 0, why };
        sewn.obj.mesh = sewn
            .obj
            .mesh
            .with_vertices(made_on.metres(&raw))
            .map_err(|e| fault(crate::garment::GarmentError::Mesh(e)))?;
        sewn.obj.uv.iter_mut().flatten().for_each(|c| *c *= unit);
        let mut notes = vec![format!("made on {}", made_on.said)];
        if file.turned > 0 {
            notes.push(format!(
                "{} faces turned over to agree with their neighbours",
                file.turned
            ));
        }
        let template = made_on.template.clone();
        let judge = Judge::new(&template);
        let (mut cloth, mut carried) = (Vec::new(), Vec::new());
        for piece in split(&sewn) {
            if judge.is_cloth(&piece) {
                cloth.push(piece)
            } else {
                carried.push(piece)
            }
        }
        let mut parts = Vec::new();
        for (piece, mut s) in cloth.into_iter().enumerate() {
            if s.stitches.is_empty() && s.obj.face_uv.is_empty() || !panels_in_metres(&s) {
                let mesh = remesh(&s.obj.mesh, edge);
                s = SewnObj {
                    obj: ObjMesh {
                        mesh,
                        uv: Vec::new(),
                        face_uv: Vec::new(),
                    },
                    stitches: Vec::new(),
                };
            }
            let part = Part::cloth(&judge, &s, &file.name, material, edge)
                .map_err(|why| WearError::Piece { piece, why })?;
            let g = &part.0.garment;
            let what = match (g.kind, part.1) {
                (GarmentKind::Top, _) => "top",
                (GarmentKind::Skirt, _) => "skirt",
                (GarmentKind::Trousers, _) => "trousers",
                (GarmentKind::Dress, _) => "dress or suit",
            };
            let rest = if part.0.as_cut {
                "panels graded to the body"
            } else {
                "fitted to the body"
            };
            notes.push(format!(
                "piece {piece}: {what}, {} vertices, {rest}{}",
                g.vertices, part.2
            ));
            parts.push(part.0);
        }
        parts = by_layer(parts);
        if let Some(merged) = merge(&carried) {
            let areas: Vec<usize> = (0..merged.obj.mesh.faces().len())
                .filter(|f| {
                    0.5 * f64::from(
                        face_normal(merged.obj.mesh.vertices(), &merged.obj.mesh.faces()[*f])
                            .norm(),
                    ) > NO_AREA
                })
                .collect();
            if let Some(kept) = some_faces(&merged, &areas) {
                let n = carried.len();
                let part = Part::carried(&judge, &kept, &file.name, material).map_err(|why| {
                    WearError::Piece {
                        piece: parts.len(),
                        why,
                    }
                })?;
                notes.push(format!(
                    "{n} {} of {} vertices carried by the skin: no cloth that falls",
                    if n == 1 { "part" } else { "parts" },
                    part.garment.vertices
                ));
                parts.insert(0, part);
            }
        }
        if parts.is_empty() {
            return Err(WearError::Nothing(format!(
                "{}: no piece with an area",
                path.display()
            )));
        }
        for (layer, p) in parts.iter_mut().enumerate() {
            p.garment.layer = layer.min(255) as u8;
        }
        Ok(Self {
            name: file.name,
            notes,
            made_on: Arc::new(made_on),
            parts,
        })
    }
    /// The same under another name, which its garments carry too.
    #[must_use]
    pub fn named(mut self, name: &str) -> Self {
        self.parts
            .iter_mut()
            .for_each(|p| p.garment.name = name.to_owned());
        Self {
            name: name.to_owned(),
            ..self
        }
    }
    /// Its place among other garments: that of what its outermost part is.
    pub fn layer(&self) -> u8 {
        let over = |p: &Part| matches!(p.garment.kind, GarmentKind::Top | GarmentKind::Dress);
        u8::from(self.parts.iter().any(over))
    }
    /// Vertices of all parts.
    pub fn vertices(&self) -> usize {
        self.parts.iter().map(|p| p.garment.vertices).sum()
    }
    /// The parts on another body, innermost first: meshes and where their vertices lie in the canonical pose, metres.
    pub(super) fn put_on(
        &self,
        template: &Template,
        figure: &super::figure::Figure,
    ) -> Vec<(GarmentMesh, Vec<P3>)> {
        let carrier = Carrier::new(&self.made_on, template, figure);
        let mut normals = Vec::new();
        let faces = template.mesh().faces();
        vertex_normals(
            Par::Rayon,
            &figure.vertices,
            faces,
            template.topology().vertex_faces(),
            &mut normals,
        );
        let tree = PointTree::new(&figure.vertices);
        // Rest shapes are taken above the skin: cloth that starts below it would be too tight for good.
        let above = |p: P3| match tree.nearest(&p, NEAR) {
            Some((i, _)) => {
                p + normals[i] * (ABOVE - normals[i].dot(&(p - figure.vertices[i]))).max(0.0)
            }
            None => p,
        };
        self.parts
            .iter()
            .map(|p| {
                let carried = p.garment.anchors.iter().any(|a| a.name == CARRIED);
                let x: Vec<P3> = (0..p.positions.len())
                    .map(|i| {
                        let q =
                            carrier.point(&p.positions[i], &p.bound.weights[i], &p.bound.over[i]);
                        if carried { q } else { above(q) }
                    })
                    .collect();
                let mut garment = p.garment.clone();
                if p.as_cut {
                    // Graded: all lengths by what the body is larger.
                    let area = |x: &[P3]| {
                        garment
                            .faces
                            .iter()
                            .map(|f| f64::from(face_normal(x, f).norm()))
                            .sum::<f64>()
                    };
                    let grade = (area(&x) / area(&p.positions).max(f64::MIN_POSITIVE)).sqrt();
                    garment
                        .rest
                        .iter_mut()
                        .flatten()
                        .flatten()
                        .for_each(|c| *c *= grade);
                } else {
                    for (rest, f) in garment.rest.iter_mut().zip(&garment.faces) {
                        let t = unfold(f.map(|v| x[v as usize].coords.cast()));
                        // Where carrying closed a triangle it keeps the shape it had.
                        if mesh_area(&t) > 0.2 * mesh_area(rest) {
                            *rest = t;
                        }
                    }
                }
                (garment, x)
            })
            .collect()
    }
}

/// Several pieces as one.
fn merge(pieces: &[SewnObj]) -> Option<SewnObj> {
    let mut out = pieces.first()?.clone();
    let (mut vertices, mut faces) = (
        out.obj.mesh.vertices().to_vec(),
        out.obj.mesh.faces().to_vec(),
    );
    for p in &pieces[1..] {
        let first = vertices.len() as u32;
        vertices.extend(p.obj.mesh.vertices());
        faces.extend(p.obj.mesh.faces().iter().map(|f| f.map(|v| v + first)));
        out.obj.face_uv.extend(&p.obj.face_uv);
    }
    out.stitches.clear();
    out.obj.mesh = TriMesh::new(vertices, faces).ok()?;
    Some(out)
}

/// What a piece is, by the skin it lies over.
struct Judge<'a> {
    template: &'a Template,
    parts: Vec<u8>,
    tree: PointTree,
    /// Is no cloth over this vertex of the body: head, hands, feet.
    end: Vec<bool>,
    shoulder: f32,
    knee: f32,
}

impl<'a> Judge<'a> {
    fn new(template: &'a Template) -> Self {
        let sk = template.skeleton();
        let body = template.mesh().vertices();
        let at = |n: &str| sk.index(n).map(|j| sk.joints()[j].rest.y as f32);
        let shoulder = at("left_shoulder").or_else(|| at("neck")).unwrap_or(1.4);
        Self {
            parts: vertex_masks(template),
            tree: PointTree::new(body),
            end: (0..body.len())
                .map(|i| {
                    let joint = template.weights().dominant(i);
                    template.parts().segment(joint).is_extremity()
                })
                .collect(),
            shoulder,
            knee: at("left_knee").unwrap_or(f32::MIN),
            template,
        }
    }
    fn is_cloth(&self, s: &SewnObj) -> bool {
        let Some((lo, hi)) = s.obj.mesh.bounds() else {
            return false;
        };
        let v = s.obj.mesh.vertices();
        let over = v
            .iter()
            .filter(|p| self.tree.nearest(p, 10.0).is_some_and(|(i, _)| self.end[i]))
            .count();
        // Socks go with the feet.
        (hi - lo).amax() > SMALL && hi.y > self.knee && (over as f64) < MOSTLY * v.len() as f64
    }
}

/// Closed chains of edges with one face, as their vertices.
fn openings(t: &Topology) -> Vec<Vec<u32>> {
    let mut next: std::collections::BTreeMap<u32, Vec<u32>> = std::collections::BTreeMap::new();
    for e in t.edges().iter().filter(|e| e.twin.is_none()) {
        next.entry(e.v[0]).or_default().push(e.v[1]);
        next.entry(e.v[1]).or_default().push(e.v[0]);
    }
    let mut seen = std::collections::BTreeSet::new();
    let mut out = Vec::new();
    for &start in next.keys() {
        if seen.contains(&start) {
            continue;
        }
        let (mut chain, mut stack) = (Vec::new(), vec![start]);
        while let Some(v) = stack.pop() {
            if seen.insert(v) {
                chain.push(v);
                stack.extend(&next[&v]);
            }
        }
        out.push(chain);
    }
    out
}

impl Part {
    /// A piece of cloth, what holds it, and what else is to be said.
    fn cloth(
        judge: &Judge<'_>,
        s: &SewnObj,
        name: &str,
        material: &Material,
        edge: f64,
    ) -> Result<(Self, Hangs, String), crate::garment::GarmentError> {
        let made = from_mesh(s, name, GarmentKind::Top, material.clone())?;
        let (mut g, mut x) = (made.garment, made.positions);
        let mut more = String::new();
        if made.open + made.closed > 0 {
            more = format!(
                ", {} stitches open, {} triangles closed",
                made.open, made.closed
            );
        }
        if made.flat && median_edge(&g) < FINER * edge {
            more += &format!(", {} in the file", g.vertices);
            (g, x) = coarsen(&g, &x, edge);
        }
        let topology = g.topology()?;
        let mut bound = bind(judge.template, &x, |i| {
            topology.vertex_neighbours().row(i).to_vec()
        });
        outside_out(&mut g, &x, &bound);
        if !made.flat {
            unroll(&mut g, &x);
        }
        // The part of the body that each vertex lies over: what its heaviest joints belong to.
        let part: Vec<u8> = (0..x.len())
            .map(|i| judge.parts[bound.over[i].first().map_or(0, |o| o.0 as usize)])
            .collect();
        let share = |mask: Region| {
            part.iter().filter(|p| **p & mask.0 != 0).count() as f64 / part.len().max(1) as f64
        };
        let legs = Region::LEFT_LEG.with(Region::RIGHT_LEG);
        let top = x.iter().map(|p| p.y).fold(f32::MIN, f32::max);
        let length = |l: &[u32]| {
            let (lo, hi) = l.iter().map(|v| x[*v as usize]).fold(
                (P3::from([f32::MAX; 3]), P3::from([f32::MIN; 3])),
                |(lo, hi), p| (lo.inf(&p), hi.sup(&p)),
            );
            (hi - lo).norm()
        };
        /// An opening smaller than this across is a slit, metres.
        const OPENING: f32 = 0.06;
        let rims: Vec<Vec<u32>> = openings(&topology)
            .into_iter()
            .filter(|l| length(l) > OPENING)
            .collect();
        let around_one = |leg: Region| {
            rims.iter().any(|l| {
                l.iter().filter(|v| part[**v as usize] & leg.0 != 0).count() * 10 > l.len() * 9
            })
        };
        // Trousers end in a leg each; a skirt ends around both.
        let two_legs = around_one(Region::LEFT_LEG) && around_one(Region::RIGHT_LEG);
        /// Cloth that reaches this close to the shoulders' height hangs from them, metres.
        const NEAR_SHOULDER: f32 = 0.02;
        let hangs = if top > judge.shoulder - NEAR_SHOULDER {
            Hangs::Shoulders
        } else {
            Hangs::Opening
        };
        g.kind = match hangs {
            Hangs::Shoulders if share(legs) > 0.25 => GarmentKind::Dress,
            Hangs::Shoulders => GarmentKind::Top,
            _ if two_legs => GarmentKind::Trousers,
            _ if share(legs) > 0.15 => GarmentKind::Skirt,
            _ => GarmentKind::Top,
        };
        if !two_legs {
            one_tube(judge.template, &x, &mut bound);
        }
        let own = |i: usize| -> Region {
            let p = Region(part[i]);
            if p.meets(Region::ARMS) {
                return p;
            }
            if !two_legs {
                return Region::TRUNK.with(legs);
            }
            /// Cloth this near to the middle may touch both legs, metres.
            const MIDDLE: f32 = 0.02;
            let trunk = Region::TRUNK;
            if p.meets(Region::TRUNK) && hangs == Hangs::Shoulders || x[i].x.abs() < MIDDLE {
                trunk.with(legs)
            } else {
                trunk.with(if x[i].x > 0.0 {
                    Region::LEFT_LEG
                } else {
                    Region::RIGHT_LEG
                })
            }
        };
        let alone: Vec<Region> = (0..x.len()).map(own).collect();
        // Where a sleeve meets the trunk both decide.
        g.regions = (0..x.len())
            .map(|i| {
                topology
                    .vertex_neighbours()
                    .row(i)
                    .iter()
                    .fold(alone[i], |r, n| r.with(alone[*n as usize]))
            })
            .collect();
        g.anchors = anchors(judge, &rims, &x, hangs);
        Ok((
            Self {
                garment: g,
                positions: x,
                bound,
                as_cut: made.flat,
            },
            hangs,
            more,
        ))
    }
    fn carried(
        judge: &Judge<'_>,
        s: &SewnObj,
        name: &str,
        material: &Material,
    ) -> Result<Self, crate::garment::GarmentError> {
        let made = from_mesh(s, name, GarmentKind::Top, material.clone())?;
        let (mut g, x) = (made.garment, made.positions);
        let bound = bind(judge.template, &x, |_| Vec::new());
        g.anchors = vec![AnchorSet {
            name: CARRIED.into(),
            vertices: (0..x.len() as u32).collect(),
            strength: 1.0,
        }];
        Ok(Self {
            garment: g,
            positions: x,
            bound,
            as_cut: false,
        })
    }
}

/// Name of the anchors of parts that are no cloth.
pub(super) const CARRIED: &str = "carried";

/// Name of the anchors on the shoulders.
pub(super) const SHOULDERS: &str = "shoulders";

/// What holds a piece of cloth.
fn anchors(judge: &Judge<'_>, rims: &[Vec<u32>], x: &[P3], hangs: Hangs) -> Vec<AnchorSet> {
    let ring = || -> Vec<u32> {
        /// What has no opening at the top is held by this much of it, metres.
        const RING: f32 = 0.025;
        let top = x.iter().map(|p| p.y).fold(f32::MIN, f32::max);
        (0..x.len() as u32)
            .filter(|v| x[*v as usize].y > top - RING)
            .collect()
    };
    match hangs {
        Hangs::Opening => {
            let height =
                |l: &[u32]| l.iter().map(|v| x[*v as usize].y).sum::<f32>() / l.len().max(1) as f32;
            let highest = rims.iter().max_by(|a, b| height(a).total_cmp(&height(b)));
            let vertices = highest.cloned().unwrap_or_else(ring);
            vec![AnchorSet {
                name: "opening".into(),
                vertices,
                strength: 1.0,
            }]
        }
        Hangs::Shoulders => {
            let sk = judge.template.skeleton();
            let at = |n: &str| sk.index(n).map(|j| sk.joints()[j].rest.cast::<f32>());
            let Some([neck, tip]) = at("neck").zip(at("left_shoulder")).map(|(a, b)| [a, b]) else {
                return vec![];
            };
            /// Half width of what lies on a shoulder, metres.
            const HALF: f32 = 0.012;
            let inner = 0.3 * (tip.x - neck.x).abs();
            let on = |p: &P3| {
                p.y > tip.y
                    && (p.z - tip.z).abs() < HALF
                    && (inner..(tip.x - neck.x).abs() + HALF).contains(&p.x.abs())
            };
            let vertices: Vec<u32> = (0..x.len() as u32)
                .filter(|v| on(&x[*v as usize]))
                .collect();
            if !vertices.is_empty() {
                // Firmly: a jacket that is open in front would slide off a body without friction.
                return vec![AnchorSet {
                    name: SHOULDERS.into(),
                    vertices,
                    strength: 1.0,
                }];
            }
            // A shirt front or a collar: it hangs from its top.
            vec![AnchorSet {
                name: SHOULDERS.into(),
                vertices: ring(),
                strength: 1.0,
            }]
        }
    }
}

/// Below the crotch a skirt goes with both legs, with each the more the nearer it is: the nearest skin would pull its
/// middle up between them.
fn one_tube(template: &Template, x: &[P3], bound: &mut Bound) {
    let sk = template.skeleton();
    let at = |n: &str| sk.index(n).map(|j| (j, sk.joints()[j].rest.cast::<f32>()));
    let side = |s: &str| Some([at(&format!("{s}_hip"))?, at(&format!("{s}_knee"))?]);
    let (Some(left), Some(right)) = (side("left"), side("right")) else {
        return;
    };
    let arms: Vec<bool> = (0..sk.len())
        .map(|j| template.parts().segment(j).is_arm())
        .collect();
    /// From the hip joints down to where legs alone decide, metres.
    const FADE: f32 = 0.12;
    /// Height over which a knee bends cloth, metres.
    const KNEE: f32 = 0.10;
    let smooth = |t: f32| t.clamp(0.0, 1.0).powi(2) * (3.0 - 2.0 * t.clamp(0.0, 1.0));
    for (p, row) in x.iter().zip(&mut bound.weights) {
        let arm: f32 = row
            .iter()
            .zip(&arms)
            .filter(|(_, a)| **a)
            .map(|(w, _)| w)
            .sum();
        let legs = smooth((left[0].1.y - p.y) / FADE) * (1.0 - arm);
        if legs <= 0.0 {
            continue;
        }
        row.iter_mut()
            .zip(&arms)
            .filter(|(_, a)| !**a)
            .for_each(|(w, _)| *w *= (1.0 - arm - legs) / (1.0 - arm));
        let share = smooth(0.5 + 0.5 * p.x / left[0].1.x.abs().max(0.05));
        for ([hip, knee], w) in [(left, legs * share), (right, legs * (1.0 - share))] {
            let below = smooth(0.5 + (knee.1.y - p.y) / KNEE);
            row[hip.0] += w * (1.0 - below);
            row[knee.0] += w * below;
        }
    }
}

/// Faces look away from the skin.
fn outside_out(g: &mut GarmentMesh, x: &[P3], bound: &Bound) {
    let out: f32 = g
        .faces
        .iter()
        .map(|f| {
            let skin = f
                .iter()
                .fold(V3::zeros(), |s, v| s + bound.normal[*v as usize]);
            face_normal(x, f).dot(&skin)
        })
        .sum();
    if out >= 0.0 {
        return;
    }
    for f in g.faces.iter_mut().chain(&mut g.render.faces) {
        f.swap(1, 2);
    }
    for r in &mut g.rest {
        // Seen from the other side of the paper.
        *r = [r[0], r[2], r[1]].map(|p| [-p[0], p[1]]);
    }
    g.corners
        .iter_mut()
        .flatten()
        .for_each(|c| c.1[0] = -c.1[0]);
}

/// Texture coordinates around the vertical, metres: a mesh that is no flat panels has none that mean lengths.
fn unroll(g: &mut GarmentMesh, x: &[P3]) {
    /// Where the unrolled texture has its lengths, metres from the vertical: about a trunk's radius.
    const RADIUS: f32 = 0.15;
    let at = |p: &P3| [p.x.atan2(p.z) * RADIUS, p.y];
    g.uv = x.iter().map(at).collect();
    g.render.uv = g
        .render
        .vertex
        .iter()
        .map(|v| at(&x[*v as usize]))
        .collect();
}

/// Innermost first: by how far two pieces are from the skin that both cover.
fn by_layer(parts: Vec<Part>) -> Vec<Part> {
    let height: Vec<std::collections::BTreeMap<u32, (f32, f32)>> = parts
        .iter()
        .map(|p| {
            let mut of = std::collections::BTreeMap::new();
            for (over, far) in p.bound.over.iter().zip(&p.bound.far) {
                if let Some((v, _)) = over.first() {
                    let e = of.entry(*v).or_insert((0.0, 0.0));
                    *e = (e.0 + far, e.1 + 1.0);
                }
            }
            of
        })
        .collect();
    let above = |a: usize, b: usize| -> f32 {
        height[a]
            .iter()
            .filter_map(|(v, p)| height[b].get(v).map(|q| p.0 / p.1 - q.0 / q.1))
            .sum()
    };
    let mut order: Vec<usize> = Vec::new();
    for k in 0..parts.len() {
        let at = order
            .iter()
            .position(|o| above(*o, k) > 0.0)
            .unwrap_or(order.len());
        order.insert(at, k);
    }
    order.into_iter().map(|k| parts[k].clone()).collect()
}

//! Template of a clothed person: the body's surface, or one whose legs are joined in a tube.

use super::meridian::{Crotch, MeridianSearch, leg_vertices};
use super::strip::{Between, Strip};
use crate::CaptureError;
use crate::settings::TopologySettings;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::sync::Arc;
use tryon_body::parts::BodySide;
use tryon_body::{BodyError, ShapeSpace, SkinWeights, Template};
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::{Face, TriMesh, sides, undirected};

/// Course of the cloth around the legs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LegTopology {
    /// Around each one: trousers, or nothing.
    #[default]
    Apart,
    /// Around both: skirts, dresses, coats.
    Joined,
}

/// Template whose first vertices are the body's; those of the tube between the legs follow.
#[derive(Clone, Debug)]
pub struct ClothTemplate {
    body: Arc<Template>,
    template: Arc<Template>,
    legs: LegTopology,
    between: Vec<Between>,
}

impl ClothTemplate {
    /// Template of a topology.
    ///
    /// # Errors
    /// [`CaptureError::Topology`] for a body without legs that can be joined.
    pub fn new(body: &Arc<Template>, legs: LegTopology) -> Result<Self, CaptureError> {
        if legs == LegTopology::Joined {
            return join_legs(body);
        }
        Ok(Self {
            body: body.clone(),
            template: body.clone(),
            legs,
            between: Vec::new(),
        })
    }

    /// Body that it clothes.
    pub fn body(&self) -> &Arc<Template> {
        &self.body
    }

    fn body_vertices(&self) -> usize {
        self.body.mesh().vertices().len()
    }

    /// Surface, skinning and shape space with the vertices of the tube.
    pub fn template(&self) -> &Arc<Template> {
        &self.template
    }

    /// Topology.
    pub fn legs(&self) -> LegTopology {
        self.legs
    }

    /// Vertices over those of the body, which come first; any positions or displacements.
    pub fn extend(&self, body: &[P3]) -> Vec<P3> {
        let between = self.between.iter().map(|b| b.at(body));
        body.iter().copied().chain(between).collect()
    }

    /// Belongs to the tube between the legs, not to the body.
    pub fn is_between(&self, vertex: usize) -> bool {
        vertex >= self.body_vertices()
    }

    /// Body vertex of a vertex: itself, or the nearer end for one between the legs.
    pub fn body_vertex(&self, vertex: u32) -> u32 {
        let k = (vertex as usize).checked_sub(self.body_vertices());
        k.map_or(vertex, |k| {
            let between = &self.between[k];
            between.ends[usize::from(between.share > 0.5)]
        })
    }

    /// Vertices of the tube within a range of shares of the way from leg to leg, top to bottom.
    pub fn middle(&self, [least, most]: [f32; 2]) -> impl Iterator<Item = usize> + '_ {
        let inner = (self.body_vertices()..).zip(&self.between);
        let inner = inner.filter(move |(_, b)| (least..most).contains(&b.share));
        inner.map(|(v, _)| v)
    }
}

/// Leaves out the faces between the legs and joins the legs at front and back.
fn join_legs(body: &Arc<Template>) -> Result<ClothTemplate, CaptureError> {
    let fault = |why: &str| CaptureError::Topology { why: why.into() };
    let settings = &TopologySettings::default();
    let vertices = body.mesh().vertices();
    let crotch = Crotch::of(body, settings).ok_or_else(|| fault("the body has no legs"))?;
    let lines = [1.0, -1.0].map(|face| {
        let search = MeridianSearch {
            template: body,
            crotch: &crotch,
            face,
            settings,
        };
        search.run()
    });
    let [Some(mut front), Some(mut back)] = lines else {
        return Err(fault("no line of edges leads down its legs"));
    };
    let gone = inner_faces(body, &crotch, &[&front, &back], settings);
    let lines = front.iter_mut().chain(&mut back);
    lines.for_each(|line| keep_open(body, &gone, line));
    let all = body.mesh().faces().iter().zip(&gone);
    let mut faces: Vec<Face> = all.filter(|(_, g)| !**g).map(|(f, _)| *f).collect();
    let mut between = Vec::new();
    for (lines, outward) in [(&front, 1.0), (&back, -1.0)] {
        let first = (vertices.len() + between.len()) as u32;
        let [left, right] = lines;
        // Lines know nothing of vertices between others: these are numbered behind them.
        let strip = Strip::join([left, right], vertices, settings.spacing, outward);
        let body = vertices.len() as u32;
        let renumber = |v: u32| if v < body { v } else { v - body + first };
        faces.extend(strip.faces.iter().map(|f| f.map(renumber)));
        between.extend(strip.vertices);
    }
    let template = extended(body, &between, faces).map_err(|e| fault(&e))?;
    Ok(ClothTemplate {
        body: body.clone(),
        template: Arc::new(template),
        legs: LegTopology::Joined,
        between,
    })
}

/// Cuts a line where the faces on both of its sides are kept.
fn keep_open(body: &Template, gone: &[bool], line: &mut Vec<u32>) {
    let faces = body.mesh().faces();
    let is_open = |e: &[u32]| {
        let around = body.topology().vertex_faces().row(e[0] as usize).iter();
        let mut both = around.filter(|f| faces[**f as usize].contains(&e[1]));
        both.any(|f| gone[*f as usize])
    };
    let open = line.windows(2).take_while(|e| is_open(e)).count();
    line.truncate(open + 1);
}

/// Membership of each face of a body in the region between its legs, which the lines enclose.
fn inner_faces(
    body: &Template,
    crotch: &Crotch,
    lines: &[&[Vec<u32>; 2]],
    settings: &TopologySettings,
) -> Vec<bool> {
    let spacing = settings.spacing;
    let (vertices, faces) = (body.mesh().vertices(), body.mesh().faces());
    let walls = lines.iter().copied().flatten();
    let walls = walls.flat_map(|line| line.windows(2));
    let walls: BTreeSet<_> = walls.map(|e| undirected([e[0], e[1]])).collect();
    // The lines end a little above or below their height.
    let lowest = crotch.end + spacing;
    let is_above = |f: &Face| f.iter().all(|v| vertices[*v as usize].y > lowest);
    let inner = |side| {
        let leg = leg_vertices(body, side);
        let near =
            |v: &u32| (vertices[*v as usize].y - crotch.at.y + settings.inner).abs() < spacing;
        let off = |v: &u32| vertices[*v as usize].x.abs();
        let near = leg.into_iter().filter(near);
        near.min_by(|a, b| off(a).total_cmp(&off(b)))
    };
    let around = body.topology().vertex_faces();
    let seeds = [BodySide::Left, BodySide::Right].map(inner);
    let open = seeds.iter().flatten().flat_map(|v| around.row(*v as usize));
    let mut open: Vec<u32> = open.copied().collect();
    let mut gone = vec![false; faces.len()];
    while let Some(f) = open.pop() {
        if gone[f as usize] || !is_above(&faces[f as usize]) {
            continue;
        }
        gone[f as usize] = true;
        for [p, q] in sides(&faces[f as usize]) {
            if walls.contains(&undirected([p, q])) {
                continue;
            }
            let across = around.row(p as usize).iter();
            open.extend(across.filter(|g| faces[**g as usize].contains(&q)));
        }
    }
    gone
}

/// Template with further vertices between those of the body and other faces.
fn extended(body: &Template, between: &[Between], faces: Vec<Face>) -> Result<Template, String> {
    let coords: Vec<V3> = body.mesh().vertices().iter().map(|p| p.coords).collect();
    let with = |all: &[V3]| -> Vec<V3> {
        let new = between.iter().map(|b| b.at(all));
        all.iter().copied().chain(new).collect()
    };
    let mesh = TriMesh::new(with(&coords).into_iter().map(P3::from).collect(), faces);
    let weights = body.weights();
    let row = |v: u32, share: f32| {
        let (joints, weights) = (weights.joints[v as usize], weights.weights[v as usize]);
        (0..4).map(move |k| (usize::from(joints[k]), f64::from(weights[k] * share)))
    };
    let rows = between.iter().map(|b| {
        let mut merged = std::collections::BTreeMap::new();
        let both = row(b.ends[0], 1.0 - b.share).chain(row(b.ends[1], b.share));
        both.for_each(|(j, w)| *merged.entry(j).or_insert(0.0) += w);
        merged.into_iter().collect::<Vec<_>>()
    });
    let new = SkinWeights::from_rows(rows).map_err(|e| e.to_string())?;
    let weights = SkinWeights {
        joints: [&weights.joints[..], &new.joints].concat(),
        weights: [&weights.weights[..], &new.weights].concat(),
    };
    let shape = body.shape_space().map(|s| ShapeSpace {
        vertices: s.vertices.iter().map(|d| with(d)).collect(),
        ..s.clone()
    });
    let mesh = mesh.map_err(|e| e.to_string())?;
    let fault = |e: BodyError| e.to_string();
    let made = Template::new(body.name(), mesh, body.skeleton().clone(), weights, shape);
    let made = made.map_err(fault)?;
    let Some(shapes) = body.pose_shapes() else {
        return Ok(made);
    };
    let shapes = shapes.extended(between.iter().map(|b| (b.ends, b.share)));
    made.with_pose_shapes(shapes).map_err(fault)
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_body::embedded;

    #[test]
    fn joined_legs_are_one_tube() {
        let body = embedded::template();
        let cloth = ClothTemplate::new(&body, LegTopology::Joined).expect("the body has legs");
        let vertices = cloth.template().mesh().vertices();
        let crotch = Crotch::of(&body, &TopologySettings::default());
        let crotch = crotch.expect("legs").at.y;
        // A horizontal cut between crotch and knee meets faces in front and behind at the middle, and none between.
        let level = crotch - 0.2;
        let mut depths: Vec<f32> = Vec::new();
        for f in cloth.template().mesh().faces() {
            let p = f.map(|v| vertices[v as usize]);
            let crosses = |axis: usize, value: f32| {
                p.iter().any(|q| q[axis] < value) && p.iter().any(|q| q[axis] >= value)
            };
            if crosses(1, level) && crosses(0, 0.0) {
                depths.push(p.iter().map(|q| q.z).sum::<f32>() / 3.0);
            }
        }
        depths.sort_by(f32::total_cmp);
        let spread = depths[depths.len() - 1] - depths[0];
        assert!(spread > 0.1, "{depths:?}");
        let count = |t: &Template| t.mesh().faces().len() as f64;
        let kept = count(cloth.template()) / count(&body);
        assert!((0.8..1.1).contains(&kept), "{kept}");
        // It lies on its body.
        let extended = cloth.extend(body.mesh().vertices());
        let off = extended.iter().zip(vertices).map(|(a, b)| (a - b).norm());
        assert!(off.fold(0.0, f32::max) < 1e-6);
        assert!(cloth.middle([0.3, 0.7]).count() > 20);
    }
}

//! Template of a clothed person: the body's surface, or one whose legs are joined in a tube.

use super::meridian::{Crotch, leg_vertices, meridians};
use super::strip::{Between, Strip};
use crate::CaptureError;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::sync::Arc;
use tryon_body::parts::BodySide;
use tryon_body::{BodyError, ShapeSpace, SkinWeights, Template};
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::{Face, TriMesh, sides, undirected};

/// Edges across the tube, metres.
const SPACING: f32 = 0.02;
/// Height below the crotch of the faces between the legs that the removal starts at, metres.
const INNER: f32 = 0.15;

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
        match legs {
            LegTopology::Apart => Ok(Self {
                body: body.clone(),
                template: body.clone(),
                legs,
                between: Vec::new(),
            }),
            LegTopology::Joined => join_legs(body),
        }
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
        let between = self.between.iter().map(|b| {
            let [p, q] = b.ends.map(|v| body[v as usize]);
            p + (q - p) * b.share
        });
        body.iter().copied().chain(between).collect()
    }

    /// Belongs to the tube between the legs, not to the body.
    pub fn is_between(&self, vertex: usize) -> bool {
        vertex >= self.body_vertices()
    }

    /// Body vertex of a vertex: itself, or the nearer end for one between the legs.
    pub fn body_vertex(&self, vertex: u32) -> u32 {
        match (vertex as usize).checked_sub(self.body_vertices()) {
            Some(k) => {
                let between = &self.between[k];
                between.ends[usize::from(between.share > 0.5)]
            }
            None => vertex,
        }
    }

    /// Vertices of the tube that lie near the middle between the legs, top to bottom.
    pub fn middle(&self) -> impl Iterator<Item = usize> + '_ {
        /// Shares of the way from leg to leg.
        const MIDDLE: std::ops::Range<f32> = 0.3..0.7;
        let inner = self.between.iter().enumerate();
        inner
            .filter(|(_, b)| MIDDLE.contains(&b.share))
            .map(|(k, _)| self.body_vertices() + k)
    }
}

/// Leaves out the faces between the legs and joins the legs at front and back.
fn join_legs(body: &Arc<Template>) -> Result<ClothTemplate, CaptureError> {
    let fault = |why: &str| CaptureError::Topology { why: why.into() };
    let vertices = body.mesh().vertices();
    let crotch = Crotch::of(body).ok_or_else(|| fault("the body has no legs"))?;
    let lines = [1.0, -1.0].map(|face| meridians(body, &crotch, face));
    let [Some(mut front), Some(mut back)] = lines else {
        return Err(fault("no line of edges leads down its legs"));
    };
    let gone = inner_faces(body, &crotch, &[&front, &back]);
    let lines = front.iter_mut().chain(&mut back);
    lines.for_each(|line| keep_open(body, &gone, line));
    let all = body.mesh().faces().iter().zip(&gone);
    let mut faces: Vec<Face> = all.filter(|(_, g)| !**g).map(|(f, _)| *f).collect();
    let mut between = Vec::new();
    for (lines, outward) in [(&front, 1.0), (&back, -1.0)] {
        let first = (vertices.len() + between.len()) as u32;
        let [left, right] = lines;
        // Lines know nothing of vertices between others: these are numbered behind them.
        let strip = Strip::join(
            [left, right],
            vertices,
            (vertices.len() as u32, SPACING, outward),
        );
        let shift = first - vertices.len() as u32;
        let renumber = |v: u32| {
            if v as usize >= vertices.len() {
                v + shift
            } else {
                v
            }
        };
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
fn inner_faces(body: &Template, crotch: &Crotch, lines: &[&[Vec<u32>; 2]]) -> Vec<bool> {
    let (vertices, faces) = (body.mesh().vertices(), body.mesh().faces());
    let walls: BTreeSet<[u32; 2]> = lines
        .iter()
        .flat_map(|sides| sides.iter().flat_map(|line| line.windows(2)))
        .map(|e| undirected([e[0], e[1]]))
        .collect();
    // The lines end a little above or below their height.
    let lowest = crotch.end + SPACING;
    let is_above = |f: &Face| f.iter().all(|v| vertices[*v as usize].y > lowest);
    let inner = |side| {
        let leg = leg_vertices(body, side);
        let near = |v: &u32| (vertices[*v as usize].y - crotch.at.y + INNER).abs() < SPACING;
        let off = |v: &u32| vertices[*v as usize].x.abs();
        leg.into_iter()
            .filter(near)
            .min_by(|a, b| off(a).total_cmp(&off(b)))
    };
    let around = body.topology().vertex_faces();
    let seeds = [BodySide::Left, BodySide::Right].map(inner);
    let mut open: Vec<u32> = seeds
        .iter()
        .flatten()
        .flat_map(|v| around.row(*v as usize))
        .copied()
        .collect();
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
    let at = |all: &[V3], b: &Between| {
        let [p, q] = b.ends.map(|v| all[v as usize]);
        p + (q - p) * b.share
    };
    let coords: Vec<V3> = body.mesh().vertices().iter().map(|p| p.coords).collect();
    let with = |all: &[V3]| -> Vec<V3> {
        let new = between.iter().map(|b| at(all, b));
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
    match body.pose_shapes() {
        Some(shapes) => {
            let between = between.iter().map(|b| (b.ends, b.share));
            let shapes = shapes.extended(between);
            made.with_pose_shapes(shapes).map_err(fault)
        }
        None => Ok(made),
    }
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
        let crotch = Crotch::of(&body).expect("legs").at.y;
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
        let spread = depths.iter().copied().fold(f32::MIN, f32::max)
            - depths.iter().copied().fold(f32::MAX, f32::min);
        assert!(!depths.is_empty() && spread > 0.1, "{depths:?}");
        let count = |t: &Template| t.mesh().faces().len() as f64;
        let kept = count(cloth.template()) / count(&body);
        assert!((0.8..1.1).contains(&kept), "{kept}");
        // It lies on its body.
        let extended = cloth.extend(body.mesh().vertices());
        let worst = extended
            .iter()
            .zip(vertices)
            .map(|(a, b)| (a - b).norm())
            .fold(0.0, f32::max);
        assert!(worst < 1e-6, "{worst}");
        assert!(cloth.middle().count() > 20);
    }
}

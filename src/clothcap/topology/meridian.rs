//! Lines down the front and the back of a leg, along the edges of a template.

use crate::settings::TopologySettings;
use tryon_body::Template;
use tryon_body::parts::{BodySegment, BodySide};
use tryon_geometry::math::P3;
use tryon_geometry::mesh::distances;

/// Place at which a template's legs part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Crotch {
    /// Lowest vertex between the legs, rest pose.
    pub(super) at: P3,
    /// Height at which the lines of the legs end, metres.
    pub(super) end: f32,
}

impl Crotch {
    /// Crotch of a template; `None` without legs.
    pub(super) fn of(template: &Template, settings: &TopologySettings) -> Option<Self> {
        let vertices = template.mesh().vertices();
        let is_shin = |v: &usize| segment(template, *v) == BodySegment::Shin;
        let shins = (0..vertices.len()).filter(is_shin);
        let lowest = shins.map(|v| vertices[v].y).min_by(f32::total_cmp)?;
        let is_above = |s| matches!(s, BodySegment::Pelvis | BodySegment::Thigh);
        let is_middle = |v: &usize| vertices[*v].x.abs() < settings.middle;
        let middle = (0..vertices.len()).filter(is_middle);
        let middle = middle.filter(|v| is_above(segment(template, *v)));
        let at = middle.min_by(|a, b| vertices[*a].y.total_cmp(&vertices[*b].y))?;
        Some(Self {
            at: vertices[at],
            end: lowest + settings.end,
        })
    }
}

fn segment(template: &Template, vertex: usize) -> BodySegment {
    let joint = template.weights().dominant(vertex);
    template.parts().segment(joint)
}

fn is_hand_or_arm(template: &Template, vertex: usize) -> bool {
    let segment = segment(template, vertex);
    segment.is_arm() || matches!(segment, BodySegment::Hand | BodySegment::Fingers)
}

/// Vertices of one leg above its foot.
pub(super) fn leg_vertices(template: &Template, side: BodySide) -> Vec<u32> {
    let is_leg = |v: &u32| {
        let joint = template.weights().dominant(*v as usize);
        let segment = template.parts().segment(joint);
        matches!(segment, BodySegment::Thigh | BodySegment::Shin)
            && template.parts().side(joint) == Some(side)
    };
    let all = 0..template.mesh().vertices().len() as u32;
    all.filter(is_leg).collect()
}

/// Search of lines down the legs of a template: at the front (`face` 1) or the back (−1).
pub(super) struct MeridianSearch<'a> {
    pub(super) template: &'a Template,
    pub(super) crotch: &'a Crotch,
    pub(super) face: f32,
    pub(super) settings: &'a TopologySettings,
}

impl MeridianSearch<'_> {
    /// Lines down both legs from their common apex, left and right.
    pub(super) fn run(&self) -> Option<[Vec<u32>; 2]> {
        let Self {
            template,
            face,
            settings,
            ..
        } = *self;
        let vertices = template.mesh().vertices();
        let trunk = (0..vertices.len()).filter(|v| !is_hand_or_arm(template, *v));
        let trunk: Vec<P3> = trunk.map(|v| vertices[v]).collect();
        let is_apex = |v: &u32| {
            let p = vertices[*v as usize];
            let is_beside = |q: &&P3| (q.y - p.y).abs() < settings.band / 2.0;
            let beside = trunk.iter().filter(is_beside).map(|q| q.z * face);
            let outermost = beside.fold(f32::MIN, f32::max);
            p.x.abs() < settings.middle
                && p.y > self.crotch.at.y
                && p.z * face > outermost - settings.hollow
        };
        let height = |v: &u32| vertices[*v as usize].y;
        let apex = (0..vertices.len() as u32).filter(is_apex);
        let apex = apex.min_by(|a, b| height(a).total_cmp(&height(b)))?;
        let left = self.line(BodySide::Left, apex)?;
        let right = self.line(BodySide::Right, apex)?;
        let pairs = left.iter().zip(&right);
        let shared = pairs.take_while(|(a, b)| a == b).count().max(1);
        Some([left, right].map(|line| line[shared - 1..].to_vec()))
    }

    /// Line down one leg: the shortest path along edges that stays near the middle of the leg.
    fn line(&self, side: BodySide, apex: u32) -> Option<Vec<u32>> {
        let Self {
            template,
            crotch,
            face,
            settings,
        } = *self;
        let vertices = template.mesh().vertices();
        let leg = leg_vertices(template, side);
        let start = vertices[apex as usize];
        let middle = |y: f32| -> P3 {
            let near = leg.iter().map(|v| vertices[*v as usize]);
            let near = near.filter(|p| (p.y - y).abs() < settings.band);
            let (sum, n) = near.fold((P3::origin(), 0), |(s, n), p| (s + p.coords, n + 1));
            sum / n.max(1) as f32
        };
        let center = middle(crotch.end);
        let off = |v: &u32| {
            let p = vertices[*v as usize];
            (p.y - crotch.end).abs() + (p.x - center.x).abs()
        };
        let is_facing = |v: &u32| (vertices[*v as usize].z - center.z) * face > 0.0;
        let ends = leg.iter().copied().filter(is_facing);
        let foot = ends.min_by(|a, b| off(a).total_cmp(&off(b)))?;
        let cost = |a: P3, b: P3| {
            let m = nalgebra::center(&a, &b);
            let t = ((start.y - m.y) / settings.spread).clamp(0.0, 1.0);
            let off = (m.x - middle(m.y).x * t) / settings.straight;
            f64::from((a - b).norm() * (1.0 + off * off))
        };
        let within = |v: u32| vertices[v as usize].y <= start.y + settings.band;
        let edges = template.topology().edges().iter().map(|e| e.v);
        let edges = edges.filter(|e| e.iter().all(|v| within(*v)));
        let place = |v: u32| vertices[v as usize];
        let edges: Vec<([u32; 2], f64)> =
            edges.map(|e| (e, cost(place(e[0]), place(e[1])))).collect();
        let far = distances(vertices.len(), &edges, f64::INFINITY, |v| {
            v == foot as usize
        });
        downhill(&far, &edges, apex)
    }
}

/// Path from a vertex to where `far` is zero; `None` if no edge leads there.
fn downhill(far: &[f64], edges: &[([u32; 2], f64)], from: u32) -> Option<Vec<u32>> {
    let mut path = vec![from];
    let mut at = from;
    while far[at as usize] > 0.0 {
        let beside = edges.iter().filter(|(v, _)| v.contains(&at));
        let beside = beside.map(|(v, cost)| {
            let other = if v[0] == at { v[1] } else { v[0] };
            (other, far[other as usize] + cost)
        });
        let next = beside.min_by(|a, b| a.1.total_cmp(&b.1))?;
        if !(far[next.0 as usize] < far[at as usize]) {
            return None;
        }
        at = next.0;
        path.push(at);
    }
    Some(path)
}

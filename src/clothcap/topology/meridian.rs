//! Lines down the front and the back of a leg, along the edges of a template.

use tryon_body::Template;
use tryon_body::parts::{BodySegment, BodySide};
use tryon_geometry::math::P3;
use tryon_geometry::mesh::distances;

/// Depth of the middle of the body below its front- or backmost points at the height where the lines part, metres.
const HOLLOW: f32 = 0.012;
/// Height over the lowest vertex of the shin at which lines end, metres.
const END: f32 = 0.03;
/// Way below the apex on which a line comes to the middle of its leg, metres.
const SPREAD: f32 = 0.12;
/// Sideways distance from the line wanted that doubles the cost of an edge, metres.
const STRAIGHT: f32 = 0.015;
/// Half the height of the band whose mean is the middle of a leg, metres.
const BAND: f32 = 0.03;
/// Half the width of the middle of the body, metres.
const MIDDLE: f32 = 0.008;

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
    pub(super) fn of(template: &Template) -> Option<Self> {
        let vertices = template.mesh().vertices();
        let is_shin = |v: &usize| segment(template, *v) == BodySegment::Shin;
        let shins = (0..vertices.len()).filter(is_shin);
        let lowest = shins.map(|v| vertices[v].y).min_by(f32::total_cmp)?;
        let middle = (0..vertices.len()).filter(|v| {
            let above = matches!(
                segment(template, *v),
                BodySegment::Pelvis | BodySegment::Thigh
            );
            above && vertices[*v].x.abs() < MIDDLE
        });
        let at = middle.min_by(|a, b| vertices[*a].y.total_cmp(&vertices[*b].y))?;
        Some(Self {
            at: vertices[at],
            end: lowest + END,
        })
    }
}

fn segment(template: &Template, vertex: usize) -> BodySegment {
    template
        .parts()
        .segment(template.weights().dominant(vertex))
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
    (0..template.mesh().vertices().len() as u32)
        .filter(is_leg)
        .collect()
}

/// Lines down both legs from their common apex, left and right: at the front (`face` 1) or the back (−1).
pub(super) fn meridians(template: &Template, crotch: &Crotch, face: f32) -> Option<[Vec<u32>; 2]> {
    let vertices = template.mesh().vertices();
    let trunk: Vec<P3> = (0..vertices.len())
        .filter(|v| !is_hand_or_arm(template, *v))
        .map(|v| vertices[v])
        .collect();
    let is_apex = |v: &u32| {
        let p = vertices[*v as usize];
        let beside = trunk.iter().filter(|q| (q.y - p.y).abs() < BAND / 2.0);
        let outermost = beside.map(|q| q.z * face).fold(f32::MIN, f32::max);
        p.x.abs() < MIDDLE && p.y > crotch.at.y && p.z * face > outermost - HOLLOW
    };
    let apex = (0..vertices.len() as u32)
        .filter(is_apex)
        .min_by(|a, b| vertices[*a as usize].y.total_cmp(&vertices[*b as usize].y))?;
    let left = meridian(template, BodySide::Left, (apex, crotch, face))?;
    let right = meridian(template, BodySide::Right, (apex, crotch, face))?;
    let shared = left
        .iter()
        .zip(&right)
        .take_while(|(a, b)| a == b)
        .count()
        .max(1);
    Some([left, right].map(|line| line[shared - 1..].to_vec()))
}

/// Line down one leg: the shortest path along edges that stays near the middle of the leg.
fn meridian(
    template: &Template,
    side: BodySide,
    (apex, crotch, face): (u32, &Crotch, f32),
) -> Option<Vec<u32>> {
    let vertices = template.mesh().vertices();
    let leg = leg_vertices(template, side);
    let start = vertices[apex as usize];
    let middle = |y: f32| -> P3 {
        let near = leg
            .iter()
            .map(|v| vertices[*v as usize])
            .filter(|p| (p.y - y).abs() < BAND);
        let (sum, n) = near.fold((P3::origin(), 0), |(s, n), p| (s + p.coords, n + 1));
        sum / n.max(1) as f32
    };
    let foot = leg
        .iter()
        .copied()
        .filter(|v| (vertices[*v as usize].z - middle(crotch.end).z) * face > 0.0)
        .min_by(|a, b| {
            let center = middle(crotch.end);
            let off = |v: u32| {
                let p = vertices[v as usize];
                (p.y - crotch.end).abs() + (p.x - center.x).abs()
            };
            off(*a).total_cmp(&off(*b))
        })?;
    let cost = |a: P3, b: P3| {
        let m = nalgebra::center(&a, &b);
        let t = ((start.y - m.y) / SPREAD).clamp(0.0, 1.0);
        let off = (m.x - middle(m.y).x * t) / STRAIGHT;
        f64::from((a - b).norm() * (1.0 + off * off))
    };
    let within = |v: u32| vertices[v as usize].y <= start.y + BAND;
    let edges: Vec<([u32; 2], f64)> = template
        .topology()
        .edges()
        .iter()
        .filter(|e| e.v.iter().all(|v| within(*v)))
        .map(|e| {
            (
                e.v,
                cost(vertices[e.v[0] as usize], vertices[e.v[1] as usize]),
            )
        })
        .collect();
    let far = distances(vertices.len(), &edges, f64::INFINITY, |v| {
        v == foot as usize
    });
    downhill(&far, &edges, apex)
}

/// Path from a vertex to where `far` is zero; `None` if no edge leads there.
fn downhill(far: &[f64], edges: &[([u32; 2], f64)], from: u32) -> Option<Vec<u32>> {
    let mut path = vec![from];
    let mut at = from;
    while far[at as usize] > 0.0 {
        let next = edges
            .iter()
            .filter_map(|(v, cost)| {
                let other = if v[0] == at { v[1] } else { v[0] };
                v.contains(&at)
                    .then_some((other, far[other as usize] + cost))
            })
            .min_by(|a, b| a.1.total_cmp(&b.1))?;
        if !(far[next.0 as usize] < far[at as usize]) {
            return None;
        }
        at = next.0;
        path.push(at);
    }
    Some(path)
}

//! Edges with more than two faces, and vertices at which sheets meet in a point, split.

use super::MeshRepairReport;
use super::surface::WorkingSurface;
use crate::math::V3;
use crate::mesh::UnionFind;

/// Passes: one along edges, one that isolates the faces which other edges still tie to a split one, one to be sure.
const PASSES: usize = 3;

/// Splits the surface until each edge has two faces at most and the faces around each vertex are connected across edges.
///
/// Of the faces on an edge those two stay together that continue each other best.
pub(super) fn split(surface: &mut WorkingSurface, report: &mut MeshRepairReport) {
    let mut isolated = vec![false; surface.faces.len()];
    let mut is_crowded = vec![false; surface.points.len()];
    for pass in 0..PASSES {
        let mut crowded = 0;
        let mut pairs = Vec::new();
        for on_edge in surface.edge_faces().chunk_by(|a, b| a.0 == b.0) {
            let edge = on_edge[0].0;
            let faces: Vec<u32> = on_edge.iter().map(|(_, f)| *f).collect();
            let own: Vec<[u32; 2]> = match faces.as_slice() {
                [_] => Vec::new(),
                &[f, g] => vec![[f, g]],
                _ => continuations(surface, edge, &faces),
            };
            if faces.len() > 2 {
                crowded += 1;
                is_crowded.resize(surface.points.len(), false);
                edge.iter().for_each(|v| is_crowded[*v as usize] = true);
                let together = own.first().copied().unwrap_or_default();
                let apart = faces.iter().filter(|f| !together.contains(f));
                let apart: Vec<u32> = apart.copied().collect();
                if pass == 0 {
                    let first = apart.iter().map(|f| surface.faces[*f as usize].face).min();
                    report.edges.add(first.unwrap_or_default());
                } else {
                    apart.iter().for_each(|f| isolated[*f as usize] = true);
                }
            }
            pairs.extend(own.into_iter().map(|faces| (edge, faces)));
        }
        pairs.retain(|(_, faces)| !faces.iter().any(|f| isolated[*f as usize]));
        if pass > 0 && crowded == 0 {
            return;
        }
        report.vertices += separate(surface, &pairs, &is_crowded);
    }
}

/// Pairs of the faces on an edge, best continuation first; a face of an odd number is left alone.
fn continuations(surface: &WorkingSurface, edge: [u32; 2], faces: &[u32]) -> Vec<[u32; 2]> {
    let [a, b] = edge.map(|v| surface.points[v as usize]);
    let axis = (b - a).try_normalize(0.0).unwrap_or_default();
    let across = |f: u32| -> V3 {
        let corners = surface.faces[f as usize].corners;
        let apex = corners.into_iter().find(|v| !edge.contains(v));
        let arm = apex.map_or(V3::zeros(), |v| surface.points[v as usize] - a);
        (arm - axis * arm.dot(&axis))
            .try_normalize(0.0)
            .unwrap_or_default()
    };
    let mut left: Vec<(u32, V3)> = faces.iter().map(|f| (*f, across(*f))).collect();
    let mut pairs = Vec::new();
    while left.len() > 1 {
        let mut best = (f32::INFINITY, 0, 1);
        for i in 0..left.len() {
            for j in i + 1..left.len() {
                let cosine = left[i].1.dot(&left[j].1);
                if cosine < best.0 {
                    best = (cosine, i, j);
                }
            }
        }
        let (_, i, j) = best;
        pairs.push([left[i].0, left[j].0]);
        left.remove(j);
        left.remove(i);
    }
    pairs
}

/// Gives each connected fan of corners a vertex of its own; fans are connected across `pairs` of an edge and its faces.
/// Returns the number of copies of vertices that are not crowded.
fn separate(
    surface: &mut WorkingSurface,
    pairs: &[([u32; 2], [u32; 2])],
    is_crowded: &[bool],
) -> usize {
    let mut copies = 0;
    let corner = |surface: &WorkingSurface, face: u32, vertex: u32| {
        let corners = surface.faces[face as usize].corners;
        (0..3u32)
            .find(|k| corners[*k as usize] == vertex)
            .map(|k| 3 * face + k)
    };
    let mut fans = UnionFind::new(3 * surface.faces.len());
    for &(edge, [f, g]) in pairs {
        for v in edge {
            if let (Some(x), Some(y)) = (corner(surface, f, v), corner(surface, g, v)) {
                fans.join(x, y);
            }
        }
    }
    let (fan, count) = fans.number();
    let mut vertex_of = vec![u32::MAX; count];
    let mut is_taken = vec![false; surface.points.len()];
    for i in 0..surface.faces.len() {
        for k in 0..3 {
            let slot = fan[3 * i + k] as usize;
            let v = surface.faces[i].corners[k];
            if vertex_of[slot] == u32::MAX {
                vertex_of[slot] = if std::mem::replace(&mut is_taken[v as usize], true) {
                    copies += usize::from(!is_crowded.get(v as usize).is_some_and(|c| *c));
                    surface.copy(v)
                } else {
                    v
                };
            }
            surface.faces[i].corners[k] = vertex_of[slot];
        }
    }
    copies
}

//! Repeated faces and faces without area.

use super::MeshRepairReport;
use super::surface::{SourcedFace, WorkingSurface};
use crate::mesh::undirected;
use std::collections::HashSet;

/// Passes over needles; each pass flips those whose neighbours it has not changed.
const PASSES: usize = 8;

/// Removes faces with the vertices of an earlier one, in either order: the second side of a sheet drawn twice.
pub(super) fn drop_repeated(surface: &mut WorkingSurface, report: &mut MeshRepairReport) {
    let mut seen = HashSet::with_capacity(surface.faces.len());
    surface.faces.retain(|f| {
        let mut key = f.corners;
        key.sort_unstable();
        let is_new = seen.insert(key);
        if !is_new {
            report.repeated.add(f.face);
        }
        is_new
    });
}

/// Removes faces no higher than `tolerance`. A needle on a face's edge gives its apex to that face, which keeps the
/// surface closed (edge flip); one on an open edge is dropped.
pub(super) fn drop_needles(
    surface: &mut WorkingSurface,
    tolerance: f32,
    report: &mut MeshRepairReport,
) {
    let mut counted = HashSet::new();
    for pass in 0..=PASSES {
        let needles: Vec<(u32, usize)> = (0..surface.faces.len())
            .filter_map(|i| Some((i as u32, apex(surface, i, tolerance)?)))
            .collect();
        if needles.is_empty() {
            return;
        }
        for (i, _) in &needles {
            let face = surface.faces[*i as usize].face;
            if counted.insert(face) {
                report.needles.add(face);
            }
        }
        // A cycle of flips ends by dropping what is left.
        flip(surface, &needles, pass == PASSES);
        drop_repeated(surface, report);
    }
}

/// Place of the corner opposite the longest side, if the face is no higher than `tolerance`.
fn apex(surface: &WorkingSurface, face: usize, tolerance: f32) -> Option<usize> {
    let p = surface.positions(face).map(|p| p.cast::<f64>());
    let length = |k: usize| (p[(k + 1) % 3] - p[k]).norm();
    let side = (0..3).fold(0, |best, k| if length(k) > length(best) { k } else { best });
    let twice_area = (p[1] - p[0]).cross(&(p[2] - p[0])).norm();
    (twice_area <= f64::from(tolerance) * length(side)).then_some((side + 2) % 3)
}

/// Flips the longest sides of needles; drops those on other than one further face, and all with `drop_all`.
fn flip(surface: &mut WorkingSurface, needles: &[(u32, usize)], drop_all: bool) {
    let on_edges = surface.edge_faces();
    let mut changed = vec![false; surface.faces.len()];
    let mut dropped = vec![false; surface.faces.len()];
    for &(i, apex) in needles {
        let needle = surface.faces[i as usize];
        let [a, c] = [1, 2].map(|k| needle.corners[(apex + k) % 3]);
        let edge = undirected([a, c]);
        let first = on_edges.partition_point(|(e, _)| *e < edge);
        let others = on_edges[first..].iter().take_while(|(e, _)| *e == edge);
        let others: Vec<u32> = others.map(|(_, f)| *f).filter(|f| *f != i).collect();
        if std::mem::replace(&mut changed[i as usize], true) {
            continue;
        }
        match others.as_slice() {
            &[other] if !drop_all => {
                if std::mem::replace(&mut changed[other as usize], true) {
                    continue;
                }
                let (b, source) = (needle.corners[apex], needle.source[apex]);
                let whole = surface.faces[other as usize];
                surface.faces[i as usize] = with_corner(whole, a, b, source);
                surface.faces[other as usize] = with_corner(whole, c, b, source);
            }
            _ => dropped[i as usize] = true,
        }
    }
    let mut dropped = dropped.into_iter();
    surface.faces.retain(|_| !dropped.next().unwrap_or(false));
}

/// The face with vertex `to`, from corner `source`, in place of `from`.
fn with_corner(mut face: SourcedFace, from: u32, to: u32, source: u32) -> SourcedFace {
    for k in 0..3 {
        if face.corners[k] == from {
            face.corners[k] = to;
            face.source[k] = source;
        }
    }
    face
}

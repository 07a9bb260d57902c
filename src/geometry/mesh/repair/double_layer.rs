//! Closed double layers (cloth modelled with thickness: two sheets joined by a rim) reduced to their outer sheet.
//!
//! A face belongs to a double layer if a face of opposite normal lies close behind it. Faces are then grouped across smooth
//! edges: a rim stands at right angles to its sheets, so two groups remain.

use super::MeshRepairReport;
use super::surface::WorkingSurface;
use crate::math::order_statistics::percentile;
use crate::math::{P3d, V3d};
use crate::mesh::MeshRepairSettings;
use face_grid::FaceGrid;

mod face_grid;

/// Cosine between normals above which an edge is smooth: 60°.
const SMOOTH: f64 = 0.5;
/// Cosine above which an edge between two backed faces is a fold of one sheet, and no join of two.
const FOLD: f64 = -0.5;
/// Least share of the whole area of a sheet.
const LEAST_SHEET: f64 = 0.05;

/// Component of a surface, closed, with its normals outward.
struct ClosedPart<'a> {
    surface: &'a WorkingSurface,
    neighbours: &'a [[Option<u32>; 3]],
    /// Its faces.
    faces: Vec<u32>,
}

/// Double layer found.
struct DoubleLayer {
    thickness: f64,
    /// Faces to keep; `None` if the sheets cannot be told apart.
    outer: Option<Vec<u32>>,
}

/// Reduces double layers; returns their median thickness.
pub(super) fn thin(
    surface: &mut WorkingSurface,
    settings: &MeshRepairSettings,
    report: &mut MeshRepairReport,
) -> Option<f32> {
    let neighbours = surface.neighbours();
    let mut is_dropped = vec![false; surface.faces.len()];
    let mut thicknesses = Vec::new();
    for faces in closed_components(&neighbours) {
        let part = ClosedPart {
            surface,
            neighbours: &neighbours,
            faces,
        };
        let Some(found) = part.double_layer(settings) else {
            continue;
        };
        let Some(outer) = found.outer else {
            report.unreduced += 1;
            continue;
        };
        thicknesses.push(found.thickness);
        report.inner += part.faces.len() - outer.len();
        part.faces
            .iter()
            .for_each(|f| is_dropped[*f as usize] = true);
        outer.iter().for_each(|f| is_dropped[*f as usize] = false);
    }

    let mut dropped = is_dropped.into_iter();
    surface.faces.retain(|_| !dropped.next().unwrap_or(false));
    percentile(&mut thicknesses, 50).map(|t| t as f32)
}

/// Faces of each component without an open edge.
fn closed_components(neighbours: &[[Option<u32>; 3]]) -> Vec<Vec<u32>> {
    let mut is_taken = vec![false; neighbours.len()];
    let mut out = Vec::new();
    for seed in 0..neighbours.len() {
        let component = flood(neighbours, seed as u32, &mut is_taken, |_, _| true);
        let is_closed = component
            .iter()
            .all(|f| neighbours[*f as usize].iter().all(Option::is_some));
        if is_closed && component.len() > 4 {
            out.push(component);
        }
    }
    out
}

/// Faces reached from `seed` across edges that `crosses` allows; none if it is taken.
fn flood(
    neighbours: &[[Option<u32>; 3]],
    seed: u32,
    is_taken: &mut [bool],
    crosses: impl Fn(u32, u32) -> bool,
) -> Vec<u32> {
    if std::mem::replace(&mut is_taken[seed as usize], true) {
        return Vec::new();
    }
    let (mut own, mut at) = (vec![seed], 0);
    while let Some(&f) = own.get(at) {
        at += 1;
        for &n in neighbours[f as usize].iter().flatten() {
            if !is_taken[n as usize] && crosses(f, n) {
                is_taken[n as usize] = true;
                own.push(n);
            }
        }
    }
    own
}

/// Sum of a value over faces.
fn sum(faces: &[u32], value: impl Fn(u32) -> f64) -> f64 {
    faces.iter().map(|f| value(*f)).sum()
}

impl ClosedPart<'_> {
    /// The double layer that the part is, if it is one.
    fn double_layer(&self, settings: &MeshRepairSettings) -> Option<DoubleLayer> {
        let n = self.surface.faces.len();
        let corners = |f: u32| self.surface.positions(f as usize).map(|p| p.cast::<f64>());
        let volume = sum(&self.faces, |f| {
            let [a, b, c] = corners(f).map(|p| p.coords);
            a.dot(&b.cross(&c))
        });
        let (mut normal, mut area) = (vec![V3d::zeros(); n], vec![0.0; n]);
        for &f in &self.faces {
            let [a, b, c] = corners(f);
            let twice = (b - a).cross(&(c - a)) * volume.signum();
            area[f as usize] = twice.norm();
            normal[f as usize] = twice.try_normalize(0.0).unwrap_or_default();
        }
        let whole = sum(&self.faces, |f| area[f as usize]);

        let reach = f64::from(settings.layer_share) * self.size();
        let grid = FaceGrid::new(self.surface, &self.faces, reach);
        let mut backing = vec![None; n];
        for &f in &self.faces {
            let [a, b, c] = corners(f);
            let middle = P3d::from((a.coords + b.coords + c.coords) / 3.0);
            let hit = grid.first_hit(f, &middle, &-normal[f as usize]);
            let is_opposite = |g: u32| normal[f as usize].dot(&normal[g as usize]) < -SMOOTH;
            backing[f as usize] = hit.filter(|(g, _)| is_opposite(*g));
        }
        let backed = |f: u32| backing[f as usize].is_some();
        let share = sum(
            &self.faces,
            |f| if backed(f) { area[f as usize] } else { 0.0 },
        );
        if share < f64::from(settings.layer_least) * whole {
            return None;
        }
        let mut depths: Vec<f64> = self
            .faces
            .iter()
            .filter_map(|f| Some(backing[*f as usize]?.1))
            .collect();
        let thickness = percentile(&mut depths, 50)?;

        let crosses = |f: u32, g: u32| {
            let cosine = normal[f as usize].dot(&normal[g as usize]);
            cosine > SMOOTH || (backed(f) && backed(g) && cosine > FOLD)
        };
        let mut is_taken = vec![false; n];
        let seeds = self.faces.iter().filter(|f| backed(**f));
        let groups = seeds.map(|f| flood(self.neighbours, *f, &mut is_taken, crosses));
        let area_of = |group: &[u32]| sum(group, |f| area[f as usize]);
        let mut sheets: Vec<Vec<u32>> = groups
            .filter(|g| area_of(g) > LEAST_SHEET * whole)
            .collect();
        let outer = match sheets.as_slice() {
            [a, b] => {
                let [x, y] = [a, b].map(|g| area_of(g));
                let is_pair = x.min(y) > f64::from(settings.layer_alike) * x.max(y);
                let flux = |g: &[u32]| self.flux(g, &normal, &area);
                let first = usize::from(flux(b) > flux(a));
                is_pair.then(|| sheets.swap_remove(first))
            }
            _ => None,
        };
        Some(DoubleLayer { thickness, outer })
    }

    /// Longest side of the bounding box.
    fn size(&self) -> f64 {
        let points = self
            .faces
            .iter()
            .flat_map(|f| self.surface.positions(*f as usize));
        let bounds = points.fold(None, |bounds, p| match bounds {
            None => Some((p, p)),
            Some((lo, hi)) => Some((p.inf(&lo), p.sup(&hi))),
        });
        bounds.map_or(0.0, |(lo, hi)| f64::from((hi - lo).amax()))
    }

    /// Flow of the field x − middle through faces: positive for the outer sheet of a tube, negative for its inner one.
    fn flux(&self, faces: &[u32], normal: &[V3d], area: &[f64]) -> f64 {
        let centre = |f: u32| {
            let p = self
                .surface
                .positions(f as usize)
                .map(|p| p.cast::<f64>().coords);
            (p[0] + p[1] + p[2]) / 3.0
        };
        let count = self.faces.len() as f64;
        let middle = self.faces.iter().fold(V3d::zeros(), |s, f| s + centre(*f)) / count;
        sum(faces, |f| {
            area[f as usize] * normal[f as usize].dot(&(centre(f) - middle))
        })
    }
}

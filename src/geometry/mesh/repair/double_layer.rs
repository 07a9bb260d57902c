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
use std::collections::HashMap;

mod face_grid;

/// Cosine between normals above which an edge is smooth: 60°.
const SMOOTH: f64 = 0.5;
/// Cosine above which an edge between two backed faces is a fold of one sheet, and no join of two.
const FOLD: f64 = -0.5;
/// Least share of the whole area of a sheet.
const LEAST_SHEET: f64 = 0.05;

/// Faces of the smallest closed surface, which has no inner sheet.
const TETRAHEDRON: usize = 4;
/// Faces of a part that are tested first: most closed parts are no double layers.
const SAMPLE: usize = 256;
/// Share of the sample with a face behind, over the share that a double layer needs, below which the part is none.
const SAMPLE_SHARE: f64 = 0.7;

/// Values of all faces, computed once.
struct FaceValues {
    /// Unit normals; zero without area.
    normal: Vec<V3d>,
    /// Twice the areas.
    area: Vec<f64>,
    /// Centres.
    centre: Vec<P3d>,
}

/// Component of a surface, closed.
struct ClosedPart<'a> {
    surface: &'a WorkingSurface,
    neighbours: &'a [[Option<u32>; 3]],
    values: &'a FaceValues,
    /// Its faces.
    faces: Vec<u32>,
    /// 1 if its normals point outward, else −1.
    outward: f64,
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
    let components = closed_components(&neighbours);
    if components.is_empty() {
        return None;
    }
    let values = FaceValues::new(surface);
    let mut is_dropped = vec![false; surface.faces.len()];
    let mut is_taken = vec![false; surface.faces.len()];
    let mut thicknesses = Vec::new();
    for faces in components {
        let part = ClosedPart::new(surface, &neighbours, &values, faces);
        let Some(found) = part.double_layer(settings, &mut is_taken) else {
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

impl FaceValues {
    fn new(surface: &WorkingSurface) -> Self {
        let corners =
            (0..surface.faces.len()).map(|f| surface.positions(f).map(|p| p.cast::<f64>()));
        let values = corners.map(|[a, b, c]| {
            let twice = (b - a).cross(&(c - a));
            let centre = P3d::from((a.coords + b.coords + c.coords) / 3.0);
            (
                twice.try_normalize(0.0).unwrap_or_default(),
                twice.norm(),
                centre,
            )
        });
        let (mut normal, mut area, mut centre) = (Vec::new(), Vec::new(), Vec::new());
        for (n, a, c) in values {
            normal.push(n);
            area.push(a);
            centre.push(c);
        }
        Self {
            normal,
            area,
            centre,
        }
    }
    /// Cosine between the normals of two faces.
    fn cosine(&self, f: u32, g: u32) -> f64 {
        self.normal[f as usize].dot(&self.normal[g as usize])
    }
    /// Twice the area of faces.
    fn area_of(&self, faces: &[u32]) -> f64 {
        faces.iter().map(|f| self.area[*f as usize]).sum()
    }
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
        if is_closed && component.len() > TETRAHEDRON {
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

impl<'a> ClosedPart<'a> {
    fn new(
        surface: &'a WorkingSurface,
        neighbours: &'a [[Option<u32>; 3]],
        values: &'a FaceValues,
        faces: Vec<u32>,
    ) -> Self {
        let volume: f64 = faces
            .iter()
            .map(|f| {
                let [a, b, c] = surface
                    .positions(*f as usize)
                    .map(|p| p.cast::<f64>().coords);
                a.dot(&b.cross(&c))
            })
            .sum();
        Self {
            surface,
            neighbours,
            values,
            faces,
            outward: volume.signum(),
        }
    }

    /// The double layer that the part is, if it is one. `is_taken` is scratch space of its faces.
    fn double_layer(
        &self,
        settings: &MeshRepairSettings,
        is_taken: &mut [bool],
    ) -> Option<DoubleLayer> {
        let reach = f64::from(settings.layer_share) * self.size();
        let grid = FaceGrid::new(self.surface, &self.faces, reach);
        let least = f64::from(settings.layer_least);
        let stride = self.faces.len().div_ceil(SAMPLE);
        let sample: Vec<u32> = self.faces.iter().step_by(stride).copied().collect();
        let of_sample = self.backed_share(&sample, |f| self.backing(&grid, f).is_some());
        if of_sample < SAMPLE_SHARE * least {
            return None;
        }

        let backing = self
            .faces
            .iter()
            .map(|f| Some((*f, self.backing(&grid, *f)?)));
        let backing: HashMap<u32, (u32, f64)> = backing.flatten().collect();
        if self.backed_share(&self.faces, |f| backing.contains_key(&f)) < least {
            return None;
        }
        let mut depths: Vec<f64> = backing.values().map(|(_, depth)| *depth).collect();
        let thickness = percentile(&mut depths, 50)?;

        let crosses = |f: u32, g: u32| {
            let cosine = self.values.cosine(f, g);
            let are_backed = || backing.contains_key(&f) && backing.contains_key(&g);
            cosine > SMOOTH || (cosine > FOLD && are_backed())
        };
        let seeds = self.faces.iter().filter(|f| backing.contains_key(*f));
        let groups = seeds.map(|f| flood(self.neighbours, *f, is_taken, crosses));
        let smallest = LEAST_SHEET * self.values.area_of(&self.faces);
        let sheets = groups
            .filter(|g| self.values.area_of(g) > smallest)
            .collect();
        Some(DoubleLayer {
            thickness,
            outer: self.outer(sheets, f64::from(settings.layer_alike)),
        })
    }

    /// The outer one of two sheets; `None` unless there are two, the smaller at least `alike` times the larger.
    fn outer(&self, mut sheets: Vec<Vec<u32>>, alike: f64) -> Option<Vec<u32>> {
        let [a, b] = sheets.as_slice() else {
            return None;
        };
        let [x, y] = [a, b].map(|g| self.values.area_of(g));
        let first = usize::from(self.flux(b) > self.flux(a));
        (x.min(y) > alike * x.max(y)).then(|| sheets.swap_remove(first))
    }

    /// Face of opposite normal close behind a face, and its distance.
    fn backing(&self, grid: &FaceGrid<'_>, face: u32) -> Option<(u32, f64)> {
        let (from, normal) = (
            &self.values.centre[face as usize],
            self.values.normal[face as usize],
        );
        let hit = grid.first_hit(face, from, &(normal * -self.outward));
        hit.filter(|(other, _)| self.values.cosine(face, *other) < -SMOOTH)
    }

    /// Share of the area of faces that have a face behind them.
    fn backed_share(&self, faces: &[u32], is_backed: impl Fn(u32) -> bool) -> f64 {
        let backed: Vec<u32> = faces.iter().copied().filter(|f| is_backed(*f)).collect();
        self.values.area_of(&backed) / self.values.area_of(faces).max(f64::MIN_POSITIVE)
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

    /// Flow of the field x − middle outward through faces: positive for the outer sheet of a tube, negative for its inner one.
    fn flux(&self, faces: &[u32]) -> f64 {
        let centre = |f: &u32| self.values.centre[*f as usize].coords;
        let middle = self.faces.iter().map(centre).sum::<V3d>() / self.faces.len() as f64;
        let through = |f: &u32| {
            let k = *f as usize;
            self.values.area[k] * self.values.normal[k].dot(&(centre(f) - middle))
        };
        self.outward * faces.iter().map(through).sum::<f64>()
    }
}

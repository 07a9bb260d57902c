//! Cloth around waist, hips and legs together, of any number of panels: waistbands, levels, godets.
//!
//! Each vertex hangs as far below the upper rim as the cloth is long to it, at an azimuth that is harmonic on its panel
//! between the panel's seams, on an ellipse of the cloth's girth at that distance.

use super::leg::leg_waist;
use super::placed_body::PlacedBody;
use super::rim_distance::{RimDistance, level_girths};
use super::skirt::waist_height;
use super::tube::Ellipse;
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::TAU;
use tryon_garment::{AnchorKind, GarmentMesh, Placement};
use tryon_geometry::math::P3;

/// Gauss–Seidel sweeps of the azimuth with over-relaxation; a panel of 50 columns needs a hundred.
const SWEEPS: usize = 300;
const OVER_RELAXATION: f64 = 1.8;
/// Sectors this near to each other meet, radians.
const SAME_SEAM: f64 = 1e-6;
/// Distance between the levels at which the girth is measured, metres.
const LEVEL: f64 = 0.01;

/// Places of the vertices of a hip tube.
pub(super) struct HipTube<'a> {
    body: PlacedBody<'a>,
    /// Distance below the upper rim of each simulation vertex along the cloth, metres.
    distance: Vec<f64>,
    /// Azimuth of the vertices of each panel, radians.
    azimuth: Vec<BTreeMap<u32, f64>>,
    /// Girth of the cloth at multiples of [`LEVEL`], metres.
    girths: Vec<f64>,
    /// Height of the upper rim.
    top: f32,
}

/// True for panels that a hip tube places.
fn is_hip(p: Placement) -> bool {
    matches!(p, Placement::SkirtFront | Placement::SkirtBack)
}

impl<'a> HipTube<'a> {
    /// The tube of a pattern whose panels say their sectors.
    pub(super) fn new(body: &PlacedBody<'a>, mesh: &GarmentMesh) -> Option<Self> {
        let panels = &body.pattern.panels;
        if !panels
            .iter()
            .any(|p| is_hip(p.placement) && p.sector.is_some())
        {
            return None;
        }
        let of_panel = |p: u16| is_hip(panels[usize::from(p)].placement);
        let rim = rim(body, mesh);
        let faces: Vec<usize> = (0..mesh.faces.len())
            .filter(|f| of_panel(mesh.face_panel[*f]))
            .collect();
        let distance = RimDistance::new(mesh, &faces).to_rim(&rim);
        let azimuth = azimuths(body, mesh);
        let girths = level_girths(mesh, &faces, &distance, &azimuth, LEVEL);
        let top = top(body, mesh, &distance);
        Some(Self {
            body: *body,
            distance,
            azimuth,
            girths,
            top,
        })
    }
    /// Place of a vertex on a panel; `None` if the tube doesn't place the panel.
    pub(super) fn point(&self, panel: u16, vertex: usize) -> Option<P3> {
        let azimuth = *self.azimuth[usize::from(panel)].get(&(vertex as u32))?;
        let down = self.distance[vertex];
        let settings = self.body.settings;
        let y = self.top - down as f32 * settings.skirt.shortened;
        let level = ((down / LEVEL).round() as usize).min(self.girths.len().saturating_sub(1));
        let girth = self.girths.get(level).copied().unwrap_or(0.0) as f32;
        let section = self.body.sections.lower.at(y);
        Some(Ellipse::rounded(&section, girth, &settings.tube).point(y, azimuth as f32, 1.0))
    }
}

/// Vertices of the upper rim: the seam to the bodice, or the tied waist.
fn rim(body: &PlacedBody<'_>, mesh: &GarmentMesh) -> Vec<u32> {
    let placement = |p: u16| body.pattern.panels[usize::from(p)].placement;
    let meets = |v: usize, wanted: &dyn Fn(Placement) -> bool| {
        mesh.corners[v].iter().any(|(p, _)| wanted(placement(*p)))
    };
    let is_trunk = |p| matches!(p, Placement::TrunkFront | Placement::TrunkBack);
    let seam: Vec<u32> = (0..mesh.vertices)
        .filter(|v| meets(*v, &is_hip) && meets(*v, &is_trunk))
        .map(|v| v as u32)
        .collect();
    if !seam.is_empty() {
        return seam;
    }
    let bands = mesh.anchors.iter().filter(|a| a.kind == AnchorKind::Band);
    bands.flat_map(|a| a.vertices.iter().copied()).collect()
}

/// Height of the upper rim.
fn top(body: &PlacedBody<'_>, mesh: &GarmentMesh, distance: &[f64]) -> f32 {
    if let Some(waist) = body.sewn_waist() {
        return waist;
    }
    let is_leg = |p: Placement| matches!(p, Placement::LegFront(_) | Placement::LegBack(_));
    let placement = |p: u16| body.pattern.panels[usize::from(p)].placement;
    let at_legs = |v: &usize| {
        let c = &mesh.corners[*v];
        c.iter().any(|(p, _)| is_hip(placement(*p))) && c.iter().any(|(p, _)| is_leg(placement(*p)))
    };
    let seam: Vec<f64> = (0..mesh.vertices)
        .filter(at_legs)
        .map(|v| distance[v])
        .collect();
    if seam.is_empty() {
        waist_height(body, body.pattern.finished[1] as f32)
    } else {
        leg_waist(body) + (seam.iter().sum::<f64>() / seam.len() as f64) as f32
    }
}

/// Azimuth of the vertices of each panel of the tube: first the panels of rings, then inserts between them.
fn azimuths(body: &PlacedBody<'_>, mesh: &GarmentMesh) -> Vec<BTreeMap<u32, f64>> {
    let panels = &body.pattern.panels;
    let mut out: Vec<BTreeMap<u32, f64>> = vec![BTreeMap::new(); panels.len()];
    for (k, p) in panels.iter().enumerate() {
        let Some([from, to]) = p.sector.filter(|_| is_hip(p.placement)) else {
            continue;
        };
        // Seams with the panels beside it in its ring: one ends where the other starts.
        let meets = |v: u32, end: f64, opposite: usize| {
            mesh.corners[v as usize].iter().any(|(q, _)| {
                let other = &panels[usize::from(*q)];
                let is_other = is_hip(other.placement) && usize::from(*q) != k;
                let sector = other.sector.filter(|_| is_other);
                sector.is_some_and(|s| same_turn(s[opposite], end))
            })
        };
        let held = |v: u32| {
            let (right, left) = (meets(v, from, 1), meets(v, to, 0));
            match (right, left) {
                (true, false) => Some(from),
                (false, true) => Some(to),
                // Two panels make the ring: the side of the panel tells.
                (true, true) => {
                    let q = mesh.corners[v as usize]
                        .iter()
                        .find(|(q, _)| usize::from(*q) == k)?;
                    Some(if q.1[0] < middle(mesh, k) { from } else { to })
                }
                (false, false) => None,
            }
        };
        out[k] = harmonic(mesh, k, &held, 0.5 * (from + to));
    }
    for (k, p) in panels.iter().enumerate() {
        if !is_hip(p.placement) || p.sector.is_some() {
            continue;
        }
        let beside = |v: u32| {
            let c = mesh.corners[v as usize].iter();
            let mut found = c.filter_map(|(q, _)| out[usize::from(*q)].get(&v).copied());
            found.next()
        };
        let known: Vec<f64> = vertices(mesh, k).into_iter().filter_map(beside).collect();
        let mean = known.iter().sum::<f64>() / known.len().max(1) as f64;
        out[k] = harmonic(mesh, k, &beside, mean);
    }
    out
}

fn same_turn(a: f64, b: f64) -> bool {
    let turn = (a - b).rem_euclid(TAU);
    turn.min(TAU - turn) < SAME_SEAM
}

/// Middle of a panel's x range, metres.
fn middle(mesh: &GarmentMesh, panel: usize) -> f64 {
    let own = mesh
        .corners
        .iter()
        .flatten()
        .filter(|(q, _)| usize::from(*q) == panel);
    let [low, high] = own.fold([f64::MAX, f64::MIN], |[l, h], (_, q)| {
        [l.min(q[0]), h.max(q[0])]
    });
    0.5 * (low + high)
}

fn vertices(mesh: &GarmentMesh, panel: usize) -> BTreeSet<u32> {
    let faces = mesh.faces.iter().zip(&mesh.face_panel);
    let own = faces.filter(|(_, p)| usize::from(**p) == panel);
    own.flat_map(|(f, _)| *f).collect()
}

/// Values on the vertices of a panel that are the mean of their neighbours' wherever they aren't held.
fn harmonic(
    mesh: &GarmentMesh,
    panel: usize,
    held: &dyn Fn(u32) -> Option<f64>,
    start: f64,
) -> BTreeMap<u32, f64> {
    let ids: Vec<u32> = vertices(mesh, panel).into_iter().collect();
    let index: BTreeMap<u32, usize> = ids.iter().enumerate().map(|(i, v)| (*v, i)).collect();
    let mut around: Vec<BTreeSet<usize>> = vec![BTreeSet::new(); ids.len()];
    let faces = mesh.faces.iter().zip(&mesh.face_panel);
    for (f, _) in faces.filter(|(_, p)| usize::from(**p) == panel) {
        let f = f.map(|v| index[&v]);
        for k in 0..3 {
            around[f[k]].extend([f[(k + 1) % 3], f[(k + 2) % 3]]);
        }
    }
    let fixed: Vec<Option<f64>> = ids.iter().map(|v| held(*v)).collect();
    let mut x: Vec<f64> = fixed.iter().map(|f| f.unwrap_or(start)).collect();
    for _ in 0..SWEEPS {
        for i in 0..ids.len() {
            if fixed[i].is_none() {
                let sum: f64 = around[i].iter().map(|j| x[*j]).sum();
                x[i] += OVER_RELAXATION * (sum / around[i].len() as f64 - x[i]);
            }
        }
    }
    ids.into_iter().zip(x).collect()
}

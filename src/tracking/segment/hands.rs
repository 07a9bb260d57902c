//! Hands beyond sleeves that give no return: small components at the end of a hole that begins on the body.

use super::components::{Component, ComponentMap, RIM_CELLS};
use crate::settings::HandSettings;
use nalgebra::Vector3;
use tryon_geometry::math::P3;
use tryon_geometry::spatial::OrganisedCloud;

/// Components of the body.
pub(super) struct BodyComponents<'a> {
    pub(super) map: &'a ComponentMap,
    /// True for components of the body, shape `[components]`.
    pub(super) members: &'a [bool],
    /// The largest one.
    pub(super) main: &'a Component,
    /// Cells without a reading are empty space, not holes.
    pub(super) background_removed: bool,
    pub(super) settings: &'a HandSettings,
}

/// Small components near each other, as one candidate.
struct Candidate {
    cells: usize,
    /// Sum of its points.
    sum: Vector3<f32>,
    ids: Vec<u32>,
}

impl Candidate {
    fn centre(&self) -> Vector3<f32> {
        self.sum / self.cells as f32
    }
}

/// Middles of the hands beyond dark sleeves, camera frame, metres.
pub(super) fn find_hands(cloud: &OrganisedCloud, body: &BodyComponents<'_>) -> Vec<P3> {
    let candidates = candidates(body);
    if candidates.is_empty() {
        return Vec::new();
    }
    let cells: Vec<usize> = (0..cloud.depth.len())
        .filter(|i| is_trunk(body, *i))
        .step_by(body.settings.body_step)
        .collect();
    if is_porous(cloud, body, cells.len()) {
        return Vec::new();
    }
    candidates
        .iter()
        .filter_map(|c| {
            let centre = P3::from(c.centre());
            let end: [i32; 2] = cloud.cell_of(&centre)?.into();
            let near = |k: &&usize| (cloud.centre(**k) - centre).norm() <= body.settings.arm_length;
            cells
                .iter()
                .filter(near)
                .any(|k| is_joined_by_hole(cloud, body, c, end, cell_position(cloud, *k)))
                .then_some(centre)
        })
        .collect()
}

fn cell_position(cloud: &OrganisedCloud, cell: usize) -> [i32; 2] {
    let columns = cloud.size().0;
    [(cell % columns) as i32, (cell / columns) as i32]
}

/// Groups of small components at the depth of the body; fingers are components of their own.
fn candidates(body: &BodyComponents<'_>) -> Vec<Candidate> {
    let small = |c: &&Component| {
        // Without a background the surroundings of the body are a hole: there a hand must be separate.
        c.id != body.main.id
            && !(body.background_removed && body.members[c.id as usize])
            && c.area < body.settings.most_area
            && (c.centre.z - body.main.centre.z).abs() < body.settings.arm_length
            && c.side_cells <= RIM_CELLS
            && c.top_cells <= RIM_CELLS
    };
    let mut out: Vec<Candidate> = Vec::new();
    for c in body.map.list.iter().filter(small) {
        let near =
            |g: &&mut Candidate| (g.centre() - c.centre.coords).norm() < body.settings.hand_length;
        let sum = c.centre.coords * c.cells as f32;
        match out.iter_mut().find(near) {
            Some(g) => {
                g.cells += c.cells;
                g.sum += sum;
                g.ids.push(c.id);
            }
            None => out.push(Candidate {
                cells: c.cells,
                sum,
                ids: vec![c.id],
            }),
        }
    }
    out.retain(|g| g.cells >= body.settings.least_cells);
    out.truncate(body.settings.most_candidates);
    out
}

/// True for a cell of the body that is no hand; a hand beside the hip already belongs to the body.
fn is_trunk(body: &BodyComponents<'_>, cell: usize) -> bool {
    body.map
        .member(cell, body.members)
        .is_some_and(|c| c.area >= body.settings.most_area)
}

/// True if single missing readings are all over the body (`sampled` of its cells, every n-th).
fn is_porous(cloud: &OrganisedCloud, body: &BodyComponents<'_>, sampled: usize) -> bool {
    let columns = cloud.size().0;
    let between = |i: usize, step: usize| {
        i >= step
            && i + step < cloud.depth.len()
            && is_trunk(body, i - step)
            && is_trunk(body, i + step)
    };
    let pore = |i: &usize| cloud.depth[*i] <= 0.0 && (between(*i, 1) || between(*i, columns));
    let pores = (0..cloud.depth.len()).filter(pore).count();
    pores as f32 > body.settings.most_pores * (body.settings.body_step * sampled) as f32
}

/// True if the straight line of cells from the candidate to the body runs through missing readings.
fn is_joined_by_hole(
    cloud: &OrganisedCloud,
    body: &BodyComponents<'_>,
    candidate: &Candidate,
    [u, v]: [i32; 2],
    [to_u, to_v]: [i32; 2],
) -> bool {
    let (du, dv) = (to_u - u, to_v - v);
    let steps = du.abs().max(dv.abs());
    let (mut empty, mut between) = (0, 0);
    for s in 1..steps {
        let Some(at) = cloud.cell(u + du * s / steps, v + dv * s / steps) else {
            return false;
        };
        if candidate.ids.contains(&body.map.of_cell[at]) || is_trunk(body, at) {
            continue;
        }
        between += 1;
        empty += i32::from(cloud.depth[at] <= 0.0);
    }
    between >= body.settings.least_gap && empty as f32 >= body.settings.hole_share * between as f32
}

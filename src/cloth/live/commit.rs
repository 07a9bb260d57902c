//! Commit stage: takes the solved positions over unless they are faulty, and measures strain and speed.

use super::contact::chunk::ContactChunk;
use super::error::ClothError;
use super::garment_model::GarmentModel;
use super::outfit_model::Model;
use super::patch::PatchWork;
use super::report::StepReport;
use super::state::{GarmentState, State};
use super::workspace::Workspace;
use tryon_geometry::math::V3;
use tryon_geometry::math::order_statistics::percentile;
use tryon_geometry::par;

/// Percentage of vertices that are at most as fast as a garment. The rest, caught between layers, may never rest.
const SPEED_PERCENTILE: usize = 95;
/// Percentile of the stretch that is reported.
const STRAIN_PERCENTILE: usize = 99;

/// Result of one garment.
#[derive(Default)]
struct Outcome {
    /// Vertex that is not finite.
    faulty: Option<usize>,
    /// Displacement that [`SPEED_PERCENTILE`] % of its vertices do not exceed, metres.
    displacement: f32,
    /// Stretch of its edges: percentile and largest.
    strain: Option<[f32; 2]>,
}

/// Takes positions over, garment by garment; one with a vertex that is not finite keeps its last state.
/// Returns the speed of the fastest garment, m/s.
pub(super) fn commit(
    model: &Model,
    state: &mut State,
    work: &Workspace,
    dt: f64,
    report: &mut StepReport,
) -> f32 {
    let (patches, chunks) = (&work.patches, &work.chunks);
    let garments = state.garments.iter_mut();
    let mut all: Vec<_> = garments.map(|g| (g, Outcome::default())).collect();
    par::for_chunks(model.config.par, &mut all, 1, |k, one| {
        let (g, outcome) = &mut one[0];
        let own = chunks.iter().filter(|c| c.garment == k);
        *outcome = commit_garment(&model.garments[k], g, own, patches);
    });
    let mut fastest = 0.0f32;
    for (k, (g, outcome)) in all.iter_mut().enumerate() {
        if let Some(index) = outcome.faulty {
            let what = "cloth vertex";
            let fault = ClothError::NotFinite { what, index };
            let name = &model.outfit.garments[k].name;
            report.kept_last_good = Some(format!("garment `{name}`: {fault}"));
            g.velocities.iter_mut().for_each(|v| *v = V3::zeros());
            continue;
        }
        fastest = fastest.max(outcome.displacement / dt as f32);
        if let Some([p99, most]) = outcome.strain {
            report.p99_strain = report.p99_strain.max(f64::from(p99));
            report.max_strain = report.max_strain.max(f64::from(most));
        }
        report.softened = report.softened.min(model.garments[k].softened);
        for c in chunks.iter().filter(|c| c.garment == k) {
            c.report.add_to(report);
        }
    }
    report.contacts = patches.iter().map(|p| p.contacts).sum();
    fastest
}

fn commit_garment<'a>(
    m: &GarmentModel,
    g: &mut GarmentState,
    chunks: impl Iterator<Item = &'a ContactChunk> + Clone,
    patches: &[PatchWork],
) -> Outcome {
    let faulty = chunks.clone().find_map(|c| {
        let (f, motion) = (&m.patches[c.patch], &patches[c.at].motion);
        let is_faulty = |i: &usize| {
            let (x, u) = (motion.position(*i).0, motion.velocity[*i].0);
            !x.iter().chain(&u).all(|c| c.is_finite())
        };
        let mut owned = c.owned(f).map(|(_, i)| i);
        owned.find(is_faulty).map(|i| f.vertices[i] as usize)
    });
    if faulty.is_some() {
        return Outcome {
            faulty,
            ..Outcome::default()
        };
    }
    let mut squares: Vec<f32> = Vec::with_capacity(g.positions.len());
    for c in chunks {
        let (f, p) = (&m.patches[c.patch], &patches[c.at]);
        for (j, i) in c.owned(f) {
            let v = f.vertices[i] as usize;
            g.positions[v] = p.position(i);
            g.velocities[v] = p.velocity(i);
            g.nearest[v] = c.nearest[j];
            // Displacement, not velocity: a vertex between contradicting planes has one and stays.
            let moved = p.motion.displacement[i];
            squares.push(moved.dot(moved));
        }
    }
    let length = |v: &[u32; 2]| (g.positions[v[0] as usize] - g.positions[v[1] as usize]).norm();
    let edges = m.sheet.edges.iter();
    let mut strain: Vec<f32> = edges.map(|(v, l)| length(v) / *l as f32 - 1.0).collect();
    let largest = strain.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    Outcome {
        faulty: None,
        displacement: percentile(&mut squares, SPEED_PERCENTILE)
            .unwrap_or(0.0)
            .sqrt(),
        strain: percentile(&mut strain, STRAIN_PERCENTILE).map(|p99| [p99, largest]),
    }
}

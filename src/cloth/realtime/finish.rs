//! What a call hands on: positions, and what is said of them.

use super::model::{GarmentModel, Model};
use super::piece::Piece;
use super::state::{GarmentState, PatchScratch, State, StepReport};
use crate::cloth::ClothError;
use crate::math::V3;
use crate::par;

/// What one garment came to.
#[derive(Default)]
struct Outcome {
    /// Vertex that is nowhere.
    bad: Option<usize>,
    /// Length of the way that 95 % of its vertices do not exceed, metres.
    way: f32,
    /// Stretch of its edges: 99th percentile and largest.
    strain: Option<[f32; 2]>,
}

/// Takes positions over unless one is not finite; returns how fast 95 % of the fastest garment is at most, m/s.
pub(super) fn finish(
    model: &Model,
    state: &mut State,
    patches: &[PatchScratch],
    pieces: &[Piece],
    dt: f64,
    report: &mut StepReport,
) -> f32 {
    let mut all: Vec<_> = state
        .garments
        .iter_mut()
        .map(|g| (g, Outcome::default()))
        .collect();
    par::for_chunks(model.config.par, &mut all, 1, |k, one| {
        let (g, outcome) = &mut one[0];
        *outcome = take_over(
            &model.garments[k],
            g,
            pieces.iter().filter(|q| q.garment == k),
            patches,
        );
    });
    let mut fastest = 0.0f32;
    for (k, (g, outcome)) in all.iter_mut().enumerate() {
        if let Some(index) = outcome.bad {
            let fault = ClothError::NotFinite {
                what: "cloth vertex",
                index,
            };
            report.kept_last_good = Some(format!(
                "garment `{}`: {fault}",
                model.outfit.garments[k].name
            ));
            g.velocities.iter_mut().for_each(|v| *v = V3::zeros());
            continue;
        }
        fastest = fastest.max(outcome.way / dt as f32);
        if let Some([p99, most]) = outcome.strain {
            report.p99_strain = report.p99_strain.max(f64::from(p99));
            report.max_strain = report.max_strain.max(f64::from(most));
        }
        report.softened = report.softened.min(model.garments[k].softened);
        for q in pieces.iter().filter(|q| q.garment == k) {
            let r = &q.report;
            report.pinched += r.pinched;
            report.cloth_contacts += r.cloth_contacts;
            report.searches_skipped += r.searches_skipped;
            report.fold_searches_skipped += r.fold_searches_skipped;
            report.penetration = report.penetration.max(r.penetration);
            report.penetration_left = report.penetration_left.max(r.penetration_left);
        }
    }
    report.contacts = patches.iter().map(|p| p.contacts).sum();
    fastest
}

fn take_over<'a>(
    m: &GarmentModel,
    g: &mut GarmentState,
    pieces: impl Iterator<Item = &'a Piece> + Clone,
    patches: &[PatchScratch],
) -> Outcome {
    let bad = pieces.clone().find_map(|q| {
        let (f, motion) = (&m.patches[q.patch], &patches[q.at].motion);
        let wrong = |i: &usize| {
            !motion
                .position(*i)
                .0
                .iter()
                .chain(&motion.velocity[*i].0)
                .all(|c| c.is_finite())
        };
        q.owned(f)
            .map(|(_, i)| i)
            .find(wrong)
            .map(|i| f.vertices[i] as usize)
    });
    if bad.is_some() {
        return Outcome {
            bad,
            ..Outcome::default()
        };
    }
    let mut ways: Vec<f32> = Vec::with_capacity(g.positions.len());
    for q in pieces {
        let (f, motion) = (&m.patches[q.patch], &patches[q.at].motion);
        for (j, i) in q.owned(f) {
            let v = f.vertices[i] as usize;
            let u = motion.velocity[i].0;
            g.positions[v] = motion.position(i).point();
            g.velocities[v] = V3::new(u[0], u[1], u[2]);
            g.nearest[v] = q.nearest[j];
            for (to, from) in g.layers.iter_mut().zip(&q.layers) {
                if let (Some(to), Some(from)) = (to.get_mut(v), from.get(j)) {
                    *to = *from;
                }
            }
            // How far it came: between planes that contradict each other a vertex has a speed and stays.
            ways.push(motion.displacement[i].dot(motion.displacement[i]));
        }
    }
    let length = |v: &[u32; 2]| (g.positions[v[0] as usize] - g.positions[v[1] as usize]).norm();
    let mut strain: Vec<f32> = m
        .sheet
        .edges
        .iter()
        .map(|(v, l)| length(v) / *l as f32 - 1.0)
        .collect();
    let largest = strain.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    Outcome {
        bad: None,
        // A few vertices caught between layers and skin may never rest, and shall not keep the others awake.
        way: percentile(&mut ways, 95).unwrap_or(0.0).sqrt(),
        strain: percentile(&mut strain, 99).map(|p99| [p99, largest]),
    }
}

/// What so many of a hundred do not exceed; nothing of nothing. Orders them anew.
pub(super) fn percentile(of: &mut [f32], hundredths: usize) -> Option<f32> {
    let at = (of.len() * hundredths / 100).min(of.len().checked_sub(1)?);
    Some(*of.select_nth_unstable_by(at, f32::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn so_many_of_a_hundred_do_not_exceed_a_percentile() {
        let mut all: Vec<f32> = (0..200).rev().map(|i| i as f32).collect();
        assert_eq!(percentile(&mut all, 95), Some(190.0));
        assert_eq!(percentile(&mut all, 100), Some(199.0));
        assert_eq!(percentile(&mut [3.0], 99), Some(3.0));
        assert_eq!(percentile(&mut [], 99), None);
        // What is no number is the largest.
        assert_eq!(percentile(&mut [f32::NAN, 1.0, 2.0], 34), Some(2.0));
    }
}

//! Robust Gauss–Newton over all outlines, from coarse to fine.
//!
//! At a quarter of the size rotation is found for a row of time offsets and the best one kept; then all unknowns at a
//! quarter, a half and the whole. Points are searched anew in every iteration; Tukey's biweight with the median
//! absolute deviation leaves out borders of something else.

use super::border::BorderSearch;
use super::evidence::WalkEvidence;
use super::residual::{
    Comparison, ResidualRow, TIME, UNKNOWNS, UnknownVector, Unknowns, WIDTH, outline_rows,
};
use super::settings::ExtrinsicsSettings;
use nalgebra::{Isometry3, SMatrix};
use tryon_geometry::math::order_statistics::median;
use tryon_geometry::par::{self, Par};

/// Tuning constant of Tukey's biweight: 95 % efficiency on normal errors.
const TUKEY: f64 = 4.685;
/// Standard deviation over the median absolute deviation of normal errors.
const MAD: f64 = 1.4826;
/// Least standard deviation assumed (pixels of a level).
const LEAST_SCALE: f64 = 0.2;
/// Residual from which a point counts as missed when times are compared (pixels of a level).
const MISSED: f64 = 3.0;
/// Relative growth of the diagonal, against singular systems.
const DAMPING: f64 = 1e-6;
/// Step below which iterations end: micrometres, microradians.
const SMALL_STEP: f64 = 2e-6;

/// Normal equations of weighted rows.
pub(crate) type NormalMatrix = SMatrix<f64, UNKNOWNS, UNKNOWNS>;

/// One stage: images of a size, and the unknowns that are free.
#[derive(Clone, Copy, Debug)]
struct Stage {
    comparison: Comparison,
    free: [bool; UNKNOWNS],
    iterations: usize,
}

/// Estimate with its normal equations.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Solution {
    pub(crate) unknowns: Unknowns,
    /// Jᵀ W J of the last iteration.
    pub(crate) normal: NormalMatrix,
    /// Sum of the weights.
    pub(crate) weight: f64,
    /// Standard deviation of a residual (pixels of reduced colour).
    pub(crate) scale: f64,
    /// Share of outline points that are met.
    pub(crate) met: f64,
}

/// Estimates all unknowns from `start`.
pub(crate) fn solve(
    evidence: &WalkEvidence,
    start: &Isometry3<f64>,
    settings: &ExtrinsicsSettings,
) -> Solution {
    let contrast = settings.least_contrast;
    let stage = |level: usize, [reach, side, iterations]: [usize; 3], fixed: &[usize]| Stage {
        comparison: Comparison {
            level,
            search: BorderSearch {
                reach,
                side,
                contrast,
            },
        },
        free: std::array::from_fn(|k| !fixed.contains(&k)),
        iterations,
    };
    let rotation = stage(2, [20, 2, 6], &[0, 1, 2, TIME, WIDTH]);
    let stages = [
        stage(2, [12, 2, 8], &[0, 1, 2, WIDTH]),
        stage(2, [8, 2, 8], &[WIDTH]),
        stage(1, [8, 2, 10], &[WIDTH]),
        stage(0, [8, 3, 12], &[]),
    ];

    let count = (settings.unknown_time / settings.time_step).floor() as i32;
    let from_time = |i: i32| {
        let start = Unknowns {
            color_from_depth: *start,
            time_offset: f64::from(i) * settings.time_step,
            width: 0.0,
        };
        let found = run(evidence, &rotation, start);
        (cost(evidence, &rotation, &found.unknowns), found)
    };
    let tried = (-count..=count).map(from_time);
    let best = tried.min_by(|a, b| a.0.total_cmp(&b.0));
    let mut found = best.map_or_else(|| from_time(0).1, |b| b.1);
    for stage in &stages {
        found = run(evidence, stage, found.unknowns);
    }
    found
}

/// Residuals of all outlines.
fn all_rows(evidence: &WalkEvidence, stage: &Stage, unknowns: &Unknowns) -> Vec<ResidualRow> {
    let mut rows: Vec<Vec<ResidualRow>> = Vec::new();
    par::map_into(Par::Rayon, evidence.outlines.len(), 1, &mut rows, |i| {
        outline_rows(evidence, i, unknowns, &stage.comparison)
    });
    rows.concat()
}

/// Mean over all outline points of the squared residual, at most one: missed points count as that.
fn cost(evidence: &WalkEvidence, stage: &Stage, unknowns: &Unknowns) -> f64 {
    let rows = all_rows(evidence, stage, unknowns);
    let gain = |r: &ResidualRow| 1.0 - (r.residual / MISSED).powi(2).min(1.0);
    1.0 - rows.iter().map(gain).sum::<f64>() / outline_points(evidence)
}

fn outline_points(evidence: &WalkEvidence) -> f64 {
    let points = evidence.outlines.iter().map(|(_, o)| o.points.len());
    points.sum::<usize>().max(1) as f64
}

fn run(evidence: &WalkEvidence, stage: &Stage, start: Unknowns) -> Solution {
    let mut found = Solution {
        unknowns: start,
        normal: NormalMatrix::zeros(),
        weight: 0.0,
        scale: f64::INFINITY,
        met: 0.0,
    };
    for _ in 0..stage.iterations {
        let rows = all_rows(evidence, stage, &found.unknowns);
        let mut sizes: Vec<f64> = rows.iter().map(|r| r.residual.abs()).collect();
        let Some(size) = median(&mut sizes) else {
            return found;
        };
        let scale = (MAD * size).max(LEAST_SCALE);
        let (mut normal, mut gradient) = (NormalMatrix::zeros(), UnknownVector::zeros());
        let mut weights = 0.0;
        for row in &rows {
            let u = row.residual / (TUKEY * scale);
            let weight = (1.0 - u * u).max(0.0).powi(2);
            normal += row.gradient * row.gradient.transpose() * weight;
            gradient += row.gradient * (weight * row.residual);
            weights += weight;
        }
        found.normal = normal;
        found.weight = weights;
        found.scale = scale * 2.0f64.powi(stage.comparison.level as i32);
        found.met = weights / outline_points(evidence);

        let step = newton_step(&normal, &gradient, &stage.free);
        found.unknowns = found.unknowns.moved(&step);
        if step.amax() < SMALL_STEP {
            break;
        }
    }
    found
}

/// −H⁻¹ g of the free unknowns, 0 of the others.
fn newton_step(
    normal: &NormalMatrix,
    gradient: &UnknownVector,
    free: &[bool; UNKNOWNS],
) -> UnknownVector {
    let (mut h, mut g) = (*normal, *gradient);
    for k in 0..UNKNOWNS {
        h[(k, k)] = h[(k, k)] * (1.0 + DAMPING) + f64::MIN_POSITIVE;
        if !free[k] {
            h.row_mut(k).fill(0.0);
            h.column_mut(k).fill(0.0);
            h[(k, k)] = 1.0;
            g[k] = 0.0;
        }
    }
    h.cholesky()
        .map_or_else(UnknownVector::zeros, |factor| -factor.solve(&g))
}

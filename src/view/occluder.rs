//! Occluder patches: connected front pixels kept when they are large, clearly in front and end in a depth step.
//!
//! Depth alone decides badly per pixel: sensor noise at 3 m equals the gap between chest and shirt.

use super::evidence::{Evidence, depth_sigma};

/// A patch with at least one limb pixel in so many is an arm, however smooth its edge.
const LIMB_RATIO: usize = 3;

/// Criteria of an occluder patch.
#[derive(Clone, Copy, Debug)]
pub(super) struct PatchCriteria<'a> {
    /// Columns of the drawn area.
    pub(super) width: usize,
    /// Smallest patch, pixels.
    pub(super) smallest: usize,
    /// Distance from the edge at which depths are compared, pixels: the sensor blurs the edge itself.
    pub(super) edge_distance: usize,
    /// Depth step of an edge, metres, on top of the noise.
    pub(super) step: f32,
    /// Share of a patch's edge on such a step below which the patch belongs to the body under the garment.
    pub(super) smooth_share: f32,
    /// Captured depth, metres, 0 = none; shape `[area]`.
    pub(super) depth: &'a [f32],
}

/// Scratch of [`drop_specks`].
#[derive(Clone, Debug, Default)]
pub(super) struct FloodScratch {
    visited: Vec<bool>,
    stack: Vec<u32>,
    patch: Vec<u32>,
}

/// Sums over one patch.
#[derive(Clone, Copy, Debug, Default)]
struct PatchStatistics {
    has_clear_front: bool,
    /// Pixels of a limb.
    limb: usize,
    /// Pairs of a patch pixel and a garment pixel beside it, and those on a depth step.
    edges: usize,
    steps: usize,
}

/// Turns front patches that are small, nowhere clearly in front, or continuous with the covered body into garment; returns
/// the number of pixels.
pub(super) fn drop_specks(
    evidence: &mut [Evidence],
    criteria: &PatchCriteria<'_>,
    scratch: &mut FloodScratch,
) -> usize {
    scratch.visited.clear();
    scratch.visited.resize(evidence.len(), false);
    let mut dropped = 0;
    for seed in 0..evidence.len() {
        if !evidence[seed].is_front() || scratch.visited[seed] {
            continue;
        }
        let s = grow(seed, evidence, criteria, scratch);
        let size = scratch.patch.len();
        let is_smooth =
            (s.steps as f32) < criteria.smooth_share * s.edges as f32 && LIMB_RATIO * s.limb < size;
        if !s.has_clear_front || is_smooth || size < criteria.smallest {
            dropped += size;
            for &i in &scratch.patch {
                evidence[i as usize] = Evidence::Garment;
            }
        }
    }
    dropped
}

/// Collects the 4-connected patch of `seed` in `scratch.patch`.
fn grow(
    seed: usize,
    evidence: &[Evidence],
    criteria: &PatchCriteria<'_>,
    scratch: &mut FloodScratch,
) -> PatchStatistics {
    let FloodScratch {
        visited,
        stack,
        patch,
    } = scratch;
    patch.clear();
    stack.clear();
    stack.push(seed as u32);
    visited[seed] = true;
    let mut sums = PatchStatistics::default();
    while let Some(pixel) = stack.pop() {
        patch.push(pixel);
        let i = pixel as usize;
        sums.has_clear_front |= evidence[i] >= Evidence::ClearFront;
        sums.limb += usize::from(evidence[i] == Evidence::Limb);
        for (side, j) in neighbours(i, criteria.width, evidence.len()) {
            if evidence[j] == Evidence::Garment {
                sums.edges += 1;
                sums.steps += usize::from(criteria.is_step(i, j, side));
            }
            if evidence[j].is_front() && !visited[j] {
                visited[j] = true;
                stack.push(j as u32);
            }
        }
    }
    sums
}

/// Left, right, upper and lower neighbours of pixel `i` of `n`, each with its side 0 to 3.
fn neighbours(i: usize, width: usize, n: usize) -> impl Iterator<Item = (usize, usize)> {
    let x = i % width;
    let all = [
        (x > 0).then(|| i - 1),
        (x + 1 < width).then(|| i + 1),
        i.checked_sub(width),
        (i + width < n).then(|| i + width),
    ];
    all.into_iter()
        .enumerate()
        .filter_map(|(side, j)| Some((side, j?)))
}

impl PatchCriteria<'_> {
    /// Captured depth steps back from patch pixel `i` to its garment neighbour `j`.
    fn is_step(&self, i: usize, j: usize, side: usize) -> bool {
        let away = self.edge_distance * if side < 2 { 1 } else { self.width };
        let (outside, inside) = if side.is_multiple_of(2) {
            (j.checked_sub(away), i.checked_add(away))
        } else {
            (j.checked_add(away), i.checked_sub(away))
        };
        let at = |k: Option<usize>| k.and_then(|k| self.depth.get(k)).copied().unwrap_or(0.0);
        let (behind, front) = (at(outside), at(inside));
        // Beside a step the sensor has a shadow without readings.
        behind == 0.0 || (front > 0.0 && behind - front > self.step + depth_sigma(behind))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Margins;

    const SIDE: usize = 20;

    /// A square patch of `size` pixels, `height` metres in front of a wall at 2 m; its evidence after the filter.
    fn filtered(size: usize, height: f32, mark: Evidence) -> (Vec<Evidence>, usize) {
        let is_patch = |i: usize| {
            let inside = |k: usize| (5..5 + size).contains(&k);
            inside(i % SIDE) && inside(i / SIDE)
        };
        let depth: Vec<f32> = (0..SIDE * SIDE)
            .map(|i| 2.0 - if is_patch(i) { height } else { 0.0 })
            .collect();
        let mut evidence: Vec<Evidence> = (0..SIDE * SIDE)
            .map(|i| if is_patch(i) { mark } else { Evidence::Garment })
            .collect();
        let criteria = PatchCriteria {
            width: SIDE,
            smallest: 16,
            edge_distance: 1,
            step: 0.012,
            smooth_share: Margins::default().smooth_share,
            depth: &depth,
        };
        let dropped = drop_specks(&mut evidence, &criteria, &mut FloodScratch::default());
        (evidence, dropped)
    }

    #[test]
    fn only_large_clear_patches_with_depth_steps_stay() {
        let kept = |size, height, mark| filtered(size, height, mark).1 == 0;
        assert!(kept(6, 0.1, Evidence::ClearFront));
        assert!(
            !kept(3, 0.1, Evidence::ClearFront),
            "smaller than the least patch"
        );
        assert!(!kept(6, 0.1, Evidence::Front), "nowhere clearly in front");
        assert!(
            !kept(6, 0.0, Evidence::ClearFront),
            "continuous with the covered body"
        );
        assert!(kept(6, 0.0, Evidence::Limb), "a limb lies flat on the body");
    }

    #[test]
    fn dropped_patches_become_garment() {
        let (evidence, dropped) = filtered(3, 0.1, Evidence::ClearFront);
        assert_eq!(dropped, 9);
        assert!(evidence.iter().all(|e| *e == Evidence::Garment));
        assert_eq!(
            drop_specks(
                &mut [],
                &PatchCriteria {
                    width: 1,
                    smallest: 1,
                    edge_distance: 1,
                    step: 0.0,
                    smooth_share: Margins::default().smooth_share,
                    depth: &[],
                },
                &mut FloodScratch::default()
            ),
            0
        );
    }
}

//! Joints as modes of the class densities in space, by weighted mean shift (section 3.3 of Shotton et al. 2011).

use super::class_map::ClassMap;
use super::feature::{PersonCells, ray_axes};
use super::tree::OFFSET_UNIT;
use crate::settings::PartVoteSettings;
use tryon_geometry::math::P3;

/// Modes of a class.
const MODES: usize = 2;
/// Starts of the search for the modes of a class, the heaviest votes apart from each other.
const STARTS: usize = 3;
/// Most votes of a class; more are thinned evenly.
const VOTES: usize = 256;
/// Most iterations of the mean shift.
const ITERATIONS: usize = 12;

/// A proposed joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointProposal {
    /// Class whose joint it is.
    pub class: u8,
    /// Place, camera frame, metres.
    pub position: P3,
    /// Confidence, 0 to 1: mean share of the class among the votes of the mode, times the mode's part of all votes.
    pub weight: f32,
}

/// Vote of one cell for one class.
#[derive(Clone, Copy, Debug)]
struct Vote {
    at: P3,
    /// Share × visible area.
    weight: f32,
    share: f32,
}

/// Votes of all classes.
#[derive(Clone, Debug, Default)]
pub(super) struct ModeScratch {
    votes: Vec<Vec<Vote>>,
    thinned: Vec<Vote>,
}

impl ModeScratch {
    /// Collects the votes of all cells, each displaced by the leaves' mean way to the joint (Girshick et al., ICCV 2011).
    /// Shares below `least_share` do not vote.
    pub(super) fn gather(&mut self, person: &PersonCells<'_>, map: &ClassMap, least_share: f32) {
        self.votes.resize(map.classes, Vec::new());
        self.votes.iter_mut().for_each(Vec::clear);
        for (i, &cell) in person.cells.iter().enumerate() {
            let p = person.cloud.centre(cell as usize);
            let area = p.z * p.z;
            let [right, down, away] = ray_axes(&p, &person.up);
            for (c, &share) in map.shares(i).iter().enumerate() {
                if share >= least_share {
                    let way = map.offsets[i * map.classes + c].map(|o| o * OFFSET_UNIT / share);
                    self.votes[c].push(Vote {
                        at: p + right * way[0] + down * way[1] + away * way[2],
                        weight: share * area,
                        share,
                    });
                }
            }
        }
    }
}

/// Kernel-weighted sums about a place.
#[derive(Clone, Copy, Default)]
struct KernelSums {
    weight: f32,
    share: f32,
    mean: P3,
}

fn kernel_sums(votes: &[Vote], at: &P3, radius: f32) -> KernelSums {
    let scale = 1.0 / (radius * radius);
    let (mut weight, mut share, mut sum) = (0.0, 0.0, nalgebra::Vector3::zeros());
    for v in votes {
        let d = (v.at - at).norm_squared() * scale;
        if d < 1.0 {
            let w = (1.0 - d) * (1.0 - d) * v.weight;
            weight += w;
            share += w * v.share;
            sum += v.at.coords * w;
        }
    }
    KernelSums {
        weight,
        share: share / weight.max(f32::MIN_POSITIVE),
        mean: P3::from(sum / weight.max(f32::MIN_POSITIVE)),
    }
}

/// Climbs from a vote to its mode.
fn climb(votes: &[Vote], mut at: P3, settings: &PartVoteSettings) -> (P3, KernelSums) {
    let mut sums = kernel_sums(votes, &at, settings.radius);
    for _ in 0..ITERATIONS {
        let step = (sums.mean - at).norm();
        at = sums.mean;
        if step < settings.settled {
            break;
        }
        sums = kernel_sums(votes, &at, settings.radius);
    }
    (at, sums)
}

/// Modes of one class, the heaviest first.
fn class_modes(votes: &[Vote], settings: &PartVoteSettings) -> Vec<(P3, KernelSums)> {
    let mut modes: Vec<(P3, KernelSums)> = Vec::new();
    let mut starts: Vec<P3> = Vec::new();
    for _ in 0..STARTS {
        let free = |v: &&Vote| starts.iter().all(|s| (s - v.at).norm() > settings.radius);
        let heaviest = votes
            .iter()
            .filter(free)
            .reduce(|a, b| if b.weight > a.weight { b } else { a });
        let Some(start) = heaviest.map(|v| v.at) else {
            break;
        };
        starts.push(start);
        let (at, sums) = climb(votes, start, settings);
        if modes.iter().all(|m| (m.0 - at).norm() > settings.same_mode) {
            modes.push((at, sums));
        }
    }
    modes.sort_by(|a, b| b.1.weight.total_cmp(&a.1.weight));
    modes.truncate(MODES);
    let most = modes.first().map_or(0.0, |m| m.1.weight);
    modes.retain(|m| m.1.weight >= settings.least_mode * most);
    modes
}

/// Modes of all classes.
pub(super) fn find_modes(
    scratch: &mut ModeScratch,
    settings: &PartVoteSettings,
) -> Vec<JointProposal> {
    let mut out = Vec::new();
    for (class, all) in scratch.votes.iter().enumerate() {
        let stride = all.len().div_ceil(VOTES).max(1);
        scratch.thinned.clear();
        scratch.thinned.extend(all.iter().step_by(stride));
        let modes = class_modes(&scratch.thinned, settings);
        let total: f32 = modes.iter().map(|m| m.1.weight).sum();
        for (position, sums) in modes {
            out.push(JointProposal {
                class: class as u8,
                position,
                weight: sums.share * sums.weight / total.max(f32::MIN_POSITIVE),
            });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_clusters_give_two_modes_in_order() {
        let vote = |x: f32, share: f32| Vote {
            at: P3::new(x, 0.0, 2.0),
            weight: share,
            share,
        };
        let near = (0..20).map(|i| vote(0.002 * i as f32, 0.9));
        let far = (0..8).map(|i| vote(0.5 + 0.002 * i as f32, 0.5));
        let mut scratch = ModeScratch {
            votes: vec![vec![], near.chain(far).collect()],
            thinned: vec![],
        };
        let found = find_modes(&mut scratch, &PartVoteSettings::default());
        assert_eq!(found.len(), 2);
        assert!(found.iter().all(|p| p.class == 1));
        assert!((found[0].position.x - 0.019).abs() < 1e-3, "{found:?}");
        assert!((found[1].position.x - 0.507).abs() < 1e-3, "{found:?}");
        assert!(found[0].weight > 0.7 && found[1].weight < 0.2, "{found:?}");
    }
}

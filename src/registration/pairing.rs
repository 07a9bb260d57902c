//! Which point of the model belongs to which reading: both directions, pruned as in Table 1 of the paper.

use super::IndexImage;
use crate::math::{P3, V3};
use crate::spatial::{Label, OrganisedCloud, PointTree};

/// How pairs are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Association {
    /// Search windows in the images, both ways.
    #[default]
    Projective,
    /// Exact nearest neighbours in space by kd-tree, both ways (the paper's choice, from the model to the data).
    KdTree,
}

/// A model point, a reading, and how to measure between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// Model point.
    pub model: u32,
    /// Cell of the reading.
    pub cell: u32,
    /// Found from the reading's side.
    pub from_data: bool,
}

/// Points of the model in the camera frame; all slices have the same length.
#[derive(Clone, Copy, Debug)]
pub struct ModelPoints<'a> {
    /// Positions, metres.
    pub positions: &'a [P3],
    /// Unit outward normals.
    pub normals: &'a [V3],
    /// Bone of each point.
    pub bones: &'a [u8],
    /// Parent of each bone.
    pub parents: &'a [Option<usize>],
    /// Mean distance between points, metres.
    pub spacing: f32,
}

/// Bounds of Table 1 and the reach of this iteration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairingConfig {
    /// How pairs are found.
    pub association: Association,
    /// Longest pair, metres (Table 1: 0.2).
    pub distance: f32,
    /// Smallest cosine between the normals (Table 1: 60°).
    pub cos_normal: f32,
    /// Readings that no window explained look this far for the model, metres; 0 switches the search off.
    pub pull: f32,
    /// Use every n-th reading in the search from the data to the model.
    pub data_step: usize,
    /// Trees are not asked again for points that have moved by no more than this since, metres (0: always asked): such a
    /// pair is longer than the shortest by twice as much at most. The scratch must forget when readings change.
    pub reuse: f32,
}

/// What pairing did and left out.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PairingStats {
    /// Model points that the camera can see.
    pub visible: usize,
    /// Model points left out because they face away or are hidden.
    pub hidden: usize,
    /// Of them, those without a pair where the camera has no reading at all: neither right nor wrong.
    pub unknown: usize,
    /// Pairs from the model's side.
    pub from_model: usize,
    /// Readings searched from the data's side.
    pub readings: usize,
    /// Of them, those with a pair in their window.
    pub explained: usize,
    /// Pairs dropped by relaxed bijective consistency, eq. 9.
    pub inconsistent: usize,
    /// Questions to a tree that an earlier answer saved.
    pub reused: usize,
}

/// Scratch of pairing.
#[derive(Default)]
pub struct PairingScratch {
    /// The model drawn into the grid.
    pub image: IndexImage,
    /// Model points in front of a farther reading of the person, with its cell: nothing can be there.
    pub in_front: Vec<(u32, u32)>,
    facing: Vec<u32>,
    facing_points: Vec<P3>,
    /// Where each model point was when the readings were asked, and the cell that answered ([`UNASKED`] before).
    asked: Vec<(P3, u32)>,
    /// All model points when they last answered, and the point that answered each reading, in the order of asking.
    answered: (Vec<P3>, Vec<u32>),
}

impl PairingScratch {
    /// Readings have changed: no earlier answer counts.
    pub fn forget(&mut self) {
        self.asked.clear();
        self.answered.0.clear();
    }
}

/// No answer yet.
const UNASKED: u32 = u32::MAX;

/// A model point behind the drawn surface by less than this counts as visible (relaxed visibility), metres.
const RELAXED_VISIBILITY: f32 = 0.05;
/// A model point nearer than the person's reading by more than this (metres) stands in free space: more than loose
/// clothes and the error of a body that is not yet adapted.
const IN_FRONT: f32 = 0.06;
/// Model points that face the camera at least this much may pull; grazing ones have unreliable readings.
const FACING: f32 = 0.1;

/// Same bone, or neighbours in the tree: eq. 9 relaxed for joints, whose points belong to either side.
fn consistent(parents: &[Option<usize>], a: u8, b: u8) -> bool {
    let (a, b) = (usize::from(a), usize::from(b));
    a == b || parents[a] == Some(b) || parents[b] == Some(a)
}

/// Finds pairs. `cells` are the person's cells, `false_edges` (shape: grid) those that must not be matched, `tree` a
/// kd-tree over the points of `cells` (needed by [`Association::KdTree`] only).
pub fn pair_surfaces(
    model: &ModelPoints<'_>,
    grid: &OrganisedCloud,
    cells: &[u32],
    false_edges: &[bool],
    tree: Option<&PointTree>,
    config: &PairingConfig,
    scratch: &mut PairingScratch,
    pairs: &mut Vec<Pair>,
) -> PairingStats {
    let mut stats = PairingStats::default();
    pairs.clear();
    scratch
        .image
        .draw(grid, model.positions, model.normals, model.spacing);
    let (columns, rows) = grid.size();
    let focal = grid.focal()[0].max(grid.focal()[1]);
    let window = |z: f32| ((config.distance * focal / z.max(0.1)).ceil() as i32).clamp(1, 12);
    let exact = tree.filter(|_| config.association == Association::KdTree);

    let near = |a: &P3, b: &P3| (a - b).norm_squared() <= config.reuse * config.reuse;
    scratch
        .asked
        .resize(model.positions.len(), (P3::origin(), UNASKED));

    // From the model to the data.
    scratch.facing.clear();
    scratch.facing_points.clear();
    scratch.in_front.clear();
    for (i, (p, n)) in model.positions.iter().zip(model.normals).enumerate() {
        if n.dot(&p.coords) > -FACING * p.coords.norm() {
            continue;
        }
        scratch.facing.push(i as u32);
        scratch.facing_points.push(*p);
        let Some((u, v)) = grid.cell_of(p) else {
            continue;
        };
        let Some(home) = grid.cell(u, v) else {
            continue;
        };
        if p.z > scratch.image.depth[home] + RELAXED_VISIBILITY {
            continue;
        }
        stats.visible += 1;
        if grid.labels[home] == Label::Person && grid.depth[home] > p.z + IN_FRONT {
            scratch.in_front.push((i as u32, home as u32));
        }
        let best = match exact {
            Some(tree) => {
                let (at, mut cell) = scratch.asked[i];
                if cell != UNASKED && near(&at, p) {
                    stats.reused += 1;
                } else {
                    cell = tree
                        .nearest(p, f32::INFINITY)
                        .map_or(UNASKED, |(k, _)| cells[k]);
                    scratch.asked[i] = (*p, cell);
                }
                let within = |k: &usize| {
                    (grid.points[*k] - p).norm_squared() < config.distance * config.distance
                };
                (cell != UNASKED)
                    .then_some(cell as usize)
                    .filter(within)
                    .filter(|&k| !false_edges[k] && grid.normals[k].dot(n) >= config.cos_normal)
            }
            None => {
                let r = window(p.z);
                // Thin out wide windows: a step of two misses nothing that the next iteration would not find.
                let step = if r > 4 { 2 } else { 1 };
                let mut best = None;
                let mut bound = config.distance * config.distance;
                let mut y = (v - r).max(0);
                while y <= (v + r).min(rows as i32 - 1) {
                    let mut x = (u - r).max(0);
                    while x <= (u + r).min(columns as i32 - 1) {
                        let k = y as usize * columns + x as usize;
                        if grid.labels[k] == Label::Person {
                            let d = (grid.points[k] - p).norm_squared();
                            if d < bound
                                && grid.normals[k].dot(n) >= config.cos_normal
                                && !false_edges[k]
                            {
                                bound = d;
                                best = Some(k);
                            }
                        }
                        x += step;
                    }
                    y += step;
                }
                best
            }
        };
        let Some(cell) = best else {
            stats.unknown += usize::from(grid.labels[home] == Label::Unknown);
            continue;
        };
        let back = scratch.image.index[cell];
        if back != IndexImage::NONE
            && !consistent(model.parents, model.bones[i], model.bones[back as usize])
        {
            stats.inconsistent += 1;
            continue;
        }
        stats.from_model += 1;
        pairs.push(Pair {
            model: i as u32,
            cell: cell as u32,
            from_data: false,
        });
    }
    stats.hidden = model.positions.len() - stats.visible;

    // From the data to the model.
    let (mut then, mut answers) = std::mem::take(&mut scratch.answered);
    let same = config.reuse > 0.0
        && then.len() == model.positions.len()
        && then.iter().zip(model.positions).all(|(a, b)| near(a, b));
    if exact.is_some() && !same {
        answers.clear();
        then.clear();
        then.extend_from_slice(model.positions);
    }
    let model_tree = exact
        .filter(|_| !same)
        .map(|_| PointTree::new(&scratch.facing_points));
    let mut unexplained = 0usize;
    for &cell in cells.iter().step_by(config.data_step.max(1)) {
        let k = cell as usize;
        let (c, n) = (grid.points[k], grid.normals[k]);
        if grid.depth[k] <= 0.0 {
            continue;
        }
        stats.readings += 1;
        let best = match exact {
            Some(_) => {
                let i = match &model_tree {
                    Some(tree) => {
                        let i = tree
                            .nearest(&c, f32::INFINITY)
                            .map_or(UNASKED, |(i, _)| scratch.facing[i]);
                        answers.push(i);
                        i
                    }
                    None => {
                        stats.reused += 1;
                        answers.get(stats.readings - 1).copied().unwrap_or(UNASKED)
                    }
                };
                let within = |i: &u32| {
                    (model.positions[*i as usize] - c).norm_squared()
                        < config.distance * config.distance
                };
                (i != UNASKED)
                    .then_some(i)
                    .filter(within)
                    .filter(|&i| model.normals[i as usize].dot(&n) >= config.cos_normal)
            }
            None => {
                let (u, v) = ((k % columns) as i32, (k / columns) as i32);
                let r = window(c.z).min(6);
                let step = if r > 3 { 2 } else { 1 };
                let mut best = None;
                let mut bound = config.distance * config.distance;
                let mut y = (v - r).max(0);
                while y <= (v + r).min(rows as i32 - 1) {
                    let mut x = (u - r).max(0);
                    while x <= (u + r).min(columns as i32 - 1) {
                        let i = scratch.image.index[y as usize * columns + x as usize];
                        if i != IndexImage::NONE {
                            let d = (model.positions[i as usize] - c).norm_squared();
                            if d < bound && model.normals[i as usize].dot(&n) >= config.cos_normal {
                                bound = d;
                                best = Some(i);
                            }
                        }
                        x += step;
                    }
                    y += step;
                }
                best
            }
        };
        if let Some(i) = best {
            stats.explained += 1;
            if !false_edges[k] {
                pairs.push(Pair {
                    model: i,
                    cell,
                    from_data: true,
                });
            }
        } else if config.pull > 0.0 {
            // A coarse pull towards what nothing explains: every third such reading looks at all facing points.
            unexplained += 1;
            if unexplained.is_multiple_of(3)
                && let Some(i) = pull_target(model, scratch, &c, &n, config.pull)
            {
                pairs.push(Pair {
                    model: i,
                    cell,
                    from_data: true,
                });
            }
        }
    }
    scratch.answered = (then, answers);
    stats
}

/// The nearest model point that faces the camera and does not look the other way.
fn pull_target(
    model: &ModelPoints<'_>,
    scratch: &PairingScratch,
    c: &P3,
    n: &V3,
    reach: f32,
) -> Option<u32> {
    let mut best = None;
    let mut bound = reach * reach;
    for (p, &i) in scratch.facing_points.iter().zip(&scratch.facing) {
        let d = (p - c).norm_squared();
        if d < bound && model.normals[i as usize].dot(n) >= 0.0 {
            bound = d;
            best = Some(i);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{DepthImage, Intrinsics};

    /// A sphere of 0.3 m at 2 m, as depth image and as model points shifted by `shift`.
    fn sphere(shift: V3) -> (OrganisedCloud, Vec<u32>, Vec<P3>, Vec<V3>) {
        let k = Intrinsics {
            width: 320,
            height: 240,
            fx: 262.5,
            fy: 262.5,
            cx: 159.5,
            cy: 119.5,
        };
        let centre = V3::new(0.0, 0.0, 2.0);
        let data = (0..k.pixels()).map(|i| {
            let d = k.unproject((i % 320) as f32, (i / 320) as f32, 1.0).coords;
            let (a, b, c) = (
                d.norm_squared(),
                d.dot(&centre),
                centre.norm_squared() - 0.09,
            );
            let disc = b * b - a * c;
            if disc < 0.0 {
                0
            } else {
                ((b - disc.sqrt()) / a * 1000.0).round() as u16
            }
        });
        let image = DepthImage::new(320, 240, data.collect()).expect("sizes agree");
        let mut cloud = OrganisedCloud::new(&k, Some(2));
        cloud.sample(&image, 8.0);
        let cells: Vec<u32> = (0..cloud.depth.len())
            .filter(|&i| cloud.depth[i] > 0.0)
            .map(|i| i as u32)
            .collect();
        cells
            .iter()
            .for_each(|&c| cloud.labels[c as usize] = Label::Person);
        cloud.refine(&image, &cells);
        let (mut positions, mut normals) = (vec![], vec![]);
        for i in 0..1500 {
            // Fibonacci sphere.
            let y = 1.0 - 2.0 * (i as f32 + 0.5) / 1500.0;
            let (r, t) = ((1.0 - y * y).sqrt(), i as f32 * 2.399_963);
            let n = V3::new(r * t.cos(), y, r * t.sin());
            positions.push(P3::from(centre + n * 0.3 + shift));
            normals.push(n);
        }
        (cloud, cells, positions, normals)
    }

    #[test]
    fn both_searches_pair_nearby_points_and_respect_table_1() {
        let shift = V3::new(0.03, -0.02, 0.02);
        let (cloud, cells, positions, normals) = sphere(shift);
        let bones = vec![0u8; positions.len()];
        let model = ModelPoints {
            positions: &positions,
            normals: &normals,
            bones: &bones,
            parents: &[None],
            spacing: 0.028,
        };
        let points: Vec<P3> = cells.iter().map(|&c| cloud.points[c as usize]).collect();
        let tree = PointTree::new(&points);
        let no_edges = vec![false; cloud.depth.len()];
        for association in [Association::Projective, Association::KdTree] {
            let config = PairingConfig {
                association,
                distance: 0.1,
                cos_normal: 0.5,
                pull: 0.0,
                data_step: 1,
                reuse: 0.0,
            };
            let (mut scratch, mut pairs) = (PairingScratch::default(), vec![]);
            let stats = pair_surfaces(
                &model,
                &cloud,
                &cells,
                &no_edges,
                Some(&tree),
                &config,
                &mut scratch,
                &mut pairs,
            );
            assert!(
                stats.visible > 500 && stats.from_model * 10 > stats.visible * 8,
                "{association:?} {stats:?}"
            );
            assert!(
                stats.explained * 10 > stats.readings * 8,
                "{association:?} {stats:?}"
            );
            for p in &pairs {
                let d = cloud.points[p.cell as usize] - positions[p.model as usize];
                assert!(d.norm() < 0.1);
                assert!(cloud.normals[p.cell as usize].dot(&normals[p.model as usize]) >= 0.5);
            }
        }
    }

    #[test]
    fn windows_find_what_the_tree_finds() {
        let (cloud, cells, positions, normals) = sphere(V3::new(0.01, 0.0, 0.0));
        let bones = vec![0u8; positions.len()];
        let model = ModelPoints {
            positions: &positions,
            normals: &normals,
            bones: &bones,
            parents: &[None],
            spacing: 0.028,
        };
        let points: Vec<P3> = cells.iter().map(|&c| cloud.points[c as usize]).collect();
        let tree = PointTree::new(&points);
        let no_edges = vec![false; cloud.depth.len()];
        let mean = |association| {
            let config = PairingConfig {
                association,
                distance: 0.05,
                cos_normal: 0.5,
                pull: 0.0,
                data_step: 1,
                reuse: 0.0,
            };
            let (mut scratch, mut pairs) = (PairingScratch::default(), vec![]);
            pair_surfaces(
                &model,
                &cloud,
                &cells,
                &no_edges,
                Some(&tree),
                &config,
                &mut scratch,
                &mut pairs,
            );
            let d: f32 = pairs
                .iter()
                .map(|p| (cloud.points[p.cell as usize] - positions[p.model as usize]).norm())
                .sum();
            d / pairs.len() as f32
        };
        let (window, exact) = (mean(Association::Projective), mean(Association::KdTree));
        assert!(
            window < exact + 0.005,
            "mean pair length {window} against {exact}"
        );
    }

    #[test]
    fn earlier_answers_hold_within_their_bound_until_forgotten() {
        const REUSE: f32 = 2e-3;
        let (cloud, cells, positions, normals) = sphere(V3::new(0.01, 0.0, 0.0));
        let bones = vec![0u8; positions.len()];
        let points: Vec<P3> = cells.iter().map(|&c| cloud.points[c as usize]).collect();
        let tree = PointTree::new(&points);
        let no_edges = vec![false; cloud.depth.len()];
        let ask = |positions: &[P3], reuse, scratch: &mut PairingScratch| {
            let model = ModelPoints {
                positions,
                normals: &normals,
                bones: &bones,
                parents: &[None],
                spacing: 0.028,
            };
            let association = Association::KdTree;
            let config = PairingConfig {
                association,
                distance: 0.1,
                cos_normal: 0.5,
                pull: 0.0,
                data_step: 1,
                reuse,
            };
            let mut pairs = vec![];
            let tree = Some(&tree);
            let stats = pair_surfaces(
                &model, &cloud, &cells, &no_edges, tree, &config, scratch, &mut pairs,
            );
            (stats, pairs)
        };
        let mut scratch = PairingScratch::default();
        let (stats, first) = ask(&positions, REUSE, &mut scratch);
        assert_eq!(stats.reused, 0, "nothing was asked before");
        let (stats, again) = ask(&positions, REUSE, &mut scratch);
        assert_eq!(
            (stats.reused, &again),
            (stats.visible + stats.readings, &first),
            "all of it is known"
        );
        let shifted = |x: f32| {
            positions
                .iter()
                .map(|p| p + V3::new(x, 0.0, 0.0))
                .collect::<Vec<_>>()
        };
        let near = shifted(0.8 * REUSE);
        let (stats, kept) = ask(&near, REUSE, &mut scratch);
        assert!(stats.reused > stats.visible, "{stats:?}");
        let (_, shortest) = ask(&near, 0.0, &mut PairingScratch::default());
        let length =
            |pair: &Pair| (cloud.points[pair.cell as usize] - near[pair.model as usize]).norm();
        let of_model = |pairs: &[Pair]| {
            pairs
                .iter()
                .filter(|p| !p.from_data)
                .map(|p| (p.model, length(p)))
                .collect::<Vec<_>>()
        };
        let best: std::collections::BTreeMap<u32, f32> = of_model(&shortest).into_iter().collect();
        let worst = of_model(&kept)
            .iter()
            .filter_map(|(i, d)| Some(d - best.get(i)?))
            .fold(0.0, f32::max);
        assert!(worst <= 2.0 * REUSE, "{worst} m longer than the shortest");
        let (stats, _) = ask(&shifted(3.0 * REUSE), REUSE, &mut scratch);
        assert_eq!(stats.reused, 0, "too far");
        scratch.forget();
        assert_eq!(
            ask(&shifted(3.0 * REUSE), REUSE, &mut scratch).0.reused,
            0,
            "readings changed"
        );
    }

    #[test]
    fn nothing_pairs_with_nothing() {
        let (cloud, _, positions, normals) = sphere(V3::zeros());
        let bones = vec![0u8; positions.len()];
        let model = ModelPoints {
            positions: &positions,
            normals: &normals,
            bones: &bones,
            parents: &[None],
            spacing: 0.028,
        };
        let config = PairingConfig {
            association: Association::KdTree,
            distance: 0.1,
            cos_normal: 0.5,
            pull: 0.3,
            data_step: 1,
            reuse: 0.0,
        };
        let (mut scratch, mut pairs) = (PairingScratch::default(), vec![]);
        let no_edges = vec![false; cloud.depth.len()];
        let tree = PointTree::new(&[]);
        let stats = pair_surfaces(
            &model,
            &cloud,
            &[],
            &no_edges,
            Some(&tree),
            &config,
            &mut scratch,
            &mut pairs,
        );
        assert_eq!((stats.readings, pairs.len()), (0, 0));
        let nan = vec![P3::new(f32::NAN, f32::NAN, f32::NAN); positions.len()];
        let model = ModelPoints {
            positions: &nan,
            ..model
        };
        pair_surfaces(
            &model,
            &cloud,
            &[],
            &no_edges,
            None,
            &config,
            &mut scratch,
            &mut pairs,
        );
    }
}

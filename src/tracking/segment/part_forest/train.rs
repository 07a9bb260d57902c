//! Training of a forest, breadth first: all nodes of one depth at a time.
//!
//! Random numbers come from a generator seeded by tree, node and task, and counts are whole numbers, so that the forest is
//! the same for any number of threads.

use super::forest::PartForest;
use super::split::{CHUNK, SplitChoice, SplitSearch};
use super::training_set::TrainingSet;
use super::tree::{DecisionTree, LEAF, LeafCounts, SplitNode};
use crate::settings::{ForestSpec, PartVoteSettings};
use tryon_geometry::par::{self, Par};

/// A node whose split is being searched.
#[derive(Clone, Copy)]
struct OpenNode {
    /// Range of its cells in the order of members.
    cells: [usize; 2],
    /// Its number, for the random numbers.
    id: u64,
    /// Child slot of the parent that gets its index; `None` for the root.
    parent: Option<(usize, usize)>,
}

/// Tree in training.
struct Grower<'a> {
    set: &'a TrainingSet,
    spec: &'a ForestSpec,
    search: SplitSearch,
    par: Par,
    members: Vec<u32>,
    /// Scratch of the partition.
    above: Vec<u32>,
    tree: DecisionTree,
}

/// Trains a forest; labels at or above `classes` are ignored. `progress` gets the share that is done.
pub fn train(
    set: &TrainingSet,
    classes: usize,
    spec: &ForestSpec,
    par: Par,
    progress: &mut dyn FnMut(f64),
) -> PartForest {
    let of_class = |i: &u32| usize::from(set.cells[*i as usize].class) < classes;
    let members: Vec<u32> = (0..set.len() as u32).filter(of_class).collect();
    let mut trees = Vec::with_capacity(spec.trees);
    for t in 0..spec.trees {
        let mut grower = Grower {
            set,
            spec,
            search: SplitSearch {
                classes,
                spec: *spec,
                seed: spec
                    .seed
                    .wrapping_add(t as u64)
                    .wrapping_mul(0x2545_f491_4f6c_dd1d),
            },
            par,
            members: members.clone(),
            above: Vec::new(),
            tree: DecisionTree::default(),
        };
        grower.grow(&mut |share| progress((t as f64 + share) / spec.trees as f64));
        trees.push(grower.tree);
    }
    PartForest {
        classes,
        trees,
        settings: PartVoteSettings::default(),
    }
}

impl Grower<'_> {
    fn grow(&mut self, progress: &mut dyn FnMut(f64)) {
        let mut open = vec![OpenNode {
            cells: [0, self.members.len()],
            id: 1,
            parent: None,
        }];
        for depth in 0..self.spec.depth {
            let splits = self.choose(&open);
            let mut next = Vec::new();
            for (node, split) in open.iter().zip(&splits) {
                match split {
                    Some(split) => next.extend(self.split(node, split)),
                    None => self.close(node),
                }
            }
            open = next;
            progress((depth + 1) as f64 / self.spec.depth as f64);
        }
        open.iter().for_each(|node| self.close(node));
    }

    /// Best split of each node; `None` for leaves. The splits of most gain fill the room that is left.
    fn choose(&self, open: &[OpenNode]) -> Vec<Option<SplitChoice>> {
        let chunks = self.spec.features.div_ceil(CHUNK).max(1);
        let mut found: Vec<SplitChoice> = Vec::new();
        par::map_into(self.par, open.len() * chunks, 1, &mut found, |task| {
            let node = &open[task / chunks];
            let cells = &self.members[node.cells[0]..node.cells[1]];
            if cells.len() < self.spec.least_cells.max(2) {
                return SplitChoice::default();
            }
            let id = node.id * chunks as u64 + (task % chunks) as u64;
            self.search.best(self.set, cells, id)
        });
        let best: Vec<SplitChoice> = found
            .chunks_exact(chunks)
            .map(|c| {
                c.iter().fold(SplitChoice::default(), |best, s| {
                    if s.gain > best.gain { *s } else { best }
                })
            })
            .collect();
        let total = |i: usize| best[i].gain * (open[i].cells[1] - open[i].cells[0]) as f64;
        let mut order: Vec<usize> = (0..open.len()).filter(|i| best[*i].gain > 0.0).collect();
        order.sort_by(|a, b| total(*b).total_cmp(&total(*a)).then(a.cmp(b)));
        order.truncate(self.spec.splits.saturating_sub(self.tree.nodes.len()));
        let mut out = vec![None; open.len()];
        for i in order {
            out[i] = Some(best[i]);
        }
        out
    }

    /// Index of a finished node goes to its parent.
    fn link(&mut self, node: &OpenNode, index: u32) {
        if let Some((parent, side)) = node.parent {
            self.tree.nodes[parent].children[side] = index;
        }
    }

    /// Adds a split and partitions its cells, in their order; returns the children.
    fn split(&mut self, node: &OpenNode, split: &SplitChoice) -> [OpenNode; 2] {
        let index = self.tree.nodes.len();
        self.tree.nodes.push(SplitNode {
            feature: split.feature,
            threshold: split.threshold,
            children: [0; 2],
        });
        self.link(node, index as u32);
        self.above.clear();
        let [start, end] = node.cells;
        let mut middle = start;
        for k in start..end {
            let i = self.members[k];
            let response = self
                .set
                .response(split.feature, &self.set.cells[i as usize]);
            if response < split.threshold {
                self.members[middle] = i;
                middle += 1;
            } else {
                self.above.push(i);
            }
        }
        self.members[middle..end].copy_from_slice(&self.above);
        let child = |side: usize, cells: [usize; 2]| OpenNode {
            cells,
            id: node.id * 2 + side as u64,
            parent: Some((index, side)),
        };
        [child(0, [start, middle]), child(1, [middle, end])]
    }

    /// Adds a leaf.
    fn close(&mut self, node: &OpenNode) {
        let mut counts = LeafCounts::new(self.search.classes);
        for &i in &self.members[node.cells[0]..node.cells[1]] {
            let cell = &self.set.cells[i as usize];
            counts.add(cell.class, cell.sector, cell.offset);
        }
        let index = self.tree.leaves.len() as u32;
        self.tree.leaves.push(counts.shares(self.spec));
        self.link(node, index | LEAF);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::segment::part_forest::{CellLabel, PartScratch, PersonCells};
    use tryon_geometry::camera::{DepthImage, Intrinsics};
    use tryon_geometry::math::V3;
    use tryon_geometry::par::with_threads;
    use tryon_geometry::spatial::OrganisedCloud;

    const UP: V3 = V3::new(0.0, -1.0, 0.0);

    /// A bar 0.4 m high at 2 m whose upper half is class 1; `shift` moves it in the picture.
    fn bar(shift: i32) -> (OrganisedCloud, Vec<u32>, Vec<CellLabel>) {
        let k = Intrinsics {
            width: 40,
            height: 60,
            fx: 100.0,
            fy: 100.0,
            cx: 19.5,
            cy: 29.5,
        };
        let inside = |u: i32, v: i32| (15..25).contains(&u) && (20..40).contains(&(v - shift));
        let data = (0..2400).map(|i| if inside(i % 40, i / 40) { 2000 } else { 0 });
        let image = DepthImage::new(40, 60, data.collect()).expect("sizes agree");
        let mut cloud = OrganisedCloud::new(&k, Some(1));
        cloud.sample(&image, 8.0);
        let cells: Vec<u32> = (0..2400)
            .filter(|c| cloud.depth[*c as usize] > 0.0)
            .collect();
        let class = |c: &u32| CellLabel {
            cell: *c,
            class: u8::from((*c as i32 / 40) - shift < 30),
            joint: cloud.centre(*c as usize) + V3::new(0.0, 0.0, 0.1),
        };
        let labelled = cells.iter().map(class).collect();
        (cloud, cells, labelled)
    }

    fn person<'a>(cloud: &'a OrganisedCloud, cells: &'a [u32]) -> PersonCells<'a> {
        PersonCells {
            cloud,
            cells,
            up: UP,
        }
    }

    fn training() -> TrainingSet {
        let mut set = TrainingSet::default();
        for shift in -8..8 {
            let (cloud, cells, labelled) = bar(shift);
            set.add(&person(&cloud, &cells), &labelled, Some(0.0));
        }
        set
    }

    fn spec() -> ForestSpec {
        ForestSpec {
            trees: 2,
            depth: 4,
            splits: 15,
            features: 64,
            thresholds: 10,
            least_cells: 4,
            seed: 3,
            ..ForestSpec::default()
        }
    }

    #[test]
    fn a_tree_separates_the_halves_of_a_bar() {
        let set = training();
        let forest = train(&set, 2, &spec(), Par::Seq, &mut |_| {});
        let (cloud, cells, labelled) = bar(9);
        let mut scratch = PartScratch::default();
        let map = forest.classify(&person(&cloud, &cells), &mut scratch);
        let right = (0..map.len()).filter(|i| map.best(*i) == Some(labelled[*i].class));
        let share = right.count() as f64 / cells.len() as f64;
        assert!(share > 0.97, "{share}");
        let proposals = forest.propose(&person(&cloud, &cells), &mut scratch);
        assert_eq!(proposals.len(), 2, "{proposals:?}");
        let y = |k: usize| proposals[k].position.y;
        assert!(
            y(1) + 0.15 < y(0),
            "the upper half is class 1: {proposals:?}"
        );
    }

    #[test]
    fn forests_are_the_same_for_any_number_of_threads() {
        let set = training();
        let bytes = |par| train(&set, 2, &spec(), par, &mut |_| {}).to_bytes();
        let alone = bytes(Par::Seq);
        for threads in [1, 2, 3] {
            let got = with_threads(threads, || bytes(Par::Rayon)).expect("pool");
            assert!(got == alone, "{threads} threads");
        }
        assert_eq!(
            PartForest::from_bytes(&alone).map(|f| f.to_bytes()),
            Ok(alone)
        );
    }

    #[test]
    fn nothing_in_nothing_out() {
        let set = TrainingSet::default();
        let forest = train(&set, 1, &spec(), Par::Seq, &mut |_| {});
        let (cloud, _, _) = bar(0);
        let mut scratch = PartScratch::default();
        assert!(
            forest
                .propose(&person(&cloud, &[]), &mut scratch)
                .is_empty()
        );
        assert!(scratch.map.is_empty());
        // Cells without a reading have no class.
        forest.classify(&person(&cloud, &[0, 1]), &mut scratch);
        assert_eq!((scratch.map.best(0), scratch.map.best(1)), (None, None));
    }
}

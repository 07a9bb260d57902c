//! Training of the part forest on labelled frames.

use super::{FRAMES_PER_PERSON, LabelledFrame, LabelledFrames, NO_CLASS};
use crate::par::{self, Par};
use crate::segment::part_forest::{ForestSpec, PartForest, TrainingSet, train};
use crate::tracking::part_classes::PART_CLASSES;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Sizes of a training.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TrainingPlan {
    /// Frames to render, about 3 ms each; rounded up to whole people.
    pub images: usize,
    /// Labelled cells of a frame: half of them anywhere, half evenly over the classes. 24 bytes each.
    pub cells: usize,
    /// The forest.
    pub forest: ForestSpec,
}

impl Default for TrainingPlan {
    fn default() -> Self {
        Self {
            images: 10_000,
            cells: 250,
            forest: ForestSpec::default(),
        }
    }
}

/// Share of the work that rendering is, for the progress.
const RENDERING: f64 = 0.3;
/// People rendered at a time; their frames are in memory together.
const BATCH: usize = 32;

/// Sums of the distance from surface to anchor, metres.
#[derive(Clone, Copy, Default)]
struct PushSums {
    sum: f64,
    count: f64,
}

/// Renders the frames and trains a forest. The same bytes for any number of threads. `progress` gets the share done.
pub fn train_parts(
    frames: &LabelledFrames,
    plan: &TrainingPlan,
    progress: &mut dyn FnMut(f64),
) -> PartForest {
    let people = plan.images.div_ceil(FRAMES_PER_PERSON);
    let mut set = TrainingSet::default();
    let mut push = vec![PushSums::default(); PART_CLASSES];
    let mut batch: Vec<Vec<LabelledFrame>> = Vec::new();
    for start in (0..people).step_by(BATCH) {
        let count = BATCH.min(people - start);
        par::map_into(Par::Rayon, count, 1, &mut batch, |i| frames.person((start + i) as u64));
        for (i, person) in batch.iter().enumerate() {
            let mut rng = Pcg64Mcg::seed_from_u64(plan.forest.seed ^ ((start + i) as u64) << 20);
            for frame in person {
                measure_push(frames, frame, &mut push);
                let chosen = choose(frame, plan.cells, &mut rng);
                set.add(&frame.cloud, &frame.cells, &frame.up, &chosen);
            }
        }
        progress(RENDERING * (start + count) as f64 / people as f64);
    }
    let push: Vec<f32> = push.iter().map(|p| (p.sum / p.count.max(1.0)) as f32).collect();
    train(&set, &push, &plan.forest, Par::Rayon, &mut |share| {
        progress(RENDERING + (1.0 - RENDERING) * share);
    })
}

/// Adds the distances of a frame's cells to the anchors of their classes.
fn measure_push(frames: &LabelledFrames, frame: &LabelledFrame, push: &mut [PushSums]) {
    let anchors: Vec<_> = (0..PART_CLASSES as u8)
        .map(|c| frames.classes().anchor_of(c, &frame.joints))
        .collect();
    for (&cell, &class) in frame.cells.iter().zip(&frame.labels) {
        let Some(Some(anchor)) = anchors.get(usize::from(class)) else {
            continue;
        };
        let p = frame.cloud.centre(cell as usize).cast::<f64>();
        let sums = &mut push[usize::from(class)];
        sums.sum += (anchor - p).dot(&p.coords) / p.coords.norm();
        sums.count += 1.0;
    }
}

/// Labelled cells for the training.
fn choose(frame: &LabelledFrame, count: usize, rng: &mut Pcg64Mcg) -> Vec<(u32, u8)> {
    let mut of_class: Vec<Vec<u32>> = vec![Vec::new(); PART_CLASSES];
    let mut all = Vec::with_capacity(frame.cells.len());
    for (&cell, &class) in frame.cells.iter().zip(&frame.labels) {
        if class != NO_CLASS {
            of_class[usize::from(class)].push(cell);
            all.push((cell, class));
        }
    }
    if all.is_empty() {
        return vec![];
    }
    let present: Vec<usize> = (0..PART_CLASSES).filter(|c| !of_class[*c].is_empty()).collect();
    (0..count)
        .map(|k| {
            if k % 2 == 0 {
                return all[rng.random_range(0..all.len())];
            }
            let class = present[rng.random_range(0..present.len())];
            let cells = &of_class[class];
            (cells[rng.random_range(0..cells.len())], class as u8)
        })
        .collect()
}

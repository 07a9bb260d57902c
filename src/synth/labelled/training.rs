//! Training of the part forest on labelled frames.

use super::{FRAMES_PER_PERSON, LabelledFrame, LabelledFrames};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use tryon_geometry::par::{self, Par};
use tryon_tracking::part_classes::PART_CLASSES;
use tryon_tracking::segment::part_forest::{CellLabel, ForestSpec, PartForest, TrainingSet, train};

/// Sizes of a training.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrainingPlan {
    /// Frames to render, about 4 ms each; rounded up to whole people.
    pub images: usize,
    /// Labelled cells of a frame: half of them anywhere, half evenly over the classes. 32 bytes each.
    pub cells: usize,
    /// The forest.
    pub forest: ForestSpec,
}

impl Default for TrainingPlan {
    fn default() -> Self {
        Self {
            images: 14_000,
            cells: 220,
            forest: ForestSpec::default(),
        }
    }
}

/// People rendered at a time; their frames are in memory together.
const BATCH: usize = 32;

/// Renders the frames and trains a forest. The same bytes for any number of threads. `progress` gets the share done.
pub fn train_parts(
    frames: &LabelledFrames,
    plan: &TrainingPlan,
    progress: &mut dyn FnMut(f64),
) -> PartForest {
    let rendering = frames.settings.rendering;
    let people = plan.images.div_ceil(FRAMES_PER_PERSON);
    let mut set = TrainingSet::default();
    let mut batch: Vec<Vec<LabelledFrame>> = Vec::new();
    for start in (0..people).step_by(BATCH) {
        let count = BATCH.min(people - start);
        par::map_into(Par::Rayon, count, 1, &mut batch, |i| {
            frames.person((start + i) as u64)
        });
        for (i, person) in batch.iter().enumerate() {
            let mut rng = Pcg64Mcg::seed_from_u64(plan.forest.seed ^ ((start + i) as u64) << 20);
            for frame in person {
                let chosen = choose(frames, frame, plan.cells, &mut rng);
                set.add(&frame.person(), &chosen, frame.yaw);
            }
        }
        progress(rendering * (start + count) as f64 / people as f64);
    }
    train(&set, PART_CLASSES, &plan.forest, Par::Rayon, &mut |share| {
        progress(rendering + (1.0 - rendering) * share);
    })
}

/// Labelled cells for the training.
fn choose(
    frames: &LabelledFrames,
    frame: &LabelledFrame,
    count: usize,
    rng: &mut Pcg64Mcg,
) -> Vec<CellLabel> {
    let joint = |c: u8| frames.classes().anchor_of(c, &frame.joints);
    let joints: Vec<_> = (0..PART_CLASSES as u8).map(joint).collect();
    let mut of_class: Vec<Vec<CellLabel>> = vec![Vec::new(); PART_CLASSES];
    for (&cell, &class) in frame.cells.iter().zip(&frame.labels) {
        if let Some(Some(joint)) = joints.get(usize::from(class)) {
            let joint = joint.cast();
            of_class[usize::from(class)].push(CellLabel { cell, class, joint });
        }
    }
    let all: Vec<CellLabel> = of_class.concat();
    of_class.retain(|cells| !cells.is_empty());
    if all.is_empty() {
        return vec![];
    }
    let pick = |k: usize| {
        let cells = if k.is_multiple_of(2) {
            &all
        } else {
            &of_class[rng.random_range(0..of_class.len())]
        };
        cells[rng.random_range(0..cells.len())]
    };
    (0..count).map(pick).collect()
}

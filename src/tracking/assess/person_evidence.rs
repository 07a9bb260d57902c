//! Evidence that a fitted body is a person: the part forest's classes of the subject's cells against the body drawn over
//! them.
//!
//! Furniture can be covered by some body. The forest knows neither fit nor pose: on a person its classes are those of the
//! body in each cell and as frequent as there, on a coat they are not.

use super::agreement::PARTS;
use crate::model::{PART_CLASSES, PartKind, TrackerModel};
use crate::registration::{IndexImage, Observation};
use crate::segment::part_forest::ClassMap;
use serde::{Deserialize, Serialize};
use tryon_geometry::spatial::{Label, OrganisedCloud};

/// Kinds of classes: both sides are one, as left and right change places with the facing; the neck is the last.
const KINDS: usize = PART_CLASSES.div_ceil(2);
/// Difference in depth up to which a reading covers the drawn body, metres: thick clothes stay below.
const COVERED: f32 = 0.10;
/// Least cells of a head that decide on it; fewer are a head out of the image.
const LEAST_HEAD: f32 = 10.0;
/// Covered share of a head in full view; the seam about it isn't covered. More says nothing: a head within a coat.
const FULL_HEAD: f32 = 0.6;
/// Covered share that stands for a head out of view.
const HIDDEN_HEAD: f32 = 0.45;
/// Log odds of a start per unit of similarity, covered head and matched points, and at zero: logistic regression on the
/// starts of `tryon-bench people` (furniture against people) and of recordings; see docs/decisions/047.
const START_WEIGHTS: [f32; 3] = [17.6, 8.05, 18.4];
/// See [`START_WEIGHTS`].
const START_BIAS: f32 = -32.4;
/// The same for a person who is followed, per unit of agreement, similarity and covered head. Who was found whole may be
/// hidden in part later: matched points say nothing any more.
const WEIGHTS: [f32; 3] = [8.8, 20.0, 14.7];
/// See [`WEIGHTS`].
const BIAS: f32 = -25.25;
/// Summed log odds from which a subject is a person. Larger starts later; the most likely of 205 starts of things had 2.6,
/// and things lose matched points in the next frame.
const SURE: f32 = 3.0;
/// Least log odds that earlier refusals leave: a mannequin that is taken away lets a person stand in its place.
const MOST_DOUBT: f32 = -6.0;
/// Most frames in which a start may become sure.
const LONGEST: u32 = 15;
/// Weight of a new frame in the running log odds of a person. Larger loses one who hides the head for a moment.
const NEWEST: f32 = 0.3;
/// Running log odds below which a subject no longer is a person.
const KEEP: f32 = -0.5;

/// Figures of one fitted body.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct PersonEvidence {
    /// Mean probability, over the subject's cells, of the kind that the body has there; 0 for cells without body.
    pub agreement: f32,
    /// Common part of the histograms of kinds: of the subject's cells by the forest, of the drawn body's cells. 0 to 1.
    pub similarity: f32,
    /// Share of the head's cells with a reading that the subject covers.
    pub head: f32,
    /// Share of the body's visible points with a reading, from its fit.
    pub matched: f32,
}

/// Body drawn into the grid that shows the subject.
struct FittedImage<'a> {
    model: &'a TrackerModel,
    grid: &'a OrganisedCloud,
    image: &'a IndexImage,
}

impl FittedImage<'_> {
    /// Sample drawn in a cell.
    fn sample(&self, cell: usize) -> Option<usize> {
        let sample = self.image.index[cell];
        (sample != IndexImage::NONE).then_some(sample as usize)
    }

    /// Kind of the body in a cell.
    fn kind(&self, cell: usize) -> Option<usize> {
        let vertex = self.model.samples[self.sample(cell)?] as usize;
        Some(usize::from(self.model.part_classes.of_vertex()[vertex]) / 2)
    }

    /// Body part in a cell.
    fn part(&self, cell: usize) -> Option<usize> {
        let sample = self.sample(cell)?;
        Some(self.model.parts[usize::from(self.model.bones[sample])])
    }

    fn has_return(&self, cell: usize) -> bool {
        self.grid.labels[cell] != Label::Unknown
    }

    /// False for a part of which most cells give no return (black trousers).
    fn parts_with_return(&self) -> [bool; PARTS] {
        let (mut all, mut missing) = ([0u32; PARTS], [0u32; PARTS]);
        for cell in 0..self.image.index.len() {
            if let Some(part) = self.part(cell) {
                all[part] += 1;
                missing[part] += u32::from(!self.has_return(cell));
            }
        }
        std::array::from_fn(|part| 2 * missing[part] <= all[part])
    }

    /// True where the subject covers the body.
    fn is_covered(&self, cell: usize) -> bool {
        let off = (self.image.depth[cell] - self.grid.depth[cell]).abs();
        self.grid.labels[cell] == Label::Person && off < COVERED
    }
}

/// Sums over the cells.
#[derive(Default)]
struct KindSums {
    cells: f32,
    drawn: f32,
    seen: [f32; KINDS],
    expected: [f32; KINDS],
    agreement: f32,
    head: [f32; 2],
}

impl PersonEvidence {
    /// Compares the classes `map` of the subject's cells with the body in `image`; `matched` is its fit's share.
    pub(crate) fn measure(
        model: &TrackerModel,
        observation: &Observation<'_>,
        image: &IndexImage,
        map: &ClassMap,
        matched: f32,
    ) -> Self {
        let grid = observation.grid;
        let body = FittedImage { model, grid, image };
        let mut sums = KindSums::default();
        // Of parts that give no return, nothing is expected.
        let parts = body.parts_with_return();
        let counts = |cell: usize| body.part(cell).map(|part| parts[part]);
        for (i, cell) in observation.cells.iter().enumerate() {
            let cell = *cell as usize;
            if grid.depth[cell] > 0.0 && counts(cell).unwrap_or(true) {
                sums.add_reading(map.shares(i), body.kind(cell));
            }
        }
        let is_expected = |&cell: &usize| body.has_return(cell) && counts(cell) == Some(true);
        for cell in (0..image.index.len()).filter(is_expected) {
            sums.add_drawn(&body, cell);
        }
        Self {
            matched,
            ..sums.evidence()
        }
    }

    /// Logarithm of the odds for a person at a start.
    fn start_odds(&self) -> f32 {
        START_BIAS + dot(START_WEIGHTS, [self.similarity, self.head, self.matched])
    }

    /// The same for a subject that was a person before.
    fn track_odds(&self) -> f32 {
        BIAS + dot(WEIGHTS, [self.agreement, self.similarity, self.head])
    }
}

fn dot(weights: [f32; 3], figures: [f32; 3]) -> f32 {
    weights.iter().zip(figures).map(|(w, f)| w * f).sum()
}

impl KindSums {
    /// Adds a reading's classes; `kind` is the body's in its cell.
    fn add_reading(&mut self, shares: &[f32], kind: Option<usize>) {
        self.cells += 1.0;
        for (class, share) in shares.iter().enumerate() {
            self.seen[class / 2] += share;
            if kind == Some(class / 2) {
                self.agreement += share;
            }
        }
    }

    /// Adds a cell of the drawn body.
    fn add_drawn(&mut self, body: &FittedImage<'_>, cell: usize) {
        let Some(kind) = body.kind(cell) else { return };
        self.drawn += 1.0;
        self.expected[kind] += 1.0;
        if kind == PartKind::Head as usize && body.grid.depth[cell] > 0.0 {
            self.head[0] += 1.0;
            self.head[1] += f32::from(u8::from(body.is_covered(cell)));
        }
    }

    fn evidence(&self) -> PersonEvidence {
        let (cells, drawn) = (self.cells.max(1.0), self.drawn.max(1.0));
        let pairs = self.seen.iter().zip(&self.expected);
        let common = pairs.map(|(s, e)| (s / cells).min(e / drawn));
        let [all, covered] = self.head;
        PersonEvidence {
            agreement: self.agreement / cells,
            similarity: common.sum(),
            head: if all < LEAST_HEAD {
                HIDDEN_HEAD
            } else {
                (covered / all).min(FULL_HEAD)
            },
            matched: 0.0,
        }
    }
}

/// Stage of the test of a subject.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Verdict {
    /// A thing, or nothing tested yet.
    #[default]
    Nobody,
    /// Maybe a person: followed, not live.
    Unsure,
    /// A person.
    Person,
}

/// Sequential test of a subject (Wald 1945): log odds of its frames are summed until they are sure, and averaged from then
/// on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct PersonBelief {
    pub(crate) log_odds: f32,
    /// Log odds before the first frame.
    refused: f32,
    frames: u32,
    pub(crate) verdict: Verdict,
}

impl PersonBelief {
    /// Belief in a person of whom somebody else is sure.
    pub(crate) fn given() -> Self {
        Self {
            log_odds: SURE,
            refused: 0.0,
            frames: 0,
            verdict: Verdict::Person,
        }
    }

    /// Belief in a candidate just found, of log odds `refused` after earlier refusals.
    pub(crate) fn start(refused: f32) -> Self {
        let refused = refused.max(MOST_DOUBT);
        Self {
            log_odds: refused,
            refused,
            frames: 0,
            verdict: Verdict::Unsure,
        }
    }

    /// Adds the evidence of a frame.
    pub(crate) fn update(&mut self, evidence: PersonEvidence) {
        self.log_odds += match self.verdict {
            Verdict::Person => NEWEST * (evidence.track_odds() - self.log_odds),
            _ => evidence.start_odds(),
        };
        self.frames = self.frames.saturating_add(1);
        self.verdict = match self.verdict {
            Verdict::Person if self.log_odds >= KEEP => Verdict::Person,
            Verdict::Unsure if self.log_odds >= SURE => Verdict::Person,
            Verdict::Unsure if self.log_odds >= self.refused && self.frames < LONGEST => {
                Verdict::Unsure
            }
            _ => Verdict::Nobody,
        };
    }

    /// Forgets a subject that was lost before the test was sure.
    pub(crate) fn lose(&mut self) {
        if self.verdict == Verdict::Unsure {
            self.verdict = Verdict::Nobody;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::FitScratch;
    use crate::segment::part_forest::{PartScratch, PersonCells};
    use crate::test_scene::{DepthScan, TestScene};
    use nalgebra::Vector3;
    use tryon_geometry::camera::DepthImage;

    /// Evidence of a body in one pose with the readings of an image.
    fn evidence(scene: &TestScene, image: &DepthImage, matched: f32) -> PersonEvidence {
        let scan = DepthScan::new(&scene.model, image).background_removed();
        let observation = scan.observation();
        let body = scene.body();
        let context = scene.context(&body, &observation);
        let person = PersonCells {
            cloud: observation.grid,
            cells: observation.cells,
            up: -Vector3::y(),
        };
        let (mut fit, mut parts) = (FitScratch::default(), PartScratch::default());
        fit.draw(&context, &scene.pose);
        let map = scene.model.forest.classify(&person, &mut parts);
        PersonEvidence::measure(&scene.model, &observation, &fit.pairing.image, map, matched)
    }

    /// A board of a person's height and width at 2 m.
    fn board(scene: &TestScene) -> DepthImage {
        let mut image = scene.depth(&scene.pose);
        let width = image.width() as usize;
        let rows = image.height() as usize;
        for (i, mm) in image.data_mut().iter_mut().enumerate() {
            let (u, v) = (i % width, i / width);
            let is_board = (260..380).contains(&u) && (40..rows - 40).contains(&v);
            *mm = if is_board { 2000 } else { 0 };
        }
        image
    }

    #[test]
    fn a_body_is_a_person_and_a_board_is_not() {
        let scene = TestScene::new(1000, 480);
        let person = evidence(&scene, &scene.depth(&scene.pose), 0.95);
        assert!(
            person.start_odds() > SURE && person.track_odds() > SURE,
            "{person:?}"
        );
        let thing = evidence(&scene, &board(&scene), 0.8);
        assert!(thing.start_odds() < SURE - 2.0, "{thing:?}");
        assert!(thing.track_odds() < person.track_odds() - 3.0, "{thing:?}");
    }

    #[test]
    fn nothing_is_nobody() {
        let scene = TestScene::new(300, 240);
        let nothing = evidence(&scene, &DepthImage::empty(640, 240), 0.0);
        assert_eq!((nothing.agreement, nothing.similarity), (0.0, 0.0));
        assert!(
            nothing.start_odds() < -SURE && nothing.track_odds() < -SURE,
            "{nothing:?}"
        );
    }

    /// Evidence of given log odds.
    fn of_odds(odds: f32) -> PersonEvidence {
        PersonEvidence {
            agreement: (odds - BIAS) / WEIGHTS[0],
            matched: (odds - START_BIAS) / START_WEIGHTS[2],
            ..PersonEvidence::default()
        }
    }

    /// Verdicts after a start and further frames.
    fn verdicts(refused: f32, odds: &[f32]) -> Vec<Verdict> {
        let mut belief = PersonBelief::start(refused);
        let verdict = |odds: &f32| {
            belief.update(of_odds(*odds));
            belief.verdict
        };
        odds.iter().map(verdict).collect()
    }

    #[test]
    fn evidence_adds_up_until_it_is_sure_and_is_averaged_then() {
        use Verdict::*;
        assert_eq!(verdicts(0.0, &[4.0, -6.0, -6.0]), [Person, Person, Nobody]);
        assert_eq!(verdicts(0.0, &[1.0, 1.0, 1.5]), [Unsure, Unsure, Person]);
        assert_eq!(verdicts(0.0, &[1.0, -2.5]), [Unsure, Nobody]);
        assert_eq!(verdicts(0.0, &[-1.0]), [Nobody]);
        let refused = verdicts(-9.0, &[5.0, 5.0]);
        assert_eq!(refused, [Unsure, Person], "doubt has a limit");
        assert_eq!(verdicts(-4.0, &[5.0, -2.0, 1.0]), [Unsure; 3]);
        assert_eq!(verdicts(-4.0, &[1.0, -2.0]), [Unsure, Nobody]);
        let forever = verdicts(0.0, &[0.01; LONGEST as usize + 1]);
        assert_eq!(
            forever.last(),
            Some(&Nobody),
            "no thing is followed for ever"
        );
    }
}

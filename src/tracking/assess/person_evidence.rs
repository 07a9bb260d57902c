//! Evidence that a fitted body is a person: the part network's classes of the subject's cells against the body drawn over
//! them.
//!
//! Furniture can be covered by some body. The network knows neither fit nor pose: on a person its classes are those of the
//! body in each cell and as frequent as there, on a coat they are not.

use super::agreement::PARTS;
use crate::model::{PART_CLASSES, PartKind, TrackerModel};
use crate::registration::{IndexImage, Observation};
use crate::segment::part_network::ClassMap;
use crate::settings::BeliefSettings;
use serde::{Deserialize, Serialize};
use tryon_geometry::spatial::{Label, OrganisedCloud};

/// Kinds of classes: both sides are one, as left and right change places with the facing; the neck is the last.
const KINDS: usize = PART_CLASSES.div_ceil(2);

/// Figures of one fitted body.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct PersonEvidence {
    /// Mean probability, over the subject's cells, of the kind that the body has there; 0 for cells without body.
    pub agreement: f32,
    /// Common part of the histograms of kinds: of the subject's cells by the network, of the drawn body's cells. 0 to 1.
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

    /// True where something else stands before the body.
    fn is_hidden(&self, cell: usize) -> bool {
        let settings = &self.model.config.assess.belief;
        let (seen, drawn) = (self.grid.depth[cell], self.image.depth[cell]);
        self.grid.labels[cell] == Label::Other && seen < drawn - settings.covered
    }

    /// True where the subject covers the body.
    fn is_covered(&self, cell: usize) -> bool {
        let settings = &self.model.config.assess.belief;
        let off = (self.image.depth[cell] - self.grid.depth[cell]).abs();
        self.grid.labels[cell] == Label::Person && off < settings.covered
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
        let is_expected = |&cell: &usize| {
            body.has_return(cell) && counts(cell) == Some(true) && !body.is_hidden(cell)
        };
        for cell in (0..image.index.len()).filter(is_expected) {
            sums.add_drawn(&body, cell);
        }
        Self {
            matched,
            ..sums.evidence(&model.config.assess.belief)
        }
    }

    /// Logarithm of the odds for a person at a start.
    fn start_odds(&self, settings: &BeliefSettings) -> f32 {
        settings.start_bias
            + dot(
                settings.start_weights,
                [self.agreement, self.head, self.matched],
            )
    }

    /// The same for a subject that was a person before.
    fn track_odds(&self, settings: &BeliefSettings) -> f32 {
        settings.bias
            + dot(
                settings.weights,
                [self.agreement, self.similarity, self.head],
            )
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

    fn evidence(&self, settings: &BeliefSettings) -> PersonEvidence {
        let (cells, drawn) = (self.cells.max(1.0), self.drawn.max(1.0));
        let pairs = self.seen.iter().zip(&self.expected);
        let common = pairs.map(|(s, e)| (s / cells).min(e / drawn));
        let [all, covered] = self.head;
        PersonEvidence {
            agreement: self.agreement / cells,
            similarity: common.sum(),
            head: if all < settings.least_head {
                settings.hidden_head
            } else {
                (covered / all).min(settings.full_head)
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
    pub(crate) fn given(settings: &BeliefSettings) -> Self {
        Self {
            log_odds: settings.sure,
            refused: 0.0,
            frames: 0,
            verdict: Verdict::Person,
        }
    }

    /// Belief in a candidate just found, of log odds `refused` after earlier refusals.
    pub(crate) fn start(refused: f32, settings: &BeliefSettings) -> Self {
        let refused = refused.max(settings.most_doubt);
        Self {
            log_odds: refused,
            refused,
            frames: 0,
            verdict: Verdict::Unsure,
        }
    }

    /// Adds the evidence of a frame.
    pub(crate) fn update(&mut self, evidence: PersonEvidence, settings: &BeliefSettings) {
        self.log_odds += match self.verdict {
            Verdict::Person => settings.newest * (evidence.track_odds(settings) - self.log_odds),
            _ => evidence.start_odds(settings),
        };
        self.frames = self.frames.saturating_add(1);
        self.verdict = match self.verdict {
            Verdict::Person if self.log_odds >= settings.keep => Verdict::Person,
            Verdict::Unsure if self.log_odds >= settings.sure => Verdict::Person,
            Verdict::Unsure if self.log_odds >= self.refused && self.frames < settings.longest => {
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
    use crate::segment::part_network::{PersonCells, PersonParts};
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
        let (mut fit, mut parts) = (FitScratch::default(), PersonParts::default());
        fit.draw(&context, &scene.pose);
        scene.model.part_network.infer(&person, &mut parts);
        let (image, map) = (&fit.pairing.image, &parts.map);
        PersonEvidence::measure(&scene.model, &observation, image, map, matched)
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
        let (scene, settings) = (TestScene::new(1000, 480), BeliefSettings::default());
        let person = evidence(&scene, &scene.depth(&scene.pose), 0.95);
        assert!(
            person.start_odds(&settings) > settings.sure
                && person.track_odds(&settings) > settings.sure,
            "{person:?}"
        );
        let thing = evidence(&scene, &board(&scene), 0.8);
        assert!(
            thing.start_odds(&settings) < settings.sure - 2.0,
            "{thing:?}"
        );
        assert!(
            thing.track_odds(&settings) < person.track_odds(&settings) - 3.0,
            "{thing:?}"
        );
    }

    #[test]
    fn nothing_is_nobody() {
        let (scene, settings) = (TestScene::new(300, 240), BeliefSettings::default());
        let nothing = evidence(&scene, &DepthImage::empty(640, 240), 0.0);
        assert_eq!((nothing.agreement, nothing.similarity), (0.0, 0.0));
        assert!(
            nothing.start_odds(&settings) < -settings.sure
                && nothing.track_odds(&settings) < -settings.sure,
            "{nothing:?}"
        );
    }

    /// Evidence of given log odds.
    fn of_odds(odds: f32) -> PersonEvidence {
        let settings = BeliefSettings::default();
        let agreement = (odds - settings.bias) / settings.weights[0];
        let of_start = settings.start_bias + settings.start_weights[0] * agreement;
        PersonEvidence {
            agreement,
            matched: (odds - of_start) / settings.start_weights[2],
            ..PersonEvidence::default()
        }
    }

    /// Verdicts after a start and further frames.
    fn verdicts(refused: f32, odds: &[f32]) -> Vec<Verdict> {
        let settings = BeliefSettings::default();
        let mut belief = PersonBelief::start(refused, &settings);
        let verdict = |odds: &f32| {
            belief.update(of_odds(*odds), &settings);
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
        let forever = verdicts(
            0.0,
            &vec![0.01; BeliefSettings::default().longest as usize + 1],
        );
        assert_eq!(
            forever.last(),
            Some(&Nobody),
            "no thing is followed for ever"
        );
    }
}

//! Person detector: the likeliest person among the boxes at all anchors.

use crate::anchors::ANCHORS;
use crate::network::{DETECTOR_PIXELS, DetectorOutput};
use crate::{LandmarkSettings, PersonRegion};

/// Numbers at an anchor: the face's box and four points.
const NUMBERS: usize = 12;
/// Logits beyond which a score has no meaning (MediaPipe's clipping).
const MOST_LOGIT: f32 = 100.0;

/// Box and alignment points at one anchor, shares of the input.
#[derive(Clone, Copy, Debug, PartialEq)]
struct AnchoredBox {
    /// Left, upper, right and lower side of the face.
    sides: [f32; 4],
    /// Middle between the hips.
    hips: [f32; 2],
    /// Point above the head, as far from the hips as the circle around the body reaches.
    reach: [f32; 2],
}

impl AnchoredBox {
    fn decode(numbers: &[f32], anchor: [f32; 2]) -> Self {
        let share = |k: usize| numbers[k] / DETECTOR_PIXELS as f32;
        let point = |k: usize| [share(k) + anchor[0], share(k + 1) + anchor[1]];
        let ([x, y], [w, h]) = (point(0), [share(2), share(3)]);
        Self {
            sides: [x - 0.5 * w, y - 0.5 * h, x + 0.5 * w, y + 0.5 * h],
            hips: point(4),
            reach: point(6),
        }
    }

    /// Intersection over union.
    fn overlap(&self, other: &Self) -> f32 {
        let area = |[left, upper, right, lower]: [f32; 4]| {
            (right - left).max(0.0) * (lower - upper).max(0.0)
        };
        let [a, b] = [self.sides, other.sides];
        let common = area([
            a[0].max(b[0]),
            a[1].max(b[1]),
            a[2].min(b[2]),
            a[3].min(b[3]),
        ]);
        let union = area(a) + area(b) - common;
        if union > 0.0 { common / union } else { 0.0 }
    }
}

/// Region of the likeliest person, in a picture of which the detector saw `seen`; `None` without one.
///
/// The boxes that overlap the likeliest one count with their probabilities (MediaPipe's weighted suppression).
pub(crate) fn likeliest_person(
    output: &DetectorOutput,
    anchors: &[[f32; 2]],
    seen: &PersonRegion,
    settings: &LandmarkSettings,
) -> Option<PersonRegion> {
    debug_assert_eq!(anchors.len(), ANCHORS);
    let (boxes, _) = output.boxes.as_chunks::<NUMBERS>();
    let candidates: Vec<(f32, AnchoredBox)> = (boxes.iter().zip(&output.scores).zip(anchors))
        .map(|((numbers, logit), anchor)| (probability(*logit), numbers, *anchor))
        .filter(|(score, ..)| *score >= settings.detection)
        .map(|(score, numbers, anchor)| (score, AnchoredBox::decode(numbers, anchor)))
        .collect();
    let (_, best) = candidates.iter().max_by(|a, b| a.0.total_cmp(&b.0))?;

    let mut sums = [0.0; 5];
    for (score, candidate) in &candidates {
        // The best one too where it has no area.
        if candidate == best || candidate.overlap(best) > settings.same_person {
            let [[x, y], [u, v]] = [candidate.hips, candidate.reach];
            for (sum, value) in sums.iter_mut().zip([1.0, x, y, u, v]) {
                *sum += score * value;
            }
        }
    }
    let [weight, x, y, u, v] = sums;
    let place = |a: f32, b: f32| seen.pixel([a / weight - 0.5, b / weight - 0.5]);
    PersonRegion::around(place(x, y), place(u, v))
}

/// Logistic function.
pub(crate) fn probability(logit: f32) -> f32 {
    1.0 / (1.0 + (-logit.clamp(-MOST_LOGIT, MOST_LOGIT)).exp())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anchors::anchors;

    const SEEN: PersonRegion = PersonRegion {
        centre: [111.5, 111.5],
        side: 224.0,
        roll: 0.0,
    };

    /// Output with nobody but the given anchors: logit, shift of everything, pixels.
    fn output(people: &[(usize, f32, f32)]) -> DetectorOutput {
        let mut output = DetectorOutput {
            boxes: vec![0.0; ANCHORS * NUMBERS],
            scores: vec![-50.0; ANCHORS],
        };
        for (anchor, logit, shift) in people {
            output.scores[*anchor] = *logit;
            // Hips 40 pixels below the anchor, the reach 10 above.
            let numbers = [
                0.0, 0.0, 30.0, 30.0, 0.0, 40.0, 0.0, -10.0, 0.0, 0.0, 0.0, 0.0,
            ];
            for (k, number) in numbers.iter().enumerate() {
                let shift = if k == 2 || k == 3 { 0.0 } else { *shift };
                output.boxes[anchor * NUMBERS + k] = number + shift;
            }
        }
        output
    }

    #[test]
    fn a_person_lies_where_the_anchor_and_its_numbers_say() {
        let (anchors, settings) = (anchors(), LandmarkSettings::default());
        let find = |people: &[_]| likeliest_person(&output(people), &anchors, &SEEN, &settings);
        assert_eq!(find(&[]), None);
        assert_eq!(find(&[(100, -0.1, 0.0)]), None);
        // The first anchor of row 14 and column 10 lies at pixel (84, 116) of the input, whose centre is 0.5 pixels beside.
        let at = 2 * (14 * 28 + 10);
        let alone = find(&[(at, 2.0, 0.0)]).expect("somebody");
        assert!((alone.centre[0] - 83.5).abs() < 1e-3 && (alone.centre[1] - 155.5).abs() < 1e-3);
        assert!((alone.side - 125.0).abs() < 1e-3 && alone.roll.abs() < 1e-6);
        // Its neighbour, eight pixels farther and shifted back by two, counts with its probability; a far one doesn't.
        let both = find(&[(at, 2.0, 0.0), (at + 2, 0.5, -2.0), (4, 1.0, 0.0)]).expect("somebody");
        let [a, b] = [2.0, 0.5].map(probability);
        assert!((both.centre[0] - (83.5 + 6.0 * b / (a + b))).abs() < 1e-3);
        assert!((both.centre[1] - (155.5 - 2.0 * b / (a + b))).abs() < 1e-3);
    }

    #[test]
    fn broken_numbers_are_nobody() {
        let (anchors, settings) = (anchors(), LandmarkSettings::default());
        let find = |output: &_| likeliest_person(output, &anchors, &SEEN, &settings);
        assert_eq!(find(&DetectorOutput::default()), None);
        let mut broken = output(&[(7, 3.0, f32::NAN)]);
        assert_eq!(find(&broken), None);
        broken.scores.fill(f32::NAN);
        assert_eq!(find(&broken), None);
    }
}

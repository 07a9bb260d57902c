//! Borders in masks: pixels near a change of class, erosion, and the F1 of a decision.

/// Surface seen at a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Seen {
    /// No garment here.
    Outside,
    Garment,
    /// The person before a garment.
    Person,
}

/// Pixels within `reach` pixels (middle to middle) of a pixel of `ends`, both of masks `width` columns wide.
pub(super) fn near(ends: &[bool], width: usize, reach: f32) -> Vec<bool> {
    let (height, r) = (ends.len() / width.max(1), reach.ceil() as isize);
    let mut out = vec![false; ends.len()];
    for i in (0..ends.len()).filter(|i| ends[*i]) {
        let (x, y) = ((i % width) as isize, (i / width) as isize);
        for dy in -r..=r {
            for dx in -r..=r {
                let (u, v) = (x + dx, y + dy);
                let is_in = u >= 0 && v >= 0 && u < width as isize && v < height as isize;
                if is_in && ((dx * dx + dy * dy) as f32) <= reach * reach {
                    out[v as usize * width + u as usize] = true;
                }
            }
        }
    }
    out
}

/// Pixels whose right or lower neighbour, or which themselves as such a neighbour, make a pair of classes that `is_border`.
pub(super) fn borders<T: Copy>(
    classes: &[T],
    width: usize,
    is_border: impl Fn(T, T) -> bool,
) -> Vec<bool> {
    let mut out = vec![false; classes.len()];
    for i in 0..classes.len() {
        let right = (i % width + 1 < width).then_some(i + 1);
        let below = (i + width < classes.len()).then_some(i + width);
        for k in [right, below].into_iter().flatten() {
            if is_border(classes[i], classes[k]) {
                (out[i], out[k]) = (true, true);
            }
        }
    }
    out
}

/// Pixels of a mask farther than `reach` pixels from any pixel outside it.
pub(super) fn eroded(mask: &[bool], width: usize, reach: f32) -> Vec<bool> {
    let outside: Vec<bool> = mask.iter().map(|m| !m).collect();
    near(&outside, width, reach).iter().map(|n| !n).collect()
}

/// Counts of a decision against truth.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct DecisionCount {
    pub(super) hits: usize,
    /// Decided for, against truth.
    pub(super) false_ones: usize,
    /// Decided against, against truth.
    pub(super) missed: usize,
    /// Decided against, as in truth.
    pub(super) rejections: usize,
}

impl DecisionCount {
    pub(super) fn add(&mut self, is_decided: bool, is_true: bool) {
        let count = match (is_decided, is_true) {
            (true, true) => &mut self.hits,
            (true, false) => &mut self.false_ones,
            (false, true) => &mut self.missed,
            (false, false) => &mut self.rejections,
        };
        *count += 1;
    }

    pub(super) fn join(&mut self, other: &Self) {
        self.hits += other.hits;
        self.false_ones += other.false_ones;
        self.missed += other.missed;
        self.rejections += other.rejections;
    }

    /// Pixels judged.
    pub(super) fn all(&self) -> usize {
        self.hits + self.false_ones + self.missed + self.rejections
    }

    /// Harmonic mean of precision and recall.
    pub(super) fn f1(&self) -> f64 {
        2.0 * self.hits as f64 / (2 * self.hits + self.false_ones + self.missed) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_half_plane_moved_by_a_pixel_has_the_f1_of_its_band() {
        const WIDTH: usize = 40;
        let truth: Vec<Seen> = (0..WIDTH * 30)
            .map(|i| {
                if i % WIDTH < 20 {
                    Seen::Garment
                } else {
                    Seen::Person
                }
            })
            .collect();
        let ends = borders(&truth, WIDTH, |a, b| a != b);
        assert_eq!(ends.iter().filter(|e| **e).count(), 2 * 30);
        let band = near(&ends, WIDTH, 5.0);
        // Columns 14 to 25.
        assert_eq!(band.iter().filter(|b| **b).count(), 12 * 30);
        let mut count = DecisionCount::default();
        for i in (0..truth.len()).filter(|i| band[*i]) {
            count.add(i % WIDTH < 21, truth[i] == Seen::Garment);
        }
        assert_eq!((count.hits, count.false_ones, count.missed), (180, 30, 0));
        assert!((count.f1() - 2.0 * 180.0 / 390.0).abs() < 1e-12);
        assert_eq!(count.all(), 360);
    }

    #[test]
    fn erosion_takes_the_reach_off_each_side() {
        let square: Vec<bool> = (0..400)
            .map(|i| (5..15).contains(&(i % 20)) && (5..15).contains(&(i / 20)))
            .collect();
        let inner = eroded(&square, 20, 2.0);
        assert_eq!(inner.iter().filter(|m| **m).count(), 36);
    }
}

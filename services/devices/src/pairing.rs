//! Pairs of depth and colour: nearest in time, at most half a period apart.

use super::Stream;
use super::driver::{Formats, SensorImage};
use std::collections::VecDeque;
use std::sync::Arc;

/// Depth and the colour of its time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct ExposurePair {
    /// Number of the depth image since the camera was opened.
    pub(crate) number: u64,
    pub(crate) depth: SensorImage,
    pub(crate) color: Option<Arc<SensorImage>>,
}

/// Colour images kept: depth may come as many images later than its colour.
const MAX_COLORS: usize = 4;
/// Depth images that wait: colour may come as many images later than its depth.
const MAX_WAITING: usize = 3;

/// Pairing of two streams whose images come in any order, each stream in its own.
pub(crate) struct Pairing {
    /// Largest time between depth and its colour, nanoseconds; `None` without colour.
    half_period_ns: Option<u64>,
    /// Newest last.
    colors: VecDeque<Arc<SensorImage>>,
    /// Depth without colour so far, and its number.
    waiting: VecDeque<(u64, SensorImage)>,
    next: u64,
    /// Time of the last depth.
    last_ns: u64,
    /// Depth images that had no colour of their time.
    pub(crate) unpaired: u64,
}

impl Pairing {
    /// Half a period is that of the slower stream: its nearest image is no farther away.
    pub(crate) fn new(formats: &Formats) -> Self {
        let half_period = |rate: f64| (0.5e9 / rate) as u64;
        Self {
            half_period_ns: formats
                .color
                .map(|color| half_period(color.rate.min(formats.depth.rate).max(1.0))),
            colors: VecDeque::new(),
            waiting: VecDeque::new(),
            next: 0,
            last_ns: 0,
            unpaired: 0,
        }
    }

    /// Takes an image in and passes on the pairs that it completes, in the order of depth.
    pub(crate) fn push(&mut self, image: SensorImage, sink: &mut dyn FnMut(ExposurePair)) {
        match image.stream {
            Stream::Depth => self.push_depth(image),
            Stream::Color => self.push_color(image),
        }
        while let Some((number, depth)) = self.waiting.pop_front() {
            let color = self.near_color(depth.time_ns);
            let is_due = color.is_some() || self.waiting.len() >= MAX_WAITING;
            if !is_due && !self.is_passed(depth.time_ns) {
                self.waiting.push_front((number, depth));
                break;
            }
            self.unpaired += u64::from(color.is_none() && self.half_period_ns.is_some());
            sink(ExposurePair {
                number,
                depth,
                color,
            });
        }
    }

    fn push_depth(&mut self, depth: SensorImage) {
        if depth.time_ns < self.last_ns {
            // The clock has jumped back: colour of before is of no depth to come.
            self.colors.clear();
        }
        self.last_ns = depth.time_ns;
        self.waiting.push_back((self.next, depth));
        self.next += 1;
    }

    fn push_color(&mut self, color: SensorImage) {
        if self.colors.len() == MAX_COLORS {
            self.colors.pop_front();
        }
        self.colors.push_back(Arc::new(color));
    }

    /// Nearest colour within half a period. A later one would be farther.
    fn near_color(&self, time_ns: u64) -> Option<Arc<SensorImage>> {
        let half_period_ns = self.half_period_ns?;
        let gap = |color: &&Arc<SensorImage>| color.time_ns.abs_diff(time_ns);
        let nearest = self.colors.iter().min_by_key(gap)?;
        (gap(&nearest) <= half_period_ns).then(|| nearest.clone())
    }

    /// True if colour has gone on past a time, so that none of it comes any more.
    fn is_passed(&self, time_ns: u64) -> bool {
        self.half_period_ns.is_none_or(|half_period_ns| {
            let newest = self.colors.back();
            newest.is_some_and(|color| color.time_ns > time_ns.saturating_add(half_period_ns))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::driver::{Encoding, StreamFormat};

    fn formats(color_rate: Option<f64>) -> Formats {
        let format = |encoding, rate| StreamFormat {
            encoding,
            width: 1,
            height: 1,
            rate,
        };
        Formats {
            depth: format(Encoding::Depth16, 30.0),
            color: color_rate.map(|rate| format(Encoding::Rgb8, rate)),
        }
    }

    /// Number and time of each depth, milliseconds, and time of its colour, of images `d` and `c` at milliseconds.
    fn pairs(color_rate: Option<f64>, images: &[(char, u64)]) -> Vec<(u64, u64, Option<u64>)> {
        let mut pairing = Pairing::new(&formats(color_rate));
        let mut out = Vec::new();
        for (stream, ms) in images {
            let image = SensorImage {
                stream: if *stream == 'd' {
                    Stream::Depth
                } else {
                    Stream::Color
                },
                time_ns: ms * 1_000_000,
                bytes: vec![],
            };
            pairing.push(image, &mut |p| {
                let color = p.color.map(|c| c.time_ns / 1_000_000);
                out.push((p.number, p.depth.time_ns / 1_000_000, color));
            });
        }
        let without = out.iter().filter(|p| p.2.is_none()).count() as u64;
        assert_eq!(
            pairing.unpaired,
            if color_rate.is_some() { without } else { 0 }
        );
        out
    }

    #[test]
    fn colour_before_and_after_depth_is_paired_by_time() {
        // Colour 10 ms before its depth: no wait.
        let early = pairs(Some(30.0), &[('c', 90), ('d', 100), ('c', 123), ('d', 133)]);
        assert_eq!(early, [(0, 100, Some(90)), (1, 133, Some(123))]);
        // Colour 10 ms after its depth, 23 ms after the one before: the later one is nearer.
        let late = pairs(
            Some(30.0),
            &[('c', 77), ('d', 100), ('c', 110), ('d', 133), ('c', 143)],
        );
        assert_eq!(late, [(0, 100, Some(110)), (1, 133, Some(143))]);
        // In the order of arrival, whatever the times.
        let slow_depth = pairs(Some(30.0), &[('c', 100), ('c', 133), ('d', 130)]);
        assert_eq!(slow_depth, [(0, 130, Some(133))]);
    }

    #[test]
    fn depth_without_colour_of_its_time_has_none_and_is_counted() {
        let lost = pairs(
            Some(30.0),
            &[
                ('d', 100),
                ('d', 133),
                ('c', 134),
                ('d', 166),
                ('d', 200),
                ('c', 260),
            ],
        );
        assert_eq!(
            lost,
            [
                (0, 100, None),
                (1, 133, Some(134)),
                (2, 166, None),
                (3, 200, None)
            ]
        );
        assert_eq!(
            pairs(None, &[('d', 100), ('d', 133)]),
            [(0, 100, None), (1, 133, None)]
        );
    }

    #[test]
    fn colour_that_comes_two_images_late_is_waited_for_and_no_longer() {
        let late = pairs(
            Some(30.0),
            &[
                ('d', 0),
                ('d', 33),
                ('c', 0),
                ('d', 66),
                ('c', 33),
                ('c', 66),
            ],
        );
        assert_eq!(
            late,
            [(0, 0, Some(0)), (1, 33, Some(33)), (2, 66, Some(66))]
        );
        let never = pairs(
            Some(30.0),
            &[('d', 0), ('d', 33), ('d', 66), ('d', 100), ('d', 133)],
        );
        assert_eq!(never, [(0, 0, None), (1, 33, None)]);
        // Depth that comes late.
        let early = pairs(
            Some(30.0),
            &[('c', 0), ('c', 33), ('d', 1), ('c', 66), ('d', 34)],
        );
        assert_eq!(early, [(0, 1, Some(0)), (1, 34, Some(33))]);
    }

    #[test]
    fn colour_of_half_the_rate_serves_two_depth_images() {
        let half = pairs(
            Some(15.0),
            &[('c', 100), ('d', 101), ('d', 132), ('d', 168), ('c', 166)],
        );
        assert_eq!(
            half,
            [
                (0, 101, Some(100)),
                (1, 132, Some(100)),
                (2, 168, Some(166))
            ]
        );
    }

    #[test]
    fn a_clock_that_runs_back_stalls_nothing() {
        let back = pairs(
            Some(30.0),
            &[
                ('c', 9000),
                ('d', 9001),
                ('d', 5),
                ('c', 6),
                ('d', 38),
                ('c', 39),
            ],
        );
        assert_eq!(
            back,
            [(0, 9001, Some(9000)), (1, 5, Some(6)), (2, 38, Some(39))]
        );
    }
}

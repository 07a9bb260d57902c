//! Pairs of depth and colour: nearest in time, at most half a period apart.

use super::Stream;
use super::driver::{Formats, RawImage};
use std::sync::Arc;

/// Depth and the colour of its time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Pair {
    /// Number of the depth image since the camera was opened.
    pub(crate) number: u64,
    pub(crate) depth: RawImage,
    pub(crate) color: Option<Arc<RawImage>>,
}

/// Pairing of two streams whose images come in any order.
pub(crate) struct Pairing {
    /// Largest time between depth and its colour, nanoseconds; `None` without colour.
    half_period_ns: Option<u64>,
    /// Newest colour.
    color: Option<Arc<RawImage>>,
    /// Depth without colour so far, and its number.
    waiting: Option<(u64, RawImage)>,
    next: u64,
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
            color: None,
            waiting: None,
            next: 0,
            unpaired: 0,
        }
    }

    /// Takes an image in and passes on the pairs that it completes.
    pub(crate) fn push(&mut self, image: RawImage, sink: &mut dyn FnMut(Pair)) {
        match image.stream {
            Stream::Depth => self.push_depth(image, sink),
            Stream::Color => self.push_color(image, sink),
        }
    }

    fn push_depth(&mut self, depth: RawImage, sink: &mut dyn FnMut(Pair)) {
        // No colour came between two depth images.
        self.release(sink);
        self.waiting = Some((self.next, depth));
        self.next += 1;
        // Colour within half a period is the nearest: the next one is farther.
        if self.half_period_ns.is_none() || self.near_color().is_some() {
            self.release(sink);
        }
    }

    fn push_color(&mut self, color: RawImage, sink: &mut dyn FnMut(Pair)) {
        self.color = Some(Arc::new(color));
        self.release(sink);
    }

    /// Newest colour if it is of the waiting depth's time.
    fn near_color(&self) -> Option<Arc<RawImage>> {
        let (color, (_, depth)) = (self.color.as_ref()?, self.waiting.as_ref()?);
        let gap = color.time_ns.abs_diff(depth.time_ns);
        (gap <= self.half_period_ns?).then(|| color.clone())
    }

    /// Passes on the depth that waits.
    fn release(&mut self, sink: &mut dyn FnMut(Pair)) {
        let color = self.near_color();
        if let Some((number, depth)) = self.waiting.take() {
            self.unpaired += u64::from(color.is_none() && self.half_period_ns.is_some());
            sink(Pair {
                number,
                depth,
                color,
            });
        }
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
            let image = RawImage {
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

//! Choice of the formats that are drawn of an exposure, so that no viewer's format costs the others their rate.
//!
//! The most wanted format is always drawn, the older of equals. Of the others, those that fit before the next exposure cost nobody anything;
//! one that does not is paid from a small share of the time, longest unserved first.

use crate::encoding::Encoding;
use std::collections::BTreeMap;
use tokio::time::{Duration, Instant};
use tryon::geometry::settings;
use tryon::view::OutputFrame;

/// Format of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Format {
    /// `None` is the camera's.
    pub(crate) shape: Option<OutputFrame>,
    pub(crate) encoding: Encoding,
}

/// Time after which a format that nobody wants is forgotten; viewers with a rate want theirs now and then.
const FORGOTTEN: Duration = Duration::from_secs(60);

settings! {
    /// Settings of the choice of formats.
    pub struct FormatSettings {
        /// Share of the time that formats may take beyond the next exposure: the rate that the others lose at most. More serves
        /// large formats oftener.
        pub share: f64 = 0.04,
        /// Most seconds saved up: one picture of 2 Mpx.
        pub saved_s: f64 = 0.04,
        /// Weight of a new measurement of costs and intervals.
        pub weight: f64 = 0.2,
        /// Interval before two exposures have come (s).
        pub first_interval_s: f64 = 0.033,
        /// Cost of a pixel before anything was measured (s): 640×480 in 6 ms.
        pub first_pixel_s: f64 = 2e-8,
    }
}

/// Viewers of a format.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wanted {
    /// Voices of their connections.
    pub(crate) voices: f64,
    /// Place of the oldest among all viewers.
    pub(crate) rank: usize,
}

/// Measurements of one format.
#[derive(Clone, Copy, Debug)]
struct Known {
    /// Time to draw and encode it, seconds; `None` until measured.
    cost: Option<f64>,
    /// Last exposure of which it was drawn; `None` comes first.
    served: Option<Instant>,
}

/// Costs of the formats of one try-on.
pub(crate) struct Formats {
    settings: FormatSettings,
    known: BTreeMap<Format, Known>,
    /// Seconds that may be overdrawn; negative after a large picture.
    credit: f64,
    interval: f64,
    last: Option<Instant>,
}

impl Default for Formats {
    fn default() -> Self {
        let settings = FormatSettings::default();
        Self {
            settings,
            known: BTreeMap::new(),
            credit: settings.saved_s,
            interval: settings.first_interval_s,
            last: None,
        }
    }
}

impl Formats {
    /// Formats to draw of an exposure of `pixels` that came at `now`, of those wanted by viewers; the first comes first.
    pub(crate) fn choose(
        &mut self,
        wanted: &BTreeMap<Format, Wanted>,
        pixels: f64,
        now: Instant,
    ) -> Vec<Format> {
        self.pass_time(now);
        let is_recent = |k: &Known| k.served.is_some_and(|t| now - t < FORGOTTEN);
        self.known
            .retain(|f, k| wanted.contains_key(f) || is_recent(k));
        let area = |f: &Format| {
            f.shape
                .map_or(pixels, |s| s.size.iter().copied().map(f64::from).product())
        };
        let fresh = Known {
            cost: None,
            served: None,
        };
        let mut waiting: Vec<(Format, Known)> = (wanted.keys())
            .map(|f| (*f, *self.known.entry(*f).or_insert(fresh)))
            .collect();
        let by_voices = |(a, _): &&(Format, Known), (b, _): &&(Format, Known)| {
            let (a, b) = (wanted[a], wanted[b]);
            (a.voices.total_cmp(&b.voices)).then(b.rank.cmp(&a.rank))
        };
        let Some(&(first, _)) = waiting.iter().max_by(by_voices) else {
            return Vec::new();
        };
        waiting.sort_by_key(|(_, k)| k.served);
        let pixel_cost = self.pixel_cost(&area);
        let cost = |(f, k): &(Format, Known)| k.cost.unwrap_or_else(|| area(f) * pixel_cost);
        let cost_of_first = waiting.iter().find(|w| w.0 == first).map_or(0.0, &cost);

        let mut left = (self.interval - cost_of_first).max(0.0);
        let mut chosen = vec![first];
        for w in waiting.iter().filter(|w| w.0 != first) {
            let over = cost(w) - left;
            if over > 0.0 && self.credit < 0.0 {
                continue;
            }
            self.credit -= over.max(0.0);
            left = (-over).max(0.0);
            chosen.push(w.0);
        }
        for f in &chosen {
            self.known.entry(*f).and_modify(|k| k.served = Some(now));
        }
        chosen
    }

    /// Takes the measured time of a format into account.
    pub(crate) fn record(&mut self, format: Format, cost: Duration) {
        let (cost, weight) = (cost.as_secs_f64(), self.settings.weight);
        if let Some(k) = self.known.get_mut(&format) {
            k.cost = Some(k.cost.map_or(cost, |c| c + weight * (cost - c)));
        }
    }

    fn pass_time(&mut self, now: Instant) {
        if let Some(last) = self.last.replace(now) {
            let passed = now.saturating_duration_since(last).as_secs_f64();
            self.interval += self.settings.weight * (passed.min(1.0) - self.interval);
            self.credit = (self.credit + self.settings.share * passed).min(self.settings.saved_s);
        }
    }

    /// Highest measured cost of a pixel (s): small pictures cost more a pixel, so unmeasured large ones are overrated.
    fn pixel_cost(&self, area: &impl Fn(&Format) -> f64) -> f64 {
        let measured = (self.known.iter()).filter_map(|(f, k)| Some(k.cost? / area(f)));
        measured.fold(self.settings.first_pixel_s, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon::view::Framing;

    const PIXELS: f64 = 640.0 * 480.0;
    const INTERVAL: Duration = Duration::from_millis(33);
    const EXPOSURES: u32 = 1800;
    /// Pictures of the most wanted format: 6 % are lost at most.
    const LEAST: usize = 1692;

    fn format(w: u32, h: u32) -> Format {
        Format {
            shape: Some(OutputFrame {
                size: [w, h],
                framing: Framing::Contain,
            }),
            encoding: Encoding::Jpeg(80),
        }
    }

    /// Runs a minute of exposures at 30 Hz whose pictures cost 30 ns a pixel; while one is drawn, the newest waits. Times
    /// that each format was drawn. Formats in order of arrival, with their voices.
    fn run(wanted: &[(Format, f64)]) -> BTreeMap<Format, usize> {
        let wanted: BTreeMap<_, _> = (wanted.iter().enumerate())
            .map(|(rank, &(f, voices))| (f, Wanted { voices, rank }))
            .collect();
        let (mut formats, mut drawn) = (Formats::default(), BTreeMap::new());
        let start = Instant::now();
        let mut free = start;
        for i in 0..EXPOSURES {
            let now = start + i * INTERVAL;
            let chosen = formats.choose(&wanted, PIXELS, now);
            if free >= now + INTERVAL {
                // A newer one replaces it.
                continue;
            }
            free = free.max(now);
            for f in chosen {
                let [w, h] = f.shape.expect("a shape").size;
                let cost = Duration::from_secs_f64(f64::from(w) * f64::from(h) * 3e-8);
                formats.record(f, cost);
                *drawn.entry(f).or_default() += 1;
                free += cost;
            }
        }
        drawn
    }

    #[test]
    fn a_huge_format_costs_its_own_rate() {
        let (small, huge) = (format(640, 480), format(4096, 4096));
        let drawn = run(&[(small, 1.0), (huge, 1.0)]);
        assert!(drawn[&small] > LEAST, "{drawn:?}");
        assert!(drawn[&huge] >= 3, "it is served too: {drawn:?}");
    }

    #[test]
    fn many_formats_share_what_is_left_and_none_starves() {
        let mut wanted: Vec<_> = (0..50)
            .map(|i| (format(320 + 16 * i, 240 + 8 * i), 0.02))
            .collect();
        wanted.push((format(640, 480), 1.0));
        let drawn = run(&wanted);
        assert!(drawn[&format(640, 480)] > LEAST, "{drawn:?}");
        assert_eq!(drawn.len(), 51);
        assert!(drawn.values().all(|n| *n >= 10), "{drawn:?}");
    }

    #[test]
    fn formats_that_fit_are_all_drawn() {
        let (a, b) = (format(640, 480), format(320, 240));
        let drawn = run(&[(a, 1.0), (b, 1.0)]);
        assert_eq!(
            (drawn[&a], drawn[&b]),
            (EXPOSURES as usize, EXPOSURES as usize)
        );
    }
}

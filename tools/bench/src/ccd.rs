//! Continuous collision detection against query sets with exact truth: missed impacts, false alarms and time.

use super::EvaluateError;
use super::ccd_queries::{CcdQuery, KINDS, find_ccd_queries, read_ccd_queries};
use serde::Serialize;
use std::hint::black_box;
use std::path::Path;
use std::time::Instant;
use tryon_cloth::contact::ccd::{PairMotion, has_impact, time_of_impact};
use tryon_geometry::math::order_statistics::median;

/// Calls timed together: one call is as short as reading the clock.
const CALLS: u32 = 8;
/// Timings of which the shortest counts: the others were interrupted.
const TIMINGS: usize = 3;

/// Answers of one query form against the truth.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct CcdAnswers {
    /// Impacts answered with no.
    pub missed: usize,
    /// Free motions answered with yes.
    pub false_alarms: usize,
    /// Median time of one query, nanoseconds.
    pub median_ns: f64,
    /// Mean time of one query, nanoseconds.
    pub mean_ns: f64,
    /// Time of each query, nanoseconds.
    #[serde(skip)]
    times: Vec<f64>,
}

/// Result of one set of queries.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct CcdScore {
    /// Group of the set.
    pub group: String,
    /// `vertex-face`, `edge-edge`, or `all`.
    pub kind: &'static str,
    /// Number of queries.
    pub queries: usize,
    /// Queries whose truth is an impact.
    pub impacts: usize,
    /// Queries with a coordinate that f64 doesn't hold; they are asked as a step, whose margin covers the rounding.
    pub rounded: usize,
    /// [`has_impact`]: the yes or no of the exact motion.
    #[serde(flatten)]
    pub decision: CcdAnswers,
    /// [`time_of_impact`]: an impact within the margin that keeps a scaled and rounded step free counts as one.
    pub step: CcdAnswers,
}

/// Results of all sets below a folder.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CcdReport {
    /// By the paths of their groups.
    pub sets: Vec<CcdScore>,
    /// All sets together.
    pub total: CcdScore,
}

/// Reads and asks all queries below `root` on the calling thread.
///
/// # Errors
/// When a file can't be read or is no query set.
pub fn score_ccd(root: &Path) -> Result<CcdReport, EvaluateError> {
    let score = |group: &str, kind| CcdScore {
        group: group.to_owned(),
        kind,
        ..CcdScore::default()
    };
    let mut total = score("total", "all");
    let mut sets = Vec::new();
    for set in find_ccd_queries(root)? {
        let (name, kind) = KINDS[set.kind];
        let mut own = score(&set.group, name);
        for file in &set.files {
            let queries = read_ccd_queries(file, kind)?;
            queries.iter().for_each(|q| own.ask(q));
        }
        total.append(&own);
        own.finish();
        sets.push(own);
    }
    total.finish();
    Ok(CcdReport { sets, total })
}

impl CcdScore {
    fn ask(&mut self, query: &CcdQuery) {
        let (motion, truth) = (&query.motion, query.has_impact);
        self.queries += 1;
        self.impacts += usize::from(truth);
        self.rounded += usize::from(!query.is_exact);
        let step = |m: &PairMotion| time_of_impact(m, 0.0).is_some();
        self.step.ask(motion, truth, step);
        if query.is_exact {
            self.decision.ask(motion, truth, has_impact);
        } else {
            self.decision.ask(motion, truth, step);
        }
    }

    fn append(&mut self, other: &Self) {
        self.queries += other.queries;
        self.impacts += other.impacts;
        self.rounded += other.rounded;
        self.decision.append(&other.decision);
        self.step.append(&other.step);
    }

    fn finish(&mut self) {
        for answers in [&mut self.decision, &mut self.step] {
            let times = &answers.times;
            answers.mean_ns = times.iter().sum::<f64>() / times.len().max(1) as f64;
            answers.median_ns = median(&mut times.clone()).unwrap_or(0.0);
        }
    }
}

impl CcdAnswers {
    fn ask(&mut self, motion: &PairMotion, truth: bool, query: impl Fn(&PairMotion) -> bool) {
        let mut answer = false;
        let mut shortest = f64::INFINITY;
        for _ in 0..TIMINGS {
            let start = Instant::now();
            for _ in 0..CALLS {
                answer = black_box(query(black_box(motion)));
            }
            shortest = shortest.min(start.elapsed().as_secs_f64());
        }
        self.times.push(shortest * 1e9 / f64::from(CALLS));
        self.missed += usize::from(truth && !answer);
        self.false_alarms += usize::from(answer && !truth);
    }

    fn append(&mut self, other: &Self) {
        self.missed += other.missed;
        self.false_alarms += other.false_alarms;
        self.times.extend(&other.times);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A vertex that falls onto the face x, z ≥ 0, x + z ≤ 1 at `x` from y = 1 to y = `end`.
    fn query(x: f64, end: f64, truth: u8) -> String {
        let face = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
        let mut text = String::new();
        for y in [1.0, end] {
            for [x, y, z] in [[x, y, 0.25]].iter().chain(&face) {
                let row = [*x, *y, *z].map(|c| format!("{},4", c * 4.0));
                text += &format!("{},{truth}\n", row.join(","));
            }
        }
        text
    }

    #[test]
    fn answers_are_counted_against_the_truth() {
        let root = tempfile::tempdir().expect("a folder");
        let folder = root.path().join("drops/vertex-face");
        std::fs::create_dir_all(&folder).expect("a folder");
        let right = query(0.25, -1.0, 1) + &query(0.25, 0.25, 0) + &query(2.0, -1.0, 0);
        let wrong = query(0.25, -1.0, 0) + &query(2.0, -1.0, 1);
        std::fs::write(folder.join("a.csv"), right).expect("a file");
        std::fs::write(folder.join("b.csv"), wrong).expect("a file");
        let report = score_ccd(root.path()).expect("a report");
        let set = &report.sets[0];
        assert_eq!((set.group.as_str(), set.kind), ("drops", "vertex-face"));
        assert_eq!((set.queries, set.impacts, set.rounded), (5, 2, 0));
        for answers in [&set.decision, &set.step, &report.total.decision] {
            assert_eq!((answers.missed, answers.false_alarms), (1, 1));
        }
    }
}

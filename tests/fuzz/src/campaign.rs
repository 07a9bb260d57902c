//! Campaign against one target, in a process of its own: mutate, execute, keep what is new, save what fails.

use crate::bundle::Bundle;
use crate::corpus;
use crate::execute::{Execution, Scratch, Verdict, catch_panics, execute};
use crate::mutate::Mutator;
use crate::shrink::shrink;
use crate::targets::Target;
use anyhow::{Context, Result};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::collections::HashSet;
use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant};

/// Time for one input, beyond which it counts as endless: a thousand times a usual one, on a busy machine.
pub const TIME_LIMIT: Duration = Duration::from_secs(10);
/// Exit status of a process whose input took longer.
pub const EXIT_ENDLESS: i32 = 124;
/// Stack of the decoding thread: that of Rust's threads, on which services decode.
const STACK: usize = 2 << 20;
/// Most inputs kept in memory.
const MOST_KEPT: usize = 2000;
/// Most findings of a campaign; one fault has many inputs.
const MOST_FINDINGS: usize = 10;

/// Result of a campaign.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tally {
    /// Executed inputs.
    pub inputs: u64,
    /// Distinct outcomes.
    pub outcomes: usize,
    /// Most bytes held by a decoder.
    pub held: usize,
    /// Longest time of an input (ms).
    pub slowest_ms: u64,
    /// Distinct faults.
    pub findings: usize,
}

impl Tally {
    /// One line for the supervisor.
    pub fn line(&self) -> String {
        let Self {
            inputs,
            outcomes,
            held,
            slowest_ms,
            findings,
        } = self;
        format!("tally {inputs} {outcomes} {held} {slowest_ms} {findings}")
    }
    /// Inverse of [`Self::line`].
    pub fn parse(line: &str) -> Option<Self> {
        let mut numbers = line.strip_prefix("tally ")?.split(' ');
        let mut next = || numbers.next()?.parse::<u64>().ok();
        Some(Self {
            inputs: next()?,
            outcomes: next()? as usize,
            held: next()? as usize,
            slowest_ms: next()?,
            findings: next()? as usize,
        })
    }
}

/// Runs for `time`; the input under way is always in the file `current`.
///
/// # Errors
/// The corpus, the scratch folder or `current` cannot be used.
pub fn run(target: &'static Target, time: Duration, seed: u64, current: &Path) -> Result<Tally> {
    catch_panics();
    let current = File::create(current).context("the file of the current input")?;
    let watch = Watch::start()?;
    let work = move || Campaign::new(target, seed, current, watch)?.run(time);
    std::thread::Builder::new()
        .stack_size(STACK)
        .spawn(work)?
        .join()
        .map_err(|_| anyhow::anyhow!("the harness itself panicked"))?
}

/// Ends the process when one input takes longer than [`TIME_LIMIT`].
struct Watch {
    inputs: Arc<AtomicU64>,
    _alive: mpsc::Sender<()>,
}

impl Watch {
    fn start() -> Result<Self> {
        let inputs = Arc::new(AtomicU64::new(0));
        let (alive, ended) = mpsc::channel::<()>();
        let seen = inputs.clone();
        let watch = move || {
            let mut last = u64::MAX;
            while ended.recv_timeout(TIME_LIMIT) == Err(mpsc::RecvTimeoutError::Timeout) {
                let now = seen.load(Ordering::Relaxed);
                if now == last {
                    // Nothing else ends a decoder that never returns.
                    #[expect(clippy::disallowed_methods)]
                    std::process::exit(EXIT_ENDLESS);
                }
                last = now;
            }
        };
        std::thread::Builder::new().spawn(watch)?;
        Ok(Self {
            inputs,
            _alive: alive,
        })
    }
}

struct Campaign {
    target: &'static Target,
    rng: Pcg64Mcg,
    current: File,
    watch: Watch,
    scratch: Scratch,
    kept: Vec<Bundle>,
    outcomes: HashSet<String>,
    faults: HashSet<String>,
    tally: Tally,
}

impl Campaign {
    fn new(target: &'static Target, seed: u64, current: File, watch: Watch) -> Result<Self> {
        let mut kept = (target.seeds)();
        kept.extend(corpus::load(target.name)?.into_iter().map(|(_, b)| b));
        kept.retain(|b| !b.0.is_empty());
        anyhow::ensure!(!kept.is_empty(), "{} has no seeds", target.name);
        Ok(Self {
            target,
            rng: Pcg64Mcg::seed_from_u64(seed),
            current,
            watch,
            scratch: Scratch::new()?,
            kept,
            outcomes: HashSet::new(),
            faults: HashSet::new(),
            tally: Tally::default(),
        })
    }

    fn run(mut self, time: Duration) -> Result<Tally> {
        let start = Instant::now();
        // Twice: what is made on first use (tables, the embedded body) is no input's memory.
        for seed in self.kept.clone() {
            self.execute(&seed)?;
        }
        for seed in self.kept.clone() {
            self.try_input(seed)?;
        }
        while start.elapsed() < time && self.faults.len() < MOST_FINDINGS {
            let input = self.next_input();
            self.try_input(input)?;
        }
        self.tally.outcomes = self.outcomes.len();
        self.tally.findings = self.faults.len();
        Ok(self.tally)
    }

    fn next_input(&mut self) -> Bundle {
        let (parent, donor) = (
            self.rng.random_range(0..self.kept.len()),
            self.rng.random_range(0..self.kept.len()),
        );
        let mut input = self.kept[parent].clone();
        let mut mutator = Mutator {
            rng: Pcg64Mcg::seed_from_u64(self.rng.random()),
            words: self.target.words,
            longest: self.target.longest,
        };
        mutator.mutate(&mut input, &self.kept[donor]);
        input
    }

    fn execute(&mut self, input: &Bundle) -> Result<Execution> {
        let bytes = input.encode();
        self.current.set_len(0)?;
        self.current.write_all_at(&bytes, 0)?;
        self.watch.inputs.fetch_add(1, Ordering::Relaxed);
        Ok(execute(self.target, input, &self.scratch))
    }

    fn try_input(&mut self, input: Bundle) -> Result<()> {
        let done = self.execute(&input)?;
        self.tally.inputs += 1;
        self.tally.held = self.tally.held.max(done.held);
        let ms = done.took.as_millis() as u64;
        self.tally.slowest_ms = self.tally.slowest_ms.max(ms);
        let is_new = self.outcomes.insert(done.verdict.signature());
        if done.verdict.is_finding() {
            if self.faults.insert(done.verdict.signature()) {
                self.report(&done.verdict, input)?;
            }
        } else if is_new && self.kept.len() < MOST_KEPT {
            self.kept.push(input);
        }
        Ok(())
    }

    fn report(&mut self, verdict: &Verdict, input: Bundle) -> Result<()> {
        let kind = match verdict {
            Verdict::Greedy { .. } => "greedy",
            _ => "panic",
        };
        let small = shrink(self.target, input, &self.scratch);
        let path = corpus::save(self.target.name, kind, &small)?;
        let line = format!("finding {verdict:?} in {}", path.display());
        crate::supervise::say(&line.replace('\n', " "));
        Ok(())
    }
}

//! Campaign against one target, in a process of its own: mutate, execute, save what fails.

use crate::bundle::Bundle;
use crate::corpus;
use crate::execute::{Execution, Scratch, Verdict, catch_panics, execute};
use crate::mutate::Mutator;
use crate::supervise::{FINDING, say};
use crate::targets::Target;
use anyhow::{Context, Result};
use arbtest::arbtest;
use prost::Message;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use std::collections::HashSet;
use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, mpsc};
use std::time::Duration;

/// Time for one input, beyond which it counts as endless: a thousand times a usual one, on a busy machine.
pub const TIME_LIMIT: Duration = Duration::from_secs(10);
/// Exit status of a process whose input took longer.
pub const EXIT_ENDLESS: i32 = 124;
/// Stack of the decoding thread: that of Rust's threads, on which services decode.
const STACK: usize = 2 << 20;
/// Random bytes of an input: a parent, a donor and the start of the mutations (arbtest's least).
const ENTROPY: u32 = 32;
/// Most findings of a campaign; one fault has many inputs.
const MOST_FINDINGS: usize = 10;

/// Work of a campaign so far.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    /// Executed inputs.
    inputs: u64,
    /// Most bytes held by a decoder.
    held: usize,
    /// Longest time of an input (ms).
    slowest_ms: u128,
}

/// Runs for `time`; the input under way is always in the file `current`.
///
/// # Errors
/// The corpus, the scratch folder or `current` cannot be used.
pub fn run(target: &'static Target, time: Duration, current: &Path) -> Result<()> {
    catch_panics();
    let current = File::create(current).context("the file of the current input")?;
    let watch = Watch::start()?;
    let work = move || Campaign::new(target, current, watch)?.run(time);
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
    current: File,
    watch: Watch,
    scratch: Scratch,
    faults: HashSet<String>,
    tally: Tally,
}

impl Campaign {
    fn new(target: &'static Target, current: File, watch: Watch) -> Result<Self> {
        Ok(Self {
            target,
            current,
            watch,
            scratch: Scratch::new()?,
            faults: HashSet::new(),
            tally: Tally::default(),
        })
    }

    fn run(mut self, time: Duration) -> Result<()> {
        let mut valid = (self.target.seeds)();
        valid.extend(corpus::load(self.target.name)?.into_iter().map(|(_, b)| b));
        valid.retain(|b| !b.0.is_empty());
        // Twice: what is made on first use (tables, the embedded body) is no input's memory.
        for seed in &valid {
            self.execute(seed)?;
        }
        for seed in &valid {
            self.try_input(seed)?;
        }

        let words: Vec<&str> = self.target.words.split_whitespace().collect();
        let mut done = Ok(());
        arbtest(|u| {
            let mut input = u.choose(&valid)?.clone();
            let donor = u.choose(&valid)?;
            let mut mutator = Mutator {
                rng: Pcg64Mcg::seed_from_u64(u.arbitrary()?),
                words: &words,
                longest: self.target.longest,
            };
            mutator.mutate(&mut input, donor);
            if done.is_ok() {
                done = self.try_input(&input);
            }
            Ok(())
        })
        .size_max(ENTROPY)
        .budget(time)
        .run();
        done?;
        say(&self.summary());
        Ok(())
    }

    fn summary(&self) -> String {
        let Tally {
            inputs,
            held,
            slowest_ms,
        } = self.tally;
        let (name, held, findings) = (self.target.name, held >> 10, self.faults.len());
        format!(
            "{name:<16} {inputs:>9} inputs {held:>8} KiB held {slowest_ms:>5} ms slowest {findings:>3} findings"
        )
    }

    fn execute(&mut self, input: &Bundle) -> Result<Execution> {
        let bytes = input.encode_to_vec();
        self.current.set_len(0)?;
        self.current.write_all_at(&bytes, 0)?;
        self.watch.inputs.fetch_add(1, Ordering::Relaxed);
        Ok(execute(self.target, input, &self.scratch))
    }

    fn try_input(&mut self, input: &Bundle) -> Result<()> {
        let Execution {
            verdict,
            held,
            took,
        } = self.execute(input)?;
        self.tally.inputs += 1;
        self.tally.held = self.tally.held.max(held);
        self.tally.slowest_ms = self.tally.slowest_ms.max(took.as_millis());
        let Some(fault) = verdict
            .fault()
            .filter(|_| self.faults.len() < MOST_FINDINGS)
        else {
            return Ok(());
        };
        if self.faults.insert(fault.to_owned()) {
            self.report(&verdict, input)?;
        }
        Ok(())
    }

    fn report(&self, verdict: &Verdict, input: &Bundle) -> Result<()> {
        let kind = match verdict {
            Verdict::Greedy { .. } => "greedy",
            _ => "panic",
        };
        let path = corpus::save(self.target.name, kind, input)?;
        let (name, path) = (self.target.name, path.display());
        let line = format!("{name}{FINDING}{verdict:?} in {path}");
        say(&line.replace('\n', " "));
        Ok(())
    }
}

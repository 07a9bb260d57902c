//! Processors in use: of those that this process may run on, by any process of the machine.

use std::path::Path;

/// Counters of one moment (Linux, /proc/stat), in clock ticks of all allowed processors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Ticks {
    busy: u64,
    all: u64,
}

/// Meter of the processors in use.
#[derive(Clone, Debug)]
pub struct LoadMeter {
    allowed: Vec<bool>,
    last: Option<Ticks>,
}

/// Load of the time between two readings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Load {
    /// Processors in use.
    pub busy: f64,
    /// Processors that there are.
    pub processors: f64,
}

impl LoadMeter {
    /// A meter of the processors in this process's affinity; `None` where the system does not tell.
    pub fn new() -> Option<Self> {
        let status = std::fs::read_to_string("/proc/self/status").ok()?;
        let list = status
            .lines()
            .find_map(|l| l.strip_prefix("Cpus_allowed_list:"))?;
        let mut meter = Self {
            allowed: allowed(list.trim())?,
            last: None,
        };
        meter.read();
        Some(meter)
    }

    /// Load since the last reading; `None` when no tick has passed or the system does not tell.
    pub fn read(&mut self) -> Option<Load> {
        self.advance(&std::fs::read_to_string(Path::new("/proc/stat")).ok()?)
    }

    fn advance(&mut self, stat: &str) -> Option<Load> {
        let (now, count) = ticks(stat, &self.allowed)?;
        let before = self.last.replace(now)?;
        let all = now.all.checked_sub(before.all).filter(|n| *n > 0)?;
        let busy = now.busy.saturating_sub(before.busy);
        let processors = count as f64;
        Some(Load {
            busy: processors * busy.min(all) as f64 / all as f64,
            processors,
        })
    }
}

/// Sums over the allowed processors, and their number.
fn ticks(stat: &str, allowed: &[bool]) -> Option<(Ticks, usize)> {
    let mut sum = Ticks { busy: 0, all: 0 };
    let mut count = 0;
    for line in stat.lines() {
        let Some((number, fields)) = line.strip_prefix("cpu").and_then(|l| l.split_once(' '))
        else {
            continue;
        };
        // The line of all processors has no number.
        let Ok(number) = number.parse::<usize>() else {
            continue;
        };
        if !allowed.get(number).copied().unwrap_or(false) {
            continue;
        }
        // user nice system idle iowait irq softirq steal; guests are counted in user.
        let fields: Vec<u64> = (fields.split_whitespace().take(8))
            .map(|f| f.parse().ok())
            .collect::<Option<_>>()?;
        let all: u64 = fields.iter().sum();
        let idle = fields.get(3)? + fields.get(4)?;
        sum.all += all;
        sum.busy += all - idle;
        count += 1;
    }
    (count > 0).then_some((sum, count))
}

/// Members of a list such as `0-3,8`.
fn allowed(list: &str) -> Option<Vec<bool>> {
    /// More processors than any machine has.
    const MOST: usize = 1 << 16;
    let mut allowed = Vec::new();
    for range in list.split(',') {
        let (first, last) = range.split_once('-').unwrap_or((range, range));
        let (first, last): (usize, usize) = (first.parse().ok()?, last.parse().ok()?);
        if last >= MOST {
            return None;
        }
        allowed.resize(allowed.len().max(last + 1), false);
        allowed.get_mut(first..=last)?.fill(true);
    }
    Some(allowed)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FIRST: &str =
        "cpu  1 2 3\ncpu0 100 0 50 800 50 0 0 0 7 0\ncpu1 10 0 0 90 0 0 0 0 0 0\nintr 5\n";
    const SECOND: &str =
        "cpu  1 2 3\ncpu0 170 0 60 820 50 0 0 0 7 0\ncpu1 10 0 0 190 0 0 0 0 0 0\n";

    #[test]
    fn load_is_that_of_the_allowed_processors() {
        let meter = |list| LoadMeter {
            allowed: allowed(list).expect("a list"),
            last: None,
        };
        for (list, busy, processors) in [("0-1", 0.8, 2.0), ("0", 0.8, 1.0), ("1,5-7", 0.0, 1.0)] {
            let mut meter = meter(list);
            assert_eq!(meter.advance(FIRST), None, "one reading is no load");
            let load = meter.advance(SECOND).expect("ticks have passed");
            assert_eq!(load, Load { busy, processors }, "{list}");
            assert_eq!(meter.advance(SECOND), None, "no tick has passed");
        }
        assert_eq!(
            meter("9").advance(FIRST),
            None,
            "there is no such processor"
        );
        assert_eq!(meter("0").advance("cpu0 a b c d e\n"), None);
    }

    #[test]
    fn lists_are_read_and_bad_ones_refused() {
        assert_eq!(allowed("1,3-4"), Some(vec![false, true, false, true, true]));
        for bad in ["", "a", "3-1", "1-", "0-99999999999", "70000"] {
            assert_eq!(allowed(bad), None, "{bad}");
        }
    }

    #[test]
    fn this_machine_tells() {
        if cfg!(target_os = "linux") {
            assert!(LoadMeter::new().is_some());
        }
    }
}

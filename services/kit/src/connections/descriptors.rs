//! Descriptors of the process: the soft limit is raised once, and the ports share what is left beside the rest.

use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use std::sync::OnceLock;

/// Most seats of a port of calls. More would only hold more strangers.
const MOST: usize = 512;
/// Least seats of a port of calls, below which nobody could work.
const LEAST: usize = 16;
/// Seats of a port of probes: an orchestrator, a scraper and the watchdog take one each.
pub(super) const PROBES: usize = 32;
/// Ports of calls of a whole box in one process; each has a port of probes.
const PORTS: usize = 4;
/// Descriptors for everything but accepted connections: the bus, cameras, files, calls to other services.
const RESERVED: usize = 512;
/// Soft limit that is asked for: every seat of a box, and the reserve twice.
const WANTED: u64 = 4096;

/// Seats of one port of calls. The first query raises the soft limit of the process.
pub(super) fn seats() -> usize {
    static SEATS: OnceLock<usize> = OnceLock::new();
    *SEATS.get_or_init(|| share(raise()))
}

/// Raises the soft limit up to the hard one, at most to [`WANTED`]. The soft limit after that.
fn raise() -> u64 {
    let limit = getrlimit(Resource::Nofile);
    // None is no limit.
    let (soft, hard) = (limit.current, limit.maximum.unwrap_or(u64::MAX));
    let Some(soft) = soft.filter(|s| *s < WANTED) else {
        return WANTED;
    };
    let raised = Rlimit {
        current: Some(WANTED.min(hard)),
        maximum: limit.maximum,
    };
    match setrlimit(Resource::Nofile, raised) {
        Ok(()) => WANTED.min(hard),
        Err(e) => {
            tracing::warn!(error = %e, soft, "the limit on descriptors could not be raised");
            soft
        }
    }
}

/// Seats of a port of calls under a soft limit.
fn share(soft: u64) -> usize {
    let soft = usize::try_from(soft).unwrap_or(usize::MAX);
    (soft.saturating_sub(RESERVED + PORTS * PROBES) / PORTS).clamp(LEAST, MOST)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_seats_of_a_box_leave_descriptors_for_the_rest() {
        for (soft, expected) in [(256, 16), (1024, 96), (WANTED, 512), (u64::MAX, 512)] {
            assert_eq!(share(soft), expected, "{soft}");
            assert!(
                ((share(soft) + PROBES) * PORTS) as u64 <= soft / 4 * 3,
                "{soft}"
            );
        }
    }

    #[test]
    fn the_soft_limit_is_raised() {
        let hard = getrlimit(Resource::Nofile).maximum.unwrap_or(u64::MAX);
        assert_eq!(raise(), WANTED.min(hard));
        assert!(
            getrlimit(Resource::Nofile)
                .current
                .is_none_or(|soft| soft >= WANTED.min(hard))
        );
        assert_eq!(seats(), share(WANTED.min(hard)));
    }
}

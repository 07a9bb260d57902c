//! Smaller inputs with the same fault, by deleting ever smaller pieces.

use crate::bundle::Bundle;
use crate::execute::{Scratch, execute};
use crate::targets::Target;
use std::time::{Duration, Instant};

/// Time for one input; a regression that is a little too long is no harm.
const BUDGET: Duration = Duration::from_secs(3);

/// Deletes pieces as long as the verdict's signature stays.
pub fn shrink(target: &Target, input: Bundle, scratch: &Scratch) -> Bundle {
    let start = Instant::now();
    let wanted = execute(target, &input, scratch).verdict.signature();
    let keeps = |b: &Bundle| execute(target, b, scratch).verdict.signature() == wanted;
    let mut best = input;
    for m in 0..best.0.len() {
        let mut piece = best.0[m].bytes.len().div_ceil(2);
        while piece > 0 {
            let mut at = 0;
            while at < best.0[m].bytes.len() {
                if start.elapsed() > BUDGET {
                    return best;
                }
                let mut smaller = best.clone();
                let end = (at + piece).min(smaller.0[m].bytes.len());
                smaller.0[m].bytes.drain(at..end);
                if keeps(&smaller) {
                    best = smaller;
                } else {
                    at += piece;
                }
            }
            piece /= 2;
        }
    }
    best
}

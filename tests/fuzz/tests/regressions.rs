//! Replays seeds and every kept input: none may panic, or hold more memory than its target allows.
//!
//! One test, since memory is counted for the whole process.

use tryon_fuzz::corpus;
use tryon_fuzz::execute::{Scratch, catch_panics, execute};
use tryon_fuzz::targets::TARGETS;

#[test]
fn kept_inputs_stay_harmless_and_seeds_are_decoded() {
    let scratch = Scratch::new().expect("a folder");
    let hook = std::panic::take_hook();
    catch_panics();
    let mut faults = Vec::new();
    for target in TARGETS {
        let seeds = (target.seeds)();
        let named = seeds.into_iter().enumerate();
        let mut inputs: Vec<_> = named.map(|(i, b)| (format!("seed {i}"), b)).collect();
        for (name, input) in &inputs {
            // The first run makes what is made once, such as the embedded body.
            let _ = execute(target, input, &scratch);
            let decoded = execute(target, input, &scratch).verdict;
            if !matches!(decoded, tryon_fuzz::execute::Verdict::Fine(Ok(_))) {
                faults.push(format!("{} {name}: {decoded:?}", target.name));
            }
        }
        inputs = corpus::load(target.name).expect("a corpus");
        for (name, input) in &inputs {
            let verdict = execute(target, input, &scratch).verdict;
            if verdict.fault().is_some() {
                faults.push(format!("{} {name}: {verdict:?}", target.name));
            }
        }
    }
    std::panic::set_hook(hook);
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

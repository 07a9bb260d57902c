//! Extent of a run: rows, cases, data and pictures.

use super::person::Person;
use super::settings::PeopleSettings;
use clap::Args;
use std::path::PathBuf;

/// Extent of a run.
#[derive(Args, Clone, Debug, Default)]
pub struct PeoplePlan {
    /// Folder with bodies, motions and recordings; without it their rows are skipped.
    #[arg(long, value_name = "DIR")]
    pub data: Option<PathBuf>,
    /// Only these rows: unlike, shops, crossing, facing, poses, sides, limb, stills, shared, uva.
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    pub only: Vec<String>,
    /// A fraction of the cases of each row: two minutes instead of many.
    #[arg(long)]
    pub quick: bool,
    /// The third of the cases that is kept apart (every index that leaves 2 when divided by 3), instead of the other two thirds:
    /// nothing is tuned on it.
    #[arg(long)]
    pub unseen: bool,
    /// Folder for a contact sheet per row: depth with true (green) and tracked (red) joints.
    #[arg(long, value_name = "DIR")]
    pub pictures: Option<PathBuf>,
    /// Bounds and placements.
    #[arg(skip)]
    pub settings: PeopleSettings,
}

/// People of the rows `poses` and `sides`.
const PEOPLE: usize = 20;
/// Cases of a quick run: one of this many.
const QUICK: usize = 5;

impl PeoplePlan {
    /// Indices of the cases to measure among `count`.
    pub(super) fn cases(&self, count: usize) -> Vec<usize> {
        let is_wanted = |i: &usize| (i % 3 == 2) == self.unseen;
        let all = (0..count).filter(is_wanted);
        if self.quick {
            all.step_by(QUICK).collect()
        } else {
            all.collect()
        }
    }

    /// The people to measure: `foreign` ones among random shapes of the embedded body, so that each part of the cases
    /// has both.
    pub(super) fn people(&self, foreign: &[Person]) -> Vec<Person> {
        let person = |i: usize| {
            let other = if i % 5 >= 3 {
                foreign.get(2 * (i / 5) + i % 5 - 3)
            } else {
                None
            };
            other
                .cloned()
                .unwrap_or_else(|| Person::random(i, &self.settings))
        };
        self.cases(PEOPLE).into_iter().map(person).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seen_and_unseen_cases_are_all_cases_once() {
        let plan = |unseen, quick| PeoplePlan {
            unseen,
            quick,
            ..PeoplePlan::default()
        };
        let mut all = plan(false, false).cases(20);
        assert_eq!(all.len(), 14);
        all.extend(plan(true, false).cases(20));
        all.sort_unstable();
        assert_eq!(all, (0..20).collect::<Vec<_>>());
        assert!(plan(true, false).cases(0).is_empty());
        assert_eq!(plan(false, true).cases(20).len(), 3);
    }
}

//! Extent of a run: rows, cases, data and pictures.

use super::person::Person;
use std::path::PathBuf;

/// Half of the cases that is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CaseSet {
    /// Two thirds of the cases, for daily work.
    #[default]
    Seen,
    /// The third that is kept apart (every index that leaves 2 when divided by 3): nothing is tuned on it.
    Unseen,
}

/// Settings of the bench.
#[derive(Clone, Debug, Default)]
pub struct PeoplePlan {
    /// Folder with bodies, motions and recordings; rows that need it are skipped without it.
    pub data: Option<PathBuf>,
    /// Cases that are measured; rows on recordings always use all of theirs.
    pub cases: CaseSet,
    /// A few cases of each row only.
    pub quick: bool,
    /// Names of the rows to run; empty for all.
    pub only: Vec<String>,
    /// Folder for one contact sheet per row.
    pub pictures: Option<PathBuf>,
}

/// People of the rows `poses` and `sides`.
const PEOPLE: usize = 20;
/// Cases of a quick run: one of this many.
const QUICK: usize = 5;

impl PeoplePlan {
    /// Indices of the cases to measure among `count`.
    pub(super) fn cases(&self, count: usize) -> Vec<usize> {
        let is_wanted = |i: &usize| (i % 3 == 2) == (self.cases == CaseSet::Unseen);
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
            other.cloned().unwrap_or_else(|| Person::random(i))
        };
        self.cases(PEOPLE).into_iter().map(person).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seen_and_unseen_cases_are_all_cases_once() {
        let plan = |cases| PeoplePlan {
            cases,
            ..PeoplePlan::default()
        };
        let mut all = plan(CaseSet::Seen).cases(20);
        assert_eq!(all.len(), 14);
        all.extend(plan(CaseSet::Unseen).cases(20));
        all.sort_unstable();
        assert_eq!(all, (0..20).collect::<Vec<_>>());
        assert!(plan(CaseSet::Unseen).cases(0).is_empty());
        let quick = PeoplePlan {
            quick: true,
            ..PeoplePlan::default()
        };
        assert_eq!(quick.cases(20).len(), 3);
    }
}

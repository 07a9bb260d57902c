//! Everyone who walks in: people, postures, sides and recordings, one row of bars each.

mod bars;
mod bodies;
mod common_joints;
mod contact_sheet;
mod limb;
mod person;
pub(crate) mod plan;
mod poses;
mod recorded;
mod session;
mod shops;
mod sides;
mod unlike;

pub use bars::{Bar, BarTable};
pub use plan::{CaseSet, PeoplePlan};

use super::EvaluateError;
use bodies::bodies;
use contact_sheet::ContactSheet;
use std::path::Path;
use tryon_synth::Actor;

/// Names of all rows, in the order of the table, each with the folder below the data that it needs.
pub const ROWS: [(&str, Option<&str>); 8] = [
    ("unlike", Some(bodies::FOLDER)),
    ("shops", None),
    ("poses", None),
    ("sides", None),
    ("limb", None),
    ("stills", Some(recorded::STILLS)),
    ("shared", Some(recorded::SHARED)),
    ("uva", Some(recorded::TURN)),
];

/// Frames of each shared sequence in a quick run.
const QUICK_FRAMES: usize = 90;

/// Bare bodies far outside the embedded body's shape space, by name; none without MakeHuman's base mesh in `data`.
///
/// # Errors
/// Names the body whose files cannot be read.
pub fn unlike_actors(data: &Path) -> Result<Vec<(String, Actor)>, EvaluateError> {
    let bare = bodies(Some(data))?.into_iter();
    let bare = bare.filter(|p| !bodies::is_covered(&p.name));
    Ok(bare.map(|p| (p.name, p.actor)).collect())
}

/// Measures the rows of a plan; `done` receives the name of each row after it.
///
/// # Errors
/// Unknown row names, data that cannot be read, pictures that cannot be written.
pub fn run(plan: &PeoplePlan, mut done: impl FnMut(&str)) -> Result<BarTable, EvaluateError> {
    if let Some(name) = plan.only.iter().find(|n| !ROWS.iter().any(|r| r.0 == **n)) {
        let known: Vec<&str> = ROWS.iter().map(|r| r.0).collect();
        return Err(EvaluateError::Scene {
            scene: name.clone(),
            why: format!("no such row; there are {}", known.join(", ")),
        });
    }
    let mut table = BarTable::default();
    let data = plan.data.as_deref();
    for (row, folder) in ROWS {
        if !plan.only.is_empty() && !plan.only.iter().any(|n| n == row) {
            continue;
        }
        let path = folder.map(|f| data.map(|d| d.join(f)));
        if let Some(path) = path.filter(|p| !p.as_ref().is_some_and(|p| p.exists())) {
            let why = path.map_or("no data".to_owned(), |p| {
                format!("{} is missing", p.display())
            });
            table.skipped.push(format!("{row}: {why}"));
            continue;
        }
        let mut sheet = ContactSheet::default();
        table.bars.extend(measure(plan, row, &mut sheet)?);
        if let Some(dir) = &plan.pictures {
            sheet.write(dir, row)?;
        }
        done(row);
    }
    Ok(table)
}

fn measure(
    plan: &PeoplePlan,
    row: &str,
    sheet: &mut ContactSheet,
) -> Result<Vec<Bar>, EvaluateError> {
    let data = plan.data.as_deref();
    let recorded = data.unwrap_or(Path::new(""));
    let people = || Ok::<_, EvaluateError>(plan.people(&bodies(data)?));
    match row {
        "unlike" => {
            let all = bodies(data)?;
            let cases = plan.cases(all.len());
            let people: Vec<_> = cases.into_iter().map(|i| all[i].clone()).collect();
            unlike::measure(recorded, &people, plan.quick, sheet)
        }
        "shops" => Ok(shops::measure(&plan.cases(shops::ROOMS), sheet)),
        "limb" => Ok(limb::measure(&plan.cases(limb::CASES), sheet)),
        "poses" => Ok(poses::measure(&people()?, sheet)),
        "sides" => Ok(sides::measure(&people()?, sheet)),
        "stills" => recorded::stills(recorded),
        "shared" => {
            let frames = if plan.quick { QUICK_FRAMES } else { usize::MAX };
            recorded::shared(recorded, frames)
        }
        _ => recorded::turn(recorded),
    }
}

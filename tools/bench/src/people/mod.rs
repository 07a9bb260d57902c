//! Everyone who walks in: people, postures, sides and recordings, one row of bars each.

mod bars;
mod bodies;
mod common_joints;
mod contact_sheet;
mod crossing;
mod facing;
mod limb;
mod person;
pub(crate) mod plan;
mod poses;
mod recorded;
mod session;
mod settings;
mod shops;
mod sides;
pub(crate) mod stills;
mod unlike;

pub use bars::{Bar, BarTable};
pub use plan::PeoplePlan;
pub use settings::PeopleSettings;

use super::EvaluateError;
use bodies::bodies;
use contact_sheet::ContactSheet;
use std::path::Path;

/// Names of all rows, in the order of the table, each with the folder below the data that it needs.
pub const ROWS: [(&str, Option<&str>); 10] = [
    ("unlike", Some(bodies::FOLDER)),
    ("shops", None),
    ("crossing", None),
    ("facing", None),
    ("poses", None),
    ("sides", None),
    ("limb", None),
    ("stills", Some(stills::STILLS)),
    ("shared", Some(recorded::SHARED)),
    ("uva", Some(recorded::TURN)),
];

/// Frames of each shared sequence in a quick run.
const QUICK_FRAMES: usize = 90;

/// Measures the rows of a plan; `done` receives the name of each row after it.
///
/// # Errors
/// Unknown row names, data that cannot be read, pictures that cannot be written.
pub fn run(plan: &PeoplePlan, mut done: impl FnMut(&str)) -> Result<BarTable, EvaluateError> {
    if let Some(name) = plan.only.iter().find(|n| !ROWS.iter().any(|r| r.0 == **n)) {
        let known: Vec<&str> = ROWS.iter().map(|r| r.0).collect();
        return Err(EvaluateError::new(
            name,
            format!("no such row; there are {}", known.join(", ")),
        ));
    }
    let mut table = BarTable {
        command: crate::table::command_line(),
        ..BarTable::default()
    };
    let data = plan.data.as_deref();
    for (row, folder) in ROWS {
        if !plan.only.is_empty() && !plan.only.iter().any(|n| n == row) {
            continue;
        }
        if let Some(folder) = folder {
            let path = data.map(|d| d.join(folder));
            if !path.is_some_and(|p| p.exists()) {
                table.skipped.push(format!("{row}: no folder {folder}"));
                continue;
            }
        }
        let mut sheet = ContactSheet::default();
        let bars = measure(plan, row, &mut sheet)?;
        table.bars.extend(bars.into_iter().map(|bar| bar.of(row)));
        if let Some(dir) = &plan.pictures {
            sheet.write(&dir.join(format!("{row}.png")))?;
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
    let settings = &plan.settings;
    let data = plan.data.as_deref();
    let recorded = data.unwrap_or(Path::new(""));
    let people = || Ok::<_, EvaluateError>(plan.people(&bodies(data)?));
    match row {
        "unlike" => {
            let all = bodies(data)?;
            let cases = plan.cases(all.len());
            let people: Vec<_> = cases.into_iter().map(|i| all[i].clone()).collect();
            unlike::measure(plan, recorded, &people, sheet)
        }
        "shops" => Ok(shops::measure(settings, &plan.cases(shops::ROOMS), sheet)),
        "crossing" => Ok(crossing::measure(
            settings,
            &plan.cases(crossing::CASES),
            sheet,
        )),
        "facing" => Ok(facing::measure(settings, &plan.cases(facing::ROOMS), sheet)),
        "limb" => Ok(limb::measure(settings, &plan.cases(limb::CASES), sheet)),
        "poses" => Ok(poses::measure(settings, &people()?, sheet)),
        "sides" => Ok(sides::measure(settings, &people()?, sheet)),
        "stills" => stills::measure(settings, recorded),
        "shared" => {
            let frames = if plan.quick { QUICK_FRAMES } else { usize::MAX };
            recorded::shared(recorded, frames)
        }
        _ => recorded::turn(recorded),
    }
}

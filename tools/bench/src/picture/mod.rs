//! The composed picture against truth and against its photo: borders, shimmer, grain and edges, own clothes left.

mod border;
mod edge_width;
mod film;
mod gallery;
mod luma;
mod noise;
mod own_cloth;
mod person_truth;
mod photo_match;
mod plan;
mod shimmer;
mod signal;
mod visibility;

pub use plan::PicturePlan;

use super::{EvaluateError, Row, Table};
use plan::{Progress, cases};

fn fault(why: impl ToString) -> EvaluateError {
    EvaluateError::new("picture", why)
}

/// Measures the rows of a plan; `progress` receives each.
///
/// # Errors
/// No row of such a name; a recording, garment or folder at fault.
pub fn measure_picture(
    plan: &PicturePlan,
    mut progress: impl FnMut(&Row),
) -> Result<Table, EvaluateError> {
    let mut table = Table::new("picture", "composing a picture");
    let mut all = cases(plan.data.as_deref());
    if !plan.only.is_empty() {
        let known: Vec<String> = all.iter().map(|(name, _)| name.clone()).collect();
        all.retain(|(name, _)| plan.only.iter().any(|o| name.contains(o.as_str())));
        if all.is_empty() {
            return Err(fault(format!(
                "no such row; there are {}",
                known.join(", ")
            )));
        }
    }
    for (name, case) in all {
        let row = case.measure(&Progress { plan, name: &name })?;
        progress(&row);
        table.rows.push(row);
    }
    Ok(table)
}

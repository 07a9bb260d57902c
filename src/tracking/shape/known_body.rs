//! Body of a subject that was measured before, and the bounds of what a tracker reports.

use super::size::{MOST_DEVIATIONS, SCALES};
use tryon_body::{BodyShape, Template};

/// Size, shape and fit of a subject that was measured before.
#[derive(Clone, Debug, PartialEq)]
pub struct KnownBody {
    /// [`TrackerState::subject`](crate::TrackerState::subject) at that time.
    pub subject: u64,
    /// Settled shape.
    pub shape: BodyShape,
    /// Residual of its fits, metres.
    pub residual: f64,
}

/// Fault of a shape that no tracker reports.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{part}: {why}")]
pub struct ShapeFault {
    /// Part of the shape, with the index of the number at fault.
    pub part: String,
    /// Reason.
    pub why: String,
}

/// Largest displacement of a known body, metres: four times what one reading can show.
const MOST_DISPLACEMENT: f32 = 0.2;
/// Heights of known bodies at rest, metres: beyond them a shape within its bounds is degenerate.
const HEIGHTS: std::ops::RangeInclusive<f32> = 0.5..=2.6;

impl KnownBody {
    /// Checks that a tracker of `template` may have reported this shape.
    ///
    /// # Errors
    /// Names the number that is out of bounds; a shape of numbers within bounds may still be no body.
    pub fn check(&self, template: &Template) -> Result<(), ShapeFault> {
        let shape = &self.shape;
        let displacements: Vec<f64> = shape.displacements.iter().map(|d| f64::from(*d)).collect();
        let most = f64::from(MOST_DISPLACEMENT);
        within(
            "coefficients",
            &shape.coefficients,
            [-MOST_DEVIATIONS, MOST_DEVIATIONS],
        )?;
        within("bone_scales", &shape.bone_scales, SCALES)?;
        within("displacements", &displacements, [-most, most])?;
        let heights = template.personalise(shape).base.into_iter().map(|p| p.y);
        let (low, high) = heights.fold((f32::MAX, f32::MIN), |(l, h), y| (l.min(y), h.max(y)));
        if !HEIGHTS.contains(&(high - low)) {
            return Err(ShapeFault {
                part: "coefficients".into(),
                why: format!("a body of {:.2} m is none", high - low),
            });
        }
        Ok(())
    }
}

/// Checks that all values of a part lie within bounds.
fn within(part: &str, values: &[f64], [low, high]: [f64; 2]) -> Result<(), ShapeFault> {
    match values.iter().position(|v| !(low..=high).contains(v)) {
        Some(at) => Err(ShapeFault {
            part: format!("{part}[{at}]"),
            why: format!("from {low} to {high}"),
        }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_scene::TestScene;

    #[test]
    fn a_shape_that_is_no_body_is_refused_by_part() {
        let template = TestScene::new(50, 480).model.template;
        let known = |coefficients: Vec<f64>| KnownBody {
            subject: 1,
            shape: BodyShape {
                coefficients,
                ..BodyShape::default()
            },
            residual: 0.002,
        };
        assert_eq!(known(Vec::new()).check(&template), Ok(()));
        for (spoilt, part) in [
            (vec![0.0, f64::NAN], "coefficients[1]"),
            (vec![8.1], "coefficients[0]"),
        ] {
            let fault = known(spoilt).check(&template).expect_err(part);
            assert_eq!(fault.part, part);
        }
        let mut scaled = known(Vec::new());
        scaled.shape.bone_scales = vec![0.5; template.skeleton().len()];
        let low = vec![-8.0; template.shape_space().map_or(0, |s| s.names.len())];
        scaled.shape.coefficients = low;
        let fault = scaled.check(&template).expect_err("a gnome");
        assert_eq!(fault.part, "coefficients", "{fault}");
    }
}

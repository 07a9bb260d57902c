//! Garments on one subject over time: measured → sized → put on → stepped → sized anew or past mending.
//!
//! The one state machine of worn garments: command line, demo and cloth service use it.

use super::choice::{Choice, SizedGarment};
use super::clock::{FrameClock, time_step};
use super::error::MirrorError;
use super::outfit::{DressedOutfit, PutOn, Subject};
use tryon_body::measure::{Measurements, measure};
use tryon_cloth::{ClothError, StepReport};
use tryon_geometry::math::P3;

/// Worn sizes against those of the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SizeState {
    /// The size of the body has not settled.
    Provisional,
    /// Sizes of the settled body.
    Settled,
    /// The settled body asks for other sizes: the garments are to be put on anew.
    Misfit,
}

/// Chosen garments on a subject.
#[derive(Debug)]
pub struct Wear {
    choices: Vec<Choice>,
    outfit: DressedOutfit,
    /// Body that the sizes were last compared with.
    measures: Measurements,
    sizes: SizeState,
    notes: Vec<String>,
    clock: FrameClock,
}

/// One step of the worn garments.
#[derive(Debug)]
pub struct WearStep {
    /// Report of the cloth.
    pub report: StepReport,
    /// Time of the stream since the last step (s).
    pub gap: f64,
}

impl Wear {
    /// Puts the choices on in the sizes of the subject, whose size `is_sized` if it has settled. Takes about half a second;
    /// [`Self::follow`] is to come next.
    ///
    /// # Errors
    /// A body that cannot be measured; faults of the garments; without `how.any_size` a garment that does not fit.
    pub fn put_on(
        choices: Vec<Choice>,
        subject: &Subject<'_>,
        is_sized: bool,
        how: PutOn,
    ) -> Result<Self, MirrorError> {
        let measures = measure(subject.template, subject.rest)?;
        let sized = sized(&choices, &measures)?;
        let notes = notes(&sized);
        let outfit = DressedOutfit::put_on(subject, sized, how).map_err(MirrorError::Dress)?;
        let sizes = if is_sized {
            SizeState::Settled
        } else {
            SizeState::Provisional
        };
        Ok(Self {
            choices,
            outfit,
            measures,
            sizes,
            notes,
            clock: FrameClock::default(),
        })
    }

    /// Follows the subject to a new exposure: carries garments that were just put on to its pose, and compares the sizes
    /// once that of the subject `is_sized`. True when they were compared now.
    ///
    /// # Errors
    /// A body that cannot be measured, of another size or with a vertex that is not finite.
    pub fn follow(&mut self, subject: &Subject<'_>, is_sized: bool) -> Result<bool, MirrorError> {
        self.outfit.carry_to(subject)?;
        let is_due = is_sized && self.sizes == SizeState::Provisional;
        if is_due {
            self.measures = measure(subject.template, subject.rest)?;
            let sized = sized(&self.choices, &self.measures)?;
            self.sizes = if self.outfit.is_in(&sized) {
                SizeState::Settled
            } else {
                SizeState::Misfit
            };
            self.notes = notes(&sized);
        }
        Ok(is_due)
    }

    /// Steps the garments to the posed body (world, metres) of an exposure at `time_ns`.
    ///
    /// # Errors
    /// A body of another size or with a vertex that is not finite.
    pub fn step(&mut self, body: &[P3], time_ns: u64) -> Result<WearStep, ClothError> {
        let gap = self.clock.gap(time_ns);
        let report = self.outfit.step(body, time_step(gap))?;
        Ok(WearStep { report, gap })
    }

    /// The garments as they are put on, with their state.
    pub fn outfit(&self) -> &DressedOutfit {
        &self.outfit
    }

    /// Measures of the body that the sizes were last compared with.
    pub fn measures(&self) -> &Measurements {
        &self.measures
    }

    /// Worn sizes against those of the body.
    pub fn sizes(&self) -> SizeState {
        self.sizes
    }

    /// Remarks about sizes and meshes.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }
}

/// Garments in the sizes of a body.
fn sized(choices: &[Choice], body: &Measurements) -> Result<Vec<SizedGarment>, MirrorError> {
    let sized = choices.iter().map(|c| c.sized(body));
    Ok(sized.collect::<Result<_, _>>()?)
}

/// Remarks of all garments.
fn notes(sized: &[SizedGarment]) -> Vec<String> {
    sized.iter().flat_map(|g| g.notes.iter().cloned()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_body::{BodyShape, Pose, embedded};
    use tryon_geometry::math::Rigid;

    #[test]
    fn provisional_sizes_are_compared_once_when_the_body_has_settled() {
        let template = embedded::template();
        let pose = Pose::rest(template.skeleton(), Rigid::identity());
        let small = template.personalise(&BodyShape::default());
        let large = template.personalise(&BodyShape {
            coefficients: vec![0.0, 2.5],
            ..BodyShape::default()
        });
        let of = |rest| Subject {
            template: &template,
            rest,
            pose: &pose,
            world_from_camera: Rigid::identity(),
        };
        let tank = || vec![Choice::library("tank", None).expect("known")];
        let put_on =
            |is_sized| Wear::put_on(tank(), &of(&small), is_sized, PutOn::default()).expect("worn");

        let mut settled = put_on(true);
        assert!(!settled.follow(&of(&large), true).expect("followed"));
        assert_eq!(settled.sizes(), SizeState::Settled);

        for (rest, after) in [(&small, SizeState::Settled), (&large, SizeState::Misfit)] {
            let mut wear = put_on(false);
            assert!(!wear.follow(&of(rest), false).expect("followed"));
            assert_eq!(wear.sizes(), SizeState::Provisional);
            assert!(wear.follow(&of(rest), true).expect("followed"));
            assert!(!wear.follow(&of(rest), true).expect("followed"));
            assert_eq!(wear.sizes(), after);
            assert_eq!(wear.notes().len(), 1);
        }
    }
}

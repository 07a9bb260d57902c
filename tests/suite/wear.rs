//! Outfits that are put on again: jumps of the body, and cloth that is past mending.

use crate::common::{DT, arms_down, posed};
use tryon::body::measure::measure;
use tryon::body::{BodyShape, Pose, RestBody, Template, embedded};
use tryon::cloth::{StepReport, WornReference};
use tryon::geometry::math::order_statistics::percentile;
use tryon::geometry::math::{Rigid, V3, World};
use tryon::mirror::{Choice, DressedOutfit, PutOn, Subject};

struct Fitting {
    template: Template,
    rest: RestBody,
    outfit: DressedOutfit,
}

/// A pullover on the mean body with its arms down.
fn fitting() -> Fitting {
    fitting_of(PutOn::default())
}

fn fitting_of(how: PutOn) -> Fitting {
    let template = embedded::template();
    let rest = template.personalise(&BodyShape::default());
    let measures = measure(&template, &rest).expect("measures");
    let choice = Choice::library("longsleeve", None).expect("a garment");
    let subject = Subject {
        template: &template,
        rest: &rest,
        pose: &arms_down(&template, &rest),
        world_from_camera: Rigid::identity(),
    };
    let worn = vec![choice.sized(&measures).expect("a size")];
    let mut outfit = DressedOutfit::put_on(&subject, worn, how).expect("dressed");
    assert!(outfit.carry_to(&subject).expect("a body") > 0);
    assert_eq!(outfit.carry_to(&subject), Ok(0), "it is there");
    Fitting {
        template: (*template).clone(),
        rest,
        outfit,
    }
}

impl Fitting {
    /// One step on a pose; what is measured of it.
    fn step(&mut self, pose: &Pose<World>) -> StepReport {
        let body = posed(&self.template, &self.rest, pose);
        self.outfit.step(&body, DT).expect("a step")
    }
}

#[test]
fn coarse_garments_have_fewer_vertices_and_skin_carries_them_along() {
    let fine = fitting();
    let coarse = fitting_of(PutOn {
        is_coarse: true,
        ..PutOn::default()
    });
    let count = |f: &Fitting| f.outfit.state.garments[0].positions.len() as f64;
    let ratio = count(&fine) / count(&coarse);
    assert!((1.8..3.5).contains(&ratio), "{ratio}");

    let mut raised = arms_down(&fine.template, &fine.rest);
    raised.lower_arms(fine.template.skeleton(), &fine.rest, -0.2);
    let body = posed(&fine.template, &fine.rest, &raised);
    let skinned = coarse.outfit.skinned(&body).expect("a body");
    let mut stepped = coarse;
    for _ in 0..30 {
        stepped.outfit.step(&body, DT).expect("a step");
    }
    let simulated = &stepped.outfit.state.garments[0].positions;
    let mut offsets: Vec<f32> = (skinned[0].iter().zip(simulated))
        .map(|(a, b)| (a - b).norm())
        .collect();
    let [median, largest] = [50, 100].map(|p| percentile(&mut offsets, p).expect("vertices"));
    // 35 and 64 mm: cloth that hangs freely swings on.
    assert!(median < 0.045 && largest < 0.1, "{median} m, {largest} m");
    assert!(stepped.outfit.skinned(&body[1..]).is_err(), "another body");
}

#[test]
fn arms_that_jump_have_their_sleeves_on_them_in_the_same_step() {
    let mut f = fitting();
    let down = arms_down(&f.template, &f.rest);
    f.step(&down);
    let reference = WornReference::new(&f.outfit.model, &f.outfit.state);

    let mut raised = down.clone();
    raised.lower_arms(f.template.skeleton(), &f.rest, -0.6);
    let report = f.step(&raised);
    assert!(report.p99_strain < 0.25, "{}", report.p99_strain);
    let offset = reference.limb_offset(&f.outfit.model, &f.outfit.state);
    assert!(offset < 0.05, "sleeves are {offset} m off the arms");
}

#[test]
fn a_sleeve_that_is_caught_is_put_on_again_in_the_same_step() {
    let mut f = fitting();
    let down = arms_down(&f.template, &f.rest);
    f.step(&down);
    let body = posed(&f.template, &f.rest, &down);
    let reference = WornReference::new(&f.outfit.model, &f.outfit.state);
    let arm = f.rest.vertices.iter().map(|p| p.x).fold(0.0, f32::max);

    for step in 0..12 {
        for p in &mut f.outfit.state.garments[0].positions {
            if p.x > 0.25 * arm {
                *p += V3::new(0.4, 0.4, 0.3);
            }
        }
        f.outfit.step(&body, DT).expect("a step");
        let (model, state) = (&f.outfit.model, &f.outfit.state);
        let offset = reference.limb_offset(model, state);
        assert!(
            offset < 0.05,
            "step {step}: the sleeve is {offset} m off the arm"
        );
    }
}

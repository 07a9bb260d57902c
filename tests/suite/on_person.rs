//! Sleeves on fast arms: garments off the recorded person in pictures of whole sequences.

use crate::common::shared;
use tryon::body::embedded;
use tryon::composite::OffPerson;
use tryon::formats::open_recording;
use tryon::mirror::{Choice, Mirror};

/// Share of the dressed pictures of Charleston with more than [`OffPerson::LIMIT`] off the person, at most.
const CHARLESTON_ABOVE: f64 = 1.0;
/// The same of jumping jacks.
const JACKS_ABOVE: f64 = 1.0;

/// Share of a sequence's dressed pictures in which a long-sleeved shirt hangs off the person; `None` without the data.
fn share_above(sequence: &str) -> Option<f64> {
    let mut recording = open_recording(&shared(sequence)?).expect("a recording");
    let choices = vec![Choice::library("longsleeve", None).expect("a garment")];
    let mut mirror = Mirror::new(embedded::template(), recording.calibration(), choices);
    mirror.set_off_person_interval(0.0);
    let (mut shares, mut cost_ms) = (Vec::new(), Vec::new());
    while let Some(frame) = recording.next_frame().expect("a frame") {
        let seen = mirror.step(&frame).expect("a picture");
        let off = seen.render.off_person;
        assert!(seen.is_dressed || off.is_none(), "no garment is in sight");
        shares.extend(off.map(|off| f64::from(off.share)));
        let stages = seen.render.stages_ms.iter();
        cost_ms.extend(stages.filter(|s| s.0 == "off person").map(|s| s.1));
    }
    let above = shares.iter().filter(|s| **s > f64::from(OffPerson::LIMIT));
    let above = above.count() as f64 / shares.len() as f64;
    cost_ms.sort_by(f32::total_cmp);
    println!(
        "{sequence}: {} pictures, {:.1} % of the shirt off the person, {:.0} % of pictures above the limit; {:.2} ms a measurement",
        shares.len(),
        shares.iter().sum::<f64>() / shares.len() as f64 * 1e2,
        above * 1e2,
        cost_ms[cost_ms.len() / 2]
    );
    assert!(shares.len() > 60, "{} pictures", shares.len());
    Some(above)
}

#[test]
fn sleeves_stay_on_the_arms_of_a_dancer() {
    let above = share_above("sequences/charleston_m_heavy_tof_room");
    assert!(
        above.is_none_or(|share| share <= CHARLESTON_ABOVE),
        "{above:?}"
    );
}

#[test]
fn sleeves_stay_on_the_arms_of_jumping_jacks() {
    let above = share_above("sequences/jacks_f_avg_kinect1_room");
    assert!(above.is_none_or(|share| share <= JACKS_ABOVE), "{above:?}");
}

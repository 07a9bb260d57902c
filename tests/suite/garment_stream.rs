//! Garments on a moving subject, coded and read back.

use tryon::cloth::{self, Input};
use tryon::dressing::{DressOptions, dress};
use tryon::formats::{POSITION_STEP, PositionCoder};
use tryon::garment::{Size, library};
use tryon::geometry::math::P3;
use tryon::synth::{Actor, Sequence, Setting};

/// Bytes a vertex and frame that a stream may take (the goal is 2).
const MOST: f64 = 4.0;

#[test]
fn moving_garments_take_few_bytes_and_lose_nothing() {
    let sequence = Sequence::new(Actor::default(), Setting::default());
    let world_from_camera = sequence.setting().world_from_camera;
    let template = &sequence.actor().template;
    let body = |i: u64| {
        let truth = sequence.truth(i);
        let mut world: Vec<P3> = Vec::new();
        world_from_camera.points_f32(&truth.vertices, &mut world);
        (truth.pose.transformed(&world_from_camera), world)
    };
    // From the second in which the arms are raised.
    let begin = 150;
    let patterns = ["tshirt", "skirt"].map(|name| library::pattern(name, Size::default()).unwrap());
    let mut dressed = dress(
        template,
        sequence.rest(),
        &body(begin).0,
        &patterns,
        &DressOptions::default(),
    )
    .unwrap();
    let meshes = &dressed.model.outfit.garments;
    let coder = |k: usize| PositionCoder::new(meshes[k].vertices, &meshes[k].faces);
    let mut ends: Vec<_> = (0..meshes.len()).map(|k| (coder(k), coder(k))).collect();
    let mut work = cloth::Workspace::default();
    let (mut first, mut later, mut vertices, frames) = (0, 0, 0, 60);
    for i in 0..frames {
        let input = Input {
            body: &body(begin + i).1,
            dt: 1.0 / 30.0,
        };
        cloth::step(&dressed.model, &mut dressed.state, &input, &mut work).unwrap();
        for (g, (tx, rx)) in dressed.state.garments.iter().zip(&mut ends) {
            let bytes = tx.encode(&g.positions).unwrap();
            let read = rx.decode(&bytes).unwrap();
            let worst = read
                .iter()
                .zip(&g.positions)
                .map(|(a, b)| (a - b).amax())
                .fold(0.0, f32::max);
            assert!(
                f64::from(worst) <= 0.5 * POSITION_STEP + 1e-6,
                "frame {i}: {worst} m"
            );
            if i == 0 {
                first += bytes.len();
                vertices += g.positions.len();
            } else {
                later += bytes.len();
            }
        }
    }
    let (first, later) = (
        first as f64 / vertices as f64,
        later as f64 / ((frames - 1) as f64 * vertices as f64),
    );
    println!("{vertices} vertices: {first:.2} bytes a vertex in the keyframe, {later:.2} later");
    assert!(
        later <= MOST && first <= 2.0 * MOST,
        "{first} and {later} bytes a vertex"
    );
}

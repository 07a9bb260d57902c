//! Own clothes that stick out of a garment, against a scene that was seen before.

use super::fixture::{RED, SKIN, Scenery};
use crate::{Model, RenderReport, State, Workspace, render};
use tryon_geometry::camera::{ColorImage, RgbdFrame};

/// Exposures in which the scene is seen whole.
const EXPOSURES: u64 = 8;

/// The dressed picture after the scene was seen without the person, or at once.
fn draw(scenery: &Scenery, empty: Option<&RgbdFrame>) -> (ColorImage, RenderReport) {
    let (mut state, mut work) = (State::default(), Workspace::default());
    let garments = [scenery.garment()];
    if let Some(empty) = empty {
        for sequence in 0..EXPOSURES {
            let frame = RgbdFrame {
                sequence,
                ..empty.clone()
            };
            let input = crate::Input {
                frame: &frame,
                body: None,
                garments: &[],
                ..scenery.input(&garments, None)
            };
            render(&Model::default(), &mut state, &input, &mut work).expect("the scene");
        }
    }
    let frame = RgbdFrame {
        sequence: EXPOSURES,
        ..scenery.frame.clone()
    };
    let input = crate::Input {
        frame: &frame,
        ..scenery.input(&garments, None)
    };
    render(&Model::default(), &mut state, &input, &mut work).expect("drawn")
}

/// Pixels within 30 grey levels of a colour.
fn pixels_like(image: &ColorImage, color: [u8; 3]) -> usize {
    let is_like = |c: &&[u8]| (0..3).all(|k| c[k].abs_diff(color[k]) < 30);
    image.data().chunks_exact(3).filter(is_like).count()
}

#[test]
fn own_clothes_become_the_scene_and_sleeves_skin() {
    let (scenery, empty) = Scenery::loose(3, RED);
    let captured = pixels_like(scenery.frame.color.as_ref().expect("colour"), RED);
    let (image, report) = draw(&scenery, Some(&empty));
    let told = report.own_clothes.expect("own clothes");
    // Own cloth below the shirt lies on the body and becomes skin.
    let (bare, left) = (captured - report.pixels_drawn, pixels_like(&image, RED));
    assert!(left * 10 < bare, "{left} of {bare}, {told:?}");
    assert!(told.by_scene > 1000 && told.by_skin > 3000, "{told:?}");
    assert!(told.left * 20 < told.by_scene + told.by_skin, "{told:?}");
    let skin = pixels_like(&image, SKIN);
    assert!(skin > pixels_like(&scenery.frame.color.expect("colour"), SKIN) + 3000);
}

#[test]
fn a_scene_never_seen_leaves_own_clothes_and_says_so() {
    let (scenery, _) = Scenery::loose(3, RED);
    let (image, report) = draw(&scenery, None);
    let told = report.own_clothes.expect("own clothes");
    assert!(
        told.left > 1000 && told.by_scene < told.left / 4,
        "{told:?}"
    );
    assert!(pixels_like(&image, RED) > 1000);
}

#[test]
fn clothes_of_the_colour_of_skin_and_a_bare_trunk_are_left_alone() {
    let (scenery, empty) = Scenery::loose(3, SKIN);
    let (_, report) = draw(&scenery, Some(&empty));
    assert_eq!(report.own_clothes, None);
}

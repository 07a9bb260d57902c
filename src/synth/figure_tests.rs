//! The display figure: its face, its truth, its picture in the studio.

use super::*;
use crate::{Actor, ColorImaging, NoiseModel, Sequence, Setting};
use tryon_body::embedded;
use tryon_geometry::math::V3;

/// A figure's rest body and paint.
fn figure() -> (RestBody, FigurePaint) {
    let sequence = Sequence::new(Actor::figure(), Setting::studio().with_wide_color(720));
    let rest = sequence.rest().clone();
    let paint = FigurePaint::new(&embedded::template(), &rest, &FigureSettings::default());
    (rest, paint)
}

/// Vertices of the head in front of the ears, with a margin to the hairline.
fn face(rest: &RestBody, paint: &FigurePaint) -> Vec<usize> {
    let template = embedded::template();
    let is_face = |i: &usize| head_share(&template, *i) > 0.9 && paint.borders[*i].hair < -HEM;
    (0..rest.base.len()).filter(is_face).collect()
}

#[test]
fn face_has_one_color_and_no_features() {
    let (rest, paint) = figure();
    let face = face(&rest, &paint);
    assert!(face.len() > 300, "{} vertices", face.len());
    let material = |i: &usize| paint.material([*i as u32; 3], [1.0, 0.0, 0.0]);
    assert!(face.iter().all(|i| material(i) == paint.skin));

    // A nose or an eye is a place where neighbours' normals part, between chin and crown and off the temples.
    let template = embedded::template();
    let around = template.topology().vertex_neighbours();
    let bend = |i: &usize| {
        let near = around.row(*i).iter();
        let cosines = near.map(|n| rest.normals[*i].dot(&rest.normals[*n as usize]));
        cosines.fold(1.0, f32::min)
    };
    let head = template.skeleton().index("head").unwrap_or(0);
    let is_inner = |i: &&usize| {
        let p = rest.base[**i];
        p.x.abs() < 0.06 && f64::from(p.y) > rest.joints[head].y - 0.02
    };
    let sharpest = face.iter().filter(is_inner).map(bend).fold(1.0, f32::min);
    assert!(sharpest > 0.93, "{sharpest}");
}

#[test]
fn base_layer_and_hair_are_where_they_belong() {
    let (rest, paint) = figure();
    let template = embedded::template();
    let at = |name: &str, offset: V3| {
        let joint = rest.joints[template.skeleton().index(name).unwrap_or(0)];
        let p = joint.coords.cast::<f32>() + offset;
        let away = |i: &usize| (rest.base[*i].coords - p).norm();
        let all = 0..rest.base.len();
        all.min_by(|a, b| away(a).total_cmp(&away(b))).unwrap_or(0)
    };
    let material = |i: usize| paint.material([i as u32; 3], [1.0, 0.0, 0.0]);
    let ahead = V3::new(0.0, 0.0, 0.2);
    assert_eq!(material(at("spine2", ahead)), paint.top);
    assert_eq!(material(at("left_knee", ahead)), paint.leggings);
    assert_eq!(material(at("left_wrist", ahead)), paint.skin);
    assert_eq!(material(at("left_foot", ahead)), paint.skin);
    assert_eq!(material(at("left_elbow", ahead)), paint.skin);
    assert_eq!(material(at("head", V3::new(0.0, 0.12, -0.2))), paint.hair);
}

/// Joints are those of the shape; the surface that depth shows is the surface of the truth.
#[test]
fn truth_of_a_figure_is_the_surface_that_the_cameras_see() {
    let setting = Setting {
        noise: NoiseModel::None,
        ..Setting::studio().with_wide_color(720)
    };
    let sequence = Sequence::new(Actor::figure(), setting);
    let template = embedded::template();
    let plain = template.personalise(&Actor::figure().shape);
    assert_eq!(sequence.rest().joints, plain.joints);
    let [low, high] = [f32::min, f32::max].map(|f| {
        let heights = sequence.rest().base.iter().map(|p| p.y);
        heights.reduce(f).unwrap_or(0.0)
    });
    assert!((1.68..1.86).contains(&(high - low)), "{}", high - low);

    let (frame, truth) = sequence.frame(40);
    let k = sequence.setting().camera;
    let on = truth.vertices.iter().filter(|v| {
        let p = k.project(v);
        let z = f32::from(frame.depth.at(p.x.round() as i32, p.y.round() as i32)) * 1e-3;
        (v.z - z).abs() < 0.01
    });
    assert!(on.count() * 4 > truth.vertices.len());
}

/// More samples soften edges and change nothing else.
#[test]
fn samples_soften_edges_only() {
    let picture = |samples: u32| {
        let setting = Setting {
            imaging: ColorImaging {
                samples,
                grain: 0.0,
            },
            ..Setting::studio().with_wide_color(720)
        };
        let (frame, _) = Sequence::new(Actor::figure(), setting).frame(0);
        frame.color.expect("colour")
    };
    let (hard, soft) = (picture(1), picture(2));
    assert_eq!((hard.width(), hard.height()), (1280, 720));
    let pairs = hard.data().chunks(3).zip(soft.data().chunks(3));
    let differs = |(a, b): &(&[u8], &[u8])| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > 12);
    let edges = pairs.filter(differs).count();
    assert!((300..9_000).contains(&edges), "{edges} pixels");
}

//! Light of the room on synthetic people in known lights: its direction, and the colour of a grey card held to the camera.

use nalgebra::Matrix3;
use tryon::body::parts::BodySegment;
use tryon::geometry::camera::{ColorImage, RgbdFrame};
use tryon::geometry::math::order_statistics::median;
use tryon::geometry::math::{P3, V3};
use tryon::geometry::par::Par;
use tryon::geometry::raster::{Cull, Options, View, VisibilityBuffer, rasterise_with};
use tryon::synth::{Actor, Sequence, Setting, Truth};
use tryon::view::{
    Appearance, BodyView, GarmentView, Input, Limbs, Model, State, Workspace, render,
};

/// Light on a white surface of normal n, by channel: mean × (1 + slope·n).
struct KnownLight {
    mean: [f32; 3],
    slope: V3,
}

/// From above, from a window at either side, from behind the camera; warm, neutral, cold; dim and bright.
const LIGHTS: [([f32; 3], [f32; 3]); 6] = [
    ([0.45, 0.45, 0.45], [0.0, -0.6, -0.3]),
    ([0.60, 0.52, 0.44], [0.5, -0.3, -0.3]),
    ([0.30, 0.32, 0.36], [-0.6, -0.2, -0.3]),
    ([0.70, 0.70, 0.66], [0.2, -0.2, -0.6]),
    ([0.24, 0.20, 0.17], [-0.3, -0.6, -0.2]),
    ([0.40, 0.44, 0.52], [0.6, 0.0, -0.4]),
];
/// Reflectances: walls, skin, shirt, trousers.
const WALL: [f32; 3] = [0.55, 0.54, 0.51];
const SKIN: [f32; 3] = [0.36, 0.22, 0.15];
const SHIRT: [f32; 3] = [0.10, 0.16, 0.30];
const LEGS: [f32; 3] = [0.06, 0.06, 0.07];
/// Spread of reflectance within a region: folds, prints.
const UNEVEN: f32 = 0.2;

fn to_srgb(light: f32) -> u8 {
    let l = light.clamp(0.0, 1.0);
    let c = if l <= 0.003_130_8 {
        12.92 * l
    } else {
        1.055 * l.powf(1.0 / 2.4) - 0.055
    };
    (255.0 * c).round() as u8
}

/// CIE 1976 L*a*b* of linear sRGB (D65).
fn lab(rgb: [f32; 3]) -> V3 {
    let xyz = Matrix3::new(
        0.4124, 0.3576, 0.1805, 0.2126, 0.7152, 0.0722, 0.0193, 0.1192, 0.9505,
    ) * V3::from(rgb);
    let f = |t: f32| {
        if t > 0.008_856 {
            t.cbrt()
        } else {
            7.787 * t + 16.0 / 116.0
        }
    };
    let [x, y, z] = [xyz.x / 0.9505, xyz.y, xyz.z / 1.089].map(f);
    V3::new(116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z))
}

fn reflectance(segment: BodySegment) -> [f32; 3] {
    use BodySegment::*;
    match segment {
        Head | Neck | Forearm | Hand | Fingers => SKIN,
        Pelvis | Thigh | Shin | Foot | Toes => LEGS,
        _ => SHIRT,
    }
}

/// The frame's colours anew: walls and the body in a known light.
fn lit(frame: &RgbdFrame, truth: &Truth, sequence: &Sequence, light: &KnownLight) -> ColorImage {
    let template = &sequence.actor().template;
    let faces = template.mesh().faces();
    let camera = sequence.setting().camera;
    let options = Options {
        par: Par::Seq,
        cull: Cull::Back,
        ..Options::default()
    };
    let view = View::Perspective { camera, near: 0.1 };
    let mut drawn = VisibilityBuffer::default();
    rasterise_with(options, &view, &truth.vertices, faces, &mut drawn);
    let (parts, weights) = (template.parts(), template.weights());
    let mut image = ColorImage::filled(camera.width, camera.height, [0; 3]);
    for (i, pixel) in image.data_mut().chunks_exact_mut(3).enumerate() {
        let face = drawn.face[i];
        let (albedo, n) = if face == VisibilityBuffer::NONE {
            (WALL, V3::new(0.0, 0.0, -1.0))
        } else {
            let f = faces[face as usize];
            let [a, b, c]: [P3; 3] = f.map(|v| truth.vertices[v as usize]);
            let n = (b - a).cross(&(c - a)).normalize();
            (
                reflectance(parts.segment(weights.dominant(f[0] as usize))),
                n,
            )
        };
        // A pattern of a few centimetres that knows nothing of the light.
        let (u, v) = (i as u32 % camera.width, i as u32 / camera.width);
        let uneven = 1.0 + UNEVEN * ((u as f32 * 0.31).sin() * (v as f32 * 0.23).cos());
        let irradiance = (1.0 + light.slope.dot(&n)).max(0.0);
        for (c, out) in pixel.iter_mut().enumerate() {
            *out = to_srgb(albedo[c] * uneven * irradiance * light.mean[c]);
        }
    }
    assert_eq!(frame.depth.width(), image.width());
    image
}

/// Angle to the known direction (degrees), and CIE ΔE of a grey card towards the camera.
fn errors(sequence: &Sequence, light: &KnownLight) -> [f32; 2] {
    let (mut frame, truth) = sequence.frame(40);
    frame.color = Some(lit(&frame, &truth, sequence, light));
    let template = &sequence.actor().template;
    // A scrap of cloth, so that there is something to light.
    let cloth = [[-0.02, 0.0, 1.2], [0.02, 0.0, 1.2], [0.0, -0.02, 1.2]].map(P3::from);
    let appearance = Appearance::default();
    let garment = GarmentView {
        vertices: &cloth,
        faces: &[[0, 1, 2]],
        uv: &[],
        normals: &[],
        places: &[],
        appearance: &appearance,
    };
    let limbs = Limbs::of(template);
    let input = Input {
        frame: &frame,
        calibration: sequence.calibration(),
        garments: &[garment],
        body: Some(BodyView {
            vertices: &truth.vertices,
            faces: template.mesh().faces(),
            limbs: &limbs,
        }),
        output: None,
    };
    let (mut state, mut work) = (State::default(), Workspace::default());
    let (_, report) = render(&Model::default(), &mut state, &input, &mut work).expect("drawn");
    let found = report.light.expect("a light");
    let slope = found.slope.iter().map(|s| V3::from(*s)).sum::<V3>();
    let card = |level: [f32; 3]| lab(level.map(|l| 0.5 * l));
    let truth = light.mean.map(|m| m * (1.0 - light.slope.z));
    let level = found.level.expect("walls");
    let [angle, delta] = [
        slope.angle(&light.slope).to_degrees(),
        (card(level) - card(truth)).norm(),
    ];
    println!(
        "light {:?} {:?}: {angle:.1}°, ΔE {delta:.1}",
        light.mean,
        light.slope.as_slice()
    );
    [angle, delta]
}

#[test]
fn the_light_of_a_room_is_found_on_who_stands_in_it() {
    let sequence = Sequence::new(Actor::default(), Setting::default());
    let all: Vec<[f32; 2]> = LIGHTS
        .iter()
        .map(|(mean, slope)| {
            let light = KnownLight {
                mean: *mean,
                slope: V3::from(*slope),
            };
            errors(&sequence, &light)
        })
        .collect();
    for [angle, delta] in &all {
        assert!(*angle < 25.0 && *delta < 12.0, "{all:?}");
    }
    let mut colors: Vec<f32> = all.iter().map(|e| e[1]).collect();
    assert!(median(&mut colors).expect("lights") < 5.0, "{all:?}");
}

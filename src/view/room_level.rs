//! Mean light of the room by channel, from what surrounds the person, within what skin can reflect.
//!
//! A picture alone tells no light from an albedo. What surrounds people indoors is known in the mean: the brighter of it is paint,
//! its mean colour is near that of the light (Buchsbaum 1980). It may stand in another light than the person, before a window
//! say: the face, which reflects between a twentieth and nearly half, bounds the answer.

use super::captured_pixels::CapturedPixels;
use super::settings::RoomLevelSettings;
use super::srgb::linear;
use tryon_geometry::math::P3;
use tryon_geometry::math::order_statistics::median;

/// Weights of red, green and blue in luma of linear light (ITU-R BT.709).
const LUMA: [f32; 3] = [0.2126, 0.7152, 0.0722];

/// Luma of linear light.
fn luma(color: [f32; 3]) -> f32 {
    (0..3).map(|c| LUMA[c] * color[c]).sum()
}

/// Part of the picture and range of depths that a body takes.
struct BodyBounds {
    left: f32,
    right: f32,
    far: f32,
}

impl BodyBounds {
    /// Bounds of posed vertices (picture's camera, metres) with a margin around them.
    fn of(captured: &CapturedPixels<'_>, vertices: &[P3], margin: f32) -> Self {
        let camera = &captured.viewport.camera;
        let mut out = Self {
            left: f32::INFINITY,
            right: f32::NEG_INFINITY,
            far: 0.0,
        };
        for p in vertices.iter().filter(|p| p.z > 0.0) {
            let u = camera.project(p).x;
            let reach = margin * camera.fx as f32 / p.z;
            out.left = out.left.min(u - reach);
            out.right = out.right.max(u + reach);
            out.far = out.far.max(p.z + margin);
        }
        out
    }

    fn has(&self, u: u32, metres: f32) -> bool {
        let u = u as f32;
        u >= self.left && u <= self.right && metres <= self.far
    }
}

/// Light on a white surface towards the camera, by channel; `None` where too little surrounds the person.
fn surroundings(
    captured: &CapturedPixels<'_>,
    vertices: &[P3],
    settings: &RoomLevelSettings,
) -> Option<[f32; 3]> {
    let bounds = BodyBounds::of(captured, vertices, settings.margin);
    let image = captured.image;
    let mut seen: Vec<[f32; 3]> = Vec::new();
    let step = (image.width() / settings.columns).max(1) as usize;
    for v in (0..image.height()).step_by(step) {
        for u in (0..image.width()).step_by(step) {
            let metres = captured.metres(u, v);
            if metres > 0.0 && !bounds.has(u, metres) {
                seen.push(image.at(u, v).map(linear));
            }
        }
    }
    if seen.len() < settings.least.max(1) {
        return None;
    }
    seen.sort_unstable_by(|a, b| luma(*a).total_cmp(&luma(*b)));
    let at = |share: f32| (share * (seen.len() - 1) as f32) as usize;
    let brighter = &seen[at(settings.brighter)..=at(settings.paint_percentile)];
    let sum = brighter
        .iter()
        .fold([0.0; 3], |s, c| [0, 1, 2].map(|k| s[k] + c[k]));
    let mean = sum.map(|s: f32| s / brighter.len() as f32);
    let level = luma(seen[at(settings.paint_percentile)]) / settings.paint;
    let [least, most] = settings.tints;
    let tint = mean.map(|c| 1.0 + (c / luma(mean).max(f32::EPSILON) - 1.0) * settings.tint);
    Some(tint.map(|t| level * t.clamp(least, most)))
}

/// Least and greatest light on a white surface for which the face could be as bright as it is; everything without a face.
fn bounds_of_face(
    captured: &CapturedPixels<'_>,
    vertices: &[P3],
    face: &[u32],
    settings: &RoomLevelSettings,
) -> [f32; 2] {
    let brightness = |&v: &u32| {
        let p = vertices.get(v as usize)?;
        let (rgb, metres) = captured.at(p)?;
        (metres > 0.0 && (metres - p.z).abs() < settings.on_face).then(|| luma(rgb.map(linear)))
    };
    let mut seen: Vec<f32> = face.iter().filter_map(brightness).collect();
    let is_enough = 2 * seen.len() > face.len();
    match median(&mut seen) {
        Some(bright) if is_enough => [bright / settings.skin[1], bright / settings.skin[0]],
        _ => [0.0, f32::INFINITY],
    }
}

/// Light on a white surface towards the camera, by channel, 1 = white comes out white; `None` where too little surrounds the
/// person. `vertices` are the body's in the picture's camera, `face` those of its face.
pub(crate) fn measure(
    captured: &CapturedPixels<'_>,
    vertices: &[P3],
    face: &[u32],
    settings: &RoomLevelSettings,
) -> Option<[f32; 3]> {
    let level = surroundings(captured, vertices, settings)?;
    let [least, most] = bounds_of_face(captured, vertices, face, settings);
    let [low, high] = settings.range;
    let mean = luma(level).max(f32::EPSILON);
    let bounded = mean.clamp(least, most.max(least)).clamp(low, high);
    Some(level.map(|c| c * bounded / mean))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Input;
    use crate::settings::FocusSettings;
    use crate::viewport::Viewport;
    use tryon_geometry::camera::{Calibration, ColorImage, DepthImage, Intrinsics, RgbdFrame};

    const WIDTH: u32 = 160;
    const HEIGHT: u32 = 120;
    const PERSON: std::ops::Range<u32> = 60..100;

    /// A picture of a person of linear brightness `face` before a wall of this linear colour, `None` for no reading.
    fn level(face: f32, wall: Option<[f32; 3]>) -> Option<[f32; 3]> {
        let byte = |l: f32| crate::srgb::ToSrgb::default().get(l).round() as u8;
        let mut color = ColorImage::filled(WIDTH, HEIGHT, [0; 3]);
        let mut depth = Vec::new();
        for (i, pixel) in color.data_mut().chunks_exact_mut(3).enumerate() {
            let is_person = PERSON.contains(&(i as u32 % WIDTH));
            let behind = if wall.is_some() { 3500 } else { 0 };
            depth.push(if is_person { 2000 } else { behind });
            let seen = if is_person {
                [face; 3]
            } else {
                wall.unwrap_or_default()
            };
            pixel.copy_from_slice(&seen.map(byte));
        }
        let camera = Intrinsics::KINECT_V1.resized(WIDTH, HEIGHT);
        let frame = RgbdFrame {
            sequence: 0,
            time_ns: 0,
            depth: DepthImage::new(WIDTH, HEIGHT, depth).expect("size"),
            color: Some(color),
        };
        let calibration = Calibration::registered(camera);
        let input = Input {
            frame: &frame,
            calibration: &calibration,
            garments: &[],
            body: None,
            output: None,
        };
        let viewport = Viewport::new(&input, None, &FocusSettings::default());
        let captured = CapturedPixels {
            viewport: &viewport,
            image: frame.color.as_ref().expect("colour"),
            depth: frame.depth.data(),
        };
        let on_person = |k: u32| camera.unproject((PERSON.start + k) as f32, 60.0, 2.0);
        let vertices: Vec<P3> = (0..PERSON.len() as u32).map(on_person).collect();
        let face = [15, 20, 25];
        measure(&captured, &vertices, &face, &RoomLevelSettings::default())
    }

    #[test]
    fn a_painted_wall_tells_the_light_and_half_of_its_colour() {
        for light in [0.3, 0.6, 0.9] {
            let [r, g, b] =
                level(0.25 * light, Some([0.66, 0.6, 0.5].map(|p| p * light))).expect("a wall");
            assert!(
                (luma([r, g, b]) / light - 1.0).abs() < 0.05,
                "{light}: {r} {g} {b}"
            );
            assert!((r / b - 1.15).abs() < 0.03, "{light}: {r} {b}");
        }
    }

    #[test]
    fn a_face_bounds_the_light_of_a_bright_and_of_a_dark_wall() {
        let settings = RoomLevelSettings::default();
        let mean = |face: f32, wall: f32| luma(level(face, Some([wall; 3])).expect("a wall"));
        let dark = mean(0.02, 0.6);
        assert!((dark - 0.02 / settings.skin[0]).abs() < 0.02, "{dark}");
        let bright = mean(0.4, 0.05);
        assert!((bright - 0.4 / settings.skin[1]).abs() < 0.02, "{bright}");
    }

    #[test]
    fn nothing_is_told_of_a_person_cut_out() {
        assert_eq!(level(0.2, None), None);
    }
}

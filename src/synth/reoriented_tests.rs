//! Scenes of turned and mirrored cameras, set right, against the upright camera's own rendering.

use crate::{Actor, NoiseModel, Routine, Sequence, Setting, SynthSource};
use nalgebra::{UnitQuaternion, Vector3};
use std::path::Path;
use tryon_formats::{FormatError, Reoriented, RgbdSource};
use tryon_geometry::camera::{
    Calibration, ColorImage, DepthImage, Intrinsics, Mounting, PictureTurn, RgbdFrame,
};
use tryon_geometry::math::{Camera, Rigid};

/// A camera whose principal point is off the middle in both directions.
const UPRIGHT: Intrinsics = Intrinsics {
    width: 240,
    height: 320,
    fx: 260.0,
    fy: 270.0,
    cx: 111.0,
    cy: 166.5,
};

/// The camera of [`UPRIGHT`], turned counter-clockwise by as many quarters: its picture needs them clockwise.
fn turned(quarters: u16) -> Setting {
    let mut camera = UPRIGHT;
    for _ in 0..quarters {
        // The right edge of the upright picture is the top of the delivered one.
        camera = Intrinsics {
            width: camera.height,
            height: camera.width,
            fx: camera.fy,
            fy: camera.fx,
            cx: camera.cy,
            cy: f64::from(camera.width) - 1.0 - camera.cx,
        };
    }
    let angle = f64::from(quarters) * std::f64::consts::FRAC_PI_2;
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
    let turn: Rigid<Camera, Camera> = Rigid::from_parts(Vector3::zeros(), turn);
    Setting {
        camera,
        world_from_camera: Setting::tilted(1.0, 3.0, 0.0) * turn,
        noise: NoiseModel::None,
        routine: Routine::Still,
        ..Setting::default()
    }
}

fn source(setting: Setting) -> Box<SynthSource> {
    Box::new(SynthSource::new(
        Sequence::new(Actor::default(), setting),
        Some(1),
    ))
}

/// A device that delivers mirrored pictures: rows are reversed, and the principal point with them.
struct Mirrored {
    source: Box<SynthSource>,
    calibration: Calibration,
}

impl Mirrored {
    fn new(source: Box<SynthSource>) -> Box<Self> {
        let mut calibration = source.calibration().clone();
        let k = &mut calibration.depth;
        k.cx = f64::from(k.width - 1) - k.cx;
        Box::new(Self {
            source,
            calibration,
        })
    }
}

impl RgbdSource for Mirrored {
    fn calibration(&self) -> &Calibration {
        &self.calibration
    }
    fn len(&self) -> Option<usize> {
        self.source.len()
    }
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, FormatError> {
        let mut frame = self.source.next_frame()?;
        if let Some(frame) = &mut frame {
            let width = frame.depth.width() as usize;
            for row in frame.depth.data_mut().chunks_exact_mut(width) {
                row.reverse();
            }
            if let Some(color) = &mut frame.color {
                for row in color.data_mut().chunks_exact_mut(3 * width) {
                    let (pixels, _) = row.as_chunks_mut::<3>();
                    pixels.reverse();
                }
            }
        }
        Ok(frame)
    }
    fn rewind(&mut self) -> Result<(), FormatError> {
        self.source.rewind()
    }
}

fn frame(source: &mut dyn RgbdSource) -> (Intrinsics, DepthImage, ColorImage) {
    let frame = source.next_frame().expect("rendered").expect("one frame");
    let color = frame.color.expect("colour");
    (source.calibration().depth, frame.depth, color)
}

/// Share of the pixels whose points, of both pictures, lie within 0.1 mm of each other, and of those with the same colour
/// within 8 levels.
fn agreement(
    (k, depth, color): &(Intrinsics, DepthImage, ColorImage),
    (other_k, other_depth, other_color): &(Intrinsics, DepthImage, ColorImage),
) -> [f64; 2] {
    let (mut points, mut colors) = (0, 0);
    for v in 0..k.height {
        for u in 0..k.width {
            let point = |k: &Intrinsics, d: &DepthImage| {
                let z = f32::from(d.at(u as i32, v as i32)) * 1e-3;
                k.unproject(u as f32, v as f32, z)
            };
            points += u32::from((point(k, depth) - point(other_k, other_depth)).norm() < 1e-4);
            let pairs = color.at(u, v).into_iter().zip(other_color.at(u, v));
            colors += u32::from(pairs.into_iter().all(|(a, b)| a.abs_diff(b) <= 8));
        }
    }
    [points, colors].map(|n| f64::from(n) / k.pixels() as f64)
}

#[test]
fn turned_and_mirrored_cameras_give_the_points_of_the_upright_one() {
    let upright = frame(source(turned(0)).as_mut());
    let readings = upright.1.data().iter().filter(|d| **d > 0).count();
    assert!(
        readings * 10 > upright.0.pixels() * 9,
        "{readings} readings"
    );
    for (quarters, turn) in (0..4).zip(PictureTurn::ALL) {
        for mirrored in [false, true] {
            let delivered: Box<dyn RgbdSource> = if mirrored {
                Mirrored::new(source(turned(quarters)))
            } else {
                source(turned(quarters))
            };
            let mounting = Mounting {
                turned: turn,
                mirrored,
            };
            let mut set_right = Reoriented::wrap(Path::new("synth"), delivered, mounting);
            let got = frame(set_right.as_mut());
            assert_eq!(
                [got.0.width, got.0.height, got.1.width(), got.2.width()],
                [240, 320, 240, 240]
            );
            // Rounding to millimetres tells a few pixels apart.
            let [points, colors] = agreement(&got, &upright);
            assert!(points > 0.998, "{mounting:?}: {points} of the points");
            assert!(colors > 0.99, "{mounting:?}: {colors} of the colours");
        }
    }
}

#[test]
fn another_mounting_than_the_true_one_gives_other_points() {
    let upright = frame(source(turned(0)).as_mut());
    let mounting = Mounting {
        turned: PictureTurn::ThreeQuarters,
        mirrored: false,
    };
    let mut wrong = Reoriented::wrap(Path::new("synth"), source(turned(1)), mounting);
    assert!(agreement(&frame(wrong.as_mut()), &upright)[0] < 0.3);
}

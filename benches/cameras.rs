//! Rectification and registration of one frame, one thread: time, and error against an analytic scene, of the library's
//! footprints and of splats that were measured beside them.
//!
//! `cargo bench -p tryon-geometry --bench cameras`

#![allow(missing_docs)] // criterion_group! writes a public function without any
#![allow(clippy::print_stdout)] // the table of errors

use criterion::{Criterion, criterion_group, criterion_main};
use tryon_geometry::camera::{ColorImage, DepthImage, Rectifier, Registration, RgbdFrame};
use tryon_geometry::fixtures::{RegistrationScore, TwoCameras};

/// Rays of the depth camera in the colour view, 0 = no ray, and its origin: (u w, v w, w) = z · ray + origin.
struct Rays {
    rays: Vec<[f32; 3]>,
    origin: [f32; 3],
    size: [usize; 2],
}

impl Rays {
    fn new(scene: &TwoCameras) -> Self {
        let (depth, color) = (
            scene.lenses.depth,
            scene.lenses.color.expect("two cameras").intrinsics,
        );
        let k = depth.intrinsics;
        let color_from_depth = scene.lenses.color_from_depth;
        let homogeneous = |p: nalgebra::Vector3<f64>| {
            let (u, v) = (
                color.fx * p.x + color.cx * p.z,
                color.fy * p.y + color.cy * p.z,
            );
            [u as f32, v as f32, p.z as f32]
        };
        let rays = (0..k.pixels()).map(|i| {
            let (u, v) = (i % k.width as usize, i / k.width as usize);
            let ray = depth
                .distortion
                .undistort([(u as f64 - k.cx) / k.fx, (v as f64 - k.cy) / k.fy]);
            ray.map_or([0.0; 3], |[x, y]| {
                homogeneous(color_from_depth.vector(&nalgebra::Vector3::new(x, y, 1.0)))
            })
        });
        Self {
            rays: rays.collect(),
            origin: homogeneous(color_from_depth.iso().translation.vector * 1e3),
            size: [color.width as usize, color.height as usize],
        }
    }

    /// Draws every depth pixel as a square of N × N pixels of its own depth, with a z-test.
    fn splat<const N: usize>(&self, depth: &DepthImage, out: &mut DepthImage) {
        let ([width, height], [ou, ov, oz]) = (self.size, self.origin);
        let out = out.data_mut();
        out.fill(u16::MAX);
        for (reading, ray) in depth.data().iter().zip(&self.rays) {
            let z = f32::from(*reading);
            let w = z * ray[2] + oz;
            if *reading == 0 || ray[2] <= 0.0 {
                continue;
            }
            // The first pixel of a square around the point.
            let shift = 1.0 - 0.5 * N as f32;
            let u = ((z * ray[0] + ou) / w + shift) as i32;
            let v = ((z * ray[1] + ov) / w + shift) as i32;
            if u < 0 || v < 0 || u as usize + N > width || v as usize + N > height {
                continue;
            }
            let first = v as usize * width + u as usize;
            let value = (w + 0.5) as u16;
            for y in 0..N {
                for pixel in &mut out[first + y * width..][..N] {
                    *pixel = value.min(*pixel);
                }
            }
        }
        out.iter_mut()
            .filter(|d| **d == u16::MAX)
            .for_each(|d| *d = 0);
    }

    /// Draws every depth pixel as one pixel, then fills pixels without reading from the readings on both sides of them.
    fn warp_and_fill(&self, depth: &DepthImage, warped: &mut DepthImage, out: &mut DepthImage) {
        self.splat::<1>(depth, warped);
        let width = self.size[0];
        let (from, to) = (warped.data(), out.data_mut());
        to.copy_from_slice(from);
        for i in width + 1..from.len() - width - 1 {
            let across = mean(from[i - 1], from[i + 1]);
            let down = mean(from[i - width], from[i + width]);
            let diagonal = mean(from[i - width - 1], from[i + width + 1]);
            let filled = if across > 0 {
                across
            } else if down > 0 {
                down
            } else {
                diagonal
            };
            to[i] = if from[i] > 0 { from[i] } else { filled };
        }
    }
}

/// Mean of two readings of one surface, 0 for two surfaces.
fn mean(a: u16, b: u16) -> u16 {
    let is_surface = a > 0 && b > 0 && 50 * u32::from(a.abs_diff(b)) < u32::from(a);
    if is_surface {
        ((u32::from(a) + u32::from(b)) / 2) as u16
    } else {
        0
    }
}

fn cameras(c: &mut Criterion) {
    let scene = TwoCameras::azure_kinect();
    let (raw, truth, rays) = (
        scene.raw_depth(),
        scene.registered_truth(),
        Rays::new(&scene),
    );
    let mut out = DepthImage::empty(1280, 720);
    let mut warped = out.clone();
    let mut registration = Registration::new(scene.lenses.clone());

    c.bench_function("footprints", |b| {
        b.iter(|| registration.depth_in_color(&raw, &mut out))
    });
    println!("{:?}", RegistrationScore::new(&out, &truth));
    c.bench_function("splats of 1x1", |b| {
        b.iter(|| rays.splat::<1>(&raw, &mut out))
    });
    println!("{:?}", RegistrationScore::new(&out, &truth));
    c.bench_function("splats of 2x2", |b| {
        b.iter(|| rays.splat::<2>(&raw, &mut out))
    });
    println!("{:?}", RegistrationScore::new(&out, &truth));
    c.bench_function("splats of 3x3", |b| {
        b.iter(|| rays.splat::<3>(&raw, &mut out))
    });
    println!("{:?}", RegistrationScore::new(&out, &truth));
    c.bench_function("warp and fill", |b| {
        b.iter(|| rays.warp_and_fill(&raw, &mut warped, &mut out));
    });
    println!("{:?}", RegistrationScore::new(&out, &truth));

    let color = ColorImage::filled(1280, 720, [90, 120, 150]);
    let mut colors = ColorImage::default();
    c.bench_function("colour of depth pixels", |b| {
        b.iter(|| registration.color_in_depth(&raw, &color, Some(&out), &mut colors));
    });
    let mut rectifier = Rectifier::new(&scene.lenses);
    let mut frame = RgbdFrame {
        sequence: 0,
        time_ns: 0,
        depth: raw.clone(),
        color: None,
    };
    c.bench_function("rectify depth", |b| {
        b.iter(|| rectifier.rectify(&mut frame))
    });
    frame.color = Some(color);
    c.bench_function("rectify depth and colour", |b| {
        b.iter(|| rectifier.rectify(&mut frame))
    });
}

criterion_group!(benches, cameras);
criterion_main!(benches);

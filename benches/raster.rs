//! Rasterising a body to depth: fast against reference, culling, views, and a degenerate case.
//!
//! `cargo bench --bench raster`

#![allow(missing_docs)] // criterion_group! writes a public function without any

use criterion::{Criterion, criterion_group, criterion_main};
use tryon::geometry::camera::Intrinsics;
use tryon::geometry::math::P3;
use tryon::geometry::mesh::Face;
use tryon::geometry::par::Par;
use tryon::geometry::raster::{
    Cull, Options, View, VisibilityBuffer, rasterise, rasterise_reference, rasterise_with,
};

/// Adds a closed ellipsoid of `cells` around and down.
fn ellipsoid(
    centre: [f32; 3],
    radius: [f32; 3],
    cells: [u32; 2],
    v: &mut Vec<P3>,
    f: &mut Vec<Face>,
) {
    let [around, down] = cells;
    let base = v.len() as u32;
    for i in 0..=down {
        let t = std::f32::consts::PI * i as f32 / down as f32;
        for j in 0..around {
            let p = std::f32::consts::TAU * j as f32 / around as f32;
            let unit = [t.sin() * p.cos(), t.cos(), t.sin() * p.sin()];
            v.push(P3::from(std::array::from_fn::<f32, 3, _>(|k| {
                centre[k] + radius[k] * unit[k]
            })));
        }
    }
    for i in 0..down {
        for j in 0..around {
            let (a, b) = (base + i * around + j, base + i * around + (j + 1) % around);
            f.push([a, b, a + around]);
            f.push([b, b + around, a + around]);
        }
    }
}

/// Trunk, head, arms and legs: 13,240 vertices, 26,000 faces, as many as the paper's template.
fn figure() -> (Vec<P3>, Vec<Face>) {
    let (mut vertices, mut faces) = (Vec::new(), Vec::new());
    ellipsoid(
        [0.0, 0.0, 2.5],
        [0.18, 0.32, 0.12],
        [60, 60],
        &mut vertices,
        &mut faces,
    );
    ellipsoid(
        [0.0, -0.5, 2.5],
        [0.09, 0.13, 0.1],
        [40, 40],
        &mut vertices,
        &mut faces,
    );
    for side in [-1.0, 1.0] {
        ellipsoid(
            [side * 0.1, 0.7, 2.5],
            [0.08, 0.45, 0.08],
            [40, 60],
            &mut vertices,
            &mut faces,
        );
        ellipsoid(
            [side * 0.35, 0.0, 2.5],
            [0.06, 0.4, 0.06],
            [30, 50],
            &mut vertices,
            &mut faces,
        );
    }
    (vertices, faces)
}

fn raster(c: &mut Criterion) {
    let (v, f) = figure();
    let kinect = View::Perspective {
        camera: Intrinsics::KINECT_V1,
        near: 0.1,
    };
    let parallel = View::Orthographic {
        width: 256,
        height: 256,
        left: -1.0,
        top: -0.8,
        pixels_per_metre: 128.0,
    };
    let mut out = VisibilityBuffer::default();
    c.bench_function("reference 640x480", |b| {
        b.iter(|| rasterise_reference(&kinect, &v, &f, &mut out))
    });
    for (name, view) in [("640x480", &kinect), ("parallel 256x256", &parallel)] {
        for cull in [Cull::None, Cull::Back] {
            for par in [Par::Seq, Par::Rayon] {
                let options = Options {
                    par,
                    cull,
                    ..Options::default()
                };
                c.bench_function(&format!("fast {name}, {cull:?} culled, {par:?}"), |b| {
                    b.iter(|| rasterise_with(options, view, &v, &f, &mut out));
                });
            }
        }
    }
    // Every face crosses the near plane and is huge: clipping and long rows.
    let wide: Vec<P3> = (0..300)
        .map(|i| {
            let t = i as f32 * 0.7;
            P3::new(
                50.0 * t.sin(),
                30.0 * t.cos(),
                if i % 3 == 0 { -1.0 } else { 3.0 },
            )
        })
        .collect();
    let faces: Vec<Face> = (0..100).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    c.bench_function("fast 640x480, 100 faces across the near plane", |b| {
        b.iter(|| rasterise(&kinect, &wide, &faces, &mut out));
    });
    // All faces have no area.
    let flat: Vec<Face> = f.iter().map(|f| [f[0], f[1], f[0]]).collect();
    c.bench_function("fast 640x480, no face has an area", |b| {
        b.iter(|| rasterise(&kinect, &v, &flat, &mut out))
    });
}

criterion_group!(benches, raster);
criterion_main!(benches);

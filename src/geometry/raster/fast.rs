//! The fast rasteriser: vertices snapped once, bands of rows in parallel.

use super::buffer::BandScratch;
use super::faces::{DrawJob, draw_into};
use super::kernel::Band;
use super::options::{Cull, Options};
use super::screen::{Corner, Projector, SUB_BITS};
use super::{View, VisibilityBuffer};
use crate::math::P3;
use crate::mesh::Face;
use crate::par::{self, Par};
use std::ops::Range;

/// Bands of rows in parallel mode. Fewer balance a body badly between threads; more spend over a tenth of the work on
/// reading the band range of every face.
const BANDS: usize = 8;
/// Faces sorted into bands by one task.
const FACE_CHUNK: usize = 4096;
/// Range of bands of a face that is not drawn.
const NOWHERE: [u8; 2] = [u8::MAX, 0];
/// Vertices projected by one task.
const VERTEX_CHUNK: usize = 2048;

/// Surface of several garments on top of each other. Vertices in the view's frame, metres.
#[derive(Clone, Copy, Debug)]
pub struct LayeredMesh<'a> {
    /// Vertices.
    pub vertices: &'a [P3],
    /// Faces; out of range or with corners that are not finite: left out.
    pub faces: &'a [Face],
    /// Face range of each garment, ascending without gaps, innermost garment first.
    pub layers: &'a [Range<usize>],
}

/// Draws all faces, both sides, on the calling thread: the pixels of [`super::rasterise_reference`], faster.
/// Points in the view's frame; faces out of range or with corners that are not finite are left out.
pub fn rasterise(view: &View, vertices: &[P3], faces: &[Face], out: &mut VisibilityBuffer) {
    let options = Options {
        par: Par::Seq,
        ..Options::default()
    };
    rasterise_with(options, view, vertices, faces, out);
}

/// [`rasterise`] with threads and culling. The bits do not depend on the thread count.
pub fn rasterise_with(
    options: Options,
    view: &View,
    vertices: &[P3],
    faces: &[Face],
    out: &mut VisibilityBuffer,
) {
    let mesh = LayeredMesh {
        vertices,
        faces,
        layers: &[],
    };
    rasterise_layers(options, view, &mesh, out);
}

/// The picture of [`rasterise_with`], bit for bit, in less time: an occluded face costs a query of coarse depth tiles.
/// Returns the number of faces left out as occluded.
pub fn rasterise_layers(
    options: Options,
    view: &View,
    mesh: &LayeredMesh<'_>,
    out: &mut VisibilityBuffer,
) -> usize {
    out.reset(view);
    let projector = Projector::new(view);
    let mut corners = std::mem::take(&mut out.scratch.corners);
    corners.resize(mesh.vertices.len(), Corner::OUTSIDE);
    par::for_chunks(options.par, &mut corners, VERTEX_CHUNK, |start, chunk| {
        project(
            &projector,
            &mesh.vertices[start..start + chunk.len()],
            chunk,
        );
    });

    let bands = if options.par == Par::Seq { 1 } else { BANDS };
    let rows = (out.height as usize).div_ceil(bands).max(1);
    let mut ranges = std::mem::take(&mut out.scratch.ranges);
    ranges.clear();
    if bands > 1 {
        ranges.resize(mesh.faces.len(), NOWHERE);
        par::for_chunks(options.par, &mut ranges, FACE_CHUNK, |start, chunk| {
            for (range, f) in chunk.iter_mut().zip(&mesh.faces[start..]) {
                *range = band_range(&corners, f, options.cull, rows as i32);
            }
        });
    }

    let job = DrawJob {
        projector,
        cull: options.cull,
        vertices: mesh.vertices,
        corners: &corners,
        faces: mesh.faces,
        layers: mesh.layers,
        ranges: &ranges,
    };
    let mut scratch = std::mem::take(&mut out.scratch.bands);
    scratch.resize_with(BANDS, BandScratch::default);
    let mut parts = split(out, options.back_offset, rows, &mut scratch);
    par::for_chunks(options.par, &mut parts[..bands], 1, |number, parts| {
        for band in parts.iter_mut().flatten().filter(|b| b.rows > 0) {
            draw_band(&job, number as u8, band);
        }
    });
    let occluded = parts.iter().flatten().map(|b| b.occluded).sum();
    (out.scratch.ranges, out.scratch.corners, out.scratch.bands) = (ranges, corners, scratch);
    occluded
}

/// Splits the buffer into bands of `rows` rows.
fn split<'a>(
    out: &'a mut VisibilityBuffer,
    back_offset: f32,
    rows: usize,
    scratch: &'a mut [BandScratch],
) -> [Option<Band<'a>>; BANDS] {
    let (width, height) = (out.width as usize, out.height as usize);
    let mut depth = out.depth.chunks_mut(rows * width.max(1));
    let mut face = out.face.chunks_mut(rows * width.max(1));
    let mut scratch = scratch.iter_mut();
    std::array::from_fn(|k| {
        let depth = depth.next().unwrap_or_default();
        Some(Band {
            width: width as i32,
            top: (k * rows) as i32,
            rows: (depth.len() / width.max(1)) as i32,
            height: height as i32,
            back_offset,
            depth,
            face: face.next().unwrap_or_default(),
            scratch: scratch.next()?,
            occluded: 0,
        })
    })
}

/// First and last band that a face may touch.
fn band_range(corners: &[Corner], f: &Face, cull: Cull, rows: i32) -> [u8; 2] {
    let [Some(a), Some(b), Some(c)] = f.map(|i| corners.get(i as usize)) else {
        return NOWHERE;
    };
    if a.is_outside() | b.is_outside() | c.is_outside() {
        return [0, BANDS as u8 - 1];
    }
    // Rounding differs from the exact sign only near zero, where the exact test in the band decides.
    let area =
        f64::from(b.x - a.x) * f64::from(c.y - a.y) - f64::from(b.y - a.y) * f64::from(c.x - a.x);
    if (cull == Cull::Back && area > 0.0) || (cull == Cull::Front && area < 0.0) {
        return NOWHERE;
    }
    let first = (a.y.min(b.y).min(c.y) >> SUB_BITS) / rows;
    let last = (a.y.max(b.y).max(c.y) >> SUB_BITS) / rows;
    if last < 0 || first >= BANDS as i32 {
        NOWHERE
    } else {
        [first.max(0) as u8, last.min(BANDS as i32 - 1) as u8]
    }
}

#[inline(always)]
fn project_generic(projector: &Projector, vertices: &[P3], corners: &mut [Corner]) {
    for (corner, p) in corners.iter_mut().zip(vertices) {
        *corner = projector.corner(p);
    }
}

/// Compiles a loop a second time for AVX2 and selects at run time: the product ships one binary.
/// Fused multiply-add stays off, so both give the same bits.
macro_rules! dispatch {
    ($name:ident, $wide:ident, $generic:ident, ($($arg:ident: $ty:ty),*)) => {
        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = "avx2")]
        fn $wide($($arg: $ty),*) {
            $generic($($arg),*);
        }
        fn $name($($arg: $ty),*) {
            #[cfg(target_arch = "x86_64")]
            if std::arch::is_x86_feature_detected!("avx2") {
                // Sound: the feature was just detected.
                #[allow(unsafe_code)]
                unsafe {
                    return $wide($($arg),*);
                }
            }
            $generic($($arg),*);
        }
    };
}
dispatch!(project, project_avx2, project_generic, (projector: &Projector, vertices: &[P3], corners: &mut [Corner]));
dispatch!(draw_band, draw_band_avx2, draw_into, (job: &DrawJob<'_>, number: u8, band: &mut Band<'_>));

#[cfg(test)]
mod tests {
    use super::super::{barycentrics, interpolate, rasterise_reference};
    use super::*;
    use crate::camera::Intrinsics;
    use rand::{Rng, SeedableRng};

    const SEQ: Options = Options {
        par: Par::Seq,
        cull: Cull::None,
        back_offset: 0.0,
    };

    fn pinhole() -> View {
        View::Perspective {
            camera: Intrinsics::KINECT_V1.resized(160, 120),
            near: 0.3,
        }
    }
    fn parallel() -> View {
        View::Orthographic {
            width: 150,
            height: 130,
            left: -1.0,
            top: -0.9,
            pixels_per_metre: 70.0,
        }
    }
    /// Triangles of all sizes, some behind the camera, some crossing the near plane, some degenerate or huge.
    fn soup(seed: u64, n: usize) -> (Vec<P3>, Vec<Face>) {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
        let mut v = Vec::new();
        for i in 0..n {
            let size = [0.002, 0.02, 0.3, 3.0, 4e3][i % 5];
            let centre = P3::new(
                rng.random_range(-1.5..1.5),
                rng.random_range(-1.0..1.0),
                rng.random_range(0.1..4.0),
            );
            for _ in 0..3 {
                let mut r = || rng.random_range(-size..size);
                v.push(
                    centre
                        + crate::math::V3::new(r(), r(), if size > 1.0 { r() * 0.3 } else { r() }),
                );
            }
            let last = v.len() - 1;
            match i % 23 {
                7 => v[last] = v[last - 1],
                11 => v[last] = v[last - 1] + (v[last - 1] - v[last - 2]) * 0.5,
                13 => v[last].x = f32::NAN,
                17 => v[last].z = -1e5,
                19 => v[last].z = 0.0,
                _ => {}
            }
        }
        let mut f: Vec<Face> = (0..n as u32)
            .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
            .collect();
        f.push([0, 1, 4_000_000]);
        (v, f)
    }
    /// f32 depth against f64: rounding relative to the depth, and in a parallel view to the largest depth of the face.
    fn close(view: &View, v: &[P3], face: &Face, a: f32, b: f32) -> bool {
        let reach = match view {
            View::Perspective { .. } => 0.0,
            View::Orthographic { .. } => face.iter().fold(0f32, |m, &i| {
                m.max(v.get(i as usize).map_or(0.0, |p| p.z.abs()))
            }),
        };
        a == b || (a - b).abs() < 2e-5 * a.abs() + 1e-6 * reach
    }
    fn drawn(options: Options, view: &View, v: &[P3], f: &[Face]) -> VisibilityBuffer {
        let mut out = VisibilityBuffer::default();
        rasterise_with(options, view, v, f, &mut out);
        out
    }

    #[test]
    fn pixels_match_the_reference() {
        for view in [pinhole(), parallel()] {
            for seed in 0..6 {
                let (v, f) = soup(seed, 150);
                // Face by face, so that no face is occluded.
                let mut slow = VisibilityBuffer::default();
                for face in &f {
                    rasterise_reference(&view, &v, std::slice::from_ref(face), &mut slow);
                    let fast = drawn(SEQ, &view, &v, &[*face]);
                    assert_eq!(slow.face, fast.face, "coverage of {face:?}, seed {seed}");
                    for (a, b) in slow.depth.iter().zip(&fast.depth) {
                        assert!(close(&view, &v, face, *a, *b), "{a} {b} {face:?}");
                    }
                }
                // All together: only ties within rounding may differ.
                rasterise_reference(&view, &v, &f, &mut slow);
                let fast = drawn(SEQ, &view, &v, &f);
                assert!(slow.face.iter().any(|&id| id != VisibilityBuffer::NONE));
                for i in 0..slow.face.len() {
                    let (a, b) = (slow.depth[i], fast.depth[i]);
                    let near = |id: u32| {
                        f.get(id as usize)
                            .is_some_and(|face| close(&view, &v, face, a, b))
                    };
                    assert!(
                        a == b || near(slow.face[i]) || near(fast.face[i]),
                        "{a} {b}"
                    );
                }
            }
        }
    }

    #[test]
    fn bits_do_not_depend_on_the_thread_count() {
        for view in [pinhole(), parallel()] {
            let (v, f) = soup(9, 400);
            for cull in [Cull::None, Cull::Back, Cull::Front] {
                let seq = drawn(Options { cull, ..SEQ }, &view, &v, &f);
                for threads in [1, 2, 5] {
                    let got = par::with_threads(threads, || {
                        drawn(
                            Options {
                                cull,
                                ..Options::default()
                            },
                            &view,
                            &v,
                            &f,
                        )
                    })
                    .expect("pool");
                    assert!(seq == got, "{threads} threads, {cull:?}");
                }
            }
        }
    }

    #[test]
    fn faces_are_cut_at_the_near_plane_as_ray_casting_says() {
        let view = pinhole();
        let View::Perspective { camera, near } = view else {
            unreachable!()
        };
        // A floor from behind the camera to 6 m ahead, 1 m below.
        let v = [[-9.0, 1.0, -3.0], [9.0, 1.0, -3.0], [0.0, 1.0, 6.0]].map(P3::from);
        let out = drawn(Options::default(), &view, &v, &[[0, 1, 2]]);
        let mut covered = 0;
        for row in 0..camera.height {
            for col in 0..camera.width {
                let d = camera.unproject(col as f32, row as f32, 1.0);
                let z = 1.0 / d.y;
                let (x, inside_margin) = (d.x * z, 0.02);
                let half = 9.0 * (6.0 - z) / 9.0;
                let i = (row * camera.width + col) as usize;
                if d.y > 0.0 && z > near + inside_margin && x.abs() < half - inside_margin {
                    assert!(
                        (out.depth[i] - z).abs() < 2e-3 * z,
                        "({col},{row}) {} {z}",
                        out.depth[i]
                    );
                    covered += 1;
                } else if d.y <= 0.0 || z < near - inside_margin || x.abs() > half + inside_margin {
                    assert_eq!(out.face[i], VisibilityBuffer::NONE);
                }
            }
        }
        assert!(covered > 2000, "{covered}");
    }

    #[test]
    fn shared_edges_are_watertight_when_clipped() {
        // Fan around a point in the picture, its rim behind the camera and far outside.
        let mut v = vec![P3::new(0.05, 0.02, 2.0)];
        let n = 37;
        v.extend((0..n).map(|i| {
            let t = std::f32::consts::TAU * i as f32 / n as f32;
            P3::new(9e4 * t.cos(), 9e4 * t.sin(), 2.0 + 0.9 * (3.0 * t).sin())
        }));
        let f: Vec<Face> = (0..n).map(|i| [0, 1 + i, 1 + (i + 1) % n]).collect();
        for view in [pinhole(), parallel()] {
            let out = drawn(Options::default(), &view, &v, &f);
            assert!(out.face.iter().all(|&id| id != VisibilityBuffer::NONE));
        }
    }

    #[test]
    fn culling_drops_one_side() {
        // Counter-clockwise seen from the camera, so a front face.
        let v = [[-0.5, 0.5, 2.0], [0.5, 0.5, 2.0], [0.0, -0.5, 2.0]].map(P3::from);
        let count = |cull, f: Face| {
            let b = drawn(Options { cull, ..SEQ }, &pinhole(), &v, &[f]);
            b.face.iter().filter(|&&id| id == 0).count()
        };
        let front = [0, 1, 2];
        assert!(
            crate::mesh::face_normal(&v, &front).z < 0.0,
            "towards the camera"
        );
        assert!(count(Cull::Back, front) > 100 && count(Cull::Front, front) == 0);
        assert!(count(Cull::Front, [0, 2, 1]) > 100 && count(Cull::Back, [0, 2, 1]) == 0);
        // Reuse at another size, empty mesh, empty picture.
        let mut out = drawn(Options::default(), &pinhole(), &v, &[front]);
        rasterise(&parallel(), &[], &[], &mut out);
        assert_eq!((out.width, out.depth.len()), (150, 150 * 130));
        let empty = View::Orthographic {
            width: 0,
            height: 0,
            left: 0.0,
            top: 0.0,
            pixels_per_metre: 1.0,
        };
        rasterise_with(Options::default(), &empty, &v, &[front], &mut out);
        assert!(out.face.is_empty());
    }

    #[test]
    fn back_faces_are_drawn_back_offset_farther() {
        let v = [[-0.5, 0.5, 2.0], [0.5, 0.5, 2.5], [0.0, -0.5, 3.0]].map(P3::from);
        for view in [pinhole(), parallel()] {
            for (face, farther) in [([0, 1, 2], 0.0), ([0, 2, 1], 0.01)] {
                let there = drawn(Options::default(), &view, &v, &[face]);
                let moved = drawn(
                    Options {
                        back_offset: 0.01,
                        ..Options::default()
                    },
                    &view,
                    &v,
                    &[face],
                );
                assert_eq!(there.face, moved.face);
                let seen = there
                    .depth
                    .iter()
                    .zip(&moved.depth)
                    .filter(|(a, _)| a.is_finite());
                // Between the corners 1/z is not exactly that of a flat face.
                assert!(seen.clone().count() > 100);
                assert!(
                    seen.into_iter()
                        .all(|(a, b)| (b - a - farther).abs() < 2e-5 + 0.05 * farther),
                    "{farther}"
                );
            }
        }
    }

    #[test]
    fn barycentrics_reproduce_the_visible_point() {
        for view in [pinhole(), parallel()] {
            let v = [[-0.7, 0.6, 1.5], [0.6, 0.5, 2.8], [0.1, -0.6, 1.9]].map(P3::from);
            let faces = [[0, 1, 2]];
            let out = drawn(Options::default(), &view, &v, &faces);
            let mut seen = 0;
            for row in 0..out.height {
                for col in 0..out.width {
                    let Some((_, w)) = interpolate(&view, &v, &faces, &out, [col, row]) else {
                        continue;
                    };
                    let p = P3::from(v[0].coords * w[0] + v[1].coords * w[1] + v[2].coords * w[2]);
                    let z = out.depth[(row * out.width + col) as usize];
                    let q = view.project(&p).expect("in front");
                    assert!((q[0] - col as f32).abs() < 0.02 && (q[1] - row as f32).abs() < 0.02);
                    assert!((q[2] - z).abs() < 5e-3);
                    seen += 1;
                }
            }
            assert!(seen > 500);
            assert_eq!(out.face.iter().filter(|i| **i == 0).count(), seen);
        }
        assert_eq!(barycentrics(&pinhole(), [P3::origin(); 3], 3.0, 3.0), None);
    }
}

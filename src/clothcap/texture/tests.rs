//! Atlases of tubes and folds, and their images painted from synthetic scans.

use super::*;
use crate::scan::{BodyScan, TextureColor};
use crate::settings::PaintSettings;
use std::f32::consts::TAU;
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::Face;

const TEXEL: f32 = 0.002;

/// An upright tube of 0.15 m radius and 0.5 m height, open at both ends.
fn tube() -> (Vec<P3>, Vec<Face>) {
    let (n, rows) = (48u32, 26u32);
    let vertices = (0..n * rows).map(|k| {
        let a = TAU * (k % n) as f32 / n as f32;
        P3::new(0.15 * a.sin(), 0.02 * (k / n) as f32, 0.15 * a.cos())
    });
    let faces = (0..n * (rows - 1)).flat_map(|k| {
        let (i, j) = (k % n, k / n);
        let at = |i: u32, j: u32| j * n + i % n;
        [
            [at(i, j), at(i + 1, j), at(i + 1, j + 1)],
            [at(i, j), at(i + 1, j + 1), at(i, j + 1)],
        ]
    });
    (vertices.collect(), faces.collect())
}

/// Paint of the tests at a place, sRGB: changes by 2 levels a millimetre at most.
fn paint(p: &P3) -> [u8; 3] {
    let wave = |t: f32| 128.0 + 100.0 * (TAU * t).sin();
    [wave(3.0 * p.y), wave(2.0 * p.x), wave(2.0 * p.z)].map(|c| c.round() as u8)
}

/// Coloured points on a tube, 4 mm apart, above a height.
fn scan(above: f32) -> BodyScan {
    let mut out = BodyScan {
        oriented: true,
        ..BodyScan::default()
    };
    let around = (TAU * 0.15 / 0.004) as u32;
    for k in 0..around * 125 {
        let a = TAU * (k % around) as f32 / around as f32;
        let n = V3::new(a.sin(), 0.0, a.cos());
        let p = P3::new(0.15 * n.x, 0.004 * (k / around) as f32, 0.15 * n.z);
        if p.y > above {
            out.points.push(p);
            out.normals.push(n);
            out.colors.push(paint(&p));
        }
    }
    out
}

fn place(corners: [P3; 3], weights: [f32; 3]) -> P3 {
    let sum: V3 = (0..3).map(|k| corners[k].coords * weights[k]).sum();
    P3::from(sum)
}

/// Faces that strictly contain the middle of each texel.
fn owners(atlas: &TextureAtlas) -> Vec<u32> {
    let mut count = vec![0; atlas.texels()];
    for f in 0..atlas.faces.len() {
        for t in atlas.texels_of(f) {
            let is_inside = t.weights.iter().all(|w| *w > 1e-3);
            count[t.index as usize] += u32::from(is_inside);
        }
    }
    count
}

#[test]
fn charts_lie_in_the_image_without_overlap_and_keep_their_size() {
    let (vertices, faces) = tube();
    let atlas = TextureAtlas::new(&vertices, &faces, TEXEL);
    assert_eq!(atlas.check(vertices.len(), faces.len()), Ok(()));
    assert!(owners(&atlas).iter().all(|n| *n <= 1));
    for (f, own) in atlas.faces.iter().zip(&faces) {
        assert_eq!(f.map(|v| atlas.vertex[v as usize]), *own);
    }
    // Projection makes a face smaller, by the cosine of 55 degrees at most and a little where axes were smoothed.
    for (f, own) in atlas.faces.iter().zip(&faces) {
        let [a, b, c] = own.map(|v| vertices[v as usize]);
        let on_cloth = 0.5 * (b - a).cross(&(c - a)).norm();
        let extent = [atlas.size.width, atlas.size.height].map(|n| n as f32 * TEXEL);
        let [a, b, c] = f.map(|v| {
            let uv = atlas.uv[v as usize];
            [uv[0] * extent[0], uv[1] * extent[1]]
        });
        let cross = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        let share = 0.5 * cross.abs() / on_cloth;
        assert!((0.3..1.01).contains(&share), "{share}");
    }
    assert_eq!(atlas, TextureAtlas::new(&vertices, &faces, TEXEL));
}

#[test]
fn a_fold_over_its_own_cloth_gets_a_chart_of_its_own() {
    // A sheet whose lower half is folded upwards in front of its upper half, all of it facing +z.
    let rows = [
        [0.0, 0.0],
        [0.2, 0.0],
        [0.21, 0.01],
        [0.0, 0.02],
        [0.2, 0.03],
    ];
    let vertices = rows.map(|[y, z]| [P3::new(0.0, y, z), P3::new(0.3, y, z)]);
    let vertices = vertices.concat();
    let strips = [[0, 2], [2, 4], [6, 8], [4, 8]];
    let faces = strips.map(|[a, b]| [[a, a + 1, b + 1], [a, b + 1, b]]);
    let faces = faces.concat();
    let atlas = TextureAtlas::new(&vertices, &faces, TEXEL);
    assert!(owners(&atlas).iter().all(|n| *n <= 1));
}

#[test]
fn an_image_has_no_more_than_its_largest_size_for_any_surface() {
    let (vertices, faces) = tube();
    let large: Vec<P3> = vertices.iter().map(|p| p * 40.0).collect();
    let atlas = TextureAtlas::new(&large, &faces, TEXEL);
    assert_eq!(atlas.check(vertices.len(), faces.len()), Ok(()));
    assert!(atlas.size.width.max(atlas.size.height) > 900);
    assert!(atlas.size.texel > 10.0 * TEXEL);
    let none = TextureAtlas::new(&[], &[], TEXEL);
    assert_eq!(none.check(0, 0), Ok(()));
}

#[test]
fn texels_have_the_paint_of_the_scan_and_later_scans_fill_the_rest() {
    let (vertices, faces) = tube();
    let atlas = TextureAtlas::new(&vertices, &faces, TEXEL);
    let grey = vec![[90; 3]; vertices.len()];
    let mut texture = GarmentTexture::of_vertices(&atlas, &grey);
    let add = |texture: &mut GarmentTexture, scan: &BodyScan| {
        let paint = ScanPaint::new(scan, |_| true, &faces, &vertices, &PaintSettings::default());
        paint.apply(texture, &atlas, &vertices, &grey);
    };
    add(&mut texture, &scan(0.25));
    let first = texture.clone();
    let mut later = scan(f32::MIN);
    let upper: Vec<bool> = later.points.iter().map(|p| p.y > 0.25).collect();
    for (color, upper) in later.colors.iter_mut().zip(upper) {
        // Texels that were seen before keep their colour.
        if upper {
            *color = [255, 0, 0];
        }
    }
    add(&mut texture, &later);

    let (mut seen, mut worst) = ([0usize; 2], 0.0f32);
    for f in 0..faces.len() {
        for t in atlas.texels_of(f) {
            let p = place(faces[f].map(|v| vertices[v as usize]), t.weights);
            let is_first = first.is_seen(t.index);
            seen[0] += usize::from(is_first);
            seen[1] += usize::from(texture.is_seen(t.index));
            if is_first {
                assert_eq!(first.at(t.index), texture.at(t.index));
            } else if p.y < 0.22 {
                assert_eq!(first.at(t.index), [90; 3], "nothing seen there");
            }
            // Between both scans red paint reaches in.
            if is_first && p.y > 0.27 || p.y < 0.23 {
                let (got, wanted) = (texture.at(t.index), paint(&p));
                let off = (0..3).map(|k| f32::from(got[k].abs_diff(wanted[k])));
                worst = off.fold(worst, f32::max);
            }
        }
    }
    assert!(seen[0] * 2 < seen[1] + seen[1] / 10, "{seen:?}");
    assert!(worst <= 8.0, "{worst} levels");

    // Stored and read again.
    let stored = (texture.image().clone(), texture.seen_image());
    let read = GarmentTexture::from_images(&atlas, stored.0, &stored.1);
    assert_eq!(read.as_ref(), Some(&texture));
    let other = tryon_geometry::camera::ColorImage::filled(3, 3, [0; 3]);
    let refused = GarmentTexture::from_images(&atlas, other.clone(), &other);
    assert_eq!(refused, None);
}

#[test]
fn the_texture_of_a_coarse_scan_is_painted_at_its_own_resolution() {
    let (vertices, faces) = tube();
    let atlas = TextureAtlas::new(&vertices, &faces, TEXEL);
    let fine = scan(f32::MIN);
    // Points 2 cm apart, grey, with a texture 4 mm apart.
    let nearest = |p: &P3| {
        let distance = |v: &usize| (vertices[*v] - p).norm_squared();
        (0..vertices.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)))
    };
    let texture = fine.points.iter().zip(&fine.colors).step_by(3);
    let texture = texture.map(|(at, color)| TextureColor {
        at: *at,
        point: nearest(at).expect("a point") as u32,
        color: *color,
    });
    let normals = vertices.iter().map(|p| V3::new(p.x, 0.0, p.z).normalize());
    let coarse = BodyScan {
        texture: texture.collect(),
        normals: normals.collect(),
        colors: vec![[90; 3]; vertices.len()],
        points: vertices.clone(),
        oriented: true,
        ..BodyScan::default()
    };
    let grey = vec![[90; 3]; vertices.len()];
    let mut image = GarmentTexture::of_vertices(&atlas, &grey);
    let paint_of = ScanPaint::new(
        &coarse,
        |_| true,
        &faces,
        &vertices,
        &PaintSettings::default(),
    );
    paint_of.apply(&mut image, &atlas, &vertices, &grey);
    let (mut sum, mut count) = (0.0, 0.0);
    for (f, face) in faces.iter().enumerate() {
        for t in atlas.texels_of(f) {
            let wanted = paint(&place(face.map(|v| vertices[v as usize]), t.weights));
            let got = image.at(t.index);
            let off = (0..3).map(|k| f64::from(got[k].abs_diff(wanted[k])));
            sum += off.fold(0.0, f64::max);
            count += 1.0;
        }
    }
    assert!(sum / count < 6.0, "{} levels", sum / count);
}

#[test]
fn gutters_have_the_colours_of_their_charts() {
    let (vertices, faces) = tube();
    let atlas = TextureAtlas::new(&vertices, &faces, TEXEL);
    let texture = GarmentTexture::of_vertices(&atlas, &vec![[20, 200, 90]; vertices.len()]);
    let mut pixels = texture.image().data().chunks(3);
    assert!(pixels.all(|c| c == [20, 200, 90]));
}

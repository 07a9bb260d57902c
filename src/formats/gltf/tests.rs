use super::*;
use crate::image::encode_png_rgb;
use std::path::Path;
use tryon_geometry::camera::ColorImage;
use tryon_geometry::math::P3;
use tryon_geometry::mesh::Face;

const CORNERS: [[f32; 3]; 4] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
];
const FACES: [Face; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
const UV: [[f32; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.25]];
const AT: &str = "outfit.glb";

fn points() -> Vec<P3> {
    CORNERS.map(P3::from).to_vec()
}

/// A shirt and a skirt, both tetrahedra.
fn encoded(frames: &[Vec<Vec<P3>>]) -> Result<Vec<u8>, crate::FormatError> {
    let p = points();
    let shirt = GlbMesh {
        name: "shirt",
        vertices: &p,
        faces: &FACES,
        uv: &UV,
        color: [200, 10, 0],
        texture: &[],
    };
    let skirt = GlbMesh {
        name: "skirt",
        color: [0, 0, 255],
        ..shirt
    };
    encode_glb(&[shirt, skirt], frames, 0.04, Path::new(AT))
}

#[test]
fn written_meshes_read_back() {
    let bytes = encoded(&[]).expect("encodes");
    let m = parse_gltf(&bytes, Path::new(AT)).expect("reads");
    assert_eq!(m.mesh.vertices(), [points(), points()].concat());
    assert_eq!(
        (m.mesh.faces()[3], m.mesh.faces()[4], m.uv[6]),
        (FACES[3], [4, 6, 5], UV[2])
    );
    assert_eq!(
        (m.parts[1].names.group.as_str(), m.parts[1].faces.clone()),
        ("skirt", 4..8)
    );
    assert!(
        (m.parts[0].color[0] - 0.577_58).abs() < 1e-4,
        "sRGB 200 is 0.578 linear"
    );
    assert!(m.parts[0].double_sided);
}

#[test]
fn motion_is_written_as_morph_targets() {
    let up = |k: usize| {
        points()
            .iter()
            .map(|p| p + nalgebra::Vector3::y() * k as f32)
            .collect::<Vec<_>>()
    };
    let mut frames = vec![(0..3).map(up).collect::<Vec<_>>()];
    let bytes = encoded(&frames).expect("encodes");
    let g = ::gltf::Gltf::from_slice(&bytes).expect("valid glTF");
    let animation = g.animations().next().expect("an animation");
    assert_eq!(
        animation
            .samplers()
            .next()
            .expect("a sampler")
            .output()
            .count(),
        9
    );
    let primitive = g
        .meshes()
        .next()
        .and_then(|m| m.primitives().next())
        .expect("a mesh");
    assert_eq!(primitive.morph_targets().count(), 3);
    frames[0][1].pop();
    let e = encoded(&frames).expect_err("short frame").to_string();
    assert!(e.contains("shirt") && e.contains("frame 1"), "{e}");
}

#[test]
fn faults_name_mesh_and_index() {
    let bytes = encoded(&[]).expect("encodes");
    // The last index of the first mesh: after 4 positions, 4 normals, 4 uv and 11 indices.
    let bin = bytes
        .windows(4)
        .position(|w| w == b"BIN\0")
        .expect("a chunk")
        + 4;
    let mut bad = bytes.clone();
    let at = bin + 4 * 12 + 4 * 12 + 4 * 8 + 11 * 4;
    bad[at..at + 4].copy_from_slice(&77u32.to_le_bytes());
    let e = parse_gltf(&bad, Path::new(AT))
        .expect_err("bad index")
        .to_string();
    assert!(
        e.contains(AT) && e.contains("shirt") && e.contains("face 3") && e.contains("77"),
        "{e}"
    );
    let mut nan = bytes.clone();
    nan[bin..bin + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    let e = parse_gltf(&nan, Path::new(AT))
        .expect_err("NaN")
        .to_string();
    assert!(e.contains("vertex 0"), "{e}");
    for cut in 0..bytes.len() {
        assert!(
            parse_gltf(&bytes[..cut], Path::new(AT)).is_err(),
            "cut at {cut}"
        );
    }
    let text = r#"{"asset":{"version":"2.0"},"buffers":[{"byteLength":4,"uri":"../../etc/passwd"}],"scenes":[{"nodes":[]}]}"#;
    let e = parse_gltf(text.as_bytes(), Path::new("a.gltf"))
        .expect_err("outside")
        .to_string();
    assert!(e.contains("out of the folder"), "{e}");
    let p = points();
    let hole = GlbMesh {
        name: "hole",
        vertices: &p,
        faces: &[[0, 1, 9]],
        uv: &[],
        color: [0; 3],
        texture: &[],
    };
    let e = encode_glb(&[hole], &[], 1.0, Path::new(AT))
        .expect_err("hole")
        .to_string();
    assert!(
        e.contains("hole") && e.contains("face 0") && e.contains('9'),
        "{e}"
    );
}

/// A square whose texture has the colours of its corners in four pixels.
fn textured(png: &[u8]) -> Result<Vec<u8>, crate::FormatError> {
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let vertices = corners.map(|[x, y]| P3::new(x, 1.0 - y, 0.0));
    let square = GlbMesh {
        name: "square",
        vertices: &vertices,
        faces: &[[0, 2, 1], [0, 3, 2]],
        uv: &corners,
        color: [255; 3],
        texture: png,
    };
    encode_glb(&[square], &[], 1.0, Path::new(AT))
}

#[test]
fn textures_are_written_and_read_back() {
    let colors = [[250, 10, 0], [0, 200, 30], [40, 0, 220], [128, 129, 130]];
    let [a, b, c, d] = colors;
    let pixels = ColorImage::new(2, 2, [a, b, d, c].concat()).expect("sizes");
    let png = encode_png_rgb(&pixels, Path::new(AT)).expect("encoded");
    let bytes = textured(&png).expect("encodes");

    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("square.glb");
    std::fs::write(&path, bytes).expect("written");
    let scan = read_gltf_scan(&path).expect("reads");
    for (got, wanted) in scan.colors.iter().zip(colors) {
        for (g, w) in got.iter().zip(wanted) {
            assert!((g - f32::from(w)).abs() < 0.5, "{got:?} for {wanted:?}");
        }
    }
    let middle = scan
        .texture
        .iter()
        .find(|t| t.face == 0 && t.weights[2] > 0.5);
    assert!(middle.is_some(), "{:?}", scan.texture);
    let e = textured(b"BM").expect_err("a bitmap").to_string();
    assert!(e.contains("`square`.texture"), "{e}");
}

#[test]
fn normals_are_shared_by_vertices_at_one_position() {
    // Two triangles at a right angle whose common edge has vertices of its own in each.
    let p = [
        [0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 0.0, 1.0],
    ]
    .map(P3::from);
    let [a, b, c, d] = p;
    let vertices = [a, b, c, a, b, d];
    let normals = super::surface::normals(&vertices, &[[0, 2, 1], [3, 4, 5]]);
    assert_eq!(normals[0], normals[3]);
    assert_eq!(normals[1], normals[4]);
    assert!(normals[2] != normals[0] && normals[5] != normals[0]);
}

#[test]
fn damaged_bytes_never_panic() {
    let bytes = encoded(&[]).expect("encodes");
    let mut x = 0x1234_5678u32;
    for _ in 0..3000 {
        x ^= x << 13;
        x ^= x >> 17;
        x ^= x << 5;
        let mut b = bytes.clone();
        let n = b.len();
        b[x as usize % n] = (x >> 24) as u8;
        let _ = parse_gltf(&b, Path::new(AT));
    }
}

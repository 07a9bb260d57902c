use super::{folder, read_bytes, refusal};
use crate::image::{encode_png_rgb, write_png_rgb};
use serde_json::{Value, json};
use std::path::Path;
use tryon_geometry::camera::ColorImage;
use tryon_geometry::math::P3;

/// Texture with a red and green upper row and a blue and white lower row.
fn texture() -> ColorImage {
    let pixels = vec![255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255];
    ColorImage::new(2, 2, pixels).expect("sizes")
}

/// Quad with its corners at the corners of the texture.
const QUAD: &str = "mtllib my scan.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 nan\n\
    vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvt 0.5 0.5\nusemtl skin\n";

#[test]
fn an_obj_takes_its_colours_from_the_texture() {
    let dir = folder();
    let at = |name: &str| dir.path().join(name);
    std::fs::write(at("my scan.mtl"), "newmtl skin\nKd 1 1 1\nmap_Kd t.png\n").expect("written");
    let text = format!("{QUAD}f 1/1/7 2/2/7 3/3/7 4/4/7");
    let e = refusal(dir.path(), "a.obj", text.as_bytes());
    assert!(
        e.contains("a.obj") && e.contains("map_Kd") && e.contains("t.png"),
        "{e}"
    );
    write_png_rgb(&at("t.png"), &texture()).expect("written");
    let scan = read_bytes(dir.path(), "a.obj", text.as_bytes()).expect("valid");
    let corners = [[0, 0, 255], [255, 255, 255], [0, 255, 0], [255, 0, 0]];
    assert_eq!(scan.colors, corners, "v counts upwards");
    assert_eq!(scan.faces, [[0, 1, 2], [0, 2, 3]]);
    assert!(scan.points[3].z.is_nan());
    // Seam: vertex 2 is white in one face and red in the other; the middle of the texture is grey.
    let seam = format!("{QUAD}f 1/5 2/2 3/3\nf 1/5 3/3 4/4\nf 1/5 4/4 2/4");
    let scan = read_bytes(dir.path(), "a.obj", seam.as_bytes()).expect("valid");
    assert_eq!(scan.colors[0], [128, 128, 128]);
    assert_eq!(scan.colors[1], [255, 128, 128]);
}

#[test]
fn textures_are_sampled_between_vertices() {
    let dir = folder();
    let at = |name: &str| dir.path().join(name);
    std::fs::write(at("s.mtl"), "newmtl cloth\nmap_Kd t.png\n").expect("written");
    // A column of light in the middle, which no corner shows.
    let pixel = |i: usize| if i % 30 / 10 == 1 { 250 } else { 20 };
    let pixels = (0..30 * 30).flat_map(|i| [pixel(i); 3]).collect();
    write_png_rgb(
        &at("t.png"),
        &ColorImage::new(30, 30, pixels).expect("sizes"),
    )
    .expect("written");
    let text = "mtllib s.mtl\nv 0 0 0\nv 3 0 0\nv 3 3 0\nv 0 3 0\n\
        vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl cloth\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n";
    let scan = read_bytes(dir.path(), "a.obj", text.as_bytes()).expect("valid");
    assert_eq!(scan.colors, [[20; 3]; 4]);
    assert!(scan.texture.len() > 1800, "{}", scan.texture.len());
    for t in &scan.texture {
        let corners = scan.faces[t.face as usize].map(|v| scan.points[v as usize]);
        let x: f32 = (0..3).map(|k| t.weights[k] * corners[k].x).sum();
        if (x - 1.0).abs() > 0.06 && (x - 2.0).abs() > 0.06 {
            let wanted = if (1.0..2.0).contains(&x) { 250 } else { 20 };
            assert_eq!(t.color, [wanted; 3], "{x}");
        }
    }
}

#[test]
fn plain_materials_and_vertices_without_one_are_coloured() {
    let dir = folder();
    let at = |name: &str| dir.path().join(name);
    let text = format!("{QUAD}f 1 2 3");
    let e = refusal(dir.path(), "a.obj", text.as_bytes());
    assert!(e.contains("mtllib") && e.contains("my"), "{e}");
    std::fs::write(at("my scan.mtl"), "newmtl skin\nKd 1 0.2 0\n").expect("written");
    let scan = read_bytes(dir.path(), "a.obj", text.as_bytes()).expect("valid");
    assert_eq!(scan.colors, [[255, 51, 0]; 4], "the fourth has the mean");
    let text = text.replace("usemtl skin", "usemtl other");
    let scan = read_bytes(dir.path(), "a.obj", text.as_bytes()).expect("valid");
    assert!(scan.colors.is_empty());
}

#[test]
fn vertex_colours_of_an_obj_win() {
    let dir = folder();
    let text =
        "mtllib none.mtl\nv 0 0 0 1 0.5 0\nv 1 0 0 0 0 0.2\nv 0 1 0\nusemtl m\nf 1 2 3\nf 1 1 2\n";
    let scan = read_bytes(dir.path(), "a.obj", text.as_bytes()).expect("valid");
    assert_eq!(scan.colors, [[255, 128, 0], [0, 0, 51], [128, 64, 26]]);
    assert_eq!(scan.faces.len(), 1, "a degenerate face is left out");
    let scan = read_bytes(dir.path(), "a.obj", b"v 0 0 0 9 8 7\nv 0 0 0 200 1 1").expect("valid");
    assert_eq!(scan.colors, [[9, 8, 7], [200, 1, 1]]);
    let e = refusal(dir.path(), "a.obj", b"v 0 0 0\nf 1 1 2");
    assert!(e.contains("line 2: face 0") && e.contains("index 2"), "{e}");
}

/// Rows of an accessor: component type, type, bytes, and true for integers as fractions.
struct AccessorRows<'a>(u32, &'a str, &'a [u8], bool);

const FLOAT: u32 = 5126;
const BYTE: u32 = 5121;
const SHORT: u32 = 5123;

/// GLB of one triangle whose node shifts it by (1, 2, 3).
fn glb(attributes: &[(&str, AccessorRows<'_>)], material: Value, image: Option<&[u8]>) -> Vec<u8> {
    let (mut binary, mut views, mut accessors) = (Vec::new(), Vec::new(), Vec::new());
    let mut view = |data: &[u8]| {
        views.push(json!({"buffer": 0, "byteOffset": binary.len(), "byteLength": data.len()}));
        binary.extend(data);
        binary.resize(binary.len().next_multiple_of(4), 0);
        views.len() - 1
    };
    let points: Vec<u8> = [0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    accessors.push(
        json!({"bufferView": view(&points), "componentType": FLOAT, "type": "VEC3",
        "count": 3, "min": [0, 0, 0], "max": [1, 1, 0]}),
    );
    let mut names = json!({"POSITION": 0});
    for (name, AccessorRows(component, kind, data, normalized)) in attributes {
        names[*name] = json!(accessors.len());
        accessors.push(json!({"bufferView": view(data), "componentType": component,
            "type": kind, "count": 3, "normalized": normalized}));
    }
    let mut root = json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "translation": [1, 2, 3]}], "accessors": accessors,
    });
    let mut primitive = json!({"attributes": names});
    if !material.is_null() {
        root["materials"] = json!([material]);
        primitive["material"] = json!(0);
    }
    if let Some(image) = image {
        root["images"] = json!([{"bufferView": view(image)}]);
        root["textures"] = json!([{"source": 0}]);
    }
    root["meshes"] = json!([{"primitives": [primitive]}]);
    root["bufferViews"] = json!(views);
    root["buffers"] = json!([{"byteLength": binary.len()}]);
    container(&root, &binary)
}

fn container(root: &Value, binary: &[u8]) -> Vec<u8> {
    let mut text = root.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut out = b"glTF\x02\0\0\0".to_vec();
    out.extend((28 + text.len() as u32 + binary.len() as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", text.as_slice()), (b"BIN\0", binary)] {
        out.extend((chunk.len() as u32).to_le_bytes());
        out.extend(kind);
        out.extend(chunk);
    }
    out
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|x| x.to_le_bytes()).collect()
}

#[test]
fn vertex_colours_of_a_glb_are_linear() {
    let dir = folder();
    let float = floats(&[1.0, 0.5, 0.0, 0.2, 0.2, 0.2, 0.0, 0.0, 1.0]);
    let short: Vec<u8> = [
        65_535u16, 32_768, 0, 65_535, 13_107, 13_107, 13_107, 0, 0, 0, 65_535, 0,
    ]
    .iter()
    .flat_map(|x| x.to_le_bytes())
    .collect();
    let byte = [255, 128, 0, 1, 51, 51, 51, 1, 0, 0, 255, 1];
    for rows in [
        AccessorRows(FLOAT, "VEC3", &float, false),
        AccessorRows(SHORT, "VEC4", &short, true),
        AccessorRows(BYTE, "VEC4", &byte, true),
    ] {
        let bytes = glb(&[("COLOR_0", rows)], Value::Null, None);
        let scan = read_bytes(dir.path(), "a.glb", &bytes).expect("valid");
        assert_eq!(scan.colors, [[255, 188, 0], [124, 124, 124], [0, 0, 255]]);
        assert_eq!(scan.points[1], P3::new(2.0, 2.0, 3.0), "the node moves it");
        assert_eq!(scan.faces, [[0, 1, 2]]);
    }
    let bytes = glb(&[], Value::Null, None);
    let scan = read_bytes(dir.path(), "a.glb", &bytes).expect("valid");
    assert!(scan.colors.is_empty());
}

/// Material with this base colour factor and the first texture.
fn textured(factor: [f32; 4]) -> Value {
    json!({"pbrMetallicRoughness": {"baseColorFactor": factor, "baseColorTexture": {"index": 0}}})
}

#[test]
fn a_glb_takes_its_colours_from_the_embedded_texture() {
    let dir = folder();
    let png = encode_png_rgb(&texture(), Path::new("t.png")).expect("encodes");
    let uv = floats(&[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
    let rows = || AccessorRows(FLOAT, "VEC2", &uv, false);
    let bytes = glb(&[("TEXCOORD_0", rows())], textured([1.0; 4]), Some(&png));
    let scan = read_bytes(dir.path(), "a.glb", &bytes).expect("valid");
    assert_eq!(
        scan.colors,
        [[255, 0, 0], [0, 255, 0], [0, 0, 255]],
        "v counts downwards"
    );
    let half = textured([0.5, 1.0, 1.0, 1.0]);
    let bytes = glb(&[("TEXCOORD_0", rows())], half, Some(&png));
    let scan = read_bytes(dir.path(), "a.glb", &bytes).expect("valid");
    assert_eq!(scan.colors[0], [188, 0, 0], "the factor is linear");
    let e = refusal(
        dir.path(),
        "a.glb",
        &glb(&[], textured([1.0; 4]), Some(&png)),
    );
    assert!(e.contains("TEXCOORD_0"), "{e}");
    for cut in (0..bytes.len()).step_by(7) {
        assert!(read_bytes(dir.path(), "a.glb", &bytes[..cut]).is_err());
    }
}

#[test]
fn a_gltf_takes_its_colours_from_files_beside_it_or_the_factor() {
    let dir = folder();
    let uv = [0, 0, 255, 0, 0, 255, 0, 0];
    let root = |material: Value| {
        json!({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}], "materials": [material],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0}]}],
            "accessors": [
                {"bufferView": 0, "componentType": FLOAT, "type": "VEC3", "count": 3, "min": [0, 0, 0], "max": [1, 1, 0]},
                {"bufferView": 1, "componentType": BYTE, "type": "VEC2", "count": 3, "normalized": true}],
            "bufferViews": [
                {"buffer": 0, "byteOffset": 0, "byteLength": 36},
                {"buffer": 0, "byteOffset": 36, "byteLength": 8}],
            "buffers": [{"byteLength": 44, "uri": "my%20scan.bin"}],
            "images": [{"uri": "t.png"}], "textures": [{"source": 0}],
        })
        .to_string()
    };
    let mut binary = floats(&[0.0, 0.0, 0.0, 1.0, f32::NAN, 0.0, 0.0, 1.0, 0.0]);
    binary.extend(uv);
    std::fs::write(dir.path().join("my scan.bin"), binary).expect("written");
    let text = root(textured([1.0; 4]));
    let e = refusal(dir.path(), "a.gltf", text.as_bytes());
    assert!(e.contains("base colour") && e.contains("t.png"), "{e}");
    write_png_rgb(&dir.path().join("t.png"), &texture()).expect("written");
    let scan = read_bytes(dir.path(), "a.gltf", text.as_bytes()).expect("valid");
    assert_eq!(scan.colors, [[255, 0, 0], [0, 255, 0], [0, 0, 255]]);
    assert!(scan.points[1].y.is_nan(), "kept");
    let plain = json!({"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.0, 1.0, 1.0]}});
    let scan = read_bytes(dir.path(), "a.gltf", root(plain).as_bytes()).expect("valid");
    assert_eq!(scan.colors, [[188, 0, 255]; 3]);
}

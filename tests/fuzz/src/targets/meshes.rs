//! Meshes: OBJ with MTL, scans, PLY, glTF.

use super::{Target, lossy, packed, text};
use crate::bundle::Bundle;
use crate::execute::Scratch;
use crate::pack;
use std::path::Path;
use tryon::formats::gltf::{GlbMesh, encode_glb, parse_gltf};
use tryon::formats::obj::parse_obj;
use tryon::formats::scan::{PlyMesh, read_scan, write_ply};
use tryon::formats::sewn_obj::parse_sewn_obj;
use tryon::garment::import::read_mesh;
use tryon::geometry::math::{P3, V3};

const OBJ_WORDS: &str = "v vt vn f o g s mtllib usemtl stitch 1/1/1 1//1 -1 map_Kd newmtl Kd \\";

const CLOTH: &str = "# a cloth\nmtllib cloth.mtl\nv 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\nv 0 1 0 1 1 1\n\
    vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 1\nusemtl red\ng front\nf 1/1/1 2/2/1 3/3/1\nf 1/1/1 3/3/1 4/4/1\n\
    stitch 0 1 2 0.5\n";
const MTL: &str = "newmtl red\nKd 1 0 0\nKa 0 0 0\nmap_Kd -s 1 1 1 cloth.png\n";

/// OBJ of meshes, garments and sewn garments.
pub(super) const OBJ: Target = Target::new(
    "obj",
    "src/formats/obj.rs, sewn_obj.rs, src/garment/import/file.rs",
    |b, scratch| {
        let (obj, at) = (lossy(b.first()), Path::new("input.obj"));
        let _ = parse_obj(&obj, at).map(|o| o.unwelded());
        let _ = parse_sewn_obj(&obj, at);
        let path = scratch.file("cloth.obj", b.first())?;
        let file = read_mesh(&path, None).map_err(text)?;
        Ok(file.sewn.obj.mesh.faces().len())
    },
    || vec![Bundle::of("cloth.obj", CLOTH)],
)
.words(OBJ_WORDS)
.allow(512 << 10, 400);

/// OBJ of scans with material and texture.
pub(super) const SCAN_OBJ: Target = Target::new(
    "scan-obj",
    "src/formats/scan/obj.rs, mtl.rs",
    |b, s| scan(b, s, "cloth.obj"),
    || {
        let bundle = Bundle::of("cloth.obj", CLOTH).and("cloth.mtl", MTL);
        vec![bundle.and("cloth.png", super::images::tiny_png())]
    },
)
.words(OBJ_WORDS)
.allow(1 << 20, 60_000);

/// PLY, text and binary.
pub(super) const PLY: Target = Target::new(
    "ply",
    "src/formats/scan/ply",
    |b, s| scan(b, s, "cloth.ply"),
    ply_seeds,
)
.words(
    "ply format ascii binary_little_endian binary_big_endian 1.0 element vertex face property \
     list uchar int uint float double x y z nx red label vertex_indices end_header comment \
     TextureFile",
);

/// Compressed and deformed meshes by other libraries.
const EXPORTED: [&str; 5] = [
    include_str!("../../../../src/garment/testdata/meshes/draco.gltf"),
    include_str!("../../../../src/garment/testdata/meshes/meshopt.gltf"),
    include_str!("../../../../src/garment/testdata/meshes/skin.gltf"),
    include_str!("../../../../src/garment/testdata/meshes/sparse.gltf"),
    include_str!("../../../../src/garment/testdata/meshes/instances.gltf"),
];

/// glTF as a garment and as a scan.
pub(super) const GLTF: Target = Target::new(
    "gltf",
    "src/formats/gltf/model.rs, src/formats/scan/gltf.rs",
    |b, scratch| {
        let parts = || pack::glb(b.get("model.json"), b.get("model.bin"));
        let file = packed(b, "model.glb", parts)?;
        let path = scratch.file("model.glb", &file)?;
        let model = parse_gltf(&file, &path).map(|m| m.parts.len());
        let scan = read_scan(&path).map(|s| s.points.len());
        model.or(scan).map_err(text)
    },
    gltf_seeds,
)
.words(
    "POSITION NORMAL TEXCOORD_0 COLOR_0 JOINTS_0 WEIGHTS_0 bufferView byteOffset byteLength \
     byteStride componentType count sparse indices mode uri data:, children matrix node scene \
     extensions KHR_texture_transform EXT_meshopt_compression KHR_draco_mesh_compression \
     KHR_mesh_quantization EXT_mesh_gpu_instancing targets weights skin normalized",
)
.allow(1 << 20, 60_000);

fn scan(b: &Bundle, scratch: &Scratch, name: &str) -> Result<usize, String> {
    let path = scratch.fill(b)?.join(name);
    read_scan(&path).map(|s| s.points.len()).map_err(text)
}

fn corners() -> Vec<P3> {
    let corners = [[0., 0.], [1., 0.], [1., 1.], [0., 1.]];
    corners.iter().map(|[x, y]| P3::new(*x, *y, 0.0)).collect()
}

fn ply_seeds() -> Vec<Bundle> {
    let ascii = "ply\nformat ascii 1.0\ncomment TextureFile t.png\nelement vertex 3\nproperty float x\n\
        property float y\nproperty float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
        element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 1 2 3\n1 0 0 4 5 6\n0 1 0 7 8 9\n\
        3 0 1 2\n";
    let big = ascii.replace("ascii", "binary_big_endian");
    let head = big.split("0 0 0 1").next().unwrap_or_default();
    let mut bytes = head.as_bytes().to_vec();
    for i in 0..3 {
        bytes.extend([0f32, 1.0, i as f32].iter().flat_map(|v| v.to_be_bytes()));
        bytes.extend([1, 2, 3]);
    }
    bytes.push(3);
    bytes.extend([0i32, 1, 2].iter().flat_map(|v| v.to_be_bytes()));

    let mut seeds = vec![
        Bundle::of("cloth.ply", ascii),
        Bundle::of("cloth.ply", bytes),
    ];
    let normals = vec![V3::z(); 4];
    let mesh = PlyMesh {
        points: &corners(),
        faces: &[[0, 1, 2], [0, 2, 3]],
        normals: &normals,
        colors: &[[9, 8, 7]; 4],
        labels: Some(&[0, 1, 2, 3]),
    };
    if let Ok(folder) = tempfile::tempdir() {
        let path = folder.path().join("a.ply");
        if write_ply(&path, &mesh).is_ok()
            && let Ok(bytes) = std::fs::read(path)
        {
            seeds.push(Bundle::of("cloth.ply", bytes));
        }
    }
    seeds
}

fn gltf_seeds() -> Vec<Bundle> {
    let (vertices, texture) = (corners(), super::images::tiny_png());
    let mesh = GlbMesh {
        name: "cloth",
        vertices: &vertices,
        faces: &[[0, 1, 2], [0, 2, 3]],
        uv: &[[0., 0.], [1., 0.], [1., 1.], [0., 1.]],
        color: [200, 30, 60],
        texture: &texture,
    };
    let glb = encode_glb(&[mesh], &[], 1.0, Path::new("model.glb")).unwrap_or_default();
    let parts = pack::unpack_glb(&glb).unwrap_or_default();
    let mut seeds = vec![Bundle::of("model.glb", glb), parts];
    seeds.extend(EXPORTED.map(|text| Bundle::of("model.glb", text)));
    seeds
}

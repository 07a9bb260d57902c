//! The house rules that a compiler does not know: layers, doors, charters and file budgets.
//!
//! The table below is the architecture as data. To change the architecture, change it here, in one reviewable place.

use std::fs;
use std::path::{Path, PathBuf};

/// Layer, module, charter: the first `//!` line of `src/<module>/mod.rs`, word for word.
const MODULES: &[(u8, &str, &str)] = &[
    (
        0,
        "math",
        "Small fixed-size algebra that nalgebra lacks: so(3)/se(3) maps, twists, polar, PSD projection, stable roots.",
    ),
    (
        0,
        "par",
        "The only door to rayon: parallel loops and reductions whose bits do not depend on the thread count.",
    ),
    (
        1,
        "mesh",
        "Triangle meshes and their topology, checked once at construction; normals, boundaries, UVs.",
    ),
    (
        1,
        "camera",
        "Intrinsics, depth and colour images, projection, noise models, what a sensor saw and when.",
    ),
    (
        1,
        "linear",
        "Sparse symmetric systems: assembly, factorisation, preconditioned iteration, with a report of how it went.",
    ),
    (
        2,
        "spatial",
        "Neighbours fast: BVH, grids, kd-tree (the only file naming kiddo), each beside its brute-force oracle.",
    ),
    (
        2,
        "raster",
        "Meshes to depth, colour and id images on the CPU: the fast path without a GPU, and the judge of the GPU.",
    ),
    (
        2,
        "formats",
        "Files in and out: MCAP, RGBD folders, npz bodies, OBJ, glTF, patterns. Bytes to domain types, never a panic.",
    ),
    (
        3,
        "body",
        "The articulated template: skeleton, twists, skinning, shape, bone scales, displacements; the embedded body; importers.",
    ),
    (
        3,
        "garment",
        "A garment before it moves: panels, seams, materials, rest shape, sizes, anchors.",
    ),
    (
        3,
        "contact",
        "Candidate pairs, continuous collision, distances and contact energies between moving triangles; it never steps time.",
    ),
    (
        3,
        "segment",
        "Which pixels are the person: floor, background, nearest body, edges.",
    ),
    (
        3,
        "registration",
        "Correspondences, robust kernels and Gauss–Newton that pull one surface onto another.",
    ),
    (
        4,
        "tracking",
        "One step from a frame and the last state to pose, displacements and a confidence report.",
    ),
    (
        4,
        "cloth",
        "One step of garment motion against a moving body: the real-time and the offline solvers.",
    ),
    (
        4,
        "clothcap",
        "Garments from scans: alignment, segmentation, multi-part templates, undressing, retargeting.",
    ),
    (
        4,
        "composite",
        "The captured image and the garments in one picture: visibility, shading, edges.",
    ),
    (
        5,
        "gpu",
        "wgpu twins of `raster` and `composite`, same inputs and outputs; the only module naming wgpu.",
    ),
    (
        5,
        "dressing",
        "A garment onto a body: panel placement, sewing, size choice, first drape, fit map.",
    ),
    (
        5,
        "synth",
        "Synthetic people, garments, cameras and sequences with known truth, for the demo, tests and benches.",
    ),
    (
        5,
        "session",
        "The life of one try-on as a pure transition table: Opening → Calibrating → Live ⇄ Degraded(why) → Draining → Closed.",
    ),
    (
        6,
        "evaluate",
        "Run time against error: standard scenes, methods side by side, tables and plots behind `tryon bench`.",
    ),
];

/// External crate, and the only path prefixes whose code may name it.
const DOORS: &[(&str, &[&str])] = &[
    ("rayon", &["src/par/"]),
    ("kiddo", &["src/spatial/kdtree.rs"]),
    ("wgpu", &["src/gpu/"]),
    ("faer", &["src/linear/"]),
    ("mcap", &["src/formats/"]),
    ("gltf", &["src/formats/"]),
    ("png", &["src/formats/"]),
    ("zune_jpeg", &["src/formats/"]),
    ("jpeg_encoder", &["src/formats/"]),
    ("npyz", &["src/formats/"]),
    ("plotters", &["src/evaluate/"]),
    ("zstd", &["src/formats/"]),
    // docs/hindsight.md: MCAP channels carry foxglove protobuf messages, so formats encodes those few itself.
    ("prost", &["proto/", "src/formats/foxglove.rs"]),
    ("tonic", &["proto/", "services/", "tests/"]),
    ("zenoh", &["services/kit/src/bus.rs"]),
    ("tokio", &["services/", "tests/", "proto/src/gen/"]),
];

/// Longest source file, lines. Around 200 is the aim; at 600 a file holds more than one idea.
const MAX_LINES: usize = 600;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn rust_files(dir: &Path, out: &mut Vec<PathBuf>) {
    let Ok(entries) = fs::read_dir(dir) else {
        return;
    };
    for entry in entries.flatten() {
        let path = entry.path();
        let name = entry.file_name();
        if path.is_dir() {
            if name != "target" && name != ".git" {
                rust_files(&path, out);
            }
        } else if path.extension().is_some_and(|e| e == "rs") {
            out.push(path);
        }
    }
}

fn all_files() -> Vec<(String, String)> {
    let mut files = Vec::new();
    for dir in ["src", "proto", "services", "tests", "benches", "examples"] {
        rust_files(&root().join(dir), &mut files);
    }
    files.sort();
    files
        .into_iter()
        .map(|p| {
            let rel = p
                .strip_prefix(root())
                .expect("inside the root")
                .to_string_lossy()
                .replace('\\', "/");
            (rel, fs::read_to_string(&p).expect("readable"))
        })
        .collect()
}

/// Source without comments (doc comments may name whatever they like). String literals stay; none names a crate path.
fn code(source: &str) -> String {
    source
        .lines()
        .map(|l| l.split("//").next().unwrap_or(""))
        .collect::<Vec<_>>()
        .join("\n")
}

/// First path segments after each `crate::`, also inside `use crate::{a::b, c}`.
fn modules_named(code: &str) -> Vec<String> {
    let ident = |s: &str| {
        s.chars()
            .take_while(|c| c.is_alphanumeric() || *c == '_')
            .collect::<String>()
    };
    let mut named = Vec::new();
    for (at, _) in code.match_indices("crate::") {
        if code[..at].ends_with('$')
            || code[..at]
                .chars()
                .last()
                .is_some_and(|c| c.is_alphanumeric() || c == '_')
        {
            continue;
        }
        let rest = &code[at + "crate::".len()..];
        if let Some(group) = rest.strip_prefix('{') {
            let (mut depth, mut start) = (1, true);
            for (i, c) in group.char_indices() {
                match c {
                    '{' => depth += 1,
                    '}' => depth -= 1,
                    ',' if depth == 1 => start = true,
                    _ if start && depth == 1 && !c.is_whitespace() => {
                        named.push(ident(&group[i..]));
                        start = false;
                    }
                    _ => {}
                }
                if depth == 0 {
                    break;
                }
            }
        } else {
            named.push(ident(rest));
        }
    }
    named
}

fn layer_of(module: &str) -> Option<u8> {
    MODULES.iter().find(|m| m.1 == module).map(|m| m.0)
}

#[test]
fn a_module_uses_only_lower_layers() {
    let mut faults = Vec::new();
    for (path, source) in all_files() {
        let Some(module) = path
            .strip_prefix("src/")
            .and_then(|p| p.split_once('/'))
            .map(|p| p.0)
        else {
            continue;
        };
        let Some(own) = layer_of(module) else {
            faults.push(format!("{path}: module `{module}` is not in the table"));
            continue;
        };
        for other in modules_named(&code(&source)) {
            if other == module {
                continue;
            }
            if let Some(layer) = layer_of(&other).filter(|layer| *layer >= own) {
                faults.push(format!(
                    "{path}: `{module}` (layer {own}) uses `{other}` (layer {layer})"
                ));
            }
        }
    }
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}

#[test]
fn external_crates_stay_behind_their_doors() {
    let mut faults = Vec::new();
    for (path, source) in all_files() {
        if path == "tests/tidy.rs" {
            continue;
        }
        let text = code(&source);
        for (name, doors) in DOORS {
            if doors.iter().any(|d| path.starts_with(d)) {
                continue;
            }
            let pattern = format!("{name}::");
            let named = text.match_indices(&pattern).any(|(at, _)| {
                // `formats::mcap::…` is ours, `mcap::…` at the start of a path is the crate.
                let before = &text[..at];
                !before.ends_with("::")
                    && !before
                        .chars()
                        .last()
                        .is_some_and(|c| c.is_alphanumeric() || c == '_')
            });
            if named {
                faults.push(format!(
                    "{path}: names `{name}`, whose door is {}",
                    doors.join(", ")
                ));
            }
        }
    }
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}

#[test]
fn every_module_opens_with_its_charter() {
    for (_, module, charter) in MODULES {
        let path = root().join("src").join(module).join("mod.rs");
        let source =
            fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        assert_eq!(
            source.lines().next(),
            Some(format!("//! {charter}").as_str()),
            "{}",
            path.display()
        );
    }
}

#[test]
fn files_stay_small() {
    let faults: Vec<String> = all_files()
        .into_iter()
        .filter(|(path, _)| !path.starts_with("proto/src/gen/"))
        .map(|(path, source)| (path, source.lines().count()))
        .filter(|(_, lines)| *lines > MAX_LINES)
        .map(|(path, lines)| format!("{path}: {lines} lines (at most {MAX_LINES})"))
        .collect();
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}

#[test]
fn services_do_not_depend_on_each_other() {
    let services = [
        "tryon-capture",
        "tryon-tracking",
        "tryon-cloth",
        "tryon-compositor",
    ];
    for own in services {
        let dir = own.trim_start_matches("tryon-");
        let manifest = fs::read_to_string(root().join("services").join(dir).join("Cargo.toml"))
            .expect("manifest");
        // Only the production dependencies: tests may start a neighbour.
        let production = manifest.split("[dev-dependencies]").next().unwrap_or("");
        for other in services.iter().filter(|s| **s != own) {
            assert!(
                !production.lines().any(|l| l.starts_with(other)),
                "{own} depends on {other}"
            );
        }
    }
}

#[test]
fn the_scanner_sees_grouped_and_plain_paths() {
    let found = modules_named(
        "use crate::{math::{P3, V3}, mesh};\nlet x = crate::raster::View; $crate::par::x",
    );
    assert_eq!(found, ["math", "mesh", "raster"]);
}

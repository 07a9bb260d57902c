//! The house rules that a compiler does not know: layers, doors, charters, import circles, budgets, wording.
//!
//! The table below is the architecture as data. To change the architecture, change it here, in one reviewable place.

#[path = "tidy/imports.rs"]
mod imports;
#[path = "tidy/nouns.rs"]
mod nouns;
#[path = "tidy/source.rs"]
mod source;

use source::{SourceFile, code, code_without_tests, root};
use std::collections::BTreeMap;
use std::fs;

/// Layer, module, charter: the first `//!` line of `src/<module>/mod.rs`, word for word.
const MODULES: &[(u8, &str, &str)] = &[
    (
        0,
        "math",
        "Small fixed-size algebra that nalgebra lacks: so(3)/se(3) maps, twists, polar rotation, PSD projection, element energy, derivative check.",
    ),
    (
        0,
        "par",
        "The only door to rayon: parallel loops and reductions whose bits do not depend on the thread count.",
    ),
    (
        1,
        "mesh",
        "Triangle meshes and their topology, checked once at construction; normals, boundaries, isotropic remeshing, neighbour smoothing.",
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
        "Neighbours fast: refit BVH (closest, overlap, ray parity), hash grid, kd-tree (the only file naming kiddo), organised image, each beside its brute-force oracle.",
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
        "The articulated template: skeleton, twists, skinning, shape, bone scales, displacements, the one map from vertices to parts and limbs; the embedded body; importers.",
    ),
    (
        3,
        "garment",
        "A garment before it moves: panels, seams, materials, rest shape, sizes, anchors.",
    ),
    (
        3,
        "contact",
        "The collision body of a pose: filtered, parts and joints separated; its closest points, inside tests and virtual depth maps. Contact pairs: broad phase, continuous collision detection, distances, barrier, friction.",
    ),
    (
        3,
        "elastic",
        "Elasticity of a thin sheet in f64: stretch and bend laws, membranes, hinges, dihedral angles, the cloth model with its masses, assembly.",
    ),
    (
        3,
        "segment",
        "The pixels of the person: floor, background, nearest body, edges, body parts.",
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
        "One step of garment motion against a moving body, `filter → collide → solve → commit → sleep`: `model/` (sheet, membrane, bending, partition), `solver/` (explicit, xpbd, implicit behind one trait), `sleep/`, `repair/`.",
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
        "Synthetic people, garments, cameras and sequences with known truth.",
    ),
    (
        5,
        "clothcap",
        "Garments from scans: alignment, segmentation, multi-part templates, undressing, retargeting.",
    ),
    (
        5,
        "offline",
        "Offline cloth on contact that never fails: steps, static drape, animation, checkpoints, obstacle springs.",
    ),
    (
        5,
        "session",
        "The life of one try-on as a pure transition table: Opening → Calibrating → Live ⇄ Degraded(why) → Draining → Closed.",
    ),
    (
        6,
        "mirror",
        "Frame to picture for one person: track, choose size, dress, simulate, composite; the one chain that command line and services share.",
    ),
    (
        7,
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
    ("mcap", &["src/formats/", "tests/fuzz/src/pack.rs"]),
    ("gltf", &["src/formats/"]),
    ("png", &["src/formats/"]),
    ("zune_jpeg", &["src/formats/"]),
    ("jpeg_encoder", &["src/formats/"]),
    ("npyz", &["src/formats/"]),
    ("plotters", &["src/evaluate/"]),
    ("robust", &["src/contact/edge_triangle.rs"]),
    ("zstd", &["src/formats/"]),
    // docs/decisions/050-recordings.md: MCAP channels carry foxglove protobuf messages, so formats encodes those few itself.
    ("prost", &["proto/", "src/formats/foxglove.rs"]),
    ("tonic", &["proto/", "services/", "tests/"]),
    (
        "zenoh",
        &["services/kit/src/bus.rs", "services/kit/src/bus/"],
    ),
    ("tokio", &["services/", "tests/", "proto/src/gen/"]),
];

/// Longest source file, lines. Around 200 is the aim; at 600 a file holds more than one idea.
const MAX_LINES: usize = 600;
/// Longest function, lines from `fn` to its closing brace. Around 30 is the aim.
const MAX_FUNCTION_LINES: usize = 80;
/// Most parameters of a function without `self`; more are a struct with a meaning of its own.
const MAX_PARAMETERS: usize = 5;
/// Longest document, bytes: what a person reads in one sitting.
const MAX_DOCUMENT_BYTES: usize = 20_000;
/// Words that no comment opens with: a comment says what a thing is, by the field's term.
const OPENINGS: &[&str] = &["What", "Which", "Whether", "Where", "How far", "So many"];
/// Type names that each module may use for its own step; every other name has one meaning.
const SHARED_NAMES: &[&str] = &[
    "Model",
    "State",
    "Input",
    "Workspace",
    "Config",
    "StepReport",
    "StepError",
];

/// Fails with one line a fault.
fn assert_none(faults: &[String]) {
    assert!(
        faults.is_empty(),
        "{} faults\n{}",
        faults.len(),
        faults.join("\n")
    );
}

fn layer_of(module: &str) -> Option<u8> {
    MODULES.iter().find(|m| m.1 == module).map(|m| m.0)
}

/// Top module of a file of the library.
fn module_of(file: &SourceFile) -> Option<&str> {
    let inner = file.path.strip_prefix("src/")?;
    inner.split_once('/').map(|p| p.0)
}

#[test]
fn a_module_uses_only_lower_layers() {
    let mut faults = Vec::new();
    for file in source::rust() {
        let Some(module) = module_of(&file) else {
            continue;
        };
        let Some(own) = layer_of(module) else {
            faults.push(format!(
                "{}: module `{module}` is not in the table",
                file.path
            ));
            continue;
        };
        for other in imports::modules_named(&code(&file.text)) {
            if let Some(layer) = layer_of(&other).filter(|l| other != module && *l >= own) {
                faults.push(format!(
                    "{}: `{module}` (layer {own}) uses `{other}` (layer {layer})",
                    file.path
                ));
            }
        }
    }
    assert_none(&faults);
}

#[test]
fn files_of_a_module_import_without_circles() {
    let sources = source::rust();
    let graph = imports::Library::new(&sources).imports();
    let circles = imports::circles(&graph);
    let faults: Vec<String> = circles.iter().map(|circle| circle.join(" ⇄ ")).collect();
    assert_none(&faults);
}

#[test]
fn external_crates_stay_behind_their_doors() {
    let mut faults = Vec::new();
    for file in source::rust() {
        if file.path.starts_with("tests/tidy") {
            continue;
        }
        let text = code(&file.text);
        for (name, doors) in DOORS {
            let behind = doors.iter().any(|d| file.path.starts_with(d));
            if !behind && imports::names_crate(&text, name) {
                faults.push(format!(
                    "{}: names `{name}`, whose door is {}",
                    file.path,
                    doors.join(", ")
                ));
            }
        }
    }
    assert_none(&faults);
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

/// True if a module holds a file or folder of this path, or declares an item of this name.
fn is_in_module(module: &str, files: &[SourceFile], name: &str) -> bool {
    let root = format!("src/{module}/");
    let is_item = |text: &str| {
        let kinds = ["struct", "enum", "trait", "fn"];
        kinds.iter().any(|kind| source::declares(text, kind, name))
    };
    let own = files.iter().filter(|f| f.path.starts_with(&root));
    own.into_iter().any(|f| {
        let inner = &f.path[root.len()..];
        inner == name
            || inner == format!("{name}.rs")
            || inner.starts_with(&format!("{name}/"))
            || is_item(&f.text)
    })
}

#[test]
fn each_noun_of_a_charter_is_a_file_or_an_item() {
    let files = source::rust();
    let mut faults = Vec::new();
    for (_, module, charter) in MODULES {
        if nouns::NOT_BUILT.contains(module) {
            let root = format!("src/{module}/");
            if files.iter().filter(|f| f.path.starts_with(&root)).count() > 1 {
                faults.push(format!(
                    "`{module}` has code: list the nouns of its charter"
                ));
            }
            continue;
        }
        let of_module = nouns::NOUNS.iter().find(|n| n.0 == *module);
        let of_module = of_module.map_or(&[][..], |n| n.1);
        for (noun, place) in of_module {
            if !charter.contains(noun) {
                faults.push(format!("`{module}`: its charter does not say `{noun}`"));
            }
            if !is_in_module(module, &files, place) {
                faults.push(format!(
                    "`{module}`: `{noun}` names `{place}`, which is not there"
                ));
            }
        }
        let listed = charter.split_once(": ").map_or(*charter, |c| c.1);
        for item in listed.split([',', ';', '→', '⇄']) {
            if !of_module
                .iter()
                .any(|(noun, _)| item.contains(noun) || noun.contains(item.trim()))
            {
                faults.push(format!(
                    "`{module}`: nothing is named for `{}`",
                    item.trim()
                ));
            }
        }
    }
    assert_none(&faults);
}

#[test]
fn files_stay_small() {
    let faults: Vec<String> = source::rust()
        .iter()
        .map(|file| (&file.path, file.text.lines().count()))
        .filter(|(_, lines)| *lines > MAX_LINES)
        .map(|(path, lines)| format!("{path}: {lines} lines (at most {MAX_LINES})"))
        .collect();
    assert_none(&faults);
}

#[test]
fn functions_fit_a_head() {
    let mut faults = Vec::new();
    for file in source::rust() {
        for f in source::functions(&file.text) {
            if f.length > MAX_FUNCTION_LINES {
                faults.push(format!(
                    "{}:{}: `{}` has {} lines (at most {MAX_FUNCTION_LINES})",
                    file.path, f.line, f.name, f.length
                ));
            }
        }
    }
    assert_none(&faults);
}

#[test]
fn functions_have_few_parameters() {
    let mut faults = Vec::new();
    for file in source::rust() {
        for f in source::signatures(&code(&file.text)) {
            if f.parameters > MAX_PARAMETERS {
                faults.push(format!(
                    "{}:{}: `{}` has {} parameters (at most {MAX_PARAMETERS})",
                    file.path, f.line, f.name, f.parameters
                ));
            }
        }
    }
    assert_none(&faults);
}

#[test]
fn comments_say_what_a_thing_is() {
    let mut faults = Vec::new();
    for file in source::rust() {
        for (n, line) in file.text.lines().enumerate() {
            let Some(comment) = line.trim_start().strip_prefix("//") else {
                continue;
            };
            let words = comment.trim_start_matches(['/', '!']).trim_start();
            let opens = |o: &&&str| {
                words
                    .strip_prefix(**o)
                    .is_some_and(|rest| !rest.starts_with(char::is_alphanumeric))
            };
            if let Some(opening) = OPENINGS.iter().find(opens) {
                let (path, line) = (&file.path, n + 1);
                faults.push(format!("{path}:{line}: a comment opens with `{opening}`"));
            }
        }
    }
    assert_none(&faults);
}

#[test]
fn a_type_name_has_one_meaning() {
    let mut places = BTreeMap::<String, Vec<String>>::new();
    for file in source::rust() {
        if module_of(&file).is_some() && !file.path.ends_with("tests.rs") {
            for name in source::types(&code_without_tests(&file.text)) {
                places.entry(name).or_default().push(file.path.clone());
            }
        }
    }
    let faults: Vec<String> = places
        .iter()
        .filter(|(name, files)| files.len() > 1 && !SHARED_NAMES.contains(&name.as_str()))
        .map(|(name, files)| format!("`{name}`: {}", files.join(", ")))
        .collect();
    assert_none(&faults);
}

#[test]
fn documents_fit_one_sitting() {
    let mut documents = source::files(&["docs", "deploy", "proto", "tests"], "md");
    for name in [
        "README.md",
        "ARCHITECTURE.md",
        "CHANGELOG.md",
        "CONTRIBUTING.md",
    ] {
        let text = fs::read_to_string(root().join(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
        documents.push(SourceFile {
            path: name.to_owned(),
            text,
        });
    }
    let faults: Vec<String> = documents
        .iter()
        .filter(|d| d.text.len() > MAX_DOCUMENT_BYTES)
        .map(|d| {
            format!(
                "{}: {} bytes (at most {MAX_DOCUMENT_BYTES})",
                d.path,
                d.text.len()
            )
        })
        .collect();
    assert_none(&faults);
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
fn the_scanner_reads_grouped_and_plain_paths() {
    let found = imports::modules_named(
        "use crate::{math::{P3, V3}, mesh};\nlet x = crate::raster::View; $crate::par::x",
    );
    assert_eq!(found, ["math", "math", "mesh", "raster"]);
}

#[test]
fn the_scanner_finds_circles_through_reexports_and_none_through_tests() {
    let file = |path: &str, text: &str| SourceFile {
        path: path.to_owned(),
        text: text.to_owned(),
    };
    let module = file(
        "src/m/mod.rs",
        "mod a;\nmod b;\nmod c;\npub use a::A;\npub use b::{B, f};\n",
    );
    let a = file("src/m/a.rs", "use super::B;\npub struct A(B);\n");
    let b = file(
        "src/m/b.rs",
        "pub struct B;\npub fn f(a: &super::a::A) {}\n",
    );
    let c = file(
        "src/m/c.rs",
        "use crate::m::{A, b::f};\n#[cfg(test)]\nmod tests {\n}\n",
    );
    let all = [module, a, b, c];
    let found = imports::circles(&imports::Library::new(&all).imports());
    assert_eq!(found, [["m::a", "m::b"]]);
    let tested = "pub struct B;\n#[cfg(test)]\nmod tests {\n    use super::super::a::A;\n}\n";
    let [module, a, _, c] = all;
    let all = [module, a, file("src/m/b.rs", tested), c];
    assert!(imports::circles(&imports::Library::new(&all).imports()).is_empty());
}

#[test]
fn the_scanner_counts_parameters_without_self() {
    let text = "fn f<T, U: Fn(T, u8) -> u8>(\n    &'a mut self,\n    (a, b): (T, u8),\n    f: impl Fn(u8, u8) -> u8,\n) {}\npub(crate) const fn g();\nfn h(self: Arc<Self>, x: [u8; 2], _: &str);\n";
    let found = source::signatures(text);
    let found: Vec<_> = found
        .iter()
        .map(|f| (&f.name[..], f.line, f.parameters))
        .collect();
    assert_eq!(found, [("f", 1, 2), ("g", 6, 0), ("h", 7, 2)]);
}

#[test]
fn the_scanner_measures_functions() {
    let text = "impl A {\n    pub(crate) const fn f(\n        x: u8,\n    ) -> u8 {\n        x\n    }\n    fn g();\n}\n";
    let found = source::functions(text);
    assert_eq!(found.len(), 1);
    assert_eq!(
        (found[0].name.as_str(), found[0].line, found[0].length),
        ("f", 2, 5)
    );
}

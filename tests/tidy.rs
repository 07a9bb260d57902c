//! The house rules that neither compiler nor clippy knows: wording, one name for one thing, sizes of files and documents,
//! import circles inside a crate.

#[path = "tidy/imports.rs"]
mod imports;
#[path = "tidy/source.rs"]
mod source;

use source::{SourceFile, code_without_tests, root};
use std::collections::BTreeMap;
use std::fs;

/// Longest source file, lines. Around 200 is the aim; at 600 a file holds more than one idea.
const MAX_LINES: usize = 600;
/// Longest document, bytes: what a person reads in one sitting.
const MAX_DOCUMENT_BYTES: usize = 20_000;
/// Longest decision record and longest file of benchmarks, bytes: one page.
const MAX_PAGE_BYTES: usize = 4_096;
/// Longest changelog, bytes: one line an entry, for users.
const MAX_CHANGELOG_BYTES: usize = 9_900;
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

#[test]
fn files_of_a_crate_import_without_circles() {
    let sources = source::rust();
    let graph = imports::Library::new(&sources).imports();
    let circles = imports::circles(&graph);
    let faults: Vec<String> = circles.iter().map(|circle| circle.join(" ⇄ ")).collect();
    assert_none(&faults);
}

#[test]
fn rooms_of_a_crate_import_downwards() {
    let sources = source::rust();
    let rooms = imports::rooms(&imports::Library::new(&sources).imports());
    let circles = imports::circles(&rooms);
    let faults: Vec<String> = circles.iter().map(|circle| circle.join(" ⇄ ")).collect();
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
        if file.path.starts_with("src/") && !file.path.ends_with("tests.rs") {
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
        .map(|d| (&d.path, d.text.len(), most_bytes(&d.path)))
        .filter(|(_, bytes, most)| bytes > most)
        .map(|(path, bytes, most)| format!("{path}: {bytes} bytes (at most {most})"))
        .collect();
    assert_none(&faults);
}

/// Longest document at `path`, bytes.
fn most_bytes(path: &str) -> usize {
    match path {
        "CHANGELOG.md" => MAX_CHANGELOG_BYTES,
        page if page.starts_with("docs/decisions/") || page.starts_with("docs/benchmarks/") => {
            MAX_PAGE_BYTES
        }
        _ => MAX_DOCUMENT_BYTES,
    }
}

#[test]
fn the_scanner_finds_circles_through_reexports_and_none_through_tests() {
    let file = |path: &str, text: &str| SourceFile {
        path: path.to_owned(),
        text: text.to_owned(),
    };
    let module = file(
        "src/m/lib.rs",
        "mod a;\nmod b;\nmod c;\npub use a::A;\npub use b::{B, f};\n",
    );
    let a = file("src/m/a.rs", "use super::B;\npub struct A(B);\n");
    let b = file(
        "src/m/b.rs",
        "pub struct B;\npub fn f(a: &super::a::A) {}\n",
    );
    let c = file(
        "src/m/c.rs",
        "use crate::{A, b::f};\n#[cfg(test)]\nmod tests {\n}\n",
    );
    let all = [module, a, b, c];
    let found = imports::circles(&imports::Library::new(&all).imports());
    assert_eq!(found, [["m::a", "m::b"]]);
    let tested = "pub struct B;\n#[cfg(test)]\nmod tests {\n    use super::super::a::A;\n}\n";
    let [module, a, _, c] = all;
    let all = [module, a, file("src/m/b.rs", tested), c];
    assert!(imports::circles(&imports::Library::new(&all).imports()).is_empty());
}

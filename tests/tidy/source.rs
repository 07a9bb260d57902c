//! The repository's text: files, code without comments and tests, functions, their lengths and parameters.

use std::fs;
use std::path::{Path, PathBuf};

/// One file: path from the root with forward slashes, and its text.
pub(crate) struct SourceFile {
    pub(crate) path: String,
    pub(crate) text: String,
}

/// Absolute path of the repository.
pub(crate) fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Files below `dirs` with this extension, sorted; build outputs, dependencies and generated code left out.
pub(crate) fn files(dirs: &[&str], extension: &str) -> Vec<SourceFile> {
    let mut paths = Vec::new();
    for dir in dirs {
        collect(&root().join(dir), extension, &mut paths);
    }
    paths.sort();
    let read = |path: PathBuf| {
        let relative = path.strip_prefix(root()).expect("inside the root");
        SourceFile {
            path: relative.to_string_lossy().replace('\\', "/"),
            text: fs::read_to_string(&path).expect("readable"),
        }
    };
    paths.into_iter().map(read).collect()
}

/// Rust written by hand.
pub(crate) fn rust() -> Vec<SourceFile> {
    files(
        &[
            "src", "proto", "services", "tests", "benches", "examples", "tools",
        ],
        "rs",
    )
}

fn collect(dir: &Path, extension: &str, out: &mut Vec<PathBuf>) {
    const LEFT_OUT: [&str; 5] = ["target", ".git", "gen", "node_modules", "out"];
    let Ok(entries) = fs::read_dir(dir) else {
        return;
    };
    for entry in entries.flatten() {
        let path = entry.path();
        if path.is_dir() {
            if !LEFT_OUT.iter().any(|name| entry.file_name() == *name) {
                collect(&path, extension, out);
            }
        } else if path.extension().is_some_and(|e| e == extension) {
            out.push(path);
        }
    }
}

/// Source without comments. String literals stay; none names a crate path.
pub(crate) fn code(source: &str) -> String {
    source
        .lines()
        .map(|l| l.split("//").next().unwrap_or(""))
        .collect::<Vec<_>>()
        .join("\n")
}

/// Code up to the file's own unit tests, which rustfmt leaves at its end.
pub(crate) fn code_without_tests(source: &str) -> String {
    let code = code(source);
    match code.find("#[cfg(test)]\nmod tests {") {
        Some(at) => code[..at].to_owned(),
        None => code,
    }
}

/// Names of the structs, enums and traits that code declares outside its tests, structs of `settings!` with them.
pub(crate) fn types(code: &str) -> Vec<String> {
    let mut names = Vec::new();
    let mut is_settings = false;
    for line in code.lines() {
        if !line.starts_with(' ') {
            is_settings = line.ends_with("settings! {") || (is_settings && line != "}");
        }
        let mut words = line.split_whitespace().peekable();
        while words
            .peek()
            .is_some_and(|w| w.starts_with("pub") || *w == "unsafe")
        {
            words.next();
        }
        if !matches!(words.next(), Some("struct" | "enum" | "trait"))
            || (line.starts_with(' ') && !is_settings)
        {
            continue;
        }
        let name = words.next().unwrap_or("");
        names.push(
            name.chars()
                .take_while(|c| c.is_alphanumeric() || *c == '_')
                .collect(),
        );
    }
    names
}

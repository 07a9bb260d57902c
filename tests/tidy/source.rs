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
        &["src", "proto", "services", "tests", "benches", "examples"],
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

/// True if the text declares an item: `declares("pub fn step(", "fn", "step")`.
pub(crate) fn declares(text: &str, kind: &str, name: &str) -> bool {
    let ends = |rest: &str| !rest.starts_with(|c: char| c.is_alphanumeric() || c == '_');
    let item = format!("{kind} {name}");
    let mut found = text.match_indices(&item);
    found.any(|(at, words)| ends(&text[at + words.len()..]))
}

/// A function as rustfmt lays it out.
pub(crate) struct Function {
    pub(crate) name: String,
    /// Line of `fn`, from 1.
    pub(crate) line: usize,
    /// Lines from `fn` to its closing brace.
    pub(crate) length: usize,
}

/// Functions with a body of more than one line, nested ones too.
pub(crate) fn functions(source: &str) -> Vec<Function> {
    let lines: Vec<&str> = source.lines().collect();
    let mut found = Vec::new();
    for (n, line) in lines.iter().enumerate() {
        let Some(name) = function_name(line) else {
            continue;
        };
        let indent = &line[..line.len() - line.trim_start().len()];
        let close = format!("{indent}}}");
        let one_line = line.ends_with(';') || line.ends_with('}');
        let end = lines[n + 1..].iter().position(|l| {
            let declared_only =
                l.starts_with(indent) && !l[indent.len()..].starts_with(' ') && l.ends_with(';');
            *l == close || declared_only
        });
        if let (false, Some(end)) = (one_line, end) {
            found.push(Function {
                name,
                line: n + 1,
                length: end + 2,
            });
        }
    }
    found
}

/// A function as declared.
pub(crate) struct Signature {
    pub(crate) name: String,
    /// Line of `fn`, from 1.
    pub(crate) line: usize,
    /// Number of parameters without `self`.
    pub(crate) parameters: usize,
}

/// Functions with or without a body, nested ones too.
pub(crate) fn signatures(code: &str) -> Vec<Signature> {
    let lines: Vec<&str> = code.lines().collect();
    let mut found = Vec::new();
    for (n, line) in lines.iter().enumerate() {
        if let Some(name) = function_name(line) {
            found.push(Signature {
                name,
                line: n + 1,
                parameters: parameters(&lines[n..].join("\n")),
            });
        }
    }
    found
}

/// Number of parameters without `self` of the function that opens the text.
fn parameters(text: &str) -> usize {
    let (mut depth, mut start, mut list) = (0_usize, 0, Vec::new());
    for (at, c) in text.char_indices() {
        match c {
            '(' | '[' | '{' | '<' => {
                if depth == 0 {
                    start = at + 1;
                    list.clear(); // generics, or `pub(crate)`
                }
                depth += 1;
            }
            ',' if depth == 1 => {
                list.push(&text[start..at]);
                start = at + 1;
            }
            '>' if text[..at].ends_with('-') => {}
            ')' | ']' | '}' | '>' => {
                depth = depth.saturating_sub(1);
                if depth == 0 && c == ')' && !text[..start].ends_with("pub(") {
                    list.push(&text[start..at]);
                    break;
                }
            }
            _ => {}
        }
    }
    let is_self = |p: &str| p.ends_with("self") || p.starts_with("self:");
    let list = list.iter().map(|p| p.trim());
    list.filter(|p| !p.is_empty() && !is_self(p)).count()
}

/// Name declared by a line that opens a function, with any qualifiers before `fn`.
fn function_name(line: &str) -> Option<String> {
    let (before, after) = line.split_once("fn ")?;
    let qualifier = |word: &str| {
        word.starts_with("pub")
            || ["const", "async", "unsafe", "extern", "\"C\"", "crate)"].contains(&word)
    };
    before.split_whitespace().all(qualifier).then_some(())?;
    let name: String = after
        .chars()
        .take_while(|c| c.is_alphanumeric() || *c == '_')
        .collect();
    (!name.is_empty()).then_some(name)
}

/// Names of the structs, enums, traits and type aliases that code declares outside its tests.
pub(crate) fn types(code: &str) -> Vec<String> {
    let mut names = Vec::new();
    for line in code.lines() {
        let mut words = line.split_whitespace().peekable();
        while words
            .peek()
            .is_some_and(|w| w.starts_with("pub") || *w == "unsafe")
        {
            words.next();
        }
        if !matches!(words.next(), Some("struct" | "enum" | "trait")) || line.starts_with(' ') {
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

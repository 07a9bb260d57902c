//! Import graph of the library: which file names items of which other file.

use super::source::{SourceFile, code_without_tests};
use std::collections::{BTreeMap, BTreeSet};

/// Paths that begin with `crate::`, `self::` or `super::`, groups expanded, as segments.
fn paths(code: &str) -> Vec<Vec<String>> {
    let mut found = Vec::new();
    for root in ["crate::", "self::", "super::"] {
        for (at, _) in code.match_indices(root) {
            let before = code[..at].chars().last();
            if before.is_some_and(|c| c.is_alphanumeric() || "_$:".contains(c)) {
                continue;
            }
            expand(&code[at..], &mut Vec::new(), &mut found);
        }
    }
    found
}

/// Appends the paths of the use tree that `text` begins with; returns the bytes it takes.
fn expand(text: &str, prefix: &mut Vec<String>, out: &mut Vec<Vec<String>>) -> usize {
    let name: String = text
        .chars()
        .take_while(|c| c.is_alphanumeric() || *c == '_')
        .collect();
    let rest = &text[name.len()..];
    if name.is_empty() {
        return if rest.starts_with('{') {
            expand_group(rest, prefix, out)
        } else {
            0
        };
    }
    prefix.push(name.clone());
    let mut taken = name.len();
    match rest.strip_prefix("::") {
        Some(more) if more.starts_with(|c: char| c.is_alphabetic() || c == '_' || c == '{') => {
            taken += 2 + expand(more, prefix, out);
        }
        _ => out.push(prefix.clone()),
    }
    prefix.pop();
    taken
}

fn expand_group(text: &str, prefix: &mut Vec<String>, out: &mut Vec<Vec<String>>) -> usize {
    let mut at = 1;
    while at < text.len() && !text[at..].starts_with('}') {
        let taken = expand(&text[at..], prefix, out);
        at += taken.max(1);
    }
    at + 1
}

/// Crate and module path of a file of `src/`: `src/a/b.rs` and `src/a/b/mod.rs` are `a::b`, `src/a/lib.rs` is `a`.
fn module_path(path: &str) -> Vec<String> {
    let inner = path.strip_prefix("src/").unwrap_or(path);
    let inner = inner.strip_suffix(".rs").unwrap_or(inner);
    let inner = inner.strip_suffix("/mod").unwrap_or(inner);
    let inner = inner.strip_suffix("/lib").unwrap_or(inner);
    inner.split('/').map(str::to_owned).collect()
}

/// Path segments from the crate on, `from` being the module that names them.
fn absolute(from: &[String], path: &[String]) -> Vec<String> {
    let mut base: Vec<String> = if path[0] == "crate" {
        from[..1].to_vec()
    } else {
        from.to_vec()
    };
    for segment in path {
        match segment.as_str() {
            "crate" | "self" => {}
            "super" => {
                base.pop();
            }
            name => base.push(name.to_owned()),
        }
    }
    base
}

/// Files of the library and the re-exports of each `mod.rs`.
pub(crate) struct Library<'a> {
    files: BTreeMap<Vec<String>, &'a SourceFile>,
    /// Module path and item name → absolute path of the item that is re-exported.
    reexports: BTreeMap<(Vec<String>, String), Vec<String>>,
}

impl<'a> Library<'a> {
    /// Reads the module tree; files that only tests compile (`#[cfg(test)] mod x;`) are left out.
    pub(crate) fn new(sources: &'a [SourceFile]) -> Self {
        let mut files: BTreeMap<_, _> = sources
            .iter()
            .filter(|f| f.path.starts_with("src/"))
            .map(|f| (module_path(&f.path), f))
            .collect();
        let mut reexports = BTreeMap::new();
        for (module, file) in files.clone() {
            for name in test_modules(&file.text) {
                let mut path = module.clone();
                path.push(name);
                files.retain(|p, _| !p.starts_with(&path));
            }
            for statement in uses(&file.text).iter().filter(|u| u.starts_with("pub")) {
                let (_, tree) = statement.split_once("use ").expect("a use statement");
                let mut paths = Vec::new();
                expand(tree, &mut Vec::new(), &mut paths);
                for path in paths {
                    let name = path.last().expect("not empty").clone();
                    reexports.insert((module.clone(), name), absolute(&module, &path));
                }
            }
        }
        Self { files, reexports }
    }

    /// File that defines the item at an absolute path, through re-exports.
    fn file_of(&self, path: &[String], depth: usize) -> Option<Vec<String>> {
        let module = (0..=path.len())
            .rev()
            .map(|n| &path[..n])
            .find(|p| self.files.contains_key(*p))?;
        if let Some(item) = path.get(module.len()).filter(|_| depth < 8) {
            let key = (module.to_vec(), item.clone());
            if let Some(target) = self.reexports.get(&key).filter(|t| *t != path) {
                return self.file_of(target, depth + 1);
            }
        }
        Some(module.to_vec())
    }

    /// Files that each file imports from, within the same crate; a re-export is no import.
    pub(crate) fn imports(&self) -> BTreeMap<Vec<String>, BTreeSet<Vec<String>>> {
        let mut graph = BTreeMap::new();
        for (module, file) in &self.files {
            let source = code_without_tests(&file.text);
            let code = uses(&source)
                .iter()
                .filter(|u| u.starts_with("pub"))
                .fold(source.clone(), |code, statement| {
                    code.replace(statement, "")
                });
            let named: BTreeSet<_> = paths(&code)
                .iter()
                .filter_map(|p| self.file_of(&absolute(module, p), 0))
                .filter(|other| other != module && other.first() == module.first())
                .filter(|other| other.len() > 1)
                .collect();
            graph.insert(module.clone(), named);
        }
        graph
    }
}

/// `use` statements at the start of a line, with their visibility.
fn uses(text: &str) -> Vec<&str> {
    let mut found = Vec::new();
    let mut at = 0;
    for line in text.split_inclusive('\n') {
        let head = line.split("use ").next().unwrap_or("");
        let visible = head.is_empty() || head.starts_with("pub");
        if visible && line.contains("use ") && !head.contains(['/', '=', '{']) {
            let end = text[at..].find(';').map_or(text.len(), |e| at + e);
            found.push(&text[at..end]);
        }
        at += line.len();
    }
    found
}

/// Child modules that only tests compile.
fn test_modules(text: &str) -> Vec<String> {
    text.split("#[cfg(test)]\n")
        .skip(1)
        .filter_map(|after| {
            let line = after.lines().next()?;
            let (_, name) = line.strip_suffix(';')?.split_once("mod ")?;
            Some(name.to_owned())
        })
        .collect()
}

/// Folders beside each other that import from each other's files: edges between siblings, at any depth.
pub(crate) fn rooms(
    graph: &BTreeMap<Vec<String>, BTreeSet<Vec<String>>>,
) -> BTreeMap<Vec<String>, BTreeSet<Vec<String>>> {
    let mut rooms = BTreeMap::<_, BTreeSet<_>>::new();
    let folders: BTreeSet<&[String]> = graph.keys().map(|m| &m[..m.len() - 1]).collect();
    for (from, others) in graph {
        for other in others {
            let common = from.iter().zip(other).take_while(|(a, b)| a == b).count();
            let [Some(a), Some(b)] = [from, other].map(|m| m.get(..=common)) else {
                continue;
            };
            rooms.entry(a.to_vec()).or_default();
            if folders.contains(a) && folders.contains(b) {
                rooms.entry(a.to_vec()).or_default().insert(b.to_vec());
                rooms.entry(b.to_vec()).or_default();
            }
        }
    }
    rooms
}

/// Sets of two or more files each of which imports, by some way, every other.
pub(crate) fn circles(graph: &BTreeMap<Vec<String>, BTreeSet<Vec<String>>>) -> Vec<Vec<String>> {
    let reach: BTreeMap<_, BTreeSet<Vec<String>>> = graph
        .keys()
        .map(|from| {
            let (mut seen, mut open) = (BTreeSet::new(), vec![from.clone()]);
            while let Some(next) = open.pop() {
                for other in graph.get(&next).into_iter().flatten() {
                    if seen.insert(other.clone()) {
                        open.push(other.clone());
                    }
                }
            }
            (from.clone(), seen)
        })
        .collect();
    let mut found = BTreeSet::new();
    for (from, reached) in &reach {
        let circle: Vec<String> = reached
            .iter()
            .filter(|other| reach.get(*other).is_some_and(|r| r.contains(from)))
            .map(|module| module.join("::"))
            .collect();
        if circle.len() > 1 {
            found.insert(circle);
        }
    }
    found.into_iter().collect()
}

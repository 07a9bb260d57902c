//! Path of a file that another file names.

use std::path::{Component, Path, PathBuf};

/// Path of `name` in the folder of `origin` or below it; `None` where it leads out of that folder.
pub(super) fn sibling(origin: &Path, name: &str) -> Option<PathBuf> {
    let name = name.replace('\\', "/");
    let inside = |c: Component<'_>| matches!(c, Component::Normal(_) | Component::CurDir);
    Path::new(&name)
        .components()
        .all(inside)
        .then(|| origin.with_file_name("").join(&name))
}

//! A part of a garment's file: its name, and its role by where it lies.

use std::fmt;
use tryon_formats::PartName;
use tryon_formats::sewn_obj::SewnObj;

/// Role of a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PartRole {
    /// Falls and folds.
    Cloth,
    /// Buttons, buckles, zips: keep their shape.
    Fastening,
    /// Hats, shoes, gloves: over head, hands or feet.
    Accessory,
}

/// Number and name of a part.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct FilePart {
    /// Among the sheets of cloth, the largest is 0.
    pub(super) number: usize,
    pub(super) name: PartName,
}

impl FilePart {
    /// A connected part of a file by its first face.
    pub(super) fn new(number: usize, sewn: &SewnObj) -> Self {
        let name = sewn.obj.origins.part_of(0).cloned();
        Self {
            number,
            name: name.unwrap_or_default(),
        }
    }
    /// True if object, group or material has one of these words, in lower case.
    pub(super) fn is_named(&self, words: &[&str]) -> bool {
        let name = self.name.to_string().to_lowercase();
        words.iter().any(|w| name.contains(w))
    }
}

impl fmt::Display for FilePart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "piece {}", self.number)?;
        match self.name.to_string() {
            name if name.is_empty() => Ok(()),
            name => write!(f, " (`{name}`)"),
        }
    }
}

/// Note on the parts of one role that the skin carries; `None` for none.
pub(super) fn carried(parts: &[SewnObj], one: &str, many: &str) -> Option<String> {
    /// Most names that a note lists.
    const NAMED: usize = 3;
    let noun = if parts.len() == 1 { one } else { many };
    let vertices: usize = parts.iter().map(|p| p.obj.mesh.vertices().len()).sum();
    let mut names: Vec<String> = Vec::new();
    for part in parts {
        let name = format!("`{}`", FilePart::new(0, part).name);
        if name.len() > 2 && !names.contains(&name) {
            names.push(name);
        }
    }
    if names.len() > NAMED {
        names.truncate(NAMED);
        names.push("…".into());
    }
    let named = match names.is_empty() {
        true => String::new(),
        false => format!(" ({})", names.join(", ")),
    };
    let count = parts.len();
    (count > 0).then(|| {
        format!(
            "{count} {noun}{named} of {vertices} vertices carried by the skin: no cloth that falls"
        )
    })
}

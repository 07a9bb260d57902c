//! Material libraries of OBJ files: diffuse colour and texture.

use crate::FormatError;
use crate::image::read_limited;
use crate::obj_text::lines;
use crate::sibling::sibling;
use crate::text_encoding::decode_text;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Largest material library, bytes; a material takes about 300.
const MAX_BYTES: u64 = 64 << 20;

/// Diffuse appearance of a material.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct MtlMaterial {
    /// Colour `Kd`, taken as sRGB, 0 to 1.
    pub(super) color: Option<[f32; 3]>,
    /// Texture `map_Kd`.
    pub(super) map: Option<PathBuf>,
}

/// Reads the libraries that the `mtllib` lines of the OBJ file `origin` name: materials by name.
///
/// # Errors
/// Names the library that is missing, or its line at fault.
pub(super) fn read_libraries(
    origin: &Path,
    libraries: &[String],
) -> Result<BTreeMap<String, MtlMaterial>, FormatError> {
    let mut materials = BTreeMap::new();
    for path in library_paths(origin, libraries)? {
        let bytes = read_limited(&path, MAX_BYTES)
            .map_err(|e| FormatError::field(origin, "mtllib", e.to_string()))?;
        add_library(&decode_text(&bytes), &path, &mut materials)?;
    }
    Ok(materials)
}

/// Paths of `mtllib` lines: one name with spaces, or several names.
fn library_paths(origin: &Path, libraries: &[String]) -> Result<Vec<PathBuf>, FormatError> {
    let mut paths = Vec::new();
    for line in libraries {
        let inside = |name: &str| {
            sibling(origin, name).ok_or_else(|| {
                let why = format!("`{name}` leads out of the folder");
                FormatError::field(origin, "mtllib", why)
            })
        };
        match sibling(origin, line).filter(|p| p.is_file()) {
            Some(path) => paths.push(path),
            None => {
                for name in line.split_whitespace() {
                    paths.push(inside(name)?);
                }
            }
        }
    }
    Ok(paths)
}

/// Adds the materials of a library's text.
fn add_library(
    text: &str,
    path: &Path,
    materials: &mut BTreeMap<String, MtlMaterial>,
) -> Result<(), FormatError> {
    let mut name = String::new();
    for (number, line) in lines(text) {
        let line = line.trim();
        let fault = |why: String| FormatError::field(path, format!("line {number}"), why);
        let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        if word == "newmtl" {
            name = rest.to_owned();
            materials.insert(name.clone(), MtlMaterial::default());
        }
        let Some(material) = materials.get_mut(&name) else {
            continue;
        };
        if word == "Kd" {
            let mut numbers = rest.split_whitespace().map(str::parse::<f32>);
            let mut next = || numbers.next().and_then(Result::ok);
            material.color = match (next(), next(), next()) {
                (Some(r), Some(g), Some(b)) => Some([r, g, b]),
                _ => return Err(fault(format!("Kd: `{rest}` is not three numbers"))),
            };
        } else if word.eq_ignore_ascii_case("map_Kd") {
            let map = sibling(path, texture_name(rest));
            let map = map.ok_or_else(|| fault(format!("`{rest}` leads out of the folder")))?;
            material.map = Some(map);
        }
    }
    Ok(())
}

/// File name of a `map_Kd` line: its last word after options, otherwise the whole text, which may have spaces.
fn texture_name(text: &str) -> &str {
    if text.starts_with('-') {
        text.split_whitespace().next_back().unwrap_or_default()
    } else {
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn materials_have_colour_and_texture() {
        let text = "# c\nKd 9 9 9\nnewmtl a\nKd 0.5 0 1\r\nnewmtl b c\n  map_Kd -s 1 1 1 t.png\n\
            newmtl d\nmap_Kd sub\\my skin.jpg\n";
        let mut found = BTreeMap::new();
        add_library(text, Path::new("x/m.mtl"), &mut found).expect("valid");
        assert_eq!(found["a"].color, Some([0.5, 0.0, 1.0]));
        assert_eq!(found["b c"].map, Some(PathBuf::from("x/t.png")));
        assert_eq!(found["d"].map, Some(PathBuf::from("x/sub/my skin.jpg")));
        let e = add_library("newmtl a\nmap_Kd ../t.png", Path::new("m.mtl"), &mut found);
        assert!(e.expect_err("outside").to_string().contains("line 2"));
        assert!(add_library("newmtl a\nKd 1", Path::new("m.mtl"), &mut found).is_err());
    }
}

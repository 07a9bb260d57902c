//! Records of a Wavefront OBJ file: vertices with colours, texture coordinates, fanned faces and their materials.

use super::FormatError;
use std::path::Path;
use std::str::SplitWhitespace;
use tryon_geometry::math::P3;
use tryon_geometry::mesh::Face;

/// Records of a file; indices are in range.
#[derive(Default)]
pub(super) struct ObjRecords {
    /// Positions.
    pub(super) vertices: Vec<P3>,
    /// Colours of the `v x y z r g b` extension as stored, shape `[vertices]`; NaN for a vertex without one.
    pub(super) colors: Vec<[f32; 3]>,
    /// Texture coordinates, v up.
    pub(super) uv: Vec<[f32; 2]>,
    /// Triangles; polygons are fanned.
    pub(super) faces: Vec<Face>,
    /// Texture coordinates of the corners, shape `[faces]`; `None` where a corner of the polygon has none.
    pub(super) face_uv: Vec<Option<Face>>,
    /// Index in `materials`, shape `[faces]`; `None` before the first `usemtl`.
    pub(super) face_materials: Vec<Option<usize>>,
    /// Names that follow `usemtl`, in the order of the file.
    pub(super) materials: Vec<String>,
    /// Texts that follow `mtllib`.
    pub(super) libraries: Vec<String>,
}

/// Treatment of positions that are not finite and of faces that use a vertex twice.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum ObjFaults {
    /// An error.
    Refused,
    /// Kept as stored.
    Kept,
}

/// Field at fault within its line, and the fault.
type LineFault = (String, String);

/// Parses OBJ text; `origin` is named in errors.
///
/// # Errors
/// Names the line and its fault: a malformed number, an index out of range, a polygon with fewer than three corners,
/// and those of `faults` where they are refused.
pub(super) fn parse_records(
    text: &str,
    origin: &Path,
    faults: ObjFaults,
) -> Result<ObjRecords, FormatError> {
    let mut records = ObjRecords::default();
    for (number, line) in text.lines().enumerate() {
        records.add(line.trim(), faults).map_err(|(what, why)| {
            FormatError::field(origin, format!("line {}: {what}", number + 1), why)
        })?;
    }
    Ok(records)
}

impl ObjRecords {
    /// Adds the record of a line.
    fn add(&mut self, line: &str, faults: ObjFaults) -> Result<(), LineFault> {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                let [x, y, z] =
                    numbers(&mut words, faults).map_err(|why| ("vertex".to_owned(), why))?;
                self.vertices.push(P3::new(x, y, z));
                self.colors.push(color(&mut words));
            }
            Some("vt") => self.uv.push(
                numbers(&mut words, faults)
                    .map_err(|why| ("texture coordinate".to_owned(), why))?,
            ),
            Some("f") => self.add_face(words, faults)?,
            Some(word @ "usemtl") => self.materials.push(rest(line, word)),
            Some(word @ "mtllib") => self.libraries.push(rest(line, word)),
            _ => {}
        }
        Ok(())
    }

    /// Adds a polygon as a fan of triangles.
    fn add_face(&mut self, words: SplitWhitespace<'_>, faults: ObjFaults) -> Result<(), LineFault> {
        let at = |why: String| (format!("face {}", self.faces.len()), why);
        let (mut corner, mut texture) = (Vec::new(), Vec::new());
        for word in words.take_while(|w| !w.starts_with('#')) {
            let mut parts = word.split('/');
            let vertex = index(parts.next(), self.vertices.len());
            corner.push(vertex.map_err(|why| at(format!("vertex {why}")))?);
            if let Some(part) = parts.next().filter(|p| !p.is_empty()) {
                let coordinate = index(Some(part), self.uv.len());
                texture.push(coordinate.map_err(|why| at(format!("texture coordinate {why}")))?);
            }
        }
        if corner.len() < 3 {
            let count = corner.len();
            return Err(at(format!("{count} corners; a face needs at least 3")));
        }
        let is_textured = texture.len() == corner.len();
        for k in 1..corner.len() - 1 {
            let f = [corner[0], corner[k], corner[k + 1]];
            if faults == ObjFaults::Refused && (f[0] == f[1] || f[1] == f[2] || f[0] == f[2]) {
                return Err((
                    format!("face {}", self.faces.len()),
                    "a vertex is used twice".into(),
                ));
            }
            self.faces.push(f);
            self.face_uv
                .push(is_textured.then(|| [texture[0], texture[k], texture[k + 1]]));
            self.face_materials
                .push(self.materials.len().checked_sub(1));
        }
        Ok(())
    }
}

/// Text of a line after its first word.
fn rest(line: &str, word: &str) -> String {
    line.strip_prefix(word)
        .unwrap_or_default()
        .trim()
        .to_owned()
}

/// First three further numbers of a vertex; NaN if there are fewer, as for a weight.
fn color(words: &mut SplitWhitespace<'_>) -> [f32; 3] {
    let mut out = [f32::NAN; 3];
    for slot in &mut out {
        match words.next().and_then(|w| w.parse().ok()) {
            Some(value) => *slot = value,
            None => return [f32::NAN; 3],
        }
    }
    out
}

fn numbers<const N: usize>(
    words: &mut SplitWhitespace<'_>,
    faults: ObjFaults,
) -> Result<[f32; N], String> {
    let mut out = [0.0; N];
    for (k, slot) in out.iter_mut().enumerate() {
        let word = words
            .next()
            .ok_or_else(|| format!("{k} numbers; {N} are needed"))?;
        let value: f32 = word.parse().map_err(|_| format!("`{word}` is no number"))?;
        if faults == ObjFaults::Refused && !value.is_finite() {
            return Err(format!("`{word}` is not finite"));
        }
        *slot = value;
    }
    Ok(out)
}

/// Index of an element: OBJ counts from 1, negative numbers count back from the last element so far.
fn index(word: Option<&str>, count: usize) -> Result<u32, String> {
    let word = word.unwrap_or("");
    let i: i64 = word
        .parse()
        .map_err(|_| format!("index `{word}` is no whole number"))?;
    let at = if i < 0 { count as i64 + i } else { i - 1 };
    if i == 0 || at < 0 || at >= count as i64 {
        return Err(format!(
            "index {i} is out of range (the file has {count} so far, counted from 1)"
        ));
    }
    u32::try_from(at).map_err(|_| format!("index {i} is too large"))
}

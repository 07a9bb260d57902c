//! Parser of Wavefront OBJ text.

use super::FormatError;
use super::face_origins::{FaceOrigin, PartName};
use super::obj_faces::{FacesBuilder, Polygon};
use super::obj_records::ObjRecords;
use super::obj_text::lines;
use std::collections::BTreeMap;
use std::path::Path;
use std::str::SplitWhitespace;
use tryon_geometry::math::P3;

/// Most different first words of lines that are counted.
const MOST_WORDS: usize = 8;

/// Treatment of positions that are not finite.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum ObjFaults {
    /// An error.
    Refused,
    /// Kept as stored.
    Kept,
}

/// Field at fault within its line, and the fault.
type LineFault = (String, String);

/// Error of a line.
fn line_error(origin: &Path, line: usize, (what, why): LineFault) -> FormatError {
    FormatError::field(origin, format!("line {line}: {what}"), why)
}

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
    let mut reader = RecordReader {
        faults,
        records: ObjRecords::default(),
        polygons: Vec::new(),
        part: PartName::default(),
        parts: BTreeMap::new(),
    };
    for (number, line) in lines(text) {
        let added = reader.add(line.trim(), number);
        added.map_err(|fault| line_error(origin, number, fault))?;
    }

    let RecordReader {
        mut records,
        polygons,
        ..
    } = reader;
    let mut builder = FacesBuilder::default();
    for (k, polygon) in polygons.iter().enumerate() {
        let built = builder.add(&mut records, polygon);
        built.map_err(|why| {
            line_error(
                origin,
                polygon.origin.line as usize,
                (format!("face {k}"), why),
            )
        })?;
    }
    records.dropped = builder.dropped();
    records.notes.extend(builder.notes());
    records.notes.extend(records.untaken());
    Ok(records)
}

/// Reader of lines.
struct RecordReader {
    faults: ObjFaults,
    records: ObjRecords,
    polygons: Vec<Polygon>,
    /// Names of the part that follows.
    part: PartName,
    /// Index of each part.
    parts: BTreeMap<PartName, u32>,
}

impl RecordReader {
    /// Adds the record of a line.
    fn add(&mut self, line: &str, number: usize) -> Result<(), LineFault> {
        let records = &mut self.records;
        records.count += 1;
        let mut words = line.split_whitespace();
        let Some(word) = words.next() else {
            return Ok(());
        };
        let short: String = word.chars().take(12).collect();
        let is_counted = records.words.len() < MOST_WORDS;
        match records.words.get_mut(&short) {
            Some(n) => *n += 1,
            None if is_counted => drop(records.words.insert(short, 1)),
            None => {}
        }
        match word {
            "v" => {
                let [x, y, z] =
                    numbers(&mut words, self.faults).map_err(|why| ("vertex".to_owned(), why))?;
                records.vertices.push(P3::new(x, y, z));
                records.colors.push(color(&mut words));
            }
            "vt" => records.uv.push(
                numbers(&mut words, self.faults)
                    .map_err(|why| ("texture coordinate".to_owned(), why))?,
            ),
            "f" | "fo" => self.add_polygon(words, number)?,
            "o" => self.part.object = rest(line, word),
            "g" => self.part.group = rest(line, word),
            "usemtl" => {
                self.part.material = rest(line, word);
                records.materials.push(rest(line, word));
            }
            "mtllib" => records.libraries.push(rest(line, word)),
            _ => {}
        }
        Ok(())
    }

    /// Adds a polygon of the current part.
    fn add_polygon(&mut self, words: SplitWhitespace<'_>, line: usize) -> Result<(), LineFault> {
        let records = &mut self.records;
        let known = self.parts.get(&self.part).copied();
        let part = known.unwrap_or_else(|| {
            let index = self.parts.len() as u32;
            self.parts.insert(self.part.clone(), index);
            records.origins.parts.push(self.part.clone());
            index
        });
        let line = u32::try_from(line).unwrap_or(u32::MAX);
        let origin = FaceOrigin { part, line };
        let material = records.materials.len().checked_sub(1);
        let counts = [records.vertices.len(), records.uv.len()];
        let polygon = Polygon::parse(words, counts, origin, material);
        let at = |why| (format!("face {}", self.polygons.len()), why);
        self.polygons.push(polygon.map_err(at)?);
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
        let value: f32 = word.parse().map_err(|_| match word.contains(',') {
            true => format!("`{word}` is no number: numbers have a decimal point"),
            false => format!("`{word}` is no number"),
        })?;
        if faults == ObjFaults::Refused && !value.is_finite() {
            return Err(format!("`{word}` is not finite"));
        }
        *slot = value;
    }
    Ok(out)
}

//! Faces of OBJ files: polygons of corners `v`, `v/vt`, `v//vn` or `v/vt/vn`, and their triangles.

use super::face_origins::FaceOrigin;
use super::obj_records::ObjRecords;
use super::polygon::triangulated;
use std::str::SplitWhitespace;

/// Most lines that a note names.
const NAMED: usize = 3;

/// Polygon of a file. Positive indices may name elements of later lines: [`FacesBuilder`] checks them.
pub(super) struct Polygon {
    /// Vertices.
    vertices: Vec<u32>,
    /// Texture coordinates; of another number than vertices if a corner has none.
    uv: Vec<u32>,
    /// Part and line.
    pub(super) origin: FaceOrigin,
    /// Index of the material.
    material: Option<usize>,
}

impl Polygon {
    /// Parses the corners of a face; `counts` are those of the vertices and texture coordinates so far.
    ///
    /// # Errors
    /// The word that is no index, or the number of corners if it is less than 3.
    pub(super) fn parse(
        words: SplitWhitespace<'_>,
        counts: [usize; 2],
        origin: FaceOrigin,
        material: Option<usize>,
    ) -> Result<Self, String> {
        let (mut vertices, mut uv) = (Vec::new(), Vec::new());
        for word in words {
            let mut parts = word.split('/');
            let vertex = index(parts.next(), counts[0]);
            vertices.push(vertex.map_err(|why| format!("vertex {why}"))?);
            if let Some(part) = parts.next().filter(|p| !p.is_empty()) {
                let coordinate = index(Some(part), counts[1]);
                uv.push(coordinate.map_err(|why| format!("texture coordinate {why}"))?);
            }
        }
        if vertices.len() < 3 {
            let count = vertices.len();
            return Err(format!("{count} corners; a face needs at least 3"));
        }
        Ok(Self {
            vertices,
            uv,
            origin,
            material,
        })
    }
}

/// Index from 0 of an element: OBJ counts from 1, negative numbers count back from the last of `count` elements so far.
fn index(word: Option<&str>, count: usize) -> Result<u32, String> {
    let word = word.unwrap_or("");
    let i: i64 = word
        .parse()
        .map_err(|_| format!("index `{word}` is no whole number"))?;
    let at = if i < 0 { count as i64 + i } else { i - 1 };
    if at < 0 {
        return Err(out_of_range(i, count));
    }
    u32::try_from(at).map_err(|_| format!("index {i} is too large"))
}

fn out_of_range(index: i64, count: usize) -> String {
    format!("index {index} is out of range (the file has {count}, counted from 1)")
}

/// Lines with one fault.
#[derive(Default)]
struct LineFinding {
    count: usize,
    first: Vec<u32>,
}

impl LineFinding {
    fn add(&mut self, line: u32) {
        self.count += 1;
        if self.first.len() < NAMED {
            self.first.push(line);
        }
    }
    /// Note with the first lines; `None` without findings.
    fn note(&self, one: &str, many: &str, rest: &str) -> Option<String> {
        let noun = if self.count == 1 { one } else { many };
        let lines: Vec<String> = self.first.iter().map(u32::to_string).collect();
        let more = if self.count > lines.len() { " …" } else { "" };
        let word = if lines.len() == 1 { "line" } else { "lines" };
        let (count, lines) = (self.count, lines.join(", "));
        (count > 0).then(|| format!("{count} {noun} {rest} ({word} {lines}{more})"))
    }
}

/// Triangles of polygons. Corners that repeat their neighbour are dropped.
#[derive(Default)]
pub(super) struct FacesBuilder {
    /// Faces with a repeated corner that have three others.
    mended: LineFinding,
    /// Faces with fewer than three different corners.
    lost: LineFinding,
    /// Faces without texture coordinates.
    untextured: LineFinding,
    /// Some face has texture coordinates.
    has_textured: bool,
}

impl FacesBuilder {
    /// Adds the triangles of a polygon to `records`.
    ///
    /// # Errors
    /// An index that is out of range.
    pub(super) fn add(
        &mut self,
        records: &mut ObjRecords,
        polygon: &Polygon,
    ) -> Result<(), String> {
        let lists = [
            ("vertex", &polygon.vertices, records.vertices.len()),
            ("texture coordinate", &polygon.uv, records.uv.len()),
        ];
        for (noun, indices, count) in lists {
            if let Some(i) = indices.iter().find(|i| **i as usize >= count) {
                return Err(format!("{noun} {}", out_of_range(i64::from(*i) + 1, count)));
            }
        }

        let v = &polygon.vertices;
        let n = v.len();
        let kept: Vec<usize> = (0..n).filter(|k| v[*k] != v[(k + n - 1) % n]).collect();
        let corners: Vec<_> = kept
            .iter()
            .map(|k| records.vertices[v[*k] as usize])
            .collect();
        let is_textured = polygon.uv.len() == n;
        let before = records.faces.len();
        for triangle in triangulated(&corners) {
            let places = triangle.map(|k| kept[k]);
            let f = places.map(|k| v[k]);
            // A vertex that a polygon passes twice, as around a hole.
            if f[0] == f[1] || f[1] == f[2] || f[0] == f[2] {
                continue;
            }
            records.faces.push(f);
            records
                .face_uv
                .push(is_textured.then(|| places.map(|k| polygon.uv[k])));
            records.face_materials.push(polygon.material);
            records.origins.faces.push(polygon.origin);
        }
        let line = polygon.origin.line;
        if records.faces.len() == before {
            self.lost.add(line);
        } else if kept.len() < n {
            self.mended.add(line);
        }
        if is_textured {
            self.has_textured = true;
        } else {
            self.untextured.add(line);
        }
        Ok(())
    }

    /// Faces that were left out or lost corners.
    pub(super) fn dropped(&self) -> usize {
        self.mended.count + self.lost.count
    }

    /// Notes on the changes and on what is not used.
    pub(super) fn notes(&self) -> impl Iterator<Item = String> {
        let mended = "without a corner that repeats its neighbour";
        let lost = "with fewer than three different corners left out";
        [
            self.mended.note("face", "faces", mended),
            self.lost.note("face", "faces", lost),
            self.untextured().filter(|_| self.has_textured),
        ]
        .into_iter()
        .flatten()
    }

    /// Note on faces without texture coordinates among others that have some.
    fn untextured(&self) -> Option<String> {
        let rest = "without texture coordinates; those of the others are not used";
        self.untextured.note("face", "faces", rest)
    }
}

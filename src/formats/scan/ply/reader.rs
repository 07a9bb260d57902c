//! PLY scans: points, normals and colours of the element `vertex`, polygons of the element `face`.

use super::header::{PlyElement, PlyHeader, PlyProperty, PlyScalar, PlyType, parse_header};
use super::values::PlyValues;
use crate::FormatError;
use crate::image::read_limited;
use crate::scan::colors::{quantized, white};
use crate::scan::mesh::ScanMesh;
use std::path::Path;
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::Face;

/// Largest PLY scan, bytes; a scan of 10 million vertices takes about 700 MB.
const MAX_BYTES: u64 = 2 << 30;
/// Names of a colour's components; the first triple present is read.
const COLOR_NAMES: [[&str; 3]; 3] = [
    ["red", "green", "blue"],
    ["diffuse_red", "diffuse_green", "diffuse_blue"],
    ["r", "g", "b"],
];
/// Names of the list of a polygon's vertices.
const CORNER_NAMES: [&str; 2] = ["vertex_indices", "vertex_index"];

/// Columns of the element `vertex`.
struct VertexColumns {
    position: [usize; 3],
    normal: Option<[usize; 3]>,
    color: Option<[usize; 3]>,
    /// Value of white; `None` for floats, whose range tells.
    white: Option<f32>,
}

/// Reads a `.ply` scan. Other elements and properties are skipped.
///
/// White is 255 for integer colours, 65,535 for `ushort`, and 1 for floats (255 if a component exceeds 2).
///
/// # Errors
/// Names the header line, or the element and row at fault: a number that is cut off or malformed, an index out of
/// range, a polygon with fewer than three corners.
pub(in crate::scan) fn read_ply(path: &Path) -> Result<ScanMesh, FormatError> {
    parse_ply(&read_limited(path, MAX_BYTES)?, path)
}

/// Parses the bytes of a file as [`read_ply`] does; `origin` is named in errors.
fn parse_ply(bytes: &[u8], origin: &Path) -> Result<ScanMesh, FormatError> {
    let header = parse_header(bytes, origin)?;
    let vertices = vertex_count(&header).map_err(|why| fault(origin, "element vertex", why))?;
    let mut values = PlyValues::new(bytes.get(header.end..).unwrap_or_default(), header.encoding);
    let mut scan = ScanMesh::default();
    for element in &header.elements {
        // Rows without properties take no space; their number is not bounded by the file.
        if element.properties.is_empty() {
            continue;
        }
        let name = format!("element {}", element.name);
        let read = match element.name.as_str() {
            "vertex" => read_vertices(&mut values, element, &mut scan),
            "face" => read_faces(&mut values, element, vertices, &mut scan.faces),
            _ => skip_rows(&mut values, element),
        };
        read.map_err(|(row, why)| match row {
            Some(row) => fault(origin, &format!("{name}, row {row}"), why),
            None => fault(origin, &name, why),
        })?;
    }
    Ok(scan)
}

fn fault(origin: &Path, field: &str, why: String) -> FormatError {
    FormatError::field(origin, field, why)
}

/// Row at fault, if one is, and the fault.
type RowFault = (Option<u64>, String);

/// Number of rows of the only element `vertex`.
fn vertex_count(header: &PlyHeader) -> Result<u32, String> {
    let mut found = header.elements.iter().filter(|e| e.name == "vertex");
    match (found.next(), found.next()) {
        (Some(vertex), None) => u32::try_from(vertex.rows)
            .map_err(|_| format!("{} rows do not fit 32-bit indices", vertex.rows)),
        (None, _) => Err("missing".into()),
        _ => Err("declared twice".into()),
    }
}

/// Columns of the three scalar properties of these names.
fn columns(element: &PlyElement, names: [&str; 3]) -> Option<[usize; 3]> {
    let find = |name: &str| {
        let is_scalar = |kind| matches!(kind, PlyType::Scalar(_));
        let mut all = element.properties.iter();
        all.position(|p| p.name == name && is_scalar(p.kind))
    };
    let [a, b, c] = names.map(find);
    Some([a?, b?, c?])
}

impl VertexColumns {
    fn of(element: &PlyElement) -> Result<Self, String> {
        let position = columns(element, ["x", "y", "z"]);
        let color = COLOR_NAMES.iter().find_map(|n| columns(element, *n));
        let kind = color.and_then(|c| element.properties.get(c[0]).map(|p| p.kind));
        Ok(Self {
            position: position.ok_or("it lacks x, y or z")?,
            normal: columns(element, ["nx", "ny", "nz"]),
            color,
            white: match kind {
                Some(PlyType::Scalar(PlyScalar::F32 | PlyScalar::F64)) => None,
                Some(PlyType::Scalar(PlyScalar::U16)) => Some(65_535.0),
                _ => Some(255.0),
            },
        })
    }
}

/// Reads the element `vertex`.
fn read_vertices(
    values: &mut PlyValues<'_>,
    element: &PlyElement,
    scan: &mut ScanMesh,
) -> Result<(), RowFault> {
    let layout = VertexColumns::of(element).map_err(|why| (None, why))?;
    let mut colors = Vec::new();
    let mut row = vec![0.0; element.properties.len()];
    for n in 0..element.rows {
        read_row(values, element, &mut row).map_err(|why| (Some(n), why))?;
        // Columns are positions in the list of properties, which `row` is as long as.
        let pick = |columns: [usize; 3]| columns.map(|c| row[c] as f32);
        scan.points.push(P3::from(pick(layout.position)));
        scan.normals
            .extend(layout.normal.map(|c| V3::from(pick(c))));
        colors.extend(layout.color.map(pick));
    }
    let white = layout.white.unwrap_or_else(|| white(&colors));
    scan.colors = quantized(&colors, white);
    Ok(())
}

/// Reads a row; the value of a list is its length.
fn read_row(
    values: &mut PlyValues<'_>,
    element: &PlyElement,
    row: &mut [f64],
) -> Result<(), String> {
    for (property, value) in element.properties.iter().zip(row) {
        *value = read_property(values, property)?;
    }
    Ok(())
}

/// Reads a property: the number, or the length of a list whose items are skipped.
fn read_property(values: &mut PlyValues<'_>, property: &PlyProperty) -> Result<f64, String> {
    let value = match property.kind {
        PlyType::Scalar(kind) => values.next(kind),
        PlyType::List { count, item } => values.next_index(count).and_then(|length| {
            (0..length).try_for_each(|_| values.next(item).map(|_| ()))?;
            Ok(length.into())
        }),
    };
    value.map_err(|why| format!("{}: {why}", property.name))
}

/// Reads past an element.
fn skip_rows(values: &mut PlyValues<'_>, element: &PlyElement) -> Result<(), RowFault> {
    let mut row = vec![0.0; element.properties.len()];
    (0..element.rows)
        .try_for_each(|n| read_row(values, element, &mut row).map_err(|why| (Some(n), why)))
}

/// Reads the element `face`; polygons are fanned.
fn read_faces(
    values: &mut PlyValues<'_>,
    element: &PlyElement,
    vertices: u32,
    faces: &mut Vec<Face>,
) -> Result<(), RowFault> {
    let is_corners = |p: &PlyProperty| {
        CORNER_NAMES.contains(&p.name.as_str()) && matches!(p.kind, PlyType::List { .. })
    };
    let list = element.properties.iter().position(is_corners);
    if list.is_none() && element.rows > 0 {
        return Err((None, format!("it lacks the list {}", CORNER_NAMES[0])));
    }
    let mut corners = Vec::new();
    for n in 0..element.rows {
        for (k, property) in element.properties.iter().enumerate() {
            let read = match property.kind {
                PlyType::List { count, item } if Some(k) == list => {
                    read_corners(values, count, item, vertices, &mut corners)
                }
                _ => read_property(values, property).map(|_| ()),
            };
            read.map_err(|why| (Some(n), why))?;
        }
        if let [first, rest @ ..] = corners.as_slice() {
            let fan = rest.iter().zip(rest.iter().skip(1));
            faces.extend(fan.map(|(b, c)| [*first, *b, *c]));
        }
    }
    Ok(())
}

/// Reads the vertices of a polygon from a list with these types of count and item.
fn read_corners(
    values: &mut PlyValues<'_>,
    count: PlyScalar,
    item: PlyScalar,
    vertices: u32,
    corners: &mut Vec<u32>,
) -> Result<(), String> {
    corners.clear();
    let length = values.next_index(count).map_err(|e| e.to_string())?;
    if length < 3 {
        return Err(format!("{length} corners; a face needs at least 3"));
    }
    for _ in 0..length {
        let index = values.next_index(item).map_err(|e| e.to_string())?;
        if index >= vertices {
            return Err(format!(
                "vertex index {index} is out of range ({vertices} vertices)"
            ));
        }
        corners.push(index);
    }
    Ok(())
}

//! MakeHuman's clothes: `.mhclo` binds each vertex of an OBJ to three vertices of the base body.

use super::FormatError;
use super::image::read_limited;
use std::path::Path;
use tryon_geometry::math::{P3, V3};

/// Largest file, bytes; the largest shared suit has 700 kB.
const MAX_BYTES: u64 = 64 << 20;

/// Binding of a garment vertex to the body: Σ weights · corners + offset, the offset in units of the body's scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Binding {
    /// Vertices of the base body.
    pub vertices: [u32; 3],
    /// Barycentric weights.
    pub weights: [f32; 3],
    /// Offset before scaling.
    pub offset: [f32; 3],
}

/// Scale of the offsets along an axis: distance of two body vertices along it, over `length`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisScale {
    /// Vertices of the base body.
    pub vertices: [u32; 2],
    /// Their distance on the source body, file units.
    pub length: f32,
}

/// A garment file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mhclo {
    /// Name in the file.
    pub name: String,
    /// OBJ beside it.
    pub obj_file: String,
    /// Material file beside it, if named.
    pub material: Option<String>,
    /// Base mesh it belongs to.
    pub base: String,
    /// Scales along x, y, z.
    pub scales: [Option<AxisScale>; 3],
    /// Drawing order: greater is farther out.
    pub z_depth: i32,
    /// Binding of each vertex of the OBJ.
    pub bindings: Vec<Binding>,
    /// Vertices of the body that the garment hides.
    pub deleted: Vec<u32>,
}

/// Reads a `.mhclo` file.
///
/// # Errors
/// As [`parse_mhclo`], or when the file cannot be read.
pub fn read_mhclo(path: &Path) -> Result<Mhclo, FormatError> {
    parse_mhclo(
        &String::from_utf8_lossy(&read_limited(path, MAX_BYTES)?),
        path,
    )
}

/// Parses `.mhclo` text; `origin` is named in errors.
///
/// # Errors
/// Names the line and its fault.
pub fn parse_mhclo(text: &str, origin: &Path) -> Result<Mhclo, FormatError> {
    let mut out = Mhclo::default();
    let mut section = MhcloSection::Head;
    for (number, line) in text.lines().enumerate() {
        out.parse_line(line, &mut section).map_err(|(what, why)| {
            FormatError::field(origin, format!("line {}: {what}", number + 1), why)
        })?;
    }
    let missing = |field: &str, why: &str| Err(FormatError::field(origin, field, why));
    if out.obj_file.is_empty() {
        return missing("obj_file", "it is missing");
    }
    if out.bindings.is_empty() {
        return missing("verts", "no vertex is bound to the body");
    }
    Ok(out)
}

/// Section of the file that the next line belongs to.
#[derive(PartialEq)]
enum MhcloSection {
    Head,
    Vertices,
    Deleted,
}

impl Mhclo {
    /// Parses one line; the error is the field and its fault.
    fn parse_line(
        &mut self,
        line: &str,
        section: &mut MhcloSection,
    ) -> Result<(), (String, String)> {
        let words: Vec<&str> = line.split_whitespace().collect();
        let Some(first) = words.first().copied().filter(|w| !w.starts_with('#')) else {
            return Ok(());
        };
        let rest = || {
            let rest = line.split_once(char::is_whitespace);
            rest.map_or("", |(_, r)| r).trim().to_owned()
        };
        match first {
            "name" => self.name = rest(),
            "obj_file" => self.obj_file = rest(),
            "material" => self.material = Some(rest()),
            "basemesh" => self.base = rest(),
            "z_depth" => self.z_depth = words.get(1).and_then(|w| w.parse().ok()).unwrap_or(0),
            "x_scale" | "y_scale" | "z_scale" => {
                let axis = usize::from(first.as_bytes()[0] - b'x');
                let why = "two body vertices and a positive length are needed";
                let scale = axis_scale(&words).ok_or_else(|| (first.to_owned(), why.to_owned()))?;
                self.scales[axis] = Some(scale);
            }
            "verts" => *section = MhcloSection::Vertices,
            "delete_verts" => *section = MhcloSection::Deleted,
            _ if *section == MhcloSection::Vertices
                && first.starts_with(|c: char| c.is_ascii_digit()) =>
            {
                let binding = binding(&words);
                let binding =
                    binding.map_err(|why| (format!("vertex {}", self.bindings.len()), why))?;
                self.bindings.push(binding);
            }
            _ if *section == MhcloSection::Deleted => {
                deleted(&words, &mut self.deleted)
                    .map_err(|why| ("delete_verts".to_owned(), why))?;
            }
            _ => {}
        }
        Ok(())
    }
}

fn axis_scale(words: &[&str]) -> Option<AxisScale> {
    let length = words.get(3)?.parse::<f32>().ok();
    Some(AxisScale {
        vertices: [vertex(words, 1).ok()?, vertex(words, 2).ok()?],
        length: length.filter(|l| l.is_finite() && *l > 0.0)?,
    })
}

fn vertex(words: &[&str], k: usize) -> Result<u32, String> {
    let w = words.get(k).ok_or("too few numbers")?;
    w.parse().map_err(|_| format!("`{w}` is no vertex number"))
}

fn binding(words: &[&str]) -> Result<Binding, String> {
    let float = |k: usize| {
        let w = words
            .get(k)
            .ok_or_else(|| format!("{} numbers; 1 or 9 are needed", words.len()))?;
        w.parse::<f32>()
            .ok()
            .filter(|x| x.is_finite())
            .ok_or_else(|| format!("`{w}` is no finite number"))
    };
    if words.len() == 1 {
        let v = vertex(words, 0)?;
        return Ok(Binding {
            vertices: [v; 3],
            weights: [1.0, 0.0, 0.0],
            offset: [0.0; 3],
        });
    }
    Ok(Binding {
        vertices: [vertex(words, 0)?, vertex(words, 1)?, vertex(words, 2)?],
        weights: [float(3)?, float(4)?, float(5)?],
        offset: [float(6)?, float(7)?, float(8)?],
    })
}

/// Appends vertex numbers and ranges `a - b`.
fn deleted(words: &[&str], out: &mut Vec<u32>) -> Result<(), String> {
    /// Longest range; longer ones exceed any body.
    const MOST: u32 = 1_000_000;
    let mut k = 0;
    while k < words.len() {
        let a = vertex(words, k)?;
        if words.get(k + 1) == Some(&"-") {
            let b = vertex(words, k + 2)?;
            if b < a || b - a > MOST {
                return Err(format!("{a} - {b} is no range"));
            }
            out.extend(a..=b);
            k += 3;
        } else {
            out.push(a);
            k += 1;
        }
    }
    Ok(())
}

impl Mhclo {
    /// Positions of the garment on a body of the same base mesh, in the body's unit.
    ///
    /// # Errors
    /// Names the garment vertex bound to a body vertex that does not exist.
    pub fn fit(&self, body: &[P3], origin: &Path) -> Result<Vec<P3>, FormatError> {
        let n = body.len();
        let missing = |what: String, v: u32| {
            FormatError::field(
                origin,
                what,
                format!("body vertex {v} does not exist (the body has {n})"),
            )
        };
        let mut scale = [1.0f32; 3];
        for (axis, s) in self.scales.iter().enumerate() {
            let Some(s) = s else { continue };
            if let Some(v) = s.vertices.iter().find(|v| **v as usize >= n) {
                return Err(missing(format!("{}_scale", ["x", "y", "z"][axis]), *v));
            }
            let [a, b] = s.vertices.map(|v| body[v as usize][axis]);
            scale[axis] = (a - b).abs() / s.length;
        }
        self.bindings
            .iter()
            .enumerate()
            .map(|(i, b)| {
                if let Some(v) = b.vertices.iter().find(|v| **v as usize >= n) {
                    return Err(missing(format!("vertex {i}"), *v));
                }
                let on = (0..3).fold(V3::zeros(), |s, k| {
                    s + body[b.vertices[k] as usize].coords * b.weights[k]
                });
                Ok(P3::from(
                    on + V3::new(
                        b.offset[0] * scale[0],
                        b.offset[1] * scale[1],
                        b.offset[2] * scale[2],
                    ),
                ))
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "# a hat\nname hat\nobj_file hat.obj\nbasemesh hm08\nx_scale 0 1 2.0\nz_depth 50\nverts 0\n\
        0 1 2 0.5 0.25 0.25 0.1 0.2 0.3\n2\ndelete_verts\n0 - 2\n";

    #[test]
    fn bound_vertices_follow_the_body_with_scaled_offsets() {
        let m = parse_mhclo(TEXT, Path::new("hat.mhclo")).expect("valid");
        assert_eq!(
            (m.deleted.as_slice(), m.z_depth, m.base.as_str()),
            (&[0, 1, 2][..], 50, "hm08")
        );
        let body = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]].map(P3::from);
        let p = m.fit(&body, Path::new("hat.mhclo")).expect("fits");
        // The x distance is twice the source length: the x offset doubles.
        assert_eq!(p[0], P3::new(1.0 + 0.2, 1.0 + 0.2, 0.3));
        assert_eq!(p[1], body[2]);
        let e = m
            .fit(&body[..2], Path::new("hat.mhclo"))
            .expect_err("short body")
            .to_string();
        assert!(e.contains("vertex 0") && e.contains("body vertex 2"), "{e}");
    }

    #[test]
    fn faults_name_line_and_vertex() {
        let e = parse_mhclo(&TEXT.replace("0.25 0.25", "0.25 x"), Path::new("h.mhclo"))
            .expect_err("x")
            .to_string();
        assert!(
            e.contains("line 8") && e.contains("vertex 0") && e.contains("`x`"),
            "{e}"
        );
        assert!(parse_mhclo("verts 0\n1\n", Path::new("h.mhclo")).is_err());
        for cut in 0..TEXT.len() {
            let _ = parse_mhclo(&TEXT[..cut], Path::new("h.mhclo"));
        }
    }
}

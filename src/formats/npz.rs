//! Bodies in SMPL's npz layout: named numpy arrays in a zip.
//!
//! Every array is measured before it is read: the entry's stated size, the header's shape and the bytes that follow
//! must agree, so that a broken or hostile file costs an error and no memory.

use super::FormatError;
use npyz::{DType, NpyHeader, Order, TypeChar};
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

/// No array of a body is larger: 55 joints × 50,000 vertices × 8 bytes is 22 MB, 300 shape directions of 10,475
/// vertices (SMPL-X) are 75 MB.
const MAX_ARRAY_BYTES: u64 = 512 << 20;

/// The root's parent in SMPL's tables (−1 stored as u32).
const NO_PARENT: i64 = 4_294_967_295;

/// The arrays of an SMPL-layout body: shapes agree, numbers are finite and indices in range.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SmplArrays {
    /// `v_template`: rest vertices, metres, shape `[V]`.
    pub vertices: Vec<[f32; 3]>,
    /// `f`: corners of each triangle, shape `[F]`.
    pub faces: Vec<[u32; 3]>,
    /// `weights`: skinning weights, row-major, shape `[V](J)`.
    pub weights: Vec<f32>,
    /// `kintree_table` row 0: parent of each joint, `None` for the root, shape `(J)`. Parents come first.
    pub parents: Vec<Option<usize>>,
    /// `J`, or `J_regressor · v_template`: rest joints, metres, shape `(J)`.
    pub joints: Vec<[f64; 3]>,
    /// `J_regressor`: row-major, shape `(J)[V]`; empty when the file has none.
    pub joint_regressor: Vec<f32>,
    /// `shapedirs`: offsets per unit of each coefficient, metres, shape `[B][V]`; empty when the file has none.
    pub shape_directions: Vec<Vec<[f32; 3]>>,
    /// `joint_names`, shape `(J)`, or SMPL's own names when the file has none and has SMPL's number of joints.
    pub joint_names: Vec<String>,
}

/// Names of SMPL's first 24 joints, in its order.
pub const SMPL_JOINT_NAMES: [&str; 24] = [
    "pelvis",
    "left_hip",
    "right_hip",
    "spine1",
    "left_knee",
    "right_knee",
    "spine2",
    "left_ankle",
    "right_ankle",
    "spine3",
    "left_foot",
    "right_foot",
    "neck",
    "left_collar",
    "right_collar",
    "head",
    "left_shoulder",
    "right_shoulder",
    "left_elbow",
    "right_elbow",
    "left_wrist",
    "right_wrist",
    "left_hand",
    "right_hand",
];

/// One array: its shape and its numbers in C order.
struct Array<T> {
    shape: Vec<usize>,
    data: Vec<T>,
}

/// The zip and the name to blame.
struct Archive<'a> {
    path: &'a Path,
    npz: npyz::npz::NpzArchive<BufReader<File>>,
}

impl Archive<'_> {
    fn fault(&self, field: &str, why: impl Into<String>) -> FormatError {
        FormatError::field(self.path, field, why)
    }

    /// Header and payload of an entry, or `None` when there is no such array.
    fn raw(&mut self, name: &str) -> Result<Option<(NpyHeader, Vec<u8>)>, FormatError> {
        let path = self.path;
        let fault = |why: String| FormatError::field(path, name, why);
        let file = npyz::npz::file_name_from_array_name(name);
        let zip = self.npz.zip_archive();
        if !zip.file_names().any(|n| n == file) {
            return Ok(None);
        }
        let entry = zip
            .by_name(&file)
            .map_err(|e| fault(format!("the zip entry cannot be opened ({e})")))?;
        let size = entry.size();
        if size > MAX_ARRAY_BYTES {
            return Err(fault(format!(
                "{size} bytes, but no body array is larger than {MAX_ARRAY_BYTES}"
            )));
        }
        // `take` and growing as bytes arrive: the stated size alone allocates nothing.
        let mut bytes = Vec::new();
        let read = entry
            .take(size + 1)
            .read_to_end(&mut bytes)
            .map_err(|e| fault(format!("cannot be read ({e})")))?;
        if read as u64 != size {
            return Err(fault(format!("{read} bytes found, {size} announced")));
        }
        // npyz allocates the header as long as it says it is; look before it does.
        let header_end = match bytes.get(6..12) {
            Some([1, _, a, b, ..]) => 10 + u64::from(u16::from_le_bytes([*a, *b])),
            Some([_, _, a, b, c, d]) => 12 + u64::from(u32::from_le_bytes([*a, *b, *c, *d])),
            _ => return Err(fault("too short for a numpy array".into())),
        };
        if header_end > size {
            return Err(fault("its header is longer than the array".into()));
        }
        let header = NpyHeader::from_reader(&bytes[..])
            .map_err(|e| fault(format!("is not a numpy array ({e})")))?;
        let item = match header.dtype() {
            DType::Plain(t) => t.num_bytes(),
            _ => None,
        };
        let Some(item) = item.filter(|i| *i > 0) else {
            return Err(fault(
                "is a pickled or structured object; save it as a plain dense array".into(),
            ));
        };
        let count = header
            .shape()
            .iter()
            .try_fold(1u64, |n, d| n.checked_mul(*d));
        let payload = bytes.split_off(header_end as usize);
        if count.and_then(|n| n.checked_mul(item as u64)) != Some(payload.len() as u64) {
            return Err(fault(format!(
                "shape {:?} of {item} bytes each does not match its {} bytes",
                header.shape(),
                payload.len()
            )));
        }
        Ok(Some((header, payload)))
    }

    /// Numbers of any plain type as f64.
    fn numbers(&mut self, name: &str) -> Result<Option<Array<f64>>, FormatError> {
        let Some((header, bytes)) = self.raw(name)? else {
            return Ok(None);
        };
        let DType::Plain(t) = header.dtype() else {
            return Err(self.fault(name, "not a plain array"));
        };
        let item = t.num_bytes().unwrap_or(0);
        if t.endianness() == npyz::Endianness::Big {
            return Err(self.fault(
                name,
                "big-endian numbers are not supported; save it little-endian",
            ));
        }
        /// The little-endian numbers of one type.
        fn parse<const N: usize>(bytes: &[u8], f: impl Fn([u8; N]) -> f64) -> Vec<f64> {
            bytes.as_chunks::<N>().0.iter().map(|c| f(*c)).collect()
        }
        let data = match (t.type_char(), item) {
            (TypeChar::Float, 4) => parse(&bytes, |b| f64::from(f32::from_le_bytes(b))),
            (TypeChar::Float, 8) => parse(&bytes, f64::from_le_bytes),
            (TypeChar::Int, 4) => parse(&bytes, |b| f64::from(i32::from_le_bytes(b))),
            (TypeChar::Int, 8) => parse(&bytes, |b| i64::from_le_bytes(b) as f64),
            (TypeChar::Uint, 4) => parse(&bytes, |b| f64::from(u32::from_le_bytes(b))),
            (TypeChar::Uint, 8) => parse(&bytes, |b| u64::from_le_bytes(b) as f64),
            (c, n) => {
                return Err(self.fault(name, format!("type {c:?} of {n} bytes is not supported")));
            }
        };
        if let Some(i) = data.iter().position(|v| !v.is_finite()) {
            return Err(self.fault(name, format!("value {i} is not finite")));
        }
        let shape: Vec<usize> = header.shape().iter().map(|d| *d as usize).collect();
        let data = if header.order() == Order::Fortran {
            to_c_order(&shape, &data)
        } else {
            data
        };
        Ok(Some(Array { shape, data }))
    }

    fn required(&mut self, name: &str) -> Result<Array<f64>, FormatError> {
        self.numbers(name)?
            .ok_or_else(|| self.fault(name, "missing; an SMPL-layout body needs it"))
    }

    /// A numpy array of unicode strings (`<U`).
    fn strings(&mut self, name: &str) -> Result<Option<Vec<String>>, FormatError> {
        let Some((header, bytes)) = self.raw(name)? else {
            return Ok(None);
        };
        let DType::Plain(t) = header.dtype() else {
            return Err(self.fault(name, "not a plain array"));
        };
        let width = match t.type_char() {
            TypeChar::UnicodeStr => t.num_bytes().unwrap_or(4),
            c => return Err(self.fault(name, format!("type {c:?}; unicode strings were expected"))),
        };
        let text = |item: &[u8]| {
            let codes = item
                .as_chunks::<4>()
                .0
                .iter()
                .map(|c| u32::from_le_bytes(*c));
            codes
                .take_while(|c| *c != 0)
                .map(char::from_u32)
                .collect::<Option<String>>()
        };
        let all: Option<Vec<String>> = bytes.chunks_exact(width).map(text).collect();
        all.map(Some)
            .ok_or_else(|| self.fault(name, "holds characters that are not unicode"))
    }
}

/// Reorders Fortran-order data to C order.
fn to_c_order(shape: &[usize], data: &[f64]) -> Vec<f64> {
    let mut index = vec![0usize; shape.len()];
    let mut strides = vec![1usize; shape.len()];
    for k in 1..shape.len() {
        strides[k] = strides[k - 1] * shape[k - 1];
    }
    let mut out = Vec::with_capacity(data.len());
    for _ in 0..data.len() {
        out.push(
            data[index
                .iter()
                .zip(&strides)
                .map(|(i, s)| i * s)
                .sum::<usize>()],
        );
        for k in (0..shape.len()).rev() {
            index[k] += 1;
            if index[k] < shape[k] {
                break;
            }
            index[k] = 0;
        }
    }
    out
}

/// Reads the arrays of an SMPL-layout body and checks that they fit each other. `posedirs` is not read: pose
/// correctives are not used.
///
/// # Errors
/// [`FormatError`] naming the file and the array at fault.
pub fn read_smpl(path: impl AsRef<Path>) -> Result<SmplArrays, FormatError> {
    let path = path.as_ref();
    let npz = npyz::npz::NpzArchive::open(path).map_err(|e| FormatError::io(path, e))?;
    let mut a = Archive { path, npz };
    let expect = |name: &str, shape: &[usize], wanted: &[usize]| {
        if shape == wanted {
            return Ok(());
        }
        Err(FormatError::field(
            path,
            name,
            format!("shape {shape:?}, expected {wanted:?}"),
        ))
    };
    let triple = |c: &[f64; 3]| c.map(|x| x as f32);

    let v = a.required("v_template")?;
    let n = v.shape.first().copied().unwrap_or(0);
    expect("v_template", &v.shape, &[n, 3])?;
    let vertices: Vec<[f32; 3]> = v.data.as_chunks::<3>().0.iter().map(triple).collect();

    let f = a.required("f")?;
    expect("f", &f.shape, &[f.shape.first().copied().unwrap_or(0), 3])?;
    if let Some(i) = f.data.iter().position(|&i| i < 0.0 || i >= n as f64) {
        return Err(a.fault(
            "f",
            format!("face {} names vertex {} of {n}", i / 3, f.data[i]),
        ));
    }
    let faces = f
        .data
        .as_chunks::<3>()
        .0
        .iter()
        .map(|c| c.map(|i| i as u32))
        .collect();

    let tree = a.required("kintree_table")?;
    let j = tree.shape.get(1).copied().unwrap_or(0);
    expect("kintree_table", &tree.shape, &[2, j])?;
    if j == 0 || j > usize::from(u8::MAX) {
        return Err(a.fault(
            "kintree_table",
            format!("{j} joints; 1 to 255 are supported"),
        ));
    }
    let parents = (0..j)
        .map(|k| match tree.data[k] as i64 {
            NO_PARENT | -1 if k == 0 => Ok(None),
            p if k > 0 && (0..k as i64).contains(&p) => Ok(Some(p as usize)),
            p => Err(a.fault(
                "kintree_table",
                format!("joint {k} has parent {p}; parents come before children"),
            )),
        })
        .collect::<Result<Vec<_>, _>>()?;

    let w = a.required("weights")?;
    expect("weights", &w.shape, &[n, j])?;
    let weights = w.data.iter().map(|x| *x as f32).collect();

    let joint_regressor: Vec<f32> = match a.numbers("J_regressor")? {
        None => Vec::new(),
        Some(r) => {
            expect("J_regressor", &r.shape, &[j, n])?;
            r.data.iter().map(|x| *x as f32).collect()
        }
    };
    let joints: Vec<[f64; 3]> = match a.numbers("J")? {
        Some(q) => {
            expect("J", &q.shape, &[j, 3])?;
            q.data.as_chunks::<3>().0.to_vec()
        }
        None if joint_regressor.is_empty() => {
            return Err(a.fault("J", "neither `J` nor `J_regressor` is there"));
        }
        None => regress(&joint_regressor, &vertices),
    };
    let shape_directions = match a.numbers("shapedirs")? {
        None => Vec::new(),
        Some(s) => {
            let b = s.shape.get(2).copied().unwrap_or(0);
            expect("shapedirs", &s.shape, &[n, 3, b])?;
            let at = |d: usize, i: usize, c: usize| s.data[(i * 3 + c) * b + d] as f32;
            (0..b)
                .map(|d| (0..n).map(|i| [0, 1, 2].map(|c| at(d, i, c))).collect())
                .collect()
        }
    };
    let joint_names = match a.strings("joint_names")? {
        Some(names) if names.len() == j => names,
        Some(names) => {
            return Err(a.fault(
                "joint_names",
                format!("{} names for {j} joints", names.len()),
            ));
        }
        None => (0..j)
            .map(|k| {
                SMPL_JOINT_NAMES
                    .get(k)
                    .map_or_else(|| format!("joint_{k}"), |s| (*s).into())
            })
            .collect(),
    };
    Ok(SmplArrays {
        vertices,
        faces,
        weights,
        parents,
        joints,
        joint_regressor,
        shape_directions,
        joint_names,
    })
}

/// `regressor · points`, shape `(J)` for a row-major regressor of shape `(J)[points]`.
pub fn regress(regressor: &[f32], points: &[[f32; 3]]) -> Vec<[f64; 3]> {
    let row = |r: &[f32]| {
        let mut sum = [0.0; 3];
        for (w, p) in r.iter().zip(points).filter(|(w, _)| **w != 0.0) {
            for c in 0..3 {
                sum[c] += f64::from(*w) * f64::from(p[c]);
            }
        }
        sum
    };
    regressor
        .chunks_exact(points.len().max(1))
        .map(row)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use npyz::WriterBuilder;

    /// Writes a body of one triangle and one joint, with one array replaced.
    fn write(dir: &Path, replace: &str, shape: &[u64], data: &[f64]) -> std::path::PathBuf {
        let path = dir.join(format!("{replace}.npz"));
        let mut z = npyz::npz::NpzWriter::create(&path).expect("create");
        let arrays: [(&str, &[u64], &[f64]); 5] = [
            (
                "v_template",
                &[3, 3],
                &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0],
            ),
            ("f", &[1, 3], &[0.0, 1.0, 2.0]),
            ("weights", &[3, 1], &[1.0, 1.0, 1.0]),
            ("kintree_table", &[2, 1], &[4_294_967_295.0, 0.0]),
            ("J", &[1, 3], &[0.0, 0.5, 0.0]),
        ];
        for (name, s, d) in arrays {
            let (s, d) = if name == replace {
                (shape, data)
            } else {
                (s, d)
            };
            let mut w = z
                .array::<f64>(name, Default::default())
                .expect("entry")
                .default_dtype()
                .shape(s)
                .begin_nd()
                .expect("begin");
            w.extend(d.iter().copied()).expect("write");
            w.finish().expect("finish");
        }
        path
    }

    #[test]
    fn a_small_body_reads_and_faults_are_named() {
        let dir = tempfile::tempdir().expect("dir");
        let ok = read_smpl(write(dir.path(), "none", &[], &[])).expect("valid");
        assert_eq!(
            (ok.faces, ok.parents, ok.joint_names),
            (vec![[0, 1, 2]], vec![None], vec!["pelvis".to_owned()])
        );
        for (name, shape, data) in [
            ("f", vec![1, 3], vec![0.0, 1.0, 3.0]),
            ("f", vec![1, 3], vec![0.0, -1.0, 2.0]),
            ("v_template", vec![3, 2], vec![0.0; 6]),
            ("v_template", vec![3, 3], vec![f64::NAN; 9]),
            ("weights", vec![2, 1], vec![1.0, 1.0]),
            ("kintree_table", vec![2, 1], vec![7.0, 0.0]),
            ("J", vec![2, 3], vec![0.0; 6]),
        ] {
            let e = read_smpl(write(dir.path(), name, &shape, &data))
                .expect_err("must be refused")
                .to_string();
            assert!(e.contains(&format!("`{name}`")), "{name}: {e}");
        }
    }

    #[test]
    fn broken_files_are_errors() {
        let dir = tempfile::tempdir().expect("dir");
        let whole = std::fs::read(write(dir.path(), "none", &[], &[])).expect("bytes");
        let path = dir.path().join("broken.npz");
        for cut in [0, 1, 40, whole.len() / 2, whole.len() - 1] {
            std::fs::write(&path, &whole[..cut]).expect("write");
            assert!(read_smpl(&path).is_err(), "cut at {cut}");
        }
        // Every byte flipped once: an error or a body, never a panic.
        for i in 0..whole.len() {
            let mut b = whole.clone();
            b[i] ^= 0xff;
            std::fs::write(&path, &b).expect("write");
            let _ = read_smpl(&path);
        }
        assert!(matches!(
            read_smpl(dir.path().join("absent.npz")),
            Err(FormatError::Io { .. })
        ));
    }

    #[test]
    fn fortran_order_is_undone() {
        assert_eq!(
            to_c_order(&[2, 3], &[1.0, 4.0, 2.0, 5.0, 3.0, 6.0]),
            [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
        );
    }
}

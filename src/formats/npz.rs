//! Bodies in SMPL's npz layout: named numpy arrays in a zip.
//!
//! The entry's stated size, the header's shape and the following bytes must agree before an array is read, so that a
//! broken or hostile file costs an error and no memory.

use super::FormatError;
use npyz::{DType, NpyHeader, Order, TypeChar};
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

/// Largest array of a body, bytes: 55 joints × 50,000 vertices × 8 bytes is 22 MB, 300 shape directions of SMPL-X
/// (10,475 vertices) are 75 MB.
const MAX_ARRAY_BYTES: u64 = 512 << 20;

/// The root's parent in SMPL's tables (−1 stored as u32).
const NO_PARENT: i64 = 4_294_967_295;

/// Arrays of an SMPL-layout body: shapes agree, numbers are finite and indices in range.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SmplArrays {
    /// `v_template`: rest vertices, metres, shape `(V)`.
    pub vertices: Vec<[f32; 3]>,
    /// `f`: corners of each triangle, shape `(F)`.
    pub faces: Vec<[u32; 3]>,
    /// `weights`: skinning weights, row-major, shape `(V, J)`.
    pub weights: Vec<f32>,
    /// `kintree_table` row 0: parent of each joint, `None` for the root, shape `(J)`. Parents come first.
    pub parents: Vec<Option<usize>>,
    /// `J`, or `J_regressor · v_template`: rest joints, metres, shape `(J)`.
    pub joints: Vec<[f64; 3]>,
    /// `J_regressor`: row-major, shape `(J, V)`; empty if absent.
    pub joint_regressor: Vec<f32>,
    /// `shapedirs`: offsets per unit of each coefficient, metres, shape `(B, V)`; empty if absent.
    pub shape_directions: Vec<Vec<[f32; 3]>>,
    /// `posedirs`: offsets per entry of R − I of each joint but the root, metres, row-major, shape `(V, 3, 9 (J − 1))`; empty
    /// if absent.
    pub pose_directions: Vec<f32>,
    /// `joint_names`, shape `(J)`; SMPL's own names if absent.
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

/// Numbers of one array in C order.
struct Array {
    shape: Vec<usize>,
    data: Vec<f64>,
}

impl Array {
    /// Length along a dimension; 0 if there is no such dimension.
    fn side(&self, dimension: usize) -> usize {
        self.shape.get(dimension).copied().unwrap_or(0)
    }
}

/// The zip, and its path for errors.
struct Archive<'a> {
    path: &'a Path,
    npz: npyz::npz::NpzArchive<BufReader<File>>,
}

impl Archive<'_> {
    fn fault(&self, field: &str, why: impl Into<String>) -> FormatError {
        FormatError::field(self.path, field, why)
    }

    /// Header and payload of an entry; `None` if there is no such array.
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
        // The buffer grows as bytes arrive: the stated size alone allocates nothing.
        let mut bytes = Vec::new();
        let read = entry
            .take(size + 1)
            .read_to_end(&mut bytes)
            .map_err(|e| fault(format!("cannot be read ({e})")))?;
        if read as u64 != size {
            return Err(fault(format!("{read} bytes found, {size} announced")));
        }
        let header_end = super::npy::data_start(&bytes)
            .ok_or_else(|| fault("too short for a numpy array".into()))?;
        if header_end > bytes.len() {
            return Err(fault("its header is longer than the array".into()));
        }
        if !super::npy::is_flat_header(&bytes[..header_end]) {
            return Err(fault("its header nests more than an array's".into()));
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
        let payload = bytes.split_off(header_end);
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
    fn numbers(&mut self, name: &str) -> Result<Option<Array>, FormatError> {
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

/// Reads the arrays of an SMPL-layout body and checks that they fit each other.
///
/// # Errors
/// [`FormatError`] naming the file and the array at fault.
pub fn read_smpl(path: impl AsRef<Path>) -> Result<SmplArrays, FormatError> {
    let path = path.as_ref();
    let npz = npyz::npz::NpzArchive::open(path).map_err(|e| FormatError::io(path, e))?;
    let mut a = Archive { path, npz };
    let vertices = a.template()?;
    let faces = a.faces(vertices.len())?;
    let parents = a.parents()?;
    let (n, j) = (vertices.len(), parents.len());
    let weights = a.shaped("weights", &[n, j])?;
    let weights = weights.ok_or_else(|| a.missing("weights"))?;
    let regressor = a.shaped("J_regressor", &[j, n])?.unwrap_or_default();
    let joint_regressor: Vec<f32> = regressor.iter().map(|x| *x as f32).collect();
    let posedirs = a.shaped("posedirs", &[n, 3, 9 * (j - 1)])?;
    let pose_directions = posedirs.unwrap_or_default();
    let joints = match a.shaped("J", &[j, 3])? {
        Some(joints) => joints.as_chunks::<3>().0.to_vec(),
        None if joint_regressor.is_empty() => {
            return Err(a.fault("J", "neither `J` nor `J_regressor` is there"));
        }
        None => regress(&joint_regressor, &vertices),
    };
    Ok(SmplArrays {
        faces,
        weights: weights.iter().map(|x| *x as f32).collect(),
        joints,
        joint_regressor,
        shape_directions: a.shape_directions(n)?,
        pose_directions: pose_directions.iter().map(|x| *x as f32).collect(),
        joint_names: a.joint_names(j)?,
        vertices,
        parents,
    })
}

impl Archive<'_> {
    fn missing(&self, name: &str) -> FormatError {
        self.fault(name, "missing; an SMPL-layout body needs it")
    }
    fn required(&mut self, name: &str) -> Result<Array, FormatError> {
        self.numbers(name)?.ok_or_else(|| self.missing(name))
    }
    fn expect_shape(&self, name: &str, a: &Array, wanted: &[usize]) -> Result<(), FormatError> {
        if a.shape == wanted {
            return Ok(());
        }
        let shape = &a.shape;
        Err(self.fault(name, format!("shape {shape:?}, expected {wanted:?}")))
    }
    /// Numbers of an array of this shape; `None` if there is no such array.
    fn shaped(&mut self, name: &str, wanted: &[usize]) -> Result<Option<Vec<f64>>, FormatError> {
        let Some(array) = self.numbers(name)? else {
            return Ok(None);
        };
        self.expect_shape(name, &array, wanted)?;
        Ok(Some(array.data))
    }
    fn template(&mut self) -> Result<Vec<[f32; 3]>, FormatError> {
        let v = self.required("v_template")?;
        self.expect_shape("v_template", &v, &[v.side(0), 3])?;
        let points = v.data.as_chunks::<3>().0.iter();
        Ok(points.map(|p| p.map(|x| x as f32)).collect())
    }
    fn faces(&mut self, vertices: usize) -> Result<Vec<[u32; 3]>, FormatError> {
        let f = self.required("f")?;
        self.expect_shape("f", &f, &[f.side(0), 3])?;
        let bad = |i: &f64| *i < 0.0 || *i >= vertices as f64;
        if let Some(i) = f.data.iter().position(bad) {
            let why = format!("face {} names vertex {} of {vertices}", i / 3, f.data[i]);
            return Err(self.fault("f", why));
        }
        let faces = f.data.as_chunks::<3>().0.iter();
        Ok(faces.map(|c| c.map(|i| i as u32)).collect())
    }
    fn parents(&mut self) -> Result<Vec<Option<usize>>, FormatError> {
        const NAME: &str = "kintree_table";
        let tree = self.required(NAME)?;
        let j = tree.side(1);
        self.expect_shape(NAME, &tree, &[2, j])?;
        if j == 0 || j > usize::from(u8::MAX) {
            return Err(self.fault(NAME, format!("{j} joints; 1 to 255 are supported")));
        }
        let parent = |k: usize| match tree.data[k] as i64 {
            NO_PARENT | -1 if k == 0 => Ok(None),
            p if k > 0 && (0..k as i64).contains(&p) => Ok(Some(p as usize)),
            p => {
                let why = format!("joint {k} has parent {p}; parents come before children");
                Err(self.fault(NAME, why))
            }
        };
        (0..j).map(parent).collect()
    }
    fn shape_directions(&mut self, vertices: usize) -> Result<Vec<Vec<[f32; 3]>>, FormatError> {
        let Some(s) = self.numbers("shapedirs")? else {
            return Ok(Vec::new());
        };
        let count = s.side(2);
        self.expect_shape("shapedirs", &s, &[vertices, 3, count])?;
        let at = |d: usize, i: usize| [0, 1, 2].map(|c| s.data[(i * 3 + c) * count + d] as f32);
        let direction = |d: usize| (0..vertices).map(|i| at(d, i)).collect();
        Ok((0..count).map(direction).collect())
    }
    fn joint_names(&mut self, joints: usize) -> Result<Vec<String>, FormatError> {
        if let Some(names) = self.strings("joint_names")? {
            if names.len() != joints {
                let why = format!("{} names for {joints} joints", names.len());
                return Err(self.fault("joint_names", why));
            }
            return Ok(names);
        }
        let name = |k: usize| {
            let known = SMPL_JOINT_NAMES.get(k);
            known.map_or_else(|| format!("joint_{k}"), |s| (*s).into())
        };
        Ok((0..joints).map(name).collect())
    }
}

/// Product `regressor · points`, shape `(J)`, of a row-major regressor of shape `(J, points)`.
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
        let known = arrays.iter().any(|(name, ..)| *name == replace);
        let added = (!known && !shape.is_empty()).then_some((replace, shape, data));
        for (name, s, d) in arrays.into_iter().chain(added) {
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
    fn a_minimal_body_reads_and_faults_are_named() {
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
            ("posedirs", vec![3, 3, 9], vec![0.0; 81]),
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

//! Bodies in SMPL's npz layout.

use super::FormatError;
use super::npz_file::{NpzArray, NpzFile};
use super::pose_feature::PoseDirections;
use std::path::Path;

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
    /// `posedirs`.
    pub pose_directions: PoseDirections,
    /// `joint_names`, shape `(J)`; if absent SMPL's own names of the joints that all its layouts share, and numbers.
    pub joint_names: Vec<String>,
    /// The file has `joint_names`.
    pub has_names: bool,
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

/// Reads the arrays of an SMPL-layout body and checks that they fit each other.
///
/// # Errors
/// [`FormatError`] naming the file and the array at fault.
pub fn read_smpl(path: impl AsRef<Path>) -> Result<SmplArrays, FormatError> {
    let path = path.as_ref();
    let mut a = NpzFile::open(path)?;
    let vertices = a.template()?;
    let faces = a.faces(vertices.len())?;
    let parents = a.parents()?;
    let (n, j) = (vertices.len(), parents.len());
    let weights = a.shaped("weights", &[n, j])?;
    let weights = weights.ok_or_else(|| a.missing("weights"))?;
    let regressor = a.shaped("J_regressor", &[j, n])?.unwrap_or_default();
    let joint_regressor: Vec<f32> = regressor.iter().map(|x| *x as f32).collect();
    let pose_directions = PoseDirections::read(&mut a, n, j)?;
    let joints = match a.shaped("J", &[j, 3])? {
        Some(joints) => joints.as_chunks::<3>().0.to_vec(),
        None if joint_regressor.is_empty() => {
            return Err(a.fault("J", "neither `J` nor `J_regressor` is there"));
        }
        None => regress(&joint_regressor, &vertices),
    };
    let named = a.joint_names(j)?;
    Ok(SmplArrays {
        faces,
        weights: weights.iter().map(|x| *x as f32).collect(),
        joints,
        joint_regressor,
        shape_directions: a.shape_directions(n)?,
        pose_directions,
        has_names: named.is_some(),
        joint_names: named.unwrap_or_else(|| default_names(j)),
        vertices,
        parents,
    })
}

impl NpzFile<'_> {
    fn missing(&self, name: &str) -> FormatError {
        self.fault(name, "missing; an SMPL-layout body needs it")
    }
    fn required(&mut self, name: &str) -> Result<NpzArray, FormatError> {
        self.numbers(name)?.ok_or_else(|| self.missing(name))
    }
    fn expect_shape(&self, name: &str, a: &NpzArray, wanted: &[usize]) -> Result<(), FormatError> {
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
    fn joint_names(&mut self, joints: usize) -> Result<Option<Vec<String>>, FormatError> {
        let names = self.strings("joint_names")?;
        if let Some(names) = &names
            && names.len() != joints
        {
            let why = format!("{} names for {joints} joints", names.len());
            return Err(self.fault("joint_names", why));
        }
        Ok(names)
    }
}

/// SMPL's names of the first joints: of 22, or of all 24 where there are no more.
fn default_names(joints: usize) -> Vec<String> {
    /// Joints that SMPL, SMPL+H and SMPL-X have in common.
    const COMMON: usize = 22;
    let known = if joints <= SMPL_JOINT_NAMES.len() {
        joints
    } else {
        COMMON
    };
    let name = |k: usize| {
        let name = SMPL_JOINT_NAMES[..known].get(k);
        name.map_or_else(|| format!("joint_{k}"), |s| (*s).into())
    };
    (0..joints).map(name).collect()
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
    use crate::PoseFeature;
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

    /// STAR's pose features are quaternions and the second shape coefficient: 4 · 23 + 1 for 24 joints, 1 for one.
    #[test]
    fn the_last_pose_direction_of_star_is_one_of_shape() {
        let dir = tempfile::tempdir().expect("dir");
        let values: Vec<f64> = (0..9).map(f64::from).collect();
        let file = write(dir.path(), "posedirs", &[3, 3, 1], &values);
        let star = read_smpl(file).expect("valid");
        assert_eq!(star.pose_directions.feature, PoseFeature::Quaternion);
        assert!(star.pose_directions.of_pose.is_empty() && !star.has_names);
        let second = &star.pose_directions.of_second_shape;
        assert_eq!(
            second[..],
            [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0], [6.0, 7.0, 8.0]]
        );
    }

    #[test]
    fn default_names_stop_where_layouts_part() {
        assert_eq!(default_names(24)[22..], ["left_hand", "right_hand"]);
        assert_eq!(
            default_names(55)[20..24],
            ["left_wrist", "right_wrist", "joint_22", "joint_23"]
        );
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
}

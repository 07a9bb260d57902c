//! Garments in other frames, with others in the same file.

use crate::common::posed;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use tryon::body::{BodyShape, Pose, embedded};
use tryon::dressing::{
    DressOptions, GarmentFile, MeshGarment, MeshGarmentError, MeshGarmentSettings, dress,
};
use tryon::formats::mesh_frame::upright_rotation;
use tryon::formats::{MeshAxis, MeshFrame, shared_data};
use tryon::garment::{Material, Size, library};
use tryon::geometry::math::{Body, P3, Rigid, V3, World};
use tryon::geometry::mesh::{Face, Topology, TriMesh, face_normal};

/// A surface as a program exports it.
#[derive(Clone, Debug)]
struct Export {
    vertices: Vec<P3>,
    faces: Vec<Face>,
}

impl Export {
    /// The library's T-shirt and our body that wears it, metres, y up, facing +z.
    fn shirt_and_person() -> [Self; 2] {
        let template = embedded::template();
        let rest = template.personalise(&BodyShape::default());
        let mut pose = Pose::rest(template.skeleton(), Rigid::<World, Body>::identity());
        pose.lower_arms(template.skeleton(), &rest, 0.75);
        let pattern = library::pattern("tshirt", Size::M).expect("a pattern");
        let options = DressOptions::default();
        let dressed = dress(&template, &rest, &pose, &[pattern], &options).expect("dressed");
        let shirt = Self {
            vertices: dressed.state.garments[0].positions.clone(),
            faces: dressed.model.outfit.garments[0].faces.clone(),
        };
        let person = Self {
            vertices: posed(&template, &rest, &pose),
            faces: template.mesh().faces().to_vec(),
        };
        [shirt, person]
    }
    /// In a unit [m] and with axes that point up and ahead.
    fn written_in(&self, unit: f32, up: MeshAxis, facing: MeshAxis) -> Self {
        let upright = upright_rotation(up, facing)
            .expect("two axes")
            .cast::<f32>();
        let place = |p: &P3| upright.transpose() * p / unit;
        Self {
            vertices: self.vertices.iter().map(place).collect(),
            faces: self.faces.clone(),
        }
    }
    /// With another surface in the same file.
    fn beside(&self, other: &Self) -> Self {
        let first = self.vertices.len() as u32;
        let mut out = self.clone();
        out.vertices.extend(&other.vertices);
        let moved = other.faces.iter().map(|f| f.map(|v| v + first));
        out.faces.extend(moved);
        out
    }
    /// Each triangle alone.
    fn soup(&self) -> Self {
        let corners = self.faces.iter().flatten();
        Self {
            vertices: corners.map(|v| self.vertices[*v as usize]).collect(),
            faces: (0..self.faces.len() as u32)
                .map(|f| [3 * f, 3 * f + 1, 3 * f + 2])
                .collect(),
        }
    }
    /// A button: a tetrahedron of 1 cm.
    fn button(at: P3) -> Self {
        let corners = [
            [0.0, 0.0, 0.0],
            [0.01, 0.0, 0.0],
            [0.0, 0.01, 0.0],
            [0.0, 0.0, 0.005],
        ];
        Self {
            vertices: corners.map(|c| at + V3::from(c)).to_vec(),
            faces: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
        }
    }
    /// The same surface, moved along its normals [m].
    fn offset(&self, distance: f32) -> Self {
        let mut normals = vec![V3::zeros(); self.vertices.len()];
        for f in &self.faces {
            let normal = face_normal(&self.vertices, f);
            f.iter().for_each(|v| normals[*v as usize] += normal);
        }
        let moved = self.vertices.iter().zip(&normals);
        Self {
            vertices: moved.map(|(p, n)| p + n.normalize() * distance).collect(),
            faces: self.faces.clone(),
        }
    }
    /// Cloth with a thickness [m]: an inner sheet, joined at the rims.
    fn thick(&self, thickness: f32) -> Self {
        let mesh = TriMesh::new(self.vertices.clone(), self.faces.clone()).expect("a surface");
        let topology = Topology::new(&mesh).expect("a sheet");
        let n = self.vertices.len() as u32;
        let mut out = self.clone();
        out.vertices.extend(self.offset(-thickness).vertices);
        out.faces
            .extend(self.faces.iter().map(|[a, b, c]| [a + n, c + n, b + n]));
        for [a, b] in topology
            .edges()
            .iter()
            .filter(|e| e.twin.is_none())
            .map(|e| e.v)
        {
            out.faces.extend([[b, a, a + n], [b, a + n, b + n]]);
        }
        out
    }
    fn save(&self, folder: &Path, name: &str) -> PathBuf {
        let mut text = String::new();
        for p in &self.vertices {
            writeln!(text, "v {:.6} {:.6} {:.6}", p.x, p.y, p.z).expect("text");
        }
        for f in &self.faces {
            let [a, b, c] = f.map(|v| v + 1);
            writeln!(text, "f {a} {b} {c}").expect("text");
        }
        let path = folder.join(format!("{name}.obj"));
        std::fs::write(&path, text).expect("written");
        path
    }
}

fn axis(name: &str) -> MeshAxis {
    name.parse().expect("an axis")
}

fn read(path: &Path, frame: MeshFrame) -> Result<MeshGarment, MeshGarmentError> {
    let cotton = Material::preset("cotton").expect("preset");
    let file = GarmentFile {
        frame,
        ..GarmentFile::new(path, None)
    };
    MeshGarment::read_on(file, &cotton, &MeshGarmentSettings::default())
}

/// Largest of the distances of the corners of two garments' bounds, metres.
fn apart(a: &MeshGarment, b: &MeshGarment) -> f32 {
    let bounds = |m: &MeshGarment| {
        let (x, _) = m.surface();
        let empty = (P3::from([f32::MAX; 3]), P3::from([f32::MIN; 3]));
        x.iter().fold(empty, |(lo, hi), p| (lo.inf(p), hi.sup(p)))
    };
    let ((a, b), (c, d)) = (bounds(a), bounds(b));
    (a - c).amax().max((b - d).amax())
}

/// Units × axes × facing, with and without the person who wears it, welded and not: one shirt.
#[test]
fn exports_of_one_shirt_are_one_shirt() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let [shirt, person] = Export::shirt_and_person();
    let plain = read(&shirt.save(folder.path(), "plain"), MeshFrame::default()).expect("worn");
    let with_person = shirt.beside(&person);
    let thick = shirt.thick(0.003);
    let exports = [
        ("decimetres", 0.1, "y", "z", &shirt),
        ("z_up_mm", 0.001, "z", "-y", &shirt),
        ("z_up_side", 1.0, "z", "x", &shirt),
        ("thick", 1.0, "y", "z", &thick),
        ("thick_z_up_inches", 0.0254, "z", "-y", &thick),
        ("centimetres", 0.01, "y", "z", &shirt),
        ("millimetres", 0.001, "y", "z", &shirt),
        ("inches", 0.0254, "y", "z", &shirt),
        ("feet", 0.3048, "z", "-y", &shirt),
        ("z_up", 1.0, "z", "-y", &shirt),
        ("z_up_cm_back", 0.01, "z", "y", &shirt),
        ("back", 1.0, "y", "-z", &shirt),
        ("side", 1.0, "y", "x", &shirt),
        ("x_up", 0.1, "x", "z", &shirt),
        ("upside_down", 1.0, "-y", "z", &shirt),
        ("soup", 1.0, "y", "z", &shirt.soup()),
        ("soup_inches", 0.0254, "z", "-y", &shirt.soup()),
        ("person", 1.0, "y", "z", &with_person),
        ("person_cm_z_up", 0.01, "z", "-y", &with_person),
        ("person_back", 1.0, "y", "-z", &with_person),
    ];
    let mut wrong = Vec::new();
    for (name, unit, up, facing, export) in exports {
        let written = export.written_in(unit, axis(up), axis(facing));
        match read(&written.save(folder.path(), name), MeshFrame::default()) {
            Ok(garment) => {
                let apart = apart(&plain, &garment);
                println!(
                    "{name}: {:.0} mm; {}",
                    apart * 1e3,
                    garment.notes.join("; ")
                );
                if apart > 0.02 || garment.vertices().abs_diff(plain.vertices()) > 40 {
                    wrong.push(name);
                }
            }
            Err(e) => {
                println!("{name}: {e}");
                wrong.push(name);
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

/// Cloth that goes around nothing is refused in words that name the options.
#[test]
fn a_rag_is_no_garment() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let [shirt, _] = Export::shirt_and_person();
    let is_front = |f: &&Face| {
        f.iter().all(|v| {
            let p = &shirt.vertices[*v as usize];
            p.z > 0.06 && p.x.abs() < 0.12
        })
    };
    let rag = Export {
        faces: shirt.faces.iter().filter(is_front).copied().collect(),
        ..shirt.clone()
    };
    let e = read(&rag.save(folder.path(), "rag"), MeshFrame::default()).expect_err("no garment");
    assert!(e.to_string().contains("--unit"), "{e}");
}

/// Surfaces that a body fits near, but that go around nothing.
#[test]
fn squares_and_triangles_are_no_garments() {
    let toys = [
        "obj_nonmanifold/three_faces.obj",
        "gltf_quantised/u16.glb",
        "gltf_triangle_strip/quad_and_strip.glb",
    ];
    for toy in toys {
        let Some(path) = shared_data(Path::new("reports").join(toy)) else {
            return;
        };
        let e = read(&path, MeshFrame::default()).expect_err("no garment");
        assert!(
            e.to_string().contains("not worn like a garment"),
            "{toy}: {e}"
        );
    }
}

/// Buttons and a lining beside the shirt are told from it by where they lie.
#[test]
fn buttons_and_linings_are_said() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let [shirt, _] = Export::shirt_and_person();
    let mut file = shirt.beside(&shirt.offset(-0.004));
    for height in [1.1f32, 1.2] {
        let front = shirt
            .vertices
            .iter()
            .filter(|p| (p.y - height).abs() < 0.02);
        let front = front.fold(0.0f32, |z, p| z.max(p.z));
        file = file.beside(&Export::button(P3::new(0.0, height, front + 0.004)));
    }
    let garment = read(&file.save(folder.path(), "jacket"), MeshFrame::default()).expect("worn");
    let notes = garment.notes.join("; ");
    assert!(notes.contains("is the lining of piece"), "{notes}");
    assert!(notes.contains("2 fastenings"), "{notes}");
}

/// Stated axes win over what lies better.
#[test]
fn stated_axes_are_taken() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let [shirt, _] = Export::shirt_and_person();
    let file = shirt.save(folder.path(), "shirt");
    let stated = MeshFrame {
        facing: Some(axis("-z")),
        ..MeshFrame::default()
    };
    let notes = read(&file, stated).expect("worn").notes.join("; ");
    assert!(notes.contains("facing -z"), "{notes}");
}

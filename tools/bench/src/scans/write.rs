//! Scans as a folder of PLY files, their truth in a folder below.

use super::scene::{ScanScene, TrueScan};
use crate::EvaluateError;
use std::fmt::Write as _;
use std::path::Path;
use tryon_formats::npy::write_npy;
use tryon_formats::scan::{PlyMesh, write_ply};
use tryon_geometry::mesh::Face;

/// Makes a scene and writes it: `NNNN.ply` with normals and colours, and the truth below `truth/`, so that
/// [`scan_files`](tryon_formats::scan::scan_files) finds scans only.
///
/// Truth: `NNNN.ply` (points with labels), `NNNN.body.ply`, `NNNN.garment1.ply` and so on (true surfaces),
/// `NNNN.pose.npy` (translation, quaternion x y z w, joint angles), `shape.npy` (coefficients), `garments.txt` (names).
/// Returns the number of scans.
///
/// # Errors
/// As [`ScanScene::run`], or a file that cannot be written.
pub fn write_scan_folder(dir: &Path, scene: &ScanScene) -> Result<usize, EvaluateError> {
    let truth = dir.join("truth");
    std::fs::create_dir_all(&truth).map_err(|e| fault(dir, e))?;
    let body_faces = scene.actor.template.mesh().faces();
    let mut count = 0;
    scene.run(|scan| {
        let name = format!("{:04}", scan.index);
        write_scan(&dir.join(format!("{name}.ply")), &scan)?;
        write_truth(&truth, &name, &scan, body_faces)?;
        count += 1;
        Ok(())
    })?;
    Ok(count)
}

fn fault(path: &Path, why: impl ToString) -> EvaluateError {
    EvaluateError::Scene {
        scene: path.display().to_string(),
        why: why.to_string(),
    }
}

/// Writes the scan as a scanner does.
fn write_scan(path: &Path, scan: &TrueScan) -> Result<(), EvaluateError> {
    if !scan.uncolored.is_empty() {
        let text = float_colors(scan);
        return std::fs::write(path, text).map_err(|e| fault(path, e));
    }
    let mesh = PlyMesh {
        points: &scan.points,
        faces: &scan.faces,
        normals: &scan.normals,
        colors: &scan.colors,
        labels: None,
    };
    write_ply(path, &mesh).map_err(|e| fault(path, e))
}

/// ASCII PLY with float colours, NaN where lost.
fn float_colors(scan: &TrueScan) -> String {
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\n",
        scan.points.len()
    );
    let normal: &[&str] = match scan.normals.is_empty() {
        true => &[],
        false => &["nx", "ny", "nz"],
    };
    for property in [&["x", "y", "z"], normal, &["red", "green", "blue"]].concat() {
        let _ = writeln!(text, "property float {property}");
    }
    let _ = writeln!(text, "element face {}", scan.faces.len());
    text.push_str("property list uchar int vertex_indices\nend_header\n");
    let mut lost = scan.uncolored.iter().peekable();
    let rows = scan.points.iter().zip(&scan.colors).enumerate();
    for (i, (p, color)) in rows {
        let color = match lost.next_if(|l| **l as usize == i) {
            Some(_) => [f32::NAN; 3],
            None => color.map(f32::from),
        };
        let normal = scan.normals.get(i).into_iter().flat_map(|n| n.iter());
        let words = p.iter().chain(normal).chain(&color);
        let words: Vec<String> = words.map(f32::to_string).collect();
        let _ = writeln!(text, "{}", words.join(" "));
    }
    for f in &scan.faces {
        let _ = writeln!(text, "3 {} {} {}", f[0], f[1], f[2]);
    }
    text
}

fn write_truth(
    dir: &Path,
    name: &str,
    scan: &TrueScan,
    body_faces: &[Face],
) -> Result<(), EvaluateError> {
    let file = |suffix: &str| dir.join(format!("{name}{suffix}"));
    let ply = |suffix: &str, mesh: &PlyMesh<'_>| {
        let path = file(suffix);
        write_ply(&path, mesh).map_err(|e| fault(&path, e))
    };
    ply(
        ".ply",
        &PlyMesh {
            points: &scan.points,
            labels: Some(&scan.labels),
            ..PlyMesh::default()
        },
    )?;
    let body = PlyMesh {
        points: &scan.body,
        faces: body_faces,
        ..PlyMesh::default()
    };
    ply(".body.ply", &body)?;
    let mut names = String::new();
    for (k, garment) in scan.garments.iter().enumerate() {
        let mesh = PlyMesh {
            points: &garment.vertices,
            faces: &garment.faces,
            ..PlyMesh::default()
        };
        ply(&format!(".garment{}.ply", k + 1), &mesh)?;
        let _ = writeln!(names, "{} {} {:?}", k + 1, garment.name, garment.kind);
    }
    let list = dir.join("garments.txt");
    std::fs::write(&list, names).map_err(|e| fault(&list, e))?;
    let root = scan.pose.root.iso();
    let (shift, turn) = (root.translation.vector, root.rotation.coords);
    let pose = shift.iter().chain(turn.iter()).chain(&scan.pose.angles);
    let pose: Vec<f32> = pose.map(|v| *v as f32).collect();
    let shape: Vec<f32> = scan.shape.coefficients.iter().map(|c| *c as f32).collect();
    for (path, values) in [(file(".pose.npy"), pose), (dir.join("shape.npy"), shape)] {
        let length = [values.len() as u64];
        write_npy(&path, &length, values.into_iter()).map_err(|e| fault(&path, e))?;
    }
    Ok(())
}

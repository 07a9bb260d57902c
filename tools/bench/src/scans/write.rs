//! Scans as a folder of PLY files.

use super::scene::ScanScene;
use crate::EvaluateError;
use std::path::Path;
use tryon_formats::scan::{PlyMesh, write_ply};

/// Makes a scene and writes its scans as `NNNN.ply` with normals and colours.
///
/// # Errors
/// As [`ScanScene::run`], or a file that cannot be written.
pub fn write_scan_folder(dir: &Path, scene: &ScanScene) -> Result<(), EvaluateError> {
    let fault = |path: &Path, why: String| EvaluateError::new(path.display(), why);
    std::fs::create_dir_all(dir).map_err(|e| fault(dir, e.to_string()))?;
    let mut count = 0;
    scene.run(|scan| {
        let path = dir.join(format!("{count:04}.ply"));
        let mesh = PlyMesh {
            points: &scan.points,
            normals: &scan.normals,
            colors: &scan.colors,
            ..PlyMesh::default()
        };
        count += 1;
        write_ply(&path, &mesh).map_err(|e| fault(&path, e.to_string()))
    })
}

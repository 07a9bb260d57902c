//! Wavefront OBJ of several meshes with a material each: NAME.obj, NAME.mtl beside it, and the textures.

use super::FormatError;
use super::gltf::GlbMesh;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Writes meshes as groups of one OBJ file, their colours and textures to NAME.mtl and NAME_MESH.png or .jpg beside it.
/// Returns the files, the OBJ file last.
///
/// # Errors
/// Texture coordinates of another number than vertices, or a file that cannot be written.
pub fn write_obj_scene(path: &Path, meshes: &[GlbMesh<'_>]) -> Result<Vec<PathBuf>, FormatError> {
    let mut files = Vec::new();
    let mut save = |path: PathBuf, bytes: &[u8]| {
        std::fs::write(&path, bytes).map_err(|e| FormatError::io(&path, e))?;
        files.push(path);
        Ok::<(), FormatError>(())
    };
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let materials = path.with_extension("mtl");
    let mut text = format!("mtllib {stem}.mtl\n");
    let mut material_text = String::new();
    let mut first = 1;
    for mesh in meshes {
        if !mesh.uv.is_empty() && mesh.uv.len() != mesh.vertices.len() {
            let why = format!("{}, expected {}", mesh.uv.len(), mesh.vertices.len());
            let field = format!("mesh `{}`.uv", mesh.name);
            return Err(FormatError::field(path, field, why));
        }
        let image = (!mesh.texture.is_empty()).then(|| image_name(&stem, mesh));
        write_material(&mut material_text, mesh, image.as_deref());
        if let Some(name) = image {
            save(path.with_file_name(name), mesh.texture)?;
        }
        write_group(&mut text, mesh, first);
        first += mesh.vertices.len();
    }
    save(materials, material_text.as_bytes())?;
    save(path.to_owned(), text.as_bytes())?;
    Ok(files)
}

fn image_name(stem: &str, mesh: &GlbMesh<'_>) -> String {
    let ending = if mesh.texture.starts_with(b"\x89PNG") {
        "png"
    } else {
        "jpg"
    };
    format!("{stem}_{}.{ending}", mesh.name)
}

fn write_material(text: &mut String, mesh: &GlbMesh<'_>, image: Option<&str>) {
    // As sRGB, as most programs take it.
    let [r, g, b] = mesh.color.map(|c| f32::from(c) / 255.0);
    let _ = writeln!(
        text,
        "newmtl {}\nKd {r:.4} {g:.4} {b:.4}\nillum 1",
        mesh.name
    );
    if let Some(image) = image {
        let _ = writeln!(text, "map_Kd {image}");
    }
}

/// One mesh; `first` is the number of its first vertex in the file.
fn write_group(text: &mut String, mesh: &GlbMesh<'_>, first: usize) {
    let _ = writeln!(text, "g {0}\nusemtl {0}", mesh.name);
    for p in mesh.vertices {
        let _ = writeln!(text, "v {} {} {}", p.x, p.y, p.z);
    }
    // One a vertex in every mesh, so that both have the same numbers; v up, as in OBJ.
    let absent = [0.0, 1.0];
    for k in 0..mesh.vertices.len() {
        let [u, v] = mesh.uv.get(k).unwrap_or(&absent);
        let _ = writeln!(text, "vt {u} {}", 1.0 - v);
    }
    for f in mesh.faces {
        let [a, b, c] = f.map(|v| v as usize + first);
        let _ = writeln!(text, "f {a}/{a} {b}/{b} {c}/{c}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::read_scan;
    use tryon_geometry::math::P3;

    #[test]
    fn meshes_are_read_back_with_their_texture() {
        let folder = tempfile::tempdir().expect("a folder");
        let triangle = [P3::origin(), P3::new(1.0, 0.0, 0.0), P3::new(0.0, 1.0, 0.0)];
        let plain = GlbMesh {
            name: "body",
            vertices: &triangle,
            faces: &[[0, 1, 2]],
            uv: &[],
            color: [255, 0, 0],
            texture: &[],
        };
        let image = folder.path().join("image.png");
        // Upper half green, lower half blue.
        let pixels = tryon_geometry::camera::ColorImage::new(1, 2, vec![0, 255, 0, 0, 0, 255]);
        let pixels = pixels.expect("an image");
        crate::image::write_png_rgb(&image, &pixels).expect("written");
        let png = std::fs::read(&image).expect("readable");
        let worn = GlbMesh {
            name: "top",
            uv: &[[0.5, 0.25]; 3],
            color: [255; 3],
            texture: &png,
            ..plain
        };
        let path = folder.path().join("dressed.obj");
        let files = write_obj_scene(&path, &[plain, worn]).expect("written");
        assert_eq!(files.len(), 3);
        assert!(folder.path().join("dressed_top.png").exists());

        let scan = read_scan(&path).expect("readable");
        assert_eq!((scan.points.len(), scan.faces.len()), (6, 2));
        assert_eq!((scan.colors[0], scan.colors[3]), ([255, 0, 0], [0, 255, 0]));

        let cut = GlbMesh {
            uv: &[[0.0; 2]],
            ..worn
        };
        let refused = write_obj_scene(&path, &[cut]).expect_err("one coordinate");
        assert!(refused.to_string().contains("top"), "{refused}");
    }
}

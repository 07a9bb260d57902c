//! outfit.glb: one mesh a garment in the world frame, animated when there is more than one frame.

use anyhow::Result;
use std::path::Path;
use tryon::formats::gltf::{GlbMesh, write_glb_motion};
use tryon::geometry::math::P3;
use tryon_proto::convert::WireError;
use tryon_proto::convert::garment::WornGarment;

/// Motion of the drawn vertices of each garment (m, world), shape `[garments][frames][drawn]`, from that of the simulated
/// vertices of all garments, shape `[frames][vertices]`.
///
/// # Errors
/// Names the garments that a frame does not fit, or the drawn vertex without a simulated one.
pub(super) fn drawn_motion(
    garments: &[WornGarment],
    frames: &[Vec<P3>],
) -> Result<Vec<Vec<Vec<P3>>>, WireError> {
    const FIELD: &str = "start_simulation_response.garments";
    let vertices: usize = garments.iter().map(|g| g.vertices).sum();
    if let Some(k) = frames.iter().position(|f| f.len() != vertices) {
        let why = format!("{vertices} vertices, but frame {k} has {}", frames[k].len());
        return Err(WireError::new(FIELD, why));
    }

    let mut first = 0;
    let mut motion = Vec::with_capacity(garments.len());
    for (i, garment) in garments.iter().enumerate() {
        let end = first + garment.vertices;
        let drawn = |frame: &Vec<P3>| {
            let own = &frame[first..end];
            let at = |v: &u32| own.get(*v as usize).copied();
            garment.drawn.iter().map(at).collect::<Option<Vec<P3>>>()
        };
        let positions: Option<_> = frames.iter().map(drawn).collect();
        let why = || WireError::new(format!("{FIELD}[{i}].drawn"), "is out of range");
        motion.push(positions.ok_or_else(why)?);
        first = end;
    }
    Ok(motion)
}

/// Writes garments in the colours of their looks, `interval` seconds between frames of shape `[frames][vertices]` (m,
/// world); no file without frames.
///
/// # Errors
/// As [`drawn_motion`], or a garment without faces, or a file that cannot be written.
pub(super) fn write_outfit(
    path: &Path,
    garments: &[WornGarment],
    frames: &[Vec<P3>],
    interval: f32,
) -> Result<()> {
    if frames.is_empty() {
        return Ok(());
    }
    let motion = drawn_motion(garments, frames)?;
    let meshes: Vec<GlbMesh<'_>> = (garments.iter().zip(&motion))
        .map(|(garment, motion)| GlbMesh {
            name: &garment.garment,
            vertices: motion.first().map_or(&[][..], Vec::as_slice),
            faces: &garment.faces,
            uv: &garment.uvs,
            color: rgb(garment.look.color_rgb),
            texture: &[],
        })
        .collect();
    let motion = if frames.len() > 1 { &motion[..] } else { &[] };
    Ok(write_glb_motion(path, &meshes, motion, interval)?)
}

/// Channels of 0xRRGGBB.
fn rgb(color: u32) -> [u8; 3] {
    let [_, r, g, b] = color.to_be_bytes();
    [r, g, b]
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use tryon::formats::gltf::read_glb;
    use tryon_proto::v1::GarmentLook;

    /// A triangle with its third vertex drawn twice.
    pub(in super::super) fn garment(name: &str) -> WornGarment {
        WornGarment {
            garment: name.into(),
            size: "M".into(),
            vertices: 3,
            drawn: vec![0, 1, 2, 2],
            faces: vec![[0, 1, 3]],
            uvs: vec![[0.0; 2]; 4],
            look: GarmentLook {
                color_rgb: 0x00ff_8040,
                ..Default::default()
            },
            image: None,
            trims: vec![],
        }
    }

    /// Triangles of two garments at height `y`.
    fn frame(y: f32) -> Vec<P3> {
        let point = |k: u8| P3::new(f32::from(k % 2), y, f32::from(k));
        (0..6).map(point).collect()
    }

    #[test]
    fn each_garment_is_drawn_from_its_own_vertices() {
        let garments = [garment("top"), garment("skirt")];
        let frames = [frame(0.0), frame(1.0)];
        let motion = drawn_motion(&garments, &frames).expect("fits");
        let skirt = [3, 4, 5, 5].map(|k| frames[1][k]);
        assert_eq!((motion.len(), &motion[1][1][..]), (2, &skirt[..]));

        let dir = tempfile::tempdir().expect("a folder");
        let file = dir.path().join("outfit.glb");
        write_outfit(&file, &garments, &frames, 0.1).expect("written");
        let glb = read_glb(&file).expect("readable");
        assert_eq!(glb.parts.len(), 2);
        let bytes = std::fs::read(&file).expect("read");
        let text = String::from_utf8_lossy(&bytes);
        assert!(text.contains("skirt motion"), "an animation");
        write_outfit(&file, &garments, &frames[..1], 0.1).expect("written");
        let bytes = std::fs::read(&file).expect("read");
        assert!(!String::from_utf8_lossy(&bytes).contains("motion"));
    }

    #[test]
    fn garments_that_do_not_fit_the_positions_are_refused() {
        let garments = [garment("top"), garment("skirt")];
        let fault = drawn_motion(&garments[..1], &[frame(0.0)]).expect_err("too few");
        assert_eq!(fault.field, "start_simulation_response.garments");
        assert!(fault.why.contains("frame 0 has 6"), "{fault}");
        let mut beyond = garment("skirt");
        beyond.drawn[2] = 3;
        let beyond = [garment("top"), beyond];
        let fault = drawn_motion(&beyond, &[frame(0.0)]).expect_err("beyond");
        assert_eq!(fault.field, "start_simulation_response.garments[1].drawn");
    }

    #[test]
    fn an_empty_motion_writes_no_file() {
        let garments = [garment("top")];
        let motion = drawn_motion(&garments, &[]).expect("fits");
        assert_eq!(motion, [Vec::<Vec<P3>>::new()]);
        let dir = tempfile::tempdir().expect("a folder");
        let file = dir.path().join("outfit.glb");
        write_outfit(&file, &garments, &[], 0.1).expect("nothing to write");
        assert!(!file.exists());
    }
}

//! Garment meshes.

use super::{WireError, bulk, required};
use crate::v1;
use bytes::Bytes;
use std::sync::Arc;
use tryon::math::P3;
use tryon::mesh::Face;

const MAX_VERTICES: u32 = 262_144;
const MAX_FACES: u32 = 524_288;
/// Most garments worn at once.
pub const MAX_GARMENTS: usize = 8;

/// What of a garment does not change while it is worn.
#[derive(Clone, Debug, PartialEq)]
pub struct WornGarment {
    /// Name in the library.
    pub garment: String,
    /// Size worn.
    pub size: String,
    /// Number of vertices.
    pub vertices: usize,
    /// Triangles, counter-clockwise seen from outside.
    pub faces: Vec<Face>,
    /// Flat panel coordinates, metres, shape `[vertices]`.
    pub uvs: Vec<[f32; 2]>,
    /// Colours and pattern.
    pub look: v1::GarmentLook,
}

/// Topology for the wire.
pub fn topology_to_wire(g: &WornGarment) -> v1::GarmentTopology {
    v1::GarmentTopology {
        garment: g.garment.clone(),
        size: g.size.clone(),
        vertex_count: g.vertices as u32,
        face_count: g.faces.len() as u32,
        faces: bulk::write(g.faces.iter().copied()),
        uvs: bulk::write(g.uvs.iter().copied()),
        look: Some(g.look),
    }
}

/// Topology whose parts fit each other.
///
/// # Errors
/// Names the field of the wrong size or with an index out of range.
pub fn topology_from_wire(t: &v1::GarmentTopology) -> Result<WornGarment, WireError> {
    let vertices = bulk::count("garment_topology.vertex_count", t.vertex_count, MAX_VERTICES)?;
    let m = bulk::count("garment_topology.face_count", t.face_count, MAX_FACES)?;
    let look = required(t.look, "garment_topology.look")?;
    if !(look.stripe_width.is_finite() && look.stripe_width >= 0.0) {
        return Err(WireError::new("garment_topology.look.stripe_width", "must be zero or positive"));
    }
    Ok(WornGarment {
        garment: t.garment.clone(),
        size: t.size.clone(),
        vertices,
        faces: bulk::faces("garment_topology.faces", m, vertices, &t.faces)?,
        uvs: bulk::read("garment_topology.uvs", vertices, &t.uvs)?,
        look,
    })
}

/// Positions for the wire, `f32[n][3]`.
pub fn positions_to_wire(p: &[P3]) -> Bytes {
    bulk::write(p.iter().map(|p| [p.x, p.y, p.z]))
}

/// Positions of `vertices` points.
///
/// # Errors
/// A wrong size, or the vertex that is not finite.
pub fn positions_from_wire(b: &Bytes, vertices: usize) -> Result<Vec<P3>, WireError> {
    Ok(bulk::read::<f32, 3>("garment_mesh.positions", vertices, b)?.into_iter().map(P3::from).collect())
}

/// Reads one stream of garment frames: remembers topology between keyframes.
#[derive(Clone, Debug, Default)]
pub struct GarmentReader {
    revision: u64,
    worn: Vec<Arc<WornGarment>>,
}

/// Garments with positions, world frame.
pub type PlacedGarments = Vec<(Arc<WornGarment>, Vec<P3>)>;

impl GarmentReader {
    /// Garments of one message.
    ///
    /// # Errors
    /// Names the field at fault; positions without an earlier keyframe are one.
    pub fn read(&mut self, f: &v1::GarmentFrame) -> Result<PlacedGarments, WireError> {
        if f.garments.len() > MAX_GARMENTS {
            return Err(WireError::new("garment_frame.garments", format!("at most {MAX_GARMENTS}")));
        }
        let keyframe = f.garments.iter().any(|g| g.topology.is_some());
        if keyframe {
            let mut worn = Vec::with_capacity(f.garments.len());
            for (i, g) in f.garments.iter().enumerate() {
                let field = format!("garment_frame.garments[{i}]");
                let t = required(g.topology.as_ref(), &format!("{field}.topology"))?;
                worn.push(Arc::new(topology_from_wire(t).map_err(|e| e.within(&field))?));
            }
            (self.revision, self.worn) = (f.outfit_revision, worn);
        } else if !f.garments.is_empty() && (self.revision, self.worn.len()) != (f.outfit_revision, f.garments.len()) {
            return Err(WireError::new("garment_frame.garments", "positions came before their topology"));
        }
        (self.worn.iter().zip(&f.garments).enumerate())
            .map(|(i, (w, g))| {
                let p = positions_from_wire(&g.positions, w.vertices);
                Ok((w.clone(), p.map_err(|e| e.within(&format!("garment_frame.garments[{i}]")))?))
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle() -> WornGarment {
        let look = v1::GarmentLook { color_rgb: 0xff0000, accent_rgb: 0xff0000, stripe_width: 0.0 };
        WornGarment {
            garment: "flag".into(),
            size: "M".into(),
            vertices: 3,
            faces: vec![[0, 1, 2]],
            uvs: vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
            look,
        }
    }

    #[test]
    fn a_stream_needs_its_keyframe_and_keeps_it() {
        let points = vec![P3::new(0.0, 1.0, 2.0); 3];
        let update = v1::GarmentMesh { topology: None, positions: positions_to_wire(&points) };
        let key = v1::GarmentMesh { topology: Some(topology_to_wire(&triangle())), ..update.clone() };
        let frame = |g: &v1::GarmentMesh, r| v1::GarmentFrame {
            garments: vec![g.clone()],
            outfit_revision: r,
            ..Default::default()
        };
        let mut r = GarmentReader::default();
        assert!(r.read(&frame(&update, 1)).is_err());
        assert_eq!(*r.read(&frame(&key, 1)).expect("keyframe")[0].0, triangle());
        assert_eq!(r.read(&frame(&update, 1)).expect("update")[0].1, points);
        assert!(r.read(&frame(&update, 2)).is_err(), "another outfit needs its own keyframe");
        assert!(r.read(&v1::GarmentFrame::default()).expect("nothing worn").is_empty());
    }

    #[test]
    fn faults_are_named() {
        let fault = |change: &dyn Fn(&mut v1::GarmentTopology)| {
            let mut w = topology_to_wire(&triangle());
            change(&mut w);
            topology_from_wire(&w).expect_err("must be refused").field
        };
        assert_eq!(fault(&|w| w.vertex_count = 4_000_000_000), "garment_topology.vertex_count");
        assert_eq!(fault(&|w| w.faces = bulk::write([[0u32, 1, 3]].into_iter())), "garment_topology.faces[0]");
        assert_eq!(fault(&|w| w.uvs = w.uvs.slice(1..)), "garment_topology.uvs");
        assert_eq!(fault(&|w| w.look = None), "garment_topology.look");
        let nan = bulk::write([[0.0f32, f32::INFINITY, 0.0]].into_iter());
        assert_eq!(positions_from_wire(&nan, 1).expect_err("inf").field, "garment_mesh.positions[0]");
    }
}

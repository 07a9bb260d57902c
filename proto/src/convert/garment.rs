//! Garment meshes on the wire.

use super::{WireError, bulk, print, required, trim};
use crate::v1;
use std::path::Path;
use std::sync::Arc;
use tryon_formats::image::{decode_color, encode_jpeg, encode_png_rgb};
use tryon_formats::{FormatError, PositionCoder};
use tryon_garment::{FabricImage, PlacedTrim};
use tryon_geometry::math::P3;
use tryon_geometry::mesh::Face;

const MAX_VERTICES: u32 = 262_144;
const MAX_FACES: u32 = 524_288;
const MAX_DRAWN: u32 = 524_288;
/// Largest image of a texture, bytes: eight of them fit a message of 16 MiB only as JPEG.
const MAX_TEXTURE_BYTES: usize = 4 << 20;
/// Longest side of an image, pixels.
const MAX_TEXTURE_SIDE: u32 = 2048;
/// Quality of an image that is too large without loss.
const JPEG_QUALITY: u8 = 90;
/// Most garments worn at once.
pub const MAX_GARMENTS: usize = 8;

/// Immutable part of a worn garment.
#[derive(Clone, Debug, PartialEq)]
pub struct WornGarment {
    /// Name in the library.
    pub garment: String,
    /// Size worn.
    pub size: String,
    /// Number of simulated vertices.
    pub vertices: usize,
    /// Simulated vertex under each drawn one.
    pub drawn: Vec<u32>,
    /// Triangles of drawn vertices, counter-clockwise seen from outside.
    pub faces: Vec<Face>,
    /// Flat panel coordinates, metres, shape `[drawn]`.
    pub uvs: Vec<[f32; 2]>,
    /// Colours and pattern.
    pub look: v1::GarmentLook,
    /// Image in place of the colours.
    pub image: Option<Arc<WornImage>>,
    /// Pockets, buttons and the like.
    pub trims: Vec<PlacedTrim>,
}

/// Image of a worn garment, encoded once for all readers.
#[derive(Clone, Debug, PartialEq)]
pub struct WornImage {
    image: FabricImage,
    wire: v1::GarmentTexture,
}

impl WornGarment {
    /// Position coder, the same for both ends of a stream.
    fn coder(&self) -> PositionCoder {
        let faces: Vec<Face> = self
            .faces
            .iter()
            .map(|f| f.map(|i| self.drawn[i as usize]))
            .collect();
        PositionCoder::new(self.vertices, &faces)
    }
}

impl WornImage {
    /// Encodes an image: PNG, without loss, or JPEG where that is too large.
    ///
    /// # Errors
    /// An image that is too large for both, or has no size.
    pub fn new(image: FabricImage) -> Result<Self, WireError> {
        let field = "garment_topology.texture.image";
        let encoded = encode_png_rgb(&image.pixels, Path::new(field));
        let fits = |bytes: &Vec<u8>| bytes.len() <= MAX_TEXTURE_BYTES;
        let bytes = match encoded {
            Ok(bytes) if fits(&bytes) => Ok(bytes),
            _ => encode_jpeg(&image.pixels, JPEG_QUALITY),
        };
        let bytes = bytes.map_err(|e| WireError::new(field, e.to_string()))?;
        if !fits(&bytes) {
            return Err(WireError::new(field, too_large(bytes.len())));
        }
        let wire = v1::GarmentTexture {
            image: bytes.into(),
            metres_per_pixel: image.metres_per_pixel,
        };
        Ok(Self { image, wire })
    }

    /// Pixels and their size.
    pub fn image(&self) -> &FabricImage {
        &self.image
    }

    fn from_wire(t: &v1::GarmentTexture) -> Result<Self, WireError> {
        let fault = |field: &str, why: String| {
            let field = format!("garment_topology.texture.{field}");
            Err(WireError::new(field, why))
        };
        if t.image.len() > MAX_TEXTURE_BYTES {
            return fault("image", too_large(t.image.len()));
        }
        if !(t.metres_per_pixel.is_finite() && t.metres_per_pixel > 0.0) {
            return fault("metres_per_pixel", "must be positive".into());
        }
        let pixels = match decode_color(&t.image, Path::new("texture")) {
            Ok(pixels) => pixels,
            Err(e) => return fault("image", e.to_string()),
        };
        let (w, h) = (pixels.width(), pixels.height());
        if w.max(h) > MAX_TEXTURE_SIDE {
            return fault("image", format!("{w}×{h}, at most {MAX_TEXTURE_SIDE}"));
        }
        let image = FabricImage {
            pixels,
            metres_per_pixel: t.metres_per_pixel,
        };
        Ok(Self {
            image,
            wire: t.clone(),
        })
    }
}

/// Wire message of a topology.
pub fn topology_to_wire(g: &WornGarment) -> v1::GarmentTopology {
    v1::GarmentTopology {
        garment: g.garment.clone(),
        size: g.size.clone(),
        vertex_count: g.vertices as u32,
        face_count: g.faces.len() as u32,
        faces: bulk::write(g.faces.iter().copied()),
        uvs: bulk::write(g.uvs.iter().copied()),
        look: Some(g.look.clone()),
        drawn_count: g.drawn.len() as u32,
        drawn: bulk::write_flat(&g.drawn),
        texture: g.image.as_ref().map(|i| i.wire.clone()),
        trims: g.trims.iter().map(trim::to_wire).collect(),
    }
}

fn too_large(bytes: usize) -> String {
    format!("{bytes} bytes, at most {MAX_TEXTURE_BYTES}")
}

/// Topology with consistent sizes.
///
/// # Errors
/// Names the field of the wrong size or with an index out of range.
pub fn topology_from_wire(t: &v1::GarmentTopology) -> Result<WornGarment, WireError> {
    let vertices = bulk::count(
        "garment_topology.vertex_count",
        t.vertex_count,
        MAX_VERTICES,
    )?;
    let m = bulk::count("garment_topology.face_count", t.face_count, MAX_FACES)?;
    let look = required(t.look.clone(), "garment_topology.look")?;
    print::check("garment_topology.look.print", look.print.as_ref())?;
    let k = bulk::count("garment_topology.drawn_count", t.drawn_count, MAX_DRAWN)?;
    let drawn: Vec<u32> = bulk::read::<u32, 1>("garment_topology.drawn", k, &t.drawn)?
        .into_iter()
        .map(|[v]| v)
        .collect();
    if let Some(i) = drawn.iter().position(|&v| v as usize >= vertices) {
        let why = format!("{}, but there are {vertices} vertices", drawn[i]);
        return Err(WireError::new(format!("garment_topology.drawn[{i}]"), why));
    }
    let image = t.texture.as_ref().map(WornImage::from_wire);
    Ok(WornGarment {
        garment: t.garment.clone(),
        size: t.size.clone(),
        vertices,
        faces: bulk::faces("garment_topology.faces", m, k, &t.faces)?,
        uvs: bulk::read("garment_topology.uvs", k, &t.uvs)?,
        image: image.transpose()?.map(Arc::new),
        trims: trim::all_from_wire(&t.trims)?,
        drawn,
        look,
    })
}

/// Simulated positions of each garment, metres, world frame.
pub type Positions = Arc<Vec<Vec<P3>>>;

/// Encoder of the garment frames of one reader: keyframes with topology, then positions coded against the messages that
/// this reader received before.
#[derive(Clone, Debug, Default)]
pub struct GarmentWriter {
    coders: Vec<PositionCoder>,
}

impl GarmentWriter {
    /// Writes positions into `f`, and with `keyframe` the topology of a new outfit.
    ///
    /// # Errors
    /// Names the garment and vertex that cannot be coded, or positions that do not fit the outfit.
    pub fn write(
        &mut self,
        f: &mut v1::GarmentFrame,
        keyframe: Option<&[Arc<WornGarment>]>,
        positions: &[Vec<P3>],
    ) -> Result<(), WireError> {
        if let Some(worn) = keyframe {
            self.coders = worn.iter().map(|w| w.coder()).collect();
        }
        if positions.len() != self.coders.len() {
            let why = format!(
                "positions of {} for an outfit of {}",
                positions.len(),
                self.coders.len()
            );
            return Err(WireError::new("garment_frame.garments", why));
        }
        f.garments.clear();
        for (i, (p, coder)) in positions.iter().zip(&mut self.coders).enumerate() {
            let bytes = coder.encode(p).map_err(|e| at(i, &e))?;
            let topology = keyframe.map(|worn| topology_to_wire(&worn[i]));
            f.garments.push(v1::GarmentMesh {
                topology,
                positions: bytes.into(),
            });
        }
        Ok(())
    }
}

fn at(garment: usize, e: &FormatError) -> WireError {
    WireError::new(
        format!("garment_frame.garments[{garment}].positions"),
        e.to_string(),
    )
}

/// Decoder of one stream of garment frames; keeps topology and the positions that later messages refer to.
#[derive(Clone, Debug, Default)]
pub struct GarmentReader {
    revision: u64,
    worn: Vec<(Arc<WornGarment>, PositionCoder)>,
}

/// Garments with the positions of their drawn vertices, world frame.
pub type PlacedGarments = Vec<(Arc<WornGarment>, Vec<P3>)>;

impl GarmentReader {
    /// Decodes the garments of one message. After an error the stream must be opened again.
    ///
    /// # Errors
    /// Names the field at fault; positions without an earlier keyframe are one.
    pub fn read(&mut self, f: &v1::GarmentFrame) -> Result<PlacedGarments, WireError> {
        if f.garments.len() > MAX_GARMENTS {
            return Err(WireError::new(
                "garment_frame.garments",
                format!("at most {MAX_GARMENTS}"),
            ));
        }
        let keyframe = f.garments.iter().any(|g| g.topology.is_some());
        if keyframe {
            let mut worn = Vec::with_capacity(f.garments.len());
            for (i, g) in f.garments.iter().enumerate() {
                let field = format!("garment_frame.garments[{i}]");
                let t = required(g.topology.as_ref(), &format!("{field}.topology"))?;
                let garment = topology_from_wire(t).map_err(|e| e.within(&field))?;
                let coder = garment.coder();
                worn.push((Arc::new(garment), coder));
            }
            (self.revision, self.worn) = (f.outfit_revision, worn);
        } else if !f.garments.is_empty()
            && (self.revision, self.worn.len()) != (f.outfit_revision, f.garments.len())
        {
            return Err(WireError::new(
                "garment_frame.garments",
                "positions came before their topology",
            ));
        }
        (self.worn.iter_mut().zip(&f.garments).enumerate())
            .map(|(i, ((worn, coder), g))| {
                let simulated = coder.decode(&g.positions).map_err(|e| at(i, &e))?;
                let drawn = worn.drawn.iter().map(|&v| simulated[v as usize]).collect();
                Ok((worn.clone(), drawn))
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_garment::TrimKind;
    use tryon_geometry::camera::ColorImage;

    /// Two triangles of two panels that share a seam: four simulated vertices, six drawn ones.
    fn flag() -> WornGarment {
        let look = v1::GarmentLook {
            color_rgb: 0xff0000,
            ..Default::default()
        };
        WornGarment {
            garment: "flag".into(),
            size: "M".into(),
            vertices: 4,
            drawn: vec![0, 1, 2, 1, 3, 2],
            faces: vec![[0, 1, 2], [3, 4, 5]],
            uvs: vec![
                [0.0, 0.0],
                [1.0, 0.0],
                [0.0, 1.0],
                [5.0, 0.0],
                [6.0, 1.0],
                [5.0, 1.0],
            ],
            look,
            image: None,
            trims: vec![PlacedTrim {
                kind: TrimKind::Zip,
                at: [0.5, 0.25],
                size: [0.02, 0.2],
                turn: 0.1,
            }],
        }
    }

    fn wind(t: f32) -> Vec<P3> {
        vec![
            P3::new(0.0, 0.0, t),
            P3::new(1.0, 0.0, t),
            P3::new(0.0, 1.0, t),
            P3::new(1.0, 1.0, t * t),
        ]
    }

    #[test]
    fn a_stream_needs_its_keyframe_and_draws_seams_twice() {
        let worn = [Arc::new(flag())];
        let mut w = GarmentWriter::default();
        let mut frame = |keyframe: bool, revision, t| {
            let mut f = v1::GarmentFrame {
                outfit_revision: revision,
                ..Default::default()
            };
            w.write(&mut f, keyframe.then_some(&worn[..]), &[wind(t)])
                .expect("written");
            f
        };
        let (key, update, later) = (
            frame(true, 1, 0.0),
            frame(false, 1, 0.1),
            frame(false, 1, 0.2),
        );
        let mut r = GarmentReader::default();
        assert!(r.read(&update).is_err(), "no keyframe yet");
        assert_eq!(*r.read(&key).expect("keyframe")[0].0, flag());
        let placed = &r.read(&update).expect("update")[0].1;
        assert_eq!(placed.len(), 6);
        assert_eq!(placed[1], placed[3], "the seam is one line");
        assert!((placed[4] - P3::new(1.0, 1.0, 0.01)).norm() < 2e-4);
        assert!((r.read(&later).expect("another")[0].1[0].z - 0.2).abs() < 2e-4);
        assert!(
            r.read(&v1::GarmentFrame {
                outfit_revision: 2,
                ..later
            })
            .is_err(),
            "another outfit needs its keyframe"
        );
        assert!(
            r.read(&v1::GarmentFrame::default())
                .expect("nothing worn")
                .is_empty()
        );
    }

    #[test]
    fn images_arrive_without_loss_and_faults_name_the_field() {
        let pixels = (0..64 * 32u32 * 3).map(|i| (i * 7 % 251) as u8).collect();
        let image = FabricImage {
            pixels: ColorImage::new(64, 32, pixels).expect("sizes"),
            metres_per_pixel: 0.002,
        };
        let sent = WornGarment {
            image: Some(Arc::new(WornImage::new(image).expect("small"))),
            ..flag()
        };
        let wire = topology_to_wire(&sent);
        assert_eq!(topology_from_wire(&wire).expect("read"), sent);
        let with = |change: &dyn Fn(&mut v1::GarmentTexture)| {
            let mut t = wire.clone();
            t.texture.iter_mut().for_each(change);
            topology_from_wire(&t).expect_err("refused").to_string()
        };
        let size = with(&|t| t.metres_per_pixel = f32::NAN);
        let cut = with(&|t| t.image = t.image.slice(..40));
        let huge = with(&|t| t.image = vec![0; MAX_TEXTURE_BYTES + 1].into());
        assert!(size.contains("texture.metres_per_pixel"), "{size}");
        assert!(cut.contains("texture.image"), "{cut}");
        assert!(huge.contains("texture.image"), "{huge}");
    }

    #[test]
    fn what_cannot_be_sent_or_read_names_its_garment() {
        let mut f = v1::GarmentFrame::default();
        let mut bad = wind(0.0);
        bad[2].y = f32::INFINITY;
        let worn = [Arc::new(flag())];
        let e = GarmentWriter::default()
            .write(&mut f, Some(&worn), &[bad])
            .expect_err("refused");
        assert!(
            e.to_string().contains("garments[0].positions") && e.to_string().contains("vertex 2"),
            "{e}"
        );
        assert!(
            GarmentWriter::default()
                .write(&mut f, None, &[wind(0.0)])
                .is_err(),
            "no outfit yet"
        );
        let t = v1::GarmentTopology {
            drawn: bulk::write_flat(&[0u32, 1, 2, 1, 9, 2]),
            ..topology_to_wire(&flag())
        };
        assert!(
            topology_from_wire(&t)
                .expect_err("refused")
                .to_string()
                .contains("drawn[4]")
        );
        GarmentWriter::default()
            .write(&mut f, Some(&worn), &[wind(0.0)])
            .expect("written");
        f.garments[0].positions = f.garments[0].positions.slice(..3);
        let e = GarmentReader::default().read(&f).expect_err("cut short");
        assert!(e.to_string().contains("garments[0].positions"), "{e}");
    }
}

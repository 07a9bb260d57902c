//! What a picture is made of, and what is said about it afterwards.

use super::framing::Framing;
use super::hand::HandReport;
use super::limbs::Limbs;
use super::look::Look;
use super::occlusion::Margins;
use super::shade::Lights;
use crate::camera::{Calibration, RgbdFrame};
use crate::math::{P3, V3};
use crate::mesh::Face;
use crate::par::Par;

/// One garment as it hangs now.
#[derive(Clone, Copy, Debug)]
pub struct GarmentView<'a> {
    /// Positions in the depth camera's frame, metres, shape `[n]`.
    pub vertices: &'a [P3],
    /// Triangles, counter-clockwise seen from outside.
    pub faces: &'a [Face],
    /// Texture coordinates, shape `[n]`, or empty; see [`Look::metres_per_uv`].
    pub uv: &'a [[f32; 2]],
    /// Outward unit normals, shape `[n]`, or empty (then computed).
    pub normals: &'a [V3],
    /// Fabric.
    pub look: &'a Look,
}

/// The tracked body, to tell the shopper's own clothing under the garment from an arm in front of it.
#[derive(Clone, Copy, Debug)]
pub struct BodyView<'a> {
    /// Skinned positions in the depth camera's frame, metres.
    pub vertices: &'a [P3],
    /// Triangles of the template.
    pub faces: &'a [Face],
    /// Which vertices are arms, face and trunk; default for none.
    pub limbs: &'a Limbs,
}

/// Everything that changes from picture to picture. Garments come from the innermost to the outermost.
#[derive(Clone, Copy, Debug)]
pub struct Input<'a> {
    /// What the camera saw.
    pub frame: &'a RgbdFrame,
    /// Its calibration; the picture is taken from the colour camera when there is a separate one.
    pub calibration: &'a Calibration,
    /// Garments, innermost first.
    pub garments: &'a [GarmentView<'a>],
    /// Tracked body, if there is one.
    pub body: Option<BodyView<'a>>,
    /// Size of the picture; `None` = the size of the colour image.
    pub output: Option<[u32; 2]>,
}

/// How pictures are made; immutable while a session runs.
#[derive(Clone, Debug, PartialEq)]
pub struct Config {
    /// Threads.
    pub par: Par,
    /// Samples along each side of a pixel, 1 to 4. Error of edges against 8×8 (grey levels) and time for 640×480 on one
    /// thread: 1 23.4, 2.8 ms; 2 9.5, 3.6 ms; 3 5.1, 4.3 ms; 4 4.6, no longer within 5 ms.
    pub samples: u32,
    /// When a captured pixel is in front of a garment.
    pub margins: Margins,
    /// Light on the garments.
    pub lights: Lights,
    /// How the captured picture fills another aspect ratio.
    pub framing: Framing,
    /// An outer garment is drawn this much nearer than the one inside it, metres: layers that the simulation holds
    /// less than a millimetre apart would show through each other.
    pub layer_offset: f32,
    /// The inside of a garment is drawn this much farther, metres: a fold that goes a few millimetres through another, in
    /// an elbow or an armpit, would show as a dark slit.
    pub inside_offset: f32,
    /// Leave out faces behind other garments or behind the garment's own front while drawing. The picture is the same,
    /// bit for bit; the graphics card tests depth by itself and pays no heed.
    pub skip_hidden: bool,
    /// Compute normals and the light in folds only where a face is seen. The picture is the same, bit for bit; the
    /// graphics card takes all, since it learns what is seen while it shades.
    pub skip_unseen: bool,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            par: Par::Rayon,
            samples: 3,
            margins: Margins::default(),
            lights: Lights::default(),
            framing: Framing::Cover,
            layer_offset: 15e-3,
            inside_offset: 10e-3,
            skip_hidden: true,
            skip_unseen: true,
        }
    }
}

/// The immutable part of compositing.
#[derive(Clone, Debug, Default)]
pub struct Model {
    /// Settings.
    pub config: Config,
    pub(crate) to_srgb: super::look::ToSrgb,
}

impl Model {
    /// A model with these settings.
    pub fn new(config: Config) -> Self {
        Self {
            config,
            ..Self::default()
        }
    }
}

/// What a picture cost and what was left out.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RenderReport {
    /// Pixels in which a garment is seen.
    pub pixels_drawn: usize,
    /// Pixels in which something in front hides a garment (by half or more).
    pub pixels_occluded: usize,
    /// Tiles of 32×32 pixels that hold a garment.
    pub tiles_drawn: usize,
    /// Tiles that are the captured picture, untouched.
    pub tiles_skipped: usize,
    /// Faces that were not drawn because all of them lies behind garments drawn before.
    pub faces_hidden: usize,
    /// Garments of which nothing is seen behind others or outside the picture.
    pub garments_hidden: usize,
    /// Garment vertices without a seen face, for which no normal was computed.
    pub normals_skipped: usize,
    /// Specks of noise that were taken for occluders and dropped, pixels.
    pub specks_dropped: usize,
    /// Bare hands and forearms that colour found in front.
    pub hands: HandReport,
    /// Estimated brightness of the captured picture; 1 = a well exposed room.
    pub brightness: f32,
    /// Milliseconds by stage, in order.
    pub stages_ms: Vec<(&'static str, f32)>,
}

/// Input that cannot be drawn.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RenderError {
    /// A coordinate is NaN or infinite.
    #[error("garment {garment}: vertex {vertex} is not finite")]
    NotFinite {
        /// Which garment.
        garment: usize,
        /// Which vertex.
        vertex: usize,
    },
    /// A face names a vertex that does not exist.
    #[error("garment {garment}: face {face} is out of range")]
    Face {
        /// Which garment.
        garment: usize,
        /// Which face.
        face: usize,
    },
    /// An attribute has another length than the vertices.
    #[error("garment {garment}: {got} {what} for {vertices} vertices")]
    Length {
        /// Which garment.
        garment: usize,
        /// Which attribute.
        what: &'static str,
        /// How many values.
        got: usize,
        /// How many there should be.
        vertices: usize,
    },
    /// An image or picture without pixels, or larger than any display.
    #[error("{what}: {width}×{height} is not a usable size")]
    Size {
        /// Which image.
        what: &'static str,
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// The graphics card failed.
    #[error("graphics: {0}")]
    Graphics(String),
}

/// No display of this product is larger.
const MAX_SIDE: u32 = 8192;

impl Input<'_> {
    /// Size of the picture.
    pub fn output_size(&self) -> [u32; 2] {
        self.output
            .unwrap_or_else(|| match (&self.frame.color, &self.calibration.color) {
                (Some(c), _) => [c.width(), c.height()],
                (None, Some(k)) => [k.width, k.height],
                (None, None) => [self.frame.depth.width(), self.frame.depth.height()],
            })
    }
    /// Checks everything a renderer relies on.
    ///
    /// # Errors
    /// [`RenderError`] naming the garment and vertex or face, or the image.
    pub fn check(&self) -> Result<(), RenderError> {
        let size = |what, [width, height]: [u32; 2]| {
            let usable = 1..=MAX_SIDE;
            if usable.contains(&width) && usable.contains(&height) {
                Ok(())
            } else {
                Err(RenderError::Size {
                    what,
                    width,
                    height,
                })
            }
        };
        size("output", self.output_size())?;
        size(
            "depth image",
            [self.frame.depth.width(), self.frame.depth.height()],
        )?;
        if let Some(c) = &self.frame.color {
            size("colour image", [c.width(), c.height()])?;
        }
        for (garment, g) in self.garments.iter().enumerate() {
            let n = g.vertices.len();
            for (what, got) in [
                ("texture coordinates", g.uv.len()),
                ("normals", g.normals.len()),
            ] {
                if got != 0 && got != n {
                    return Err(RenderError::Length {
                        garment,
                        what,
                        got,
                        vertices: n,
                    });
                }
            }
            if let Some(vertex) = g
                .vertices
                .iter()
                .position(|p| !p.iter().all(|c| c.is_finite()))
            {
                return Err(RenderError::NotFinite { garment, vertex });
            }
            if let Some(face) = g
                .faces
                .iter()
                .position(|f| f.iter().any(|&i| i as usize >= n))
            {
                return Err(RenderError::Face { garment, face });
            }
        }
        Ok(())
    }
}

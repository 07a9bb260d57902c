//! Input of a picture and its validation.

use super::appearance::Appearance;
use super::construction::EdgePlace;
use super::limbs::Limbs;
use tryon_geometry::camera::{Calibration, FrameSizeError, RgbdFrame};
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::Face;

/// Posed surface of one garment.
#[derive(Clone, Copy, Debug)]
pub struct GarmentView<'a> {
    /// Positions in the depth camera's frame, metres, shape `[n]`.
    pub vertices: &'a [P3],
    /// Triangles, counter-clockwise seen from outside.
    pub faces: &'a [Face],
    /// Texture coordinates, shape `[n]`, or empty; see [`Appearance::metres_per_uv`].
    pub uv: &'a [[f32; 2]],
    /// Outward unit normals, shape `[n]`, or empty (then computed).
    pub normals: &'a [V3],
    /// Places in the pattern ([`edge_places`](super::edge_places)), shape `[n]`, or empty: then no edge is sewn.
    pub places: &'a [EdgePlace],
    /// Colour and surface of the fabric.
    pub appearance: &'a Appearance,
}

/// The tracked body: separates the user's own clothing under the garment from an arm in front of it.
#[derive(Clone, Copy, Debug)]
pub struct BodyView<'a> {
    /// Skinned positions in the depth camera's frame, metres.
    pub vertices: &'a [P3],
    /// Triangles of the template.
    pub faces: &'a [Face],
    /// Vertices of arms, face and trunk; empty by default, which disables the detection of hands.
    pub limbs: &'a Limbs,
}

/// Data of one picture. Garments come from the innermost to the outermost.
#[derive(Clone, Copy, Debug)]
pub struct Input<'a> {
    /// Captured depth and colour.
    pub frame: &'a RgbdFrame,
    /// Its calibration; the picture is taken from the colour camera when there is a separate one.
    pub calibration: &'a Calibration,
    /// Garments, innermost first.
    pub garments: &'a [GarmentView<'a>],
    /// Tracked body, if there is one.
    pub body: Option<BodyView<'a>>,
    /// Shape of the picture; `None` = the colour image's.
    pub output: Option<OutputFrame>,
}

/// Fit of the captured picture into one of another aspect ratio. Proportions are always kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum Framing {
    /// Show everything, black beside it.
    #[default]
    Contain,
    /// Fill the picture, cropping what does not fit; the crop follows the tracked person.
    Cover,
}

/// Shape of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct OutputFrame {
    /// Columns and rows, pixels.
    pub size: [u32; 2],
    /// Fit of the captured picture.
    pub framing: Framing,
}

/// Input that cannot be drawn.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RenderError {
    /// A coordinate is NaN or infinite.
    #[error("garment {garment}: vertex {vertex} is not finite")]
    NotFinite {
        /// Index of the garment.
        garment: usize,
        /// Index of the vertex.
        vertex: usize,
    },
    /// A face names a vertex that does not exist.
    #[error("garment {garment}: face {face} is out of range")]
    Face {
        /// Index of the garment.
        garment: usize,
        /// Index of the face.
        face: usize,
    },
    /// An attribute has another length than the vertices.
    #[error("garment {garment}: {got} {what} for {vertices} vertices")]
    Length {
        /// Index of the garment.
        garment: usize,
        /// Name of the attribute.
        what: &'static str,
        /// Number of values.
        got: usize,
        /// Number of values expected.
        vertices: usize,
    },
    /// An image or picture without pixels, or larger than any display.
    #[error("{what}: {width}×{height} is not a usable size")]
    Size {
        /// Name of the image.
        what: &'static str,
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// An image that has not the size of its camera.
    #[error(transparent)]
    FrameSize(#[from] FrameSizeError),
    /// The graphics card failed.
    #[error("graphics: {0}")]
    Graphics(String),
}

/// Largest side of an image or picture, pixels: 8K displays.
const MAX_SIDE: u32 = 8192;

impl Input<'_> {
    /// Size of the picture.
    pub fn output_size(&self) -> [u32; 2] {
        self.output.map(|o| o.size).unwrap_or_else(|| {
            match (&self.frame.color, &self.calibration.color) {
                (Some(c), _) => [c.width(), c.height()],
                (None, Some(k)) => [k.width, k.height],
                (None, None) => [self.frame.depth.width(), self.frame.depth.height()],
            }
        })
    }

    /// Checks everything a renderer relies on.
    ///
    /// # Errors
    /// [`RenderError`] naming the garment and vertex or face, or the image.
    pub fn check(&self) -> Result<(), RenderError> {
        let depth = &self.frame.depth;
        check_size("output", self.output_size())?;
        check_size("depth image", [depth.width(), depth.height()])?;
        if let Some(c) = &self.frame.color {
            check_size("colour image", [c.width(), c.height()])?;
        }
        (self.garments.iter().enumerate()).try_for_each(|(index, g)| g.check(index))
    }
}

fn check_size(what: &'static str, [width, height]: [u32; 2]) -> Result<(), RenderError> {
    let usable = 1..=MAX_SIDE;
    if usable.contains(&width) && usable.contains(&height) {
        return Ok(());
    }
    Err(RenderError::Size {
        what,
        width,
        height,
    })
}

impl GarmentView<'_> {
    fn check(&self, garment: usize) -> Result<(), RenderError> {
        let vertices = self.vertices.len();
        let attributes = [
            ("texture coordinates", self.uv.len()),
            ("normals", self.normals.len()),
            ("places", self.places.len()),
        ];
        if let Some((what, got)) = attributes.into_iter().find(|a| a.1 != 0 && a.1 != vertices) {
            return Err(RenderError::Length {
                garment,
                what,
                got,
                vertices,
            });
        }
        let is_finite = |p: &P3| p.iter().all(|c| c.is_finite());
        if let Some(vertex) = self.vertices.iter().position(|p| !is_finite(p)) {
            return Err(RenderError::NotFinite { garment, vertex });
        }
        let is_inside = |f: &Face| f.iter().all(|&i| (i as usize) < vertices);
        match self.faces.iter().position(|f| !is_inside(f)) {
            Some(face) => Err(RenderError::Face { garment, face }),
            None => Ok(()),
        }
    }
}

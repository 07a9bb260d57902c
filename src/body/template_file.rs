//! A template as bytes: its parts in postcard's compact form, compressed by deflate.

use super::{BodyError, Joint, ShapeSpace, Skeleton, SkinWeights, Template};
use flate2::Compression;
use flate2::read::{DeflateDecoder, DeflateEncoder};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::io::Read;
use tryon_geometry::math::P3;
use tryon_geometry::mesh::{Face, TriMesh};

/// Parts that [`Template::new`] makes a body of.
#[derive(Serialize, Deserialize)]
struct TemplateFile<'a> {
    name: Cow<'a, str>,
    vertices: Cow<'a, [P3]>,
    faces: Cow<'a, [Face]>,
    joints: Cow<'a, [Joint]>,
    weights: Cow<'a, SkinWeights>,
    shape_space: Cow<'a, Option<ShapeSpace>>,
}

/// Error of a file that cannot be read.
fn fault(why: impl std::fmt::Display) -> BodyError {
    BodyError::Array {
        array: "template file".into(),
        why: why.to_string(),
    }
}

impl Template {
    /// The template as bytes: the same for the same template. Pose shapes are left out.
    pub fn to_bytes(&self) -> Vec<u8> {
        let shape_space = self.shape_space().cloned();
        let file = TemplateFile {
            name: self.name().into(),
            vertices: self.mesh().vertices().into(),
            faces: self.mesh().faces().into(),
            joints: self.skeleton().joints().into(),
            weights: Cow::Borrowed(self.weights()),
            shape_space: Cow::Borrowed(&shape_space),
        };
        let mut bytes = Vec::new();
        #[expect(clippy::expect_used, reason = "memory takes every write")]
        postcard::to_stdvec(&file)
            .map(|plain| {
                DeflateEncoder::new(&plain[..], Compression::best()).read_to_end(&mut bytes)
            })
            .expect("serialisable")
            .expect("written to memory");
        bytes
    }

    /// Reads what [`Template::to_bytes`] gave.
    ///
    /// # Errors
    /// Bytes that are cut or of another kind; parts that do not fit each other.
    pub(crate) fn from_bytes(bytes: &[u8]) -> Result<Self, BodyError> {
        let mut plain = Vec::new();
        DeflateDecoder::new(bytes)
            .read_to_end(&mut plain)
            .map_err(fault)?;
        let file: TemplateFile<'_> = postcard::from_bytes(&plain).map_err(fault)?;
        let mesh = TriMesh::new(file.vertices.into_owned(), file.faces.into_owned())?;
        let skeleton = Skeleton::new(file.joints.into_owned())?;
        let (weights, shape_space) = (file.weights.into_owned(), file.shape_space.into_owned());
        Self::new(file.name, mesh, skeleton, weights, shape_space)
    }
}

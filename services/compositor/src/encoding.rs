//! Encodings of pictures.

use tryon_proto::convert::WireError;
use tryon_proto::v1::PictureCodec;

/// JPEG quality of single pictures.
pub(crate) const PICTURE_QUALITY: u8 = 95;

/// Encoding of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Encoding {
    Jpeg(u8),
    Png,
}

impl From<Encoding> for PictureCodec {
    fn from(encoding: Encoding) -> Self {
        match encoding {
            Encoding::Jpeg(_) => Self::Jpeg,
            Encoding::Png => Self::Png,
        }
    }
}

impl Encoding {
    /// Encoding of single pictures.
    ///
    /// # Errors
    /// Names the field when the codec is unknown.
    pub(crate) fn of_picture(codec: i32, field: &str) -> Result<Self, WireError> {
        match PictureCodec::try_from(codec) {
            Ok(PictureCodec::Unspecified | PictureCodec::Png) => Ok(Self::Png),
            Ok(PictureCodec::Jpeg) => Ok(Self::Jpeg(PICTURE_QUALITY)),
            Err(_) => Err(WireError::new(field, "JPEG or PNG")),
        }
    }
}

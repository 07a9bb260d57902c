//! Depth and colour images as files and as bytes: PNG, JPEG and the depth codec of the wire.
//!
//! A size is checked against [`MAX_SIDE`], [`MAX_PIXELS`] and the number of bytes before anything is allocated.

pub(crate) mod depth_codec;
mod files;
mod jpeg;
pub(crate) mod limits;
mod png_file;
mod sample;
mod yuv;

pub use depth_codec::{decode_depth, encode_depth};
pub use files::{decode_color, read_color, read_png_depth, write_png_depth, write_png_rgb};
pub use jpeg::{decode_jpeg, encode_jpeg};
pub use limits::{MAX_PIXELS, MAX_SIDE};
pub(super) use limits::{check_size, read_limited};
pub use png_file::{decode_png_color, decode_png_depth, encode_png_depth, encode_png_rgb};
pub use sample::sample_texture;
pub use yuv::{yuv_to_rgb, yuyv_to_rgb};

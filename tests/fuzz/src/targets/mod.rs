//! Decoders of outside data, each with seeds of its own.

mod bodies;
mod device_recordings;
mod garments;
mod images;
mod live;
mod meshes;
mod recordings;
mod secrets;
mod settings;
mod wire;

use crate::bundle::Bundle;
use crate::execute::Scratch;

/// Memory that an input may cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Allowance {
    /// For any input, bytes.
    pub base: usize,
    /// For each byte of the input.
    pub per_byte: usize,
}

/// Parsed text and unpacked messages are some tens of times their bytes.
const COMMON: Allowance = Allowance {
    base: 256 << 10,
    per_byte: 200,
};
/// Longest member of most inputs, bytes: long enough for every branch, short enough for thousands a second.
const LONGEST: usize = 16 << 10;

/// A decoder under test.
#[derive(Debug)]
pub struct Target {
    /// Name on the command line and in the corpus.
    pub name: &'static str,
    /// Function that reads the input.
    pub decoder: &'static str,
    /// Decodes an input: the size of the result, or why it is refused.
    pub run: fn(&Bundle, &Scratch) -> Result<usize, String>,
    /// Valid inputs.
    pub seeds: fn() -> Vec<Bundle>,
    /// Tokens of the format, with spaces between.
    pub words: &'static str,
    /// Memory.
    pub allowance: Allowance,
    /// Longest member, bytes.
    pub longest: usize,
}

impl Target {
    const fn new(
        name: &'static str,
        decoder: &'static str,
        run: fn(&Bundle, &Scratch) -> Result<usize, String>,
        seeds: fn() -> Vec<Bundle>,
    ) -> Self {
        Self {
            name,
            decoder,
            run,
            seeds,
            words: "",
            allowance: COMMON,
            longest: LONGEST,
        }
    }
    const fn words(mut self, words: &'static str) -> Self {
        self.words = words;
        self
    }
    const fn allow(mut self, base: usize, per_byte: usize) -> Self {
        self.allowance = Allowance { base, per_byte };
        self
    }
}

/// All targets.
pub const TARGETS: &[Target] = &[
    wire::REQUESTS,
    wire::FRAME,
    wire::GARMENTS,
    wire::BODY,
    images::DEPTH,
    images::POSITIONS,
    images::PNG,
    images::JPEG,
    meshes::OBJ,
    meshes::SCAN_OBJ,
    meshes::PLY,
    meshes::GLTF,
    bodies::NPZ,
    bodies::NPY,
    bodies::MOTION,
    bodies::MAKEHUMAN,
    garments::FABRIC,
    garments::GARMENTCODE,
    garments::PATTERN,
    garments::SCENE,
    recordings::MCAP,
    recordings::BAG,
    recordings::SQLITE,
    recordings::FOLDER,
    device_recordings::KINECT,
    device_recordings::RECORD3D,
    device_recordings::ARRAYS,
    live::LIVE,
    secrets::TOKEN,
    secrets::SEALED,
    settings::CONFIG,
    settings::HOSTS,
];

/// Text of an error.
fn text(e: impl std::fmt::Display) -> String {
    e.to_string()
}

/// Little-endian bytes of numbers.
fn le<const N: usize, T: Copy>(values: &[T], bytes: fn(T) -> [u8; N]) -> Vec<u8> {
    values.iter().flat_map(|v| bytes(*v)).collect()
}

/// The member `raw`, or what `pack` makes of all members where there is none.
fn packed(
    b: &Bundle,
    raw: &str,
    pack: impl FnOnce() -> Result<Vec<u8>, String>,
) -> Result<Vec<u8>, String> {
    match b.get(raw) {
        [] => pack(),
        raw => Ok(raw.to_vec()),
    }
}

/// Input as text, as readers of files see it.
fn lossy(bytes: &[u8]) -> std::borrow::Cow<'_, str> {
    String::from_utf8_lossy(bytes)
}

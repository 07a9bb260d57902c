//! Recordings in NumPy's npz: `depth` (frames × rows × columns) and `K` (3 × 3), perhaps `color` or `rgb`.

mod array;
mod reader;

pub use reader::NpzReader;

#[cfg(test)]
mod tests;

//! Arrays of numbers as NumPy reads them.

use super::FormatError;
use npyz::WriterBuilder;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

/// Writes `data` in C order with this shape, little-endian f32.
///
/// # Errors
/// When the shape does not hold the data, or the file cannot be written.
pub fn write_npy(path: &Path, shape: &[u64], data: impl ExactSizeIterator<Item = f32>) -> Result<(), FormatError> {
    let expected: u64 = shape.iter().product();
    if expected != data.len() as u64 {
        return Err(FormatError::field(path, "shape", format!("{shape:?} does not hold {} values", data.len())));
    }
    let io = |e| FormatError::io(path, e);
    let file = BufWriter::new(File::create(path).map_err(io)?);
    let mut writer = npyz::WriteOptions::new().default_dtype().shape(shape).writer(file).begin_nd().map_err(io)?;
    writer.extend(data).map_err(io)?;
    writer.finish().map_err(io)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shape_and_values_come_back() {
        let dir = tempfile::tempdir().expect("temporary folder");
        let path = dir.path().join("a.npy");
        write_npy(&path, &[2, 1, 3], (0..6).map(|i| i as f32)).expect("written");
        let bytes = std::fs::read(&path).expect("read");
        let back = npyz::NpyFile::new(&bytes[..]).expect("a header");
        assert_eq!(back.shape(), [2, 1, 3]);
        assert_eq!(back.into_vec::<f32>().expect("values"), [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
        assert!(write_npy(&path, &[2, 2], (0..6).map(|i| i as f32)).is_err());
    }
}

//! Sheets of equally large pictures in rows.

use super::EvaluateError;
use std::path::Path;
use tryon_formats::image::write_png_rgb;
use tryon_geometry::camera::ColorImage;

/// Pictures in rows.
#[derive(Clone, Debug)]
pub struct Sheet {
    cell: [u32; 2],
    columns: usize,
    cells: Vec<Vec<u8>>,
}

impl Sheet {
    /// An empty sheet: width and height of a cell (pixels), most cells in a row.
    pub fn new(cell: [u32; 2], columns: usize) -> Self {
        Self {
            cell,
            columns,
            cells: Vec::new(),
        }
    }

    /// Pictures so far.
    pub(super) fn len(&self) -> usize {
        self.cells.len()
    }

    /// Adds a picture of a cell's size, RGB bytes.
    pub fn push(&mut self, picture: Vec<u8>) {
        self.cells.push(picture);
    }

    /// Writes the sheet as PNG, its folder too; nothing without pictures.
    ///
    /// # Errors
    /// Names the file that cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), EvaluateError> {
        if self.cells.is_empty() {
            return Ok(());
        }
        let fault = |why: String| EvaluateError::new(path.display(), why);
        let columns = self.columns.min(self.cells.len());
        let rows = self.cells.len().div_ceil(columns);
        let [w, h] = self.cell.map(|n| n as usize);
        let mut data = vec![255u8; 3 * w * columns * h * rows];
        for (k, cell) in self.cells.iter().enumerate() {
            let (x, y) = (k % columns * w, k / columns * h);
            for (row, line) in cell.chunks_exact(3 * w).enumerate() {
                let at = 3 * ((y + row) * w * columns + x);
                data[at..at + 3 * w].copy_from_slice(line);
            }
        }
        let image = ColorImage::new((w * columns) as u32, (h * rows) as u32, data);
        let image = image.map_err(|e| fault(e.to_string()))?;
        let folder = path.parent().unwrap_or(path);
        std::fs::create_dir_all(folder).map_err(|e| fault(e.to_string()))?;
        write_png_rgb(path, &image).map_err(|e| fault(e.to_string()))
    }
}

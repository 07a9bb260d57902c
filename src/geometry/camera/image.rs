//! Depth and colour images.

/// Number of values that does not match the stated size.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{what}: {got} values, but {width}×{height} needs {expected}")]
pub struct ImageError {
    /// Kind of image.
    pub what: &'static str,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Values expected.
    pub expected: usize,
    /// Values given.
    pub got: usize,
}

/// An image that has not the size of its camera.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{what}: {}×{} pixels, but the camera has {}×{}", got[0], got[1], expected[0], expected[1])]
pub struct FrameSizeError {
    /// Kind of image.
    pub what: &'static str,
    /// Columns and rows of the image.
    pub got: [u32; 2],
    /// Columns and rows of the camera.
    pub expected: [u32; 2],
}

impl FrameSizeError {
    /// Compares columns and rows of an image with those of its camera.
    pub(super) fn check(what: &'static str, got: [u32; 2], expected: [u32; 2]) -> Result<(), Self> {
        if got == expected {
            Ok(())
        } else {
            Err(Self {
                what,
                got,
                expected,
            })
        }
    }
}

fn check(
    what: &'static str,
    width: u32,
    height: u32,
    channels: usize,
    got: usize,
) -> Result<(), ImageError> {
    let expected = width as usize * height as usize * channels;
    if expected == got {
        Ok(())
    } else {
        Err(ImageError {
            what,
            width,
            height,
            expected,
            got,
        })
    }
}

/// Depth along the optical axis, u16 millimetres, row-major, 0 = no reading.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DepthImage {
    width: u32,
    height: u32,
    data: Vec<u16>,
}

impl DepthImage {
    /// Checks row-major millimetres.
    ///
    /// # Errors
    /// When the number of values is not `width × height`.
    pub fn new(width: u32, height: u32, data: Vec<u16>) -> Result<Self, ImageError> {
        check("depth image", width, height, 1, data.len())?;
        Ok(Self {
            width,
            height,
            data,
        })
    }
    /// An image without readings.
    pub fn empty(width: u32, height: u32) -> Self {
        Self {
            width,
            height,
            data: vec![0; width as usize * height as usize],
        }
    }
    /// Changes the size and keeps the memory; the values are then of no meaning unless the size was the same.
    pub(super) fn resize(&mut self, [width, height]: [u32; 2]) {
        self.data.resize(width as usize * height as usize, 0);
        (self.width, self.height) = (width, height);
    }
    /// Columns and rows.
    pub(super) fn size(&self) -> [u32; 2] {
        [self.width, self.height]
    }
    /// Columns.
    pub fn width(&self) -> u32 {
        self.width
    }
    /// Rows.
    pub fn height(&self) -> u32 {
        self.height
    }
    /// Millimetres, row-major.
    pub fn data(&self) -> &[u16] {
        &self.data
    }
    /// Millimetres, writable.
    pub fn data_mut(&mut self) -> &mut [u16] {
        &mut self.data
    }
    /// Millimetres at column `u`, row `v`; 0 outside the image.
    pub fn at(&self, u: i32, v: i32) -> u16 {
        if u < 0 || v < 0 || u >= self.width as i32 || v >= self.height as i32 {
            return 0;
        }
        self.data[v as usize * self.width as usize + u as usize]
    }
}

/// Colour, 8-bit sRGB, interleaved RGB, row-major.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ColorImage {
    width: u32,
    height: u32,
    data: Vec<u8>,
}

impl ColorImage {
    /// Checks row-major interleaved RGB.
    ///
    /// # Errors
    /// When the number of bytes is not `3 × width × height`.
    pub fn new(width: u32, height: u32, data: Vec<u8>) -> Result<Self, ImageError> {
        check("colour image", width, height, 3, data.len())?;
        Ok(Self {
            width,
            height,
            data,
        })
    }
    /// One colour everywhere.
    pub fn filled(width: u32, height: u32, rgb: [u8; 3]) -> Self {
        Self {
            width,
            height,
            data: rgb.repeat(width as usize * height as usize),
        }
    }
    /// Changes the size and keeps the memory; the values are then of no meaning unless the size was the same.
    pub(super) fn resize(&mut self, [width, height]: [u32; 2]) {
        self.data.resize(3 * width as usize * height as usize, 0);
        (self.width, self.height) = (width, height);
    }
    /// Columns and rows.
    pub(super) fn size(&self) -> [u32; 2] {
        [self.width, self.height]
    }
    /// Columns.
    pub fn width(&self) -> u32 {
        self.width
    }
    /// Rows.
    pub fn height(&self) -> u32 {
        self.height
    }
    /// Bytes, RGB interleaved.
    pub fn data(&self) -> &[u8] {
        &self.data
    }
    /// Bytes, writable.
    pub fn data_mut(&mut self) -> &mut [u8] {
        &mut self.data
    }
    /// Pixel at column `u`, row `v`; must be inside.
    pub fn at(&self, u: u32, v: u32) -> [u8; 3] {
        let i = 3 * (v as usize * self.width as usize + u as usize);
        [self.data[i], self.data[i + 1], self.data[i + 2]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_checked() {
        assert!(DepthImage::new(2, 2, vec![1, 2, 3, 4]).is_ok());
        let e = ColorImage::new(2, 2, vec![0; 11]).expect_err("one byte short");
        assert_eq!((e.expected, e.got), (12, 11));
        assert_eq!(DepthImage::empty(3, 2).at(-1, 0), 0);
    }
}

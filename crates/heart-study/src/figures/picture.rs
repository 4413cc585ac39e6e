//! An image in memory, and its PNG file.

use heart_phantom::PhantomError;
use heart_phantom::files::{png_bytes, write_atomically};
use std::path::Path;

/// An RGB image with 8 bits per channel: the result of every figure. Equal input gives equal bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Picture {
    /// Columns.
    pub(crate) width: u32,
    /// Rows.
    pub(crate) height: u32,
    /// Samples `[row][column][red, green, blue]`, the first row on top.
    pub(crate) rgb: Vec<u8>,
}

impl Picture {
    /// Returns the colour at column `x` from the left and row `y` from the top; `None` outside the image.
    #[cfg(test)]
    pub(super) fn pixel(&self, x: u32, y: u32) -> Option<[u8; 3]> {
        if x >= self.width {
            return None;
        }
        let at = y as usize * self.width as usize + x as usize;
        self.rgb.as_chunks().0.get(at).copied()
    }

    pub(super) fn set(&mut self, x: u32, y: u32, colour: [u8; 3]) {
        let at = 3 * (y as usize * self.width as usize + x as usize);
        self.rgb[at..at + 3].copy_from_slice(&colour);
    }

    /// Returns the bytes of a PNG file.
    pub(crate) fn to_png(&self) -> Result<Vec<u8>, PhantomError> {
        png_bytes([self.width, self.height], &self.rgb)
    }

    /// Writes a PNG file atomically.
    pub(crate) fn write_png(&self, path: &Path) -> Result<(), PhantomError> {
        let png = self.to_png()?;
        write_atomically(path, |out| out.write_all(&png))
    }
}

//! Sections of a volume as grey images: PNG, and a GIF of the cycle.

use super::names::check_extension;
use crate::error::{PhantomError, check, check_count};
use crate::files::{Samples, Volume, write_atomically};
use png::{BitDepth, ColorType, Compression, Encoder, EncodingError};
use std::io;
use std::path::Path;

/// A section through the voxels of one index in radiological orientation: the patient's left on the right of the image, head or
/// front on top.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Section {
    /// Axial: x to the right, y downwards.
    Axial(usize),
    /// Coronal: x to the right, z upwards.
    Coronal(usize),
    /// Sagittal: y to the right, z upwards.
    Sagittal(usize),
}

/// Writes one section as an 8-bit grey PNG, one pixel per voxel: `grey[0]` black, `grey[1]` white, linear between, clamped.
///
/// # Errors
/// [`PhantomError::Extension`] unless the path ends in `.png`; [`PhantomError::Count`] for an index beyond the volume;
/// [`PhantomError::OutOfRange`] if the grey range is empty; [`PhantomError::File`].
pub fn write_png(
    path: &Path,
    volume: &Volume,
    section: Section,
    grey: [f64; 2],
) -> Result<(), PhantomError> {
    check_extension(path, "png")?;
    let picture = Picture::new(volume, section, grey)?;
    let size = [picture.width, picture.height].map(|n| n as u32);
    let png = png_bytes(size, &picture.pixels)?;
    write_atomically(path, |out| out.write_all(&png))
}

/// Returns a PNG file of `[width, height]` pixels of 8 bits per channel, rows from the top: grey with one sample per pixel, RGB
/// with three.
///
/// # Errors
/// [`PhantomError::WrongLength`] for another number of samples, [`PhantomError::File`] if the encoder fails, as for a size of 0.
pub fn png_bytes(size: [u32; 2], samples: &[u8]) -> Result<Vec<u8>, PhantomError> {
    let expected = size[0] as usize * size[1] as usize;
    let colour = match samples.len() {
        len if len == expected => ColorType::Grayscale,
        len if len == 3 * expected => ColorType::Rgb,
        given => {
            return Err(PhantomError::WrongLength {
                what: "samples of an image",
                given,
                expected,
            });
        }
    };
    let encode = || {
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes, size[0], size[1]);
        encoder.set_color(colour);
        encoder.set_depth(BitDepth::Eight);
        encoder.set_compression(Compression::Fast);
        encoder.set_filter(png::Filter::Adaptive);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(samples)?;
        writer.finish()?;
        Ok::<_, EncodingError>(bytes)
    };
    encode().map_err(|error| PhantomError::File {
        path: "an image".into(),
        source: io::Error::other(error),
    })
}

/// Writes the same section of several volumes as a looping GIF, each frame shown for `seconds` (rounded to hundredths by GIF). Grey
/// values as in [`write_png`].
///
/// # Errors
/// As [`write_png`] with `.gif`; [`PhantomError::Count`] if there are no frames, and
/// [`PhantomError::WrongLength`] if a frame has another size than the first.
pub fn write_gif(
    path: &Path,
    frames: &[Volume],
    section: Section,
    grey: [f64; 2],
    seconds: f64,
) -> Result<(), PhantomError> {
    check_extension(path, "gif")?;
    check_count("frames", frames.len(), [1, usize::MAX])?;
    check("seconds per frame", seconds, [0.01, 655.35])?;
    let pictures: Vec<Picture> = frames
        .iter()
        .map(|frame| Picture::new(frame, section, grey))
        .collect::<Result<_, _>>()?;
    let first = &pictures[0];
    for picture in &pictures {
        if (picture.width, picture.height) != (first.width, first.height) {
            return Err(PhantomError::WrongLength {
                what: "pixels of a frame",
                given: picture.pixels.len(),
                expected: first.pixels.len(),
            });
        }
    }
    let palette: Vec<u8> = (0..=255).flat_map(|v| [v; 3]).collect();
    write_atomically(path, |out| {
        let (width, height) = (first.width as u16, first.height as u16);
        let mut gif = gif::Encoder::new(out, width, height, &palette).map_err(io::Error::other)?;
        gif.set_repeat(gif::Repeat::Infinite)
            .map_err(io::Error::other)?;
        for picture in &pictures {
            let frame = gif::Frame {
                width,
                height,
                delay: (100.0 * seconds).round() as u16,
                buffer: picture.pixels.as_slice().into(),
                ..gif::Frame::default()
            };
            gif.write_frame(&frame).map_err(io::Error::other)?;
        }
        Ok(())
    })
}

/// Grey pixels, rows from the top.
struct Picture {
    width: usize,
    height: usize,
    pixels: Vec<u8>,
}

impl Picture {
    fn new(volume: &Volume, section: Section, grey: [f64; 2]) -> Result<Self, PhantomError> {
        let [nx, ny, nz] = volume.grid.shape();
        check("black", grey[0], [f64::MIN, f64::MAX])?;
        check("white", grey[1], [grey[0].next_up(), f64::MAX])?;
        let (index, n, width, height) = match section {
            Section::Axial(k) => (k, nz, nx, ny),
            Section::Coronal(k) => (k, ny, nx, nz),
            Section::Sagittal(k) => (k, nx, ny, nz),
        };
        check_count("section", index, [0, n - 1])?;
        for side in [width, height] {
            check_count("pixels along a side", side, [1, usize::from(u16::MAX)])?;
        }
        let at = |column: usize, row: usize| match section {
            Section::Axial(z) => (z * ny + row) * nx + column,
            Section::Coronal(y) => ((nz - 1 - row) * ny + y) * nx + column,
            Section::Sagittal(x) => ((nz - 1 - row) * ny + column) * nx + x,
        };
        let value = |k: usize| match volume.samples {
            Samples::F32(values) => f64::from(values[k]),
            Samples::U8(values) => f64::from(values[k]),
            Samples::U16(values) => f64::from(values[k]),
        };
        let shade = |v: f64| (255.0 * (v - grey[0]) / (grey[1] - grey[0])).round() as u8;
        let pixels = (0..height)
            .flat_map(|row| (0..width).map(move |column| (column, row)))
            .map(|(column, row)| shade(value(at(column, row))))
            .collect();
        Ok(Self {
            width,
            height,
            pixels,
        })
    }
}

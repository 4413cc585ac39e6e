//! Samples of volumes and projections, and their bytes.

use crate::error::{PhantomError, check_finite, check_length};
use std::io::{self, Write};
use std::ops::Range;

/// Bytes per write: few calls, and within the cache.
pub(super) const PIECE: usize = 1 << 16;

/// Allowed times from one gate to the next, s.
pub(super) const SECONDS_PER_GATE: [f64; 2] = [1e-9, 1e9];

/// Samples to be written, borrowed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Samples<'a> {
    /// Activity, attenuation, line integrals.
    F32(&'a [f32]),
    /// Labels up to 255.
    U8(&'a [u8]),
    /// Labels or counts up to 65535.
    U16(&'a [u16]),
}

impl<'a> Samples<'a> {
    /// Returns the number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::F32(values) => values.len(),
            Self::U8(values) => values.len(),
            Self::U16(values) => values.len(),
        }
    }

    /// Returns whether there are no samples.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the bytes per sample.
    #[must_use]
    pub fn bytes_each(&self) -> usize {
        match self {
            Self::F32(_) => 4,
            Self::U8(_) => 1,
            Self::U16(_) => 2,
        }
    }

    /// Checks the length against the shape, and for NaN and infinity.
    pub(super) fn check(&self, what: &'static str, shape: &[usize]) -> Result<(), PhantomError> {
        // A product that overflows cannot be a length.
        let expected = shape.iter().fold(1, |n: usize, &k| n.saturating_mul(k));
        check_length(what, self.len(), expected)?;
        match self {
            Self::F32(values) => check_finite(what, values),
            Self::U8(_) | Self::U16(_) => Ok(()),
        }
    }

    /// Writes all samples, little-endian.
    pub(super) fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        self.write_range(0..self.len(), out)
    }

    /// Writes runs of `run` samples from the last to the first in each block of `runs` of them.
    pub(super) fn write_reversed(
        &self,
        run: usize,
        runs: usize,
        out: &mut dyn Write,
    ) -> io::Result<()> {
        for block in (0..self.len()).step_by(run * runs) {
            for k in (0..runs).rev() {
                let first = block + k * run;
                self.write_range(first..first + run, out)?;
            }
        }
        Ok(())
    }

    /// Writes the samples of each block of `len` from the last to the first.
    pub(super) fn write_backwards(&self, len: usize, out: &mut dyn Write) -> io::Result<()> {
        for from in (0..self.len()).step_by(len) {
            let block = self.picked((from..from + len).rev());
            block.as_samples().write(out)?;
        }
        Ok(())
    }

    /// Writes the views `[gate][head][view]` of `len` samples each as `[head][gate][view]`, with the samples of each reversed.
    #[cfg(feature = "dicom")]
    pub(super) fn backwards_by_head(
        &self,
        [gates, heads, views]: [usize; 3],
        len: usize,
    ) -> OwnSamples {
        let of_head = |head| (0..gates).map(move |gate| (gate * heads + head) * views);
        let first = (0..heads).flat_map(of_head);
        let view = first.flat_map(|first| first..first + views);
        self.picked(view.flat_map(|view| (view * len..(view + 1) * len).rev()))
    }

    /// Writes the first sample of each block of `len`, then the second of each, and so on.
    pub(super) fn write_interleaved(&self, len: usize, out: &mut dyn Write) -> io::Result<()> {
        // Processes as many samples of a block at once as fill one write.
        let blocks = self.len() / len.max(1);
        let run = (PIECE / 4 / blocks.max(1)).max(1);
        for from in (0..len).step_by(run) {
            let to = len.min(from + run);
            let places = (from..to).flat_map(|k| (0..blocks).map(move |block| block * len + k));
            self.picked(places).as_samples().write(out)?;
        }
        Ok(())
    }

    /// Returns the samples at given indices, in that order.
    fn picked(&self, places: impl Iterator<Item = usize>) -> OwnSamples {
        match self {
            Self::F32(values) => OwnSamples::F32(places.map(|k| values[k]).collect()),
            Self::U8(values) => OwnSamples::U8(places.map(|k| values[k]).collect()),
            Self::U16(values) => OwnSamples::U16(places.map(|k| values[k]).collect()),
        }
    }

    fn write_range(&self, range: Range<usize>, out: &mut dyn Write) -> io::Result<()> {
        match self {
            Self::F32(values) => write_bytes(&values[range], |v| v.to_le_bytes(), out),
            Self::U8(values) => out.write_all(&values[range]),
            Self::U16(values) => write_bytes(&values[range], |v| v.to_le_bytes(), out),
        }
    }
}

/// Returns the number of gates of `len` samples each, at least one.
pub(super) fn n_gates(samples: Samples<'_>, len: usize) -> usize {
    (samples.len() / len.max(1)).max(1)
}

/// Samples of an array, owned; [`Samples`] borrows them.
pub(super) enum OwnSamples {
    F32(Vec<f32>),
    U8(Vec<u8>),
    U16(Vec<u16>),
}

impl OwnSamples {
    /// Returns the samples, borrowed.
    pub(super) fn as_samples(&self) -> Samples<'_> {
        match self {
            Self::F32(values) => values.into(),
            Self::U8(values) => values.into(),
            Self::U16(values) => values.into(),
        }
    }
}

fn write_bytes<T: Copy, const N: usize>(
    values: &[T],
    bytes: impl Fn(T) -> [u8; N],
    out: &mut dyn Write,
) -> io::Result<()> {
    // In pieces, because a copy as bytes would double the memory.
    let mut buffer = [0; PIECE];
    for piece in values.chunks(PIECE / N) {
        let used = &mut buffer[..piece.len() * N];
        for (to, &value) in used.as_chunks_mut::<N>().0.iter_mut().zip(piece) {
            *to = bytes(value);
        }
        out.write_all(used)?;
    }
    Ok(())
}

macro_rules! samples_of {
    ($($kind:ident($sample:ty)),*) => {$(
        impl<'a> From<&'a [$sample]> for Samples<'a> {
            fn from(values: &'a [$sample]) -> Self {
                Self::$kind(values)
            }
        }

        impl<'a> From<&'a Vec<$sample>> for Samples<'a> {
            fn from(values: &'a Vec<$sample>) -> Self {
                Self::$kind(values)
            }
        }
    )*};
}
samples_of!(F32(f32), U8(u8), U16(u16));

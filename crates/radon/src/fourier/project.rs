//! The transpose of back-projection: rows of an image, by the transposed steps.

use std::ops::Range;

use rustfft::num_complex::Complex;

use super::polar::{Columns, PolarView, turns};
use super::{BAND, Gridding, GriddingScratch, Work, real_ends};
use crate::pool::grown;
use crate::simd::{DIGITS, LANES};
use crate::{Sample, parallel};

/// The part of the rows' spectra in a band of columns: by segment in the order of the views, with the start of each view.
struct Found<T> {
    values: Vec<Complex<T>>,
    starts: Vec<usize>,
}

impl<T: Sample> Gridding<T> {
    /// Computes the rows `[view][bin]` of an image `[y][x]`: the transpose of back-projection.
    pub(crate) fn project(&self, image: &[T], rows: &mut [T], scratch: &mut GriddingScratch<T>) {
        let GriddingScratch { bands, works, .. } = scratch;
        let spectrum = &mut grown(bands, self.bands_len())[..self.n[1] * self.n_columns()];
        parallel::chunks(spectrum, self.n_columns(), &|y, spectrum| {
            let pixels = &image[y * self.n[0]..][..self.n[0]];
            works.with(Work::default, |work| {
                self.transform_pixels(y, pixels, spectrum, work)
            });
        });
        let spectrum = &*spectrum;
        let n_bands = self.n_columns().div_ceil(BAND);
        let found = parallel::collect(n_bands, &|band| {
            simd_set::unit(n_bands + self.polar.views.len());
            works.with(Work::default, |work| self.read_band(spectrum, band, work))
        });
        parallel::chunks(rows, self.n_bins, &|view, row| {
            simd_set::unit(n_bands + self.polar.views.len());
            let place = self.polar.places[view];
            works.with(Work::default, |work| {
                self.assemble(&found, place, row, work)
            });
        });
    }

    /// Divides a row of pixels by the factor of interpolation between cells and transforms it along x.
    fn transform_pixels(
        &self,
        y: usize,
        pixels: &[T],
        spectrum: &mut [Complex<T>],
        work: &mut Work<T>,
    ) {
        let row = grown(&mut work.row, self.polar.cells[0]);
        row.fill(T::ZERO);
        for (x, (pixel, inverse)) in pixels.iter().zip(&self.inverse[0]).enumerate() {
            row[self.place(0, x)] = *pixel * *inverse * self.inverse[1][y];
        }
        let fft = grown(&mut work.fft, self.fft_len());
        let done = self.along_x.0.process_with_scratch(row, spectrum, fft);
        debug_assert!(done.is_ok());
    }

    /// Returns the columns whose samples belong to a band; each sample or its mirror image is in exactly one band.
    fn owned(&self, band: usize) -> Columns {
        let half = (self.polar.cells[0] as i64) << (DIGITS - 1);
        let [first, end] = [band, band + 1].map(|b| (((b * BAND) as i64) << DIGITS).min(half));
        let mirrored: Range<i64> = first + 1..end + 1;
        Columns {
            samples: first..end,
            mirrored,
        }
    }

    /// Transforms the columns of a band and reads all samples in it.
    fn read_band(&self, spectrum: &[Complex<T>], band: usize, work: &mut Work<T>) -> Found<T> {
        let owned = self.owned(band);
        let (mut starts, mut n) = (Vec::with_capacity(self.polar.views.len() + 1), 0);
        for view in &self.polar.views {
            starts.push(n);
            self.polar
                .segments(view, &owned, |segment| n += segment.samples.len());
        }
        let mut values = vec![Complex::default(); n];
        if n == 0 {
            return Found { values, starts };
        }
        let first = (band * BAND) as i64 - (LANES / 2) as i64;
        let cells = self.columns(spectrum, first, work);
        let mut rest = &mut values[..];
        for view in &self.polar.views {
            self.polar.segments(view, &owned, |segment| {
                let (these, others) = std::mem::take(&mut rest).split_at_mut(segment.samples.len());
                rest = others;
                let path = self.path(&segment, first);
                T::read_between(self.instructions, &self.taps, &path, cells, these);
            });
        }
        Found { values, starts }
    }

    /// Returns the transformed columns of a band, and those on either side within reach of its samples.
    fn columns<'a>(
        &self,
        spectrum: &[Complex<T>],
        first: i64,
        work: &'a mut Work<T>,
    ) -> &'a [Complex<T>] {
        let cells = grown(&mut work.cells, self.cells_len());
        let fft = grown(&mut work.fft, self.fft_len());
        let (stride, [nx, ny]) = (self.stride(), self.polar.cells);
        let reach = self.taps.width.div_ceil(2);
        let used = LANES / 2 - reach..LANES / 2 + BAND + reach;
        // Columns beyond the half that a real image needs are its mirror image.
        let sources: Vec<(usize, bool)> = (used.clone())
            .map(|i| (first + i as i64).rem_euclid(nx as i64) as usize)
            .map(|at| {
                if at > nx / 2 {
                    (nx - at, true)
                } else {
                    (at, false)
                }
            })
            .collect();
        let columns = &mut cells[used.start * stride..used.end * stride];
        columns.fill(Complex::default());
        for (y, row) in spectrum.chunks_exact(self.n_columns()).enumerate() {
            let columns = columns.chunks_exact_mut(stride);
            for (column, &(at, mirrored)) in columns.zip(&sources) {
                let value = row[at];
                column[self.place(1, y)] = if mirrored { value.conj() } else { value };
            }
        }
        for column in columns.chunks_exact_mut(stride) {
            let (column, behind) = column.split_at_mut(ny);
            self.along_y.0.process_with_scratch(column, fft);
            behind[..LANES / 2].copy_from_slice(&column[..LANES / 2]);
        }
        cells
    }

    /// Assembles a row from the parts of all bands.
    fn assemble(&self, found: &[Found<T>], place: usize, out: &mut [T], work: &mut Work<T>) {
        let view: &PolarView = &self.polar.views[place];
        let half = grown(&mut work.spectrum, self.polar.half_len());
        half.fill(Complex::default());
        let factors: Vec<Complex<T>> = (0..self.polar.replicas.len())
            .map(|replica| self.factor(view, replica).conj())
            .collect();
        for (band, found) in found.iter().enumerate() {
            let mut values = found.values[found.starts[place]..].iter();
            self.polar.segments(view, &self.owned(band), |segment| {
                let gains = &self.gains[segment.replica][segment.samples.clone()];
                let factor = factors[segment.replica];
                let to = half[segment.samples].iter_mut();
                // The segment is the first argument, so that `zip` takes no value too many.
                for ((to, &gain), &value) in to.zip(gains).zip(&mut values) {
                    *to = *to + value * factor.scale(gain);
                }
            });
        }
        for (value, phase) in half.iter_mut().zip(turns(-view.turn)) {
            if view.conjugate {
                *value = value.conj();
            }
            *value = *value * Complex::new(T::of(phase.re), T::of(phase.im));
        }
        // Frequencies that are their own mirror image.
        if let [first, .., last] = &mut *half {
            *first = *first + *first;
            *last = *last + *last;
        }
        real_ends(half);
        let row = grown(&mut work.row, self.polar.row_len);
        let fft = grown(&mut work.fft, self.fft_len());
        let done = self.row.1.process_with_scratch(half, row, fft);
        debug_assert!(done.is_ok());
        out.copy_from_slice(&row[..self.n_bins]);
    }
}

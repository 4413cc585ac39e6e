//! Back-projection of rows and its transpose by Fourier transforms: N^2 log N operations instead of N^3 for a sum over views.
//!
//! The image of rows q_v that are interpolated between bins by a kernel of response G,
//!
//! ```text
//! f(x) = sum_v sum_j q_v[j] K(x . theta_v - s_j)        K(s) = sum_k G(k / P) cos(2 pi k s / (P pitch)) / P
//! ```
//!
//! is a sum of plane waves. Their frequencies are those of the rows of P samples, along the direction of their view. The samples are
//! *spread* over the cells of a rectangular grid in the image's spectrum. One transform of this grid gives all pixels. The effect of
//! spreading on the image is a known smooth factor, which is divided out (type 1 of the non-uniform transforms of Dutt & Rokhlin 1993,
//! doi:10.1137/0914081; gridding, O'Sullivan 1985, doi:10.1109/TMI.1985.4307723). The transpose applies the transpose of each step.
//!
//! The grid is divided into bands of columns. One job spreads all samples in a band, in the order of the views, and transforms its columns.
//! So the grid is never stored as a whole, and results are bitwise identical for any number of threads.

use std::f64::consts::PI;
use std::ops::Range;

use rustfft::num_complex::Complex;

use crate::error::{RadonError, within};
use crate::fft::{ComplexPair, RealPair};
use crate::filter::padded_len;
use crate::pool::{Pool, grown};
use crate::simd::{DIGITS, InstructionSet, LANES, RayPath, Taps};
use crate::{ImageGrid, ParallelGeometry, Sample, parallel};

mod polar;
mod project;
pub(crate) mod projector;
mod taps;

use polar::{Columns, Polar, PolarView, Segment, turns};
use taps::{FINER, Shape};

/// Columns of the grid per band.
const BAND: usize = 32;

/// Sizes of the work, known before planning.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Counts {
    pub(crate) n_views: usize,
    /// Period of a row in samples.
    pub(crate) row_len: usize,
    /// Cells of the image's spectrum along x and y.
    pub(crate) cells: [usize; 2],
    /// Samples that are spread.
    pub(crate) n_spread: f64,
    /// Rows of the image.
    pub(crate) ny: usize,
}

impl Counts {
    pub(crate) fn new(
        geometry: &ParallelGeometry,
        grid: &ImageGrid,
        response: Response,
    ) -> Result<Self, RadonError> {
        let row_len = row_period(geometry, grid)?;
        let least = |n: usize| ((n as f64 * FINER).ceil() as usize).max(2 * LANES);
        let n_views = geometry.n_views();
        Ok(Self {
            n_views,
            row_len,
            cells: [padded_len(least(grid.nx()))?, padded_len(least(grid.ny()))?],
            n_spread: response.most([1.0, 0.0]) * row_len as f64 * n_views as f64,
            ny: grid.ny(),
        })
    }
}

/// The planned pair of operators.
pub(crate) struct Gridding<T: Sample> {
    polar: Polar,
    n_bins: usize,
    /// Pixels along x and y.
    n: [usize; 2],
    taps: Taps<T>,
    /// G / P for each replica and sample of half a spectrum.
    gains: Vec<Vec<T>>,
    /// Reciprocals of the factors of spreading along x and along y.
    inverse: [Vec<T>; 2],
    row: RealPair<T>,
    along_x: RealPair<T>,
    along_y: ComplexPair<T>,
    instructions: InstructionSet,
}

impl<T: Sample> std::fmt::Debug for Gridding<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Gridding").finish_non_exhaustive()
    }
}

/// The kernel K between bins, by its response at frequencies in units of 1/pitch.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Response {
    /// Linear interpolation between samples, this many per bin: the first lobe of sinc^2 for one, otherwise the band of the row itself.
    Lines(usize),
    /// Bin averages of an image of these pixels.
    BinMeans { pitch: f64, spacing: [f64; 2] },
}

impl Response {
    fn gain(self, frequency: f64) -> f64 {
        let sinc = |x: f64| {
            if x == 0.0 {
                1.0
            } else {
                (PI * x).sin() / (PI * x)
            }
        };
        match self {
            Self::Lines(per_bin) => sinc(frequency / per_bin as f64).powi(2),
            Self::BinMeans {
                pitch,
                spacing: [dx, dy],
            } => dx * dy / pitch * sinc(frequency),
        }
    }

    /// Returns the largest frequency in a direction (cosine and sine).
    fn most(self, [cos, sin]: [f64; 2]) -> f64 {
        match self {
            Self::Lines(1) => 1.0,
            Self::Lines(_) => 0.5,
            Self::BinMeans {
                pitch,
                spacing: [dx, dy],
            } => 0.5 * pitch / (dx * cos.abs()).max(dy * sin.abs()),
        }
    }
}

/// Work arrays.
#[derive(Debug, Default)]
pub(crate) struct GriddingScratch<T> {
    /// `[view by direction][sample of half a spectrum]`
    spectra: Vec<Complex<T>>,
    /// `[band][row of the image][column]`: the image's spectrum along x.
    bands: Vec<Complex<T>>,
    /// One per active thread.
    works: Pool<Work<T>>,
}

/// Work arrays of a thread.
#[derive(Debug, Default)]
struct Work<T> {
    /// `[column][cell]` of a band and of `LANES / 2` columns on either side.
    cells: Vec<Complex<T>>,
    row: Vec<T>,
    spectrum: Vec<Complex<T>>,
    fft: Vec<Complex<T>>,
}

impl<T: Sample> Gridding<T> {
    pub(crate) fn new(
        geometry: &ParallelGeometry,
        grid: &ImageGrid,
        tolerance: f64,
        instructions: InstructionSet,
        response: Response,
    ) -> Result<Self, RadonError> {
        let shape = Shape::for_tolerance(tolerance);
        let n = [grid.nx(), grid.ny()];
        let Counts { row_len, cells, .. } = Counts::new(geometry, grid, response)?;
        let most = |direction| response.most(direction);
        let both_ends = matches!(response, Response::BinMeans { .. });
        let polar = Polar::new(geometry, grid, (row_len, cells), most, both_ends)?;
        let half = polar.half_len();
        let gains = (0..polar.replicas.len()).map(|replica| {
            let gain = |k: usize| {
                // Both ends of half a spectrum are their own mirror images and are visited twice.
                let share = if k == 0 || k == half - 1 { 0.5 } else { 1.0 };
                let frequency = (polar.first(replica) + k as i64) as f64 / row_len as f64;
                T::of(share * response.gain(frequency) / row_len as f64)
            };
            (0..half).map(gain).collect()
        });
        let inverse = |axis: usize| {
            let (n, cells) = (n[axis], cells[axis] as f64);
            (0..n)
                .map(|i| T::of(1.0 / shape.transform((i as f64 - (n / 2) as f64) / cells)))
                .collect()
        };
        Ok(Self {
            gains: gains.collect(),
            inverse: [inverse(0), inverse(1)],
            n_bins: geometry.n_bins(),
            n,
            taps: shape.taps(),
            row: T::real(row_len, row_len),
            along_x: T::real(cells[0], cells[0]),
            along_y: T::complex(cells[1]),
            polar,
            instructions,
        })
    }

    fn n_columns(&self) -> usize {
        self.polar.cells[0] / 2 + 1
    }

    fn spectra_len(&self) -> usize {
        self.polar.views.len() * self.polar.half_len()
    }

    fn bands_len(&self) -> usize {
        self.n_columns().div_ceil(BAND) * BAND * self.n[1]
    }

    /// Returns the distance between the columns of a band in memory: not a multiple of a power of two, to avoid cache conflicts.
    fn stride(&self) -> usize {
        (self.polar.cells[1] + LANES / 2).next_multiple_of(16) + 8
    }

    fn cells_len(&self) -> usize {
        (BAND + LANES) * self.stride()
    }

    /// Bytes of the work arrays of a back-projection on `n_threads` threads.
    pub(crate) fn work_bytes(&self, n_threads: usize) -> usize {
        let row = self.polar.row_len.max(self.polar.cells[0]);
        // Half a complex number per sample of a row, and the same for its spectrum.
        let work = self.cells_len() + row + 1 + self.fft_len();
        let shared = self.spectra_len() + self.bands_len();
        (shared + n_threads * work) * size_of::<Complex<T>>()
    }

    fn fft_len(&self) -> usize {
        let lens = [
            self.row.0.get_scratch_len(),
            self.row.1.get_scratch_len(),
            self.along_x.0.get_scratch_len(),
            self.along_x.1.get_scratch_len(),
            self.along_y.0.get_inplace_scratch_len(),
            self.along_y.1.get_inplace_scratch_len(),
        ];
        lens.into_iter().fold(0, usize::max)
    }

    /// Computes the image, `[y][x]`, of rows that `fill(view, row)` writes (`false` for a row of zeros), limited to `region` (x and y).
    pub(crate) fn back_project(
        &self,
        fill: &(dyn Fn(usize, &mut [T]) -> bool + Sync),
        region: &[Range<usize>; 2],
        image: &mut [T],
        scratch: &mut GriddingScratch<T>,
    ) {
        let GriddingScratch {
            spectra,
            bands,
            works,
        } = scratch;
        let spectra = grown(spectra, self.spectra_len());
        let bands = grown(bands, self.bands_len());
        parallel::chunks(spectra, self.polar.half_len(), &|place, half| {
            works.with(Work::default, |work| {
                self.transform_row(fill, &self.polar.views[place], half, work)
            });
        });
        let spectra = &*spectra;
        parallel::chunks(bands, BAND * self.n[1], &|band, columns| {
            works.with(Work::default, |work| {
                self.spread_band(spectra, band, columns, work)
            });
        });
        let bands = &*bands;
        parallel::chunks(image, region[0].len(), &|y, row| {
            works.with(Work::default, |work| {
                self.image_row(bands, region[1].start + y, &region[0], row, work)
            });
        });
    }

    /// Computes the image, `[y][x]`, of rows `[view][bin]`: the transpose of [`Self::project`].
    pub(crate) fn project_back(
        &self,
        rows: &[T],
        image: &mut [T],
        scratch: &mut GriddingScratch<T>,
    ) {
        let fill = |view: usize, row: &mut [T]| {
            row.copy_from_slice(&rows[view * self.n_bins..][..self.n_bins]);
            true
        };
        self.back_project(&fill, &self.n.map(|n| 0..n), image, scratch);
    }

    /// Half the spectrum of a row, about the image's reference pixel.
    fn transform_row(
        &self,
        fill: &(dyn Fn(usize, &mut [T]) -> bool + Sync),
        view: &PolarView,
        half: &mut [Complex<T>],
        work: &mut Work<T>,
    ) {
        simd_set::unit(self.polar.views.len() + self.n_columns().div_ceil(BAND));
        let row = grown(&mut work.row, self.polar.row_len);
        if !fill(view.view, &mut row[..self.n_bins]) {
            half.fill(Complex::default());
            return;
        }
        row[self.n_bins..].fill(T::ZERO);
        let fft = grown(&mut work.fft, self.fft_len());
        let done = self.row.0.process_with_scratch(row, half, fft);
        debug_assert!(done.is_ok());
        for (value, phase) in half.iter_mut().zip(turns(view.turn)) {
            *value = *value * Complex::new(T::of(phase.re), T::of(phase.im));
            if view.conjugate {
                *value = value.conj();
            }
        }
    }

    /// The phase of a replica's first frequency.
    fn factor(&self, view: &PolarView, replica: usize) -> Complex<T> {
        let phase = Complex::cis(-view.turn * self.polar.first(replica) as f64);
        let im = if view.conjugate { -phase.im } else { phase.im };
        Complex::new(T::of(phase.re), T::of(im))
    }

    /// Returns the path of a segment through the columns of a band, the first of which is `first`.
    fn path(&self, segment: &Segment, first: i64) -> RayPath {
        let period = (self.polar.cells[1] as i64) << DIGITS;
        // The first of the cells over which a sample is spread.
        let shift = (2 - self.taps.width as i64) << (DIGITS - 1);
        RayPath {
            at: [
                segment.at[0] + shift - (first << DIGITS),
                (segment.at[1] + shift).rem_euclid(period),
            ],
            step: [segment.step[0], segment.step[1].rem_euclid(period)],
            period,
            stride: self.stride(),
            mirrored: segment.mirrored,
        }
    }

    /// Spreads all samples over a band and transforms its columns.
    fn spread_band(
        &self,
        spectra: &[Complex<T>],
        band: usize,
        columns: &mut [Complex<T>],
        work: &mut Work<T>,
    ) {
        simd_set::unit(self.polar.views.len() + self.n_columns().div_ceil(BAND));
        let cells = grown(&mut work.cells, self.cells_len());
        cells.fill(Complex::default());
        let [first, end] = [band, band + 1].map(|b| (b * BAND) as i64);
        let half_width = (self.taps.width as i64) << (DIGITS - 1);
        // Samples whose cells reach into the band.
        let reach = (first << DIGITS) - half_width..((end - 1) << DIGITS) + half_width;
        let reach = Columns {
            samples: reach.clone(),
            mirrored: reach,
        };
        let margin = LANES / 2;
        let mut any = false;
        let halves = spectra.chunks_exact(self.polar.half_len());
        for (view, half) in self.polar.views.iter().zip(halves) {
            self.polar.segments(view, &reach, |segment| {
                any = true;
                let gains = &self.gains[segment.replica][segment.samples.clone()];
                let samples = &half[segment.samples.clone()];
                let path = self.path(&segment, first - margin as i64);
                let values = (samples, gains, self.factor(view, segment.replica));
                T::spread(self.instructions, &self.taps, &path, values, cells);
            });
        }
        if !any {
            columns.fill(Complex::default());
            return;
        }
        let (stride, n_cells) = (self.stride(), self.polar.cells[1]);
        let fft = grown(&mut work.fft, self.fft_len());
        let cells = &mut cells[margin * stride..][..BAND * stride];
        for column in cells.chunks_exact_mut(stride) {
            let (column, behind) = column.split_at_mut(n_cells);
            for (cell, value) in column.iter_mut().zip(&behind[..margin]) {
                *cell = *cell + value;
            }
            self.along_y.1.process_with_scratch(column, fft);
        }
        for (y, columns) in columns.as_chunks_mut::<BAND>().0.iter_mut().enumerate() {
            let y = self.place(1, y);
            for (value, column) in columns.iter_mut().zip(cells.chunks_exact(stride)) {
                *value = column[y];
            }
        }
    }

    /// Returns the position of a pixel in a transform, whose first sample is the reference pixel.
    fn place(&self, axis: usize, pixel: usize) -> usize {
        let (n, cells) = (self.n[axis], self.polar.cells[axis]);
        (pixel + cells - n / 2) % cells
    }

    /// Computes a row of the image from its spectrum along x.
    fn image_row(
        &self,
        bands: &[Complex<T>],
        y: usize,
        x: &Range<usize>,
        out: &mut [T],
        work: &mut Work<T>,
    ) {
        let spectrum = grown(&mut work.spectrum, self.n_columns());
        for (columns, band) in spectrum
            .chunks_mut(BAND)
            .zip(bands.chunks_exact(BAND * self.n[1]))
        {
            columns.copy_from_slice(&band[y * BAND..][..columns.len()]);
        }
        real_ends(spectrum);
        let row = grown(&mut work.row, self.polar.cells[0]);
        let fft = grown(&mut work.fft, self.fft_len());
        let done = self.along_x.1.process_with_scratch(spectrum, row, fft);
        debug_assert!(done.is_ok());
        let inverse_y = self.inverse[1][y];
        // Pixels to the left of the reference pixel are at the end.
        let middle = (self.n[0] / 2).clamp(x.start, x.end);
        let (left, right) = out.split_at_mut(middle - x.start);
        for (out, x) in [(left, x.start..middle), (right, middle..x.end)] {
            let Some(first) = x.clone().next() else {
                continue;
            };
            let values = &row[self.place(0, first)..];
            for ((out, value), inverse) in out.iter_mut().zip(values).zip(&self.inverse[0][x]) {
                *out = *value * *inverse * inverse_y;
            }
        }
    }
}

/// Rejects tolerances below single precision and above a useful approximation.
pub(crate) fn check_tolerance(tolerance: f64) -> Result<(), RadonError> {
    within("tolerance", tolerance, 1e-6, 1e-2)
}

/// Makes the ends of a real row's spectrum real.
fn real_ends<T: Sample>(spectrum: &mut [Complex<T>]) {
    if let [first, .., last] = spectrum {
        first.im = T::ZERO;
        last.im = T::ZERO;
    }
}

/// Returns the period of a row in samples: long enough that no pixel reads the next copy.
fn row_period(geometry: &ParallelGeometry, grid: &ImageGrid) -> Result<usize, RadonError> {
    let corners =
        [0, grid.nx() - 1].map(|ix| [0, grid.ny() - 1].map(|iy| grid.pixel_centre(ix, iy)));
    let corners = corners.iter().flatten().map(|[x, y]| x.hypot(*y));
    let farthest = corners.fold(0.0, f64::max) + geometry.offset().abs();
    let n = geometry.n_bins() as f64;
    let least = (n / 2.0 + farthest / geometry.pitch() + 2.0).max(n + 2.0);
    within("row of a Fourier method", least, 0.0, f64::from(1 << 23))?;
    padded_len(least.ceil() as usize)
}

//! Options of an FBP plan, and the report of a run.

use std::ops::Range;

use crate::filter::Window;
use crate::geometry::ArcPolicy;
use crate::simd::InstructionSet;

/// Options of [`FbpPlan`](crate::FbpPlan); `Default` is the Ram-Lak filter at full cutoff with linear
/// interpolation, the default variants of the enums below, the whole grid, and the widest instruction set.
///
/// ```
/// use radon::{FbpOptions, FbpPlan, ImageGrid, Interpolation, ParallelGeometry, Window};
/// // A smoother image, of its middle alone.
/// let options = FbpOptions::default()
///     .with_window(Window::Hann)
///     .with_cutoff(0.8)
///     .with_interpolation(Interpolation::BandLimited)
///     .with_region(24..40, 16..48);
/// let geometry = ParallelGeometry::half_turn(90, 64, 0.1)?;
/// let plan = FbpPlan::<f32>::new(&geometry, &ImageGrid::square(64, 0.1)?, &options)?;
/// assert_eq!(plan.image_len(), 16 * 32);
/// # Ok::<(), radon::RadonError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct FbpOptions {
    /// Whether rows are filtered. Without, window, cutoff and edge are not used and rows are back-projected as they are:
    /// `f(x, y) = sum_v w_v p_v(x cos theta_v + y sin theta_v)`, for rows filtered elsewhere or the unfiltered image.
    pub ramp: bool,
    /// Apodising window of the ramp filter.
    pub window: Window,
    /// Cutoff as a fraction of the Nyquist frequency `1/(2 pitch)`, in `(0, 1]`.
    pub cutoff: f64,
    /// Interpolation of filtered rows between bin centres.
    pub interpolation: Interpolation,
    /// Extrapolation beyond the ends of a row.
    pub edge: EdgePolicy,
    /// Treatment of directions that no view measured.
    pub arc: ArcPolicy,
    /// Pixels to reconstruct: `(x, y)` index ranges of the grid; `None` for all. With the same method the result is bitwise identical to
    /// that part of the whole image.
    pub region: Option<(Range<usize>, Range<usize>)>,
    /// Method of summation over the views.
    pub method: FbpMethod,
    /// Instruction set of the kernels; `None` for the widest available one. Not stored by `serde`.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub instructions: Option<InstructionSet>,
    /// Memory limit of the work arrays of a run, in bytes; 512 MiB by default. A smaller budget costs time; one below the smallest slab, which
    /// grows with the number of threads, is an error. It does not affect results.
    pub memory: usize,
}

impl Default for FbpOptions {
    fn default() -> Self {
        Self {
            ramp: true,
            window: Window::RamLak,
            cutoff: 1.0,
            interpolation: Interpolation::Linear,
            edge: EdgePolicy::Zero,
            arc: ArcPolicy::Complete,
            region: None,
            method: FbpMethod::Auto,
            instructions: None,
            memory: 512 << 20,
        }
    }
}

impl FbpOptions {
    /// Restricts the reconstruction to the pixels of these index ranges.
    #[must_use]
    pub fn with_region(mut self, x: Range<usize>, y: Range<usize>) -> Self {
        self.region = Some((x, y));
        self
    }

    setters! {
        /// Sets whether rows are filtered.
        with_ramp(ramp: bool);
        /// Sets the window.
        with_window(window: Window);
        /// Sets the cutoff, a fraction of the Nyquist frequency.
        with_cutoff(cutoff: f64);
        /// Sets the interpolation of filtered rows between bin centres.
        with_interpolation(interpolation: Interpolation);
        /// Sets the extrapolation beyond the ends of a row.
        with_edge(edge: EdgePolicy);
        /// Sets the treatment of missing directions.
        with_arc(arc: ArcPolicy);
        /// Sets the method of back-projection.
        with_method(method: FbpMethod);
        /// Sets the instruction set.
        with_instructions(instructions: InstructionSet);
        /// Sets the memory budget of work arrays, in bytes.
        with_memory(memory: usize);
    }
}

/// The method of summation of filtered rows over the views.
///
/// The two methods compute the same sum with two differences. The Fourier method keeps only the first lobe of the response of linear
/// interpolation, up to the sampling frequency 1/pitch (half of it with [`Interpolation::BandLimited`]), and it spreads samples over a
/// grid to a `tolerance`. Root mean square difference of the two images within the field of view less one pixel, for the Shepp-Logan phantom
/// (values 0 to 1) from exact bin averages; in the outermost pixel the images differ by up to 0.023:
///
/// | interpolation, window | 128 x 128, 180 views | 256 x 256, 360 views |
/// | --- | --- | --- |
/// | linear, Ram-Lak | 2.8e-3 | 1.8e-3 |
/// | linear, Hann | 1.1e-3 | 6.2e-4 |
/// | band-limited, Ram-Lak | 9.3e-4 (1.2e-3 with `EdgePolicy::Ellipse`) | 6.0e-4 (8.0e-4) |
/// | band-limited, Hann | 2.7e-4 | 1.4e-4 |
///
/// The errors of the two images against the phantom agree to 1 %: 2.9e-2 and 2.0e-2 in the first row.
///
/// | | one slice of N x N from V views | work arrays |
/// | --- | --- | --- |
/// | `Direct` | N^2 V updates | some rows, [`FbpOptions::memory`] |
/// | `Fourier` | V rows of N log N, 1.25 N V samples spread, (2 N)^2 log N | 10 N V + 16 N^2 bytes (`f32`), about twice the data |
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
#[non_exhaustive]
pub enum FbpMethod {
    /// The sum over views, pixel by pixel: for small images and parts of images, and for stacks of small slices.
    Direct,
    /// Fourier transforms, one slice at a time: for large images.
    Fourier {
        /// L2 error of gridding, relative to the norm of the whole image of the grid; between 1e-6 and 1e-2. Rounding in single precision
        /// adds about 1e-6.
        ///
        /// Condition: the object lies within the field of view, that is within the grid and within the rows. The error scales with all data, the
        /// norm only with the content of the grid: for a disc beside a grid of 16 x 16 pixels the error was 50 times the tolerance.
        tolerance: f64,
    },
    /// `Fourier` to [`AUTO_TOLERANCE`](Self::AUTO_TOLERANCE) if it is expected to be faster than `Direct` and needs at most 256 MiB (work
    /// arrays and one slice of data), else `Direct`. With as many views as pixels per side, the crossover is at about 314 x 314 pixels
    /// (`f32`) or 432 x 432 pixels (`f64`).
    ///
    /// The choice depends only on the sizes of image and sinogram, the interpolation and the sample type; it is the same on every machine
    /// and for any [`FbpOptions::memory`]; [`FbpPlan::method`](crate::FbpPlan::method) returns it. A run whose budget is below the
    /// requirement of the method returns [`RadonError::BudgetTooSmall`](crate::RadonError::BudgetTooSmall).
    #[default]
    Auto,
}

impl FbpMethod {
    /// Tolerance of the Fourier method with [`FbpMethod::Auto`]: far below the errors of linear interpolation and sampling.
    pub const AUTO_TOLERANCE: f64 = 1e-4;
}

/// Interpolation of filtered rows between bin centres.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
#[non_exhaustive]
pub enum Interpolation {
    /// Linear interpolation between bins: robust, with a slight low-pass effect.
    #[default]
    Linear,
    /// Upsampling of rows by 8 in the Fourier domain, then linear interpolation: close to ideal interpolation of a band-limited row.
    BandLimited,
}

impl Interpolation {
    /// Samples of a filtered row per detector bin.
    pub(crate) fn upsampling(self) -> usize {
        match self {
            Interpolation::Linear => 1,
            Interpolation::BandLimited => 8,
        }
    }
}

/// Extrapolation of rows beyond their ends before filtering.
///
/// Truncated rows do not determine the image; a policy trades one bias for another. Mean error over the inner 70 % of the radius of the field of
/// view, without pixels at outlines, for bodies of value 1 (180 views, rows of 128 chords at the centres of bins; lengths in half rows). The
/// centres of the bodies are 0.11 off the axis if not stated otherwise:
///
/// | body | `Zero` | `Ellipse` |
/// | --- | --- | --- |
/// | disc, radius 1.2 | +0.076 | -0.001 |
/// | disc, radius 1.5 | +0.248 | -0.001 |
/// | disc, radius 2 | +0.581 | -0.001 |
/// | disc, radius 3 | +1.290 | +0.011 |
/// | disc, radius 1.5, 0.57 off the axis | +0.245 | -0.023 |
/// | ellipse, half axes 2 and 0.6 | +0.097 | -0.000 |
/// | disc, radius 1.5, with a heart of value 4 | +0.253 | -0.001 |
/// | disc, radius 1.5, of value 1/2 but for its rim | +0.185 | -0.030 |
/// | disc, radius 1.5, with a spot of value 3 across the end | +0.268 | -0.071 |
///
/// Noise of 2 % of the largest chord moves these by less than 0.006 (by 0.05 for the disc of radius 3). The policies are equal where rows end in
/// zeros. Cost: with `Ellipse` the rows are padded to twice the length, and the image is not linear in the data.
///
/// ```
/// use radon::{BinSampling, EdgePolicy, FbpOptions, FbpPlan, ImageGrid, ParallelGeometry, Phantom2, Shape2};
/// let geometry = ParallelGeometry::half_turn(90, 64, 0.1)?; // 6.4 wide
/// let torso = Phantom2::new([(1.0, Shape2::ellipse([0.2, 0.0], [6.0, 4.0], 0.0)?)])?;
/// let sinogram: Vec<f64> = torso.sinogram(&geometry, BinSampling::Mean)?;
/// let options = FbpOptions::default().with_edge(EdgePolicy::Ellipse);
/// let image = FbpPlan::new(&geometry, &ImageGrid::square(64, 0.1)?, &options)?.reconstruct(&sinogram)?;
/// assert!((image[32 * 64 + 32] - 1.0).abs() < 0.01);
/// # Ok::<(), radon::RadonError>(())
/// ```
#[doc(alias = "truncation correction")]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
#[non_exhaustive]
pub enum EdgePolicy {
    /// Zeros: exact if the object is within the field of view.
    #[default]
    Zero,
    /// Each end continued by the ellipse about the middle of the row that fits its last eighth: for a body wider than the field of view.
    /// Exact, except for sampling, for one centred homogeneous ellipse that ends within a row's length. This is the water cylinder of Hsieh
    /// et al. 2004, doi:10.1118/1.1776673, for a centred body of unknown value.
    Ellipse,
}

/// Slices of a run, reconstructed and skipped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct FbpReport {
    /// Slices that were back-projected.
    pub slices_reconstructed: usize,
    /// Slices without signal, filled with zeros.
    pub slices_skipped: usize,
}

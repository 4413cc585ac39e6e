//! Geometry of rays, bins and pixels by their centres: one definition for projectors, filters and FBP.

use std::f64::consts::PI;

use crate::error::{RadonError, at_least, finite, positive, product, room, zeros};

/// Largest number of turns of an arc, and of the angles of [`ParallelGeometry::new`]. More are probably in the wrong unit.
pub(crate) const MOST_TURNS: f64 = 2.0;

/// Parallel-beam acquisition: a list of view angles and a row of detector bins.
///
/// The rays of view `v` at angle `theta` run along `(-sin theta, cos theta)`; its bins lie along `(cos theta, sin theta)`. The
/// centre of bin `k` of `n` is at
///
/// ```text
/// s_k = (k - (n - 1)/2) * pitch + offset        (the same length unit as the image grid, cm by convention)
/// ```
///
/// measured from the axis of rotation, which is the origin of the image plane. A sinogram is `[view][bin]`, bin fastest.
///
/// ```
/// # use radon::ParallelGeometry;
/// let geometry = ParallelGeometry::half_turn(90, 256, 0.0625)?; // 90 views over pi, 256 bins 0.0625 apart
/// assert_eq!(geometry.bin_centre(0), -127.5 * 0.0625);
/// assert_eq!(geometry.sinogram_len(), 90 * 256);
/// // The same views, with angles in degrees.
/// let angles: Vec<f64> = (0..90).map(|k| 2.0 * f64::from(k)).collect();
/// let listed = ParallelGeometry::from_degrees(&angles, 256, 0.0625)?;
/// assert!((listed.angles()[45] - geometry.angles()[45]).abs() < 1e-15);
/// assert!(ParallelGeometry::new(angles, 256, 0.0625).is_err()); // 28 turns: angles in degrees
/// # Ok::<(), radon::RadonError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct ParallelGeometry {
    angles: Vec<f64>,
    n_bins: usize,
    pitch: f64,
    offset: f64,
}

impl ParallelGeometry {
    /// Views at `angles` in radians (in any order, repeated or not), `n_bins` bins `pitch` apart, centred on the axis. They span at most
    /// two turns; three or more whole numbers at most half a turn, multiples of 1/32 (2.5, 5.625) at most one turn, so
    /// that most lists in degrees are rejected; [`from_radians`](Self::from_radians) has no limit.
    ///
    /// # Errors
    /// As [`from_radians`](Self::from_radians); [`RadonError::LikeDegrees`] beyond these limits.
    pub fn new(angles: impl Into<Vec<f64>>, n_bins: usize, pitch: f64) -> Result<Self, RadonError> {
        let geometry = Self::from_radians(angles, n_bins, pitch)?;
        let ends = [f64::INFINITY, f64::NEG_INFINITY];
        let (n_views, mut angles) = (geometry.n_views(), geometry.angles.iter());
        let [first, last] =
            (angles.clone()).fold(ends, |[low, high], &a| [low.min(a), high.max(a)]);
        let arc = last - first; // has the rounding errors of angles, hence 1e-9
        let parts = if arc > 2.0 * PI { 32.0 } else { 1.0 };
        let whole = n_views > 2 && arc > PI && angles.all(|a| (a * parts).fract() == 0.0);
        if whole || arc > MOST_TURNS * 2.0 * PI * (1.0 + 1e-9) {
            return Err(RadonError::LikeDegrees { n_views, arc });
        }
        Ok(geometry)
    }

    /// As [`new`](Self::new), with angles over any number of turns, such as those of a golden-angle or a helical acquisition.
    ///
    /// # Errors
    /// No view, no bin, an angle or pitch that is NaN or infinite, `pitch <= 0`, sizes beyond the address space.
    #[doc(alias("golden angle", "helical"))]
    pub fn from_radians(
        angles: impl Into<Vec<f64>>,
        n_bins: usize,
        pitch: f64,
    ) -> Result<Self, RadonError> {
        let angles = angles.into();
        for &angle in &angles {
            finite("angle", angle)?;
        }
        at_least("n_views", angles.len(), 1)?;
        at_least("n_bins", n_bins, 1)?;
        positive("pitch", pitch)?;
        product("sinogram", angles.len(), n_bins)?;
        finite("n_bins * pitch", n_bins as f64 * pitch)?;
        Ok(Self {
            angles,
            n_bins,
            pitch,
            offset: 0.0,
        })
    }

    /// As [`from_radians`](Self::from_radians), with the angles in degrees.
    ///
    /// # Errors
    /// As [`from_radians`](Self::from_radians).
    pub fn from_degrees(angles: &[f64], n_bins: usize, pitch: f64) -> Result<Self, RadonError> {
        let radians: Vec<f64> = angles.iter().map(|angle| angle.to_radians()).collect();
        Self::from_radians(radians, n_bins, pitch)
    }

    /// View `k` of `n_views` at `k * pi / n_views`: every line once. The number of views precedes that of bins, as in the sinogram
    /// `[view][bin]`; exchanged numbers have the same product and are not detected.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn half_turn(n_views: usize, n_bins: usize, pitch: f64) -> Result<Self, RadonError> {
        Self::arc_radians(n_views, PI, n_bins, pitch)
    }

    /// View `k` of `n_views` at `k * 2 pi / n_views`: every line from both sides.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn full_turn(n_views: usize, n_bins: usize, pitch: f64) -> Result<Self, RadonError> {
        Self::arc_radians(n_views, 2.0 * PI, n_bins, pitch)
    }

    /// View `k` of `n_views` at `k * arc / n_views`, `arc` in radians.
    ///
    /// # Errors
    /// As [`from_radians`](Self::from_radians); an `arc` that is not finite and greater than zero; [`RadonError::LongArc`] beyond two
    /// turns.
    pub fn arc_radians(
        n_views: usize,
        arc: f64,
        n_bins: usize,
        pitch: f64,
    ) -> Result<Self, RadonError> {
        let turns = positive("arc", arc)? / (2.0 * PI);
        if turns > MOST_TURNS * (1.0 + f64::EPSILON) {
            let most = MOST_TURNS;
            return Err(RadonError::LongArc { arc, turns, most });
        }
        product("sinogram", n_views, n_bins)?;
        let mut angles = zeros("angles", n_views, 1)?;
        for (k, angle) in angles.iter_mut().enumerate() {
            *angle = k as f64 * arc / n_views as f64;
        }
        Self::from_radians(angles, n_bins, pitch)
    }

    /// The same views with every bin centre moved by `offset` (a length, towards larger bins).
    ///
    /// # Errors
    /// An `offset` that is NaN or infinite.
    pub fn with_offset(mut self, offset: f64) -> Result<Self, RadonError> {
        self.offset = finite("offset", offset)?;
        Ok(self)
    }

    /// The same views with the axis of rotation projected onto the (fractional) bin index `bin`, inside the row or not.
    ///
    /// # Errors
    /// A `bin` that is NaN or infinite.
    pub fn with_rotation_bin(self, bin: f64) -> Result<Self, RadonError> {
        finite("rotation bin", bin)?;
        let offset = ((self.n_bins - 1) as f64 / 2.0 - bin) * self.pitch;
        self.with_offset(offset)
    }

    /// Number of views.
    #[must_use]
    pub fn n_views(&self) -> usize {
        self.angles.len()
    }

    /// Angle of each view, radians.
    #[must_use]
    pub fn angles(&self) -> &[f64] {
        &self.angles
    }

    /// Number of bins in a view.
    #[must_use]
    pub fn n_bins(&self) -> usize {
        self.n_bins
    }

    /// Distance between neighbouring bin centres.
    #[must_use]
    pub fn pitch(&self) -> f64 {
        self.pitch
    }

    /// Shift of the middle of the row from the axis of rotation.
    #[must_use]
    pub fn offset(&self) -> f64 {
        self.offset
    }

    /// Position of the centre of bin `bin_idx` along `(cos theta, sin theta)`.
    #[must_use]
    pub fn bin_centre(&self, bin_idx: usize) -> f64 {
        (bin_idx as f64 - (self.n_bins - 1) as f64 / 2.0) * self.pitch + self.offset
    }

    /// Fractional bin index of position `s`; the inverse of [`bin_centre`](Self::bin_centre).
    #[must_use]
    pub fn bin_at(&self, s: f64) -> f64 {
        (s - self.offset) / self.pitch + (self.n_bins - 1) as f64 / 2.0
    }

    /// Number of samples of one sinogram, `n_views * n_bins`.
    #[must_use]
    pub fn sinogram_len(&self) -> usize {
        self.angles.len() * self.n_bins
    }

    /// Weight of each view in the integral over directions, by the trapezoidal rule on the circle of directions modulo pi.
    ///
    /// Opposite views measure the same lines, so angles are folded into `[0, pi)`, sorted, and each distinct direction gets half the
    /// distance to its two neighbours; views that share a direction (to 1e-9 rad) share its weight. Uniform half and full turns thus get
    /// `pi / n_views`; non-uniform, repeated and over-complete lists need no special case. [`ArcPolicy`] defines the treatment of an
    /// unmeasured wedge. Cost: a sort.
    ///
    /// ```
    /// # use radon::{ArcPolicy, ParallelGeometry};
    /// let repeated = ParallelGeometry::new([0.0, 0.5, 0.5, 1.0, 2.0], 8, 1.0)?;
    /// let weights = repeated.view_weights(ArcPolicy::Complete)?;
    /// assert_eq!(weights[1], 0.25); // two views share (1.0 - 0.0)/2
    /// # Ok::<(), radon::RadonError>(())
    /// ```
    ///
    /// # Errors
    /// [`RadonError::ShortArc`] under [`ArcPolicy::Complete`]; [`RadonError::TooLarge`] if the views exceed the memory.
    pub fn view_weights(&self, policy: ArcPolicy) -> Result<Vec<f64>, RadonError> {
        const SAME: f64 = 1e-9;
        // All lists below: eight numbers per view.
        drop(room::<[f64; 8]>("view weights", self.angles.len(), 1)?);
        let folded: Vec<f64> = self.angles.iter().map(|a| a.rem_euclid(PI) % PI).collect();
        let mut order: Vec<usize> = (0..folded.len()).collect();
        order.sort_unstable_by(|&a, &b| folded[a].total_cmp(&folded[b]));

        // Distinct directions, the views at each, and the direction of each view.
        let mut directions = Vec::with_capacity(folded.len());
        let mut counts = Vec::with_capacity(folded.len());
        let mut direction_of = vec![0; folded.len()];
        for view in order {
            match (directions.last(), counts.last_mut()) {
                (Some(direction), Some(count)) if folded[view] - direction <= SAME => *count += 1,
                _ => {
                    directions.push(folded[view]);
                    counts.push(1);
                }
            }
            direction_of[view] = directions.len() - 1;
        }
        if let [first, .., last] = directions[..]
            && first + PI - last <= SAME
        {
            // A direction just below pi equals the one just above zero.
            directions.pop();
            counts[0] += counts.pop().unwrap_or(0);
        }

        let n = directions.len();
        // gap[i]: from direction i to the next one on the circle; they sum to pi.
        let mut gap: Vec<f64> = (0..n)
            .map(|i| {
                if i + 1 < n {
                    directions[i + 1] - directions[i]
                } else {
                    directions[0] + PI - directions[i]
                }
            })
            .collect();
        let widest = (0..n).fold(0, |best, i| if gap[i] > gap[best] { i } else { best });
        let measured = PI - gap[widest];
        let mut scale = 1.0;
        if n > 1 {
            match policy {
                ArcPolicy::Complete => {
                    let ratio = gap[widest] / (measured / (n - 1) as f64);
                    if ratio > COMPLETE_RATIO {
                        let furthest = self.angles.iter().fold(0.0, |m: f64, a| m.max(a.abs()));
                        return Err(RadonError::ShortArc {
                            gap: gap[widest],
                            ratio,
                            most: COMPLETE_RATIO,
                            furthest,
                        });
                    }
                }
                ArcPolicy::Extend => {}
                ArcPolicy::Truncate | ArcPolicy::Rescale => {
                    // Each end view represents its inner half gap on both sides.
                    let ends = gap[(widest + 1) % n].min(gap[widest])
                        + gap[(widest + n - 1) % n].min(gap[widest]);
                    gap[widest] = (ends / 2.0).min(gap[widest]);
                    if policy == ArcPolicy::Rescale {
                        scale = PI / (measured + gap[widest]);
                    }
                }
            }
        }
        let mut weights = vec![0.0; folded.len()];
        for (weight, direction) in weights.iter_mut().zip(direction_of) {
            // A direction just below pi is the first one.
            let i = direction % n;
            let whole = scale * (gap[i] + gap[(i + n - 1) % n]) / 2.0;
            *weight = whole / counts[i] as f64;
        }
        Ok(weights)
    }
}

/// Treatment of a wedge of directions that no view measures.
#[doc(alias = "limited angle")]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
#[non_exhaustive]
pub enum ArcPolicy {
    /// Return an error if the largest gap between neighbouring directions exceeds four times the average of the others. A golden-angle
    /// series has at most 2.7 times the average, a uniform one 1, random directions may exceed it. A single view is complete.
    #[default]
    Complete,
    /// Extend the views on either side of a gap over all of it: weights sum to pi.
    Extend,
    /// Omit the widest gap: the unmeasured wedge counts as zero. The first and the last view of the measured arc have the gap to their only
    /// neighbour as their weight; weights sum to the arc and half of these two gaps.
    Truncate,
    /// As `Truncate`, then scale all weights so that they sum to pi, which preserves the mean of the image.
    Rescale,
}

/// Largest gap that [`ArcPolicy::Complete`] accepts, relative to the average of the other gaps.
const COMPLETE_RATIO: f64 = 4.0;

/// A rectangular grid of pixels in the image plane.
///
/// The centre of pixel `(ix, iy)` is at `centre + (dx * (ix - (nx-1)/2), dy * (iy - (ny-1)/2))` with `[dx, dy]` the
/// [`spacing`](Self::spacing); an image is `[y][x]`, x fastest; a stack of them `[slice][y][x]`.
///
/// ```
/// # use radon::ImageGrid;
/// let grid = ImageGrid::new(4, 3, 0.5)?.with_centre([1.0, 0.0])?;
/// assert_eq!(grid.pixel_centre(0, 1), [0.25, 0.0]);
/// let flat = ImageGrid::anisotropic(4, 3, [0.5, 2.0])?;
/// assert_eq!(flat.pixel_centre(0, 0), [-0.75, -2.0]);
/// # Ok::<(), radon::RadonError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImageGrid {
    nx: usize,
    ny: usize,
    spacing: [f64; 2],
    centre: [f64; 2],
}

impl ImageGrid {
    /// `nx` by `ny` square pixels, `spacing` apart, centred on the axis of rotation.
    ///
    /// # Errors
    /// A size of zero, a `spacing` that is not finite and greater than zero, sizes beyond the address space.
    pub fn new(nx: usize, ny: usize, spacing: f64) -> Result<Self, RadonError> {
        Self::anisotropic(nx, ny, [spacing; 2])
    }

    /// `nx` by `ny` pixels, `spacing[0]` apart along x and `spacing[1]` along y, centred on the axis of rotation.
    ///
    /// # Errors
    /// As [`new`](Self::new), for either spacing.
    pub fn anisotropic(nx: usize, ny: usize, spacing: [f64; 2]) -> Result<Self, RadonError> {
        at_least("nx", nx, 1)?;
        at_least("ny", ny, 1)?;
        product("image", nx, ny)?;
        for (n, spacing) in [nx, ny].into_iter().zip(spacing) {
            positive("spacing", spacing)?;
            finite("extent", n as f64 * spacing)?;
        }
        Ok(Self {
            nx,
            ny,
            spacing,
            centre: [0.0; 2],
        })
    }

    /// `n` by `n` square pixels, `spacing` apart, centred on the axis of rotation.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn square(n: usize, spacing: f64) -> Result<Self, RadonError> {
        Self::new(n, n, spacing)
    }

    /// The same grid with its middle at `centre`.
    ///
    /// # Errors
    /// A coordinate that is NaN or infinite.
    pub fn with_centre(mut self, centre: [f64; 2]) -> Result<Self, RadonError> {
        self.centre = [
            finite("centre x", centre[0])?,
            finite("centre y", centre[1])?,
        ];
        Ok(self)
    }

    /// Pixels in a row.
    #[must_use]
    pub fn nx(&self) -> usize {
        self.nx
    }

    /// Rows.
    #[must_use]
    pub fn ny(&self) -> usize {
        self.ny
    }

    /// Distance between neighbouring pixel centres along x and along y.
    #[must_use]
    pub fn spacing(&self) -> [f64; 2] {
        self.spacing
    }

    /// Middle of the grid.
    #[must_use]
    pub fn centre(&self) -> [f64; 2] {
        self.centre
    }

    /// Number of pixels, `nx * ny`.
    #[must_use]
    pub fn image_len(&self) -> usize {
        self.nx * self.ny
    }

    /// Centre of pixel `(ix, iy)`.
    #[must_use]
    pub fn pixel_centre(&self, ix: usize, iy: usize) -> [f64; 2] {
        [
            (ix as f64 - (self.nx - 1) as f64 / 2.0) * self.spacing[0] + self.centre[0],
            (iy as f64 - (self.ny - 1) as f64 / 2.0) * self.spacing[1] + self.centre[1],
        ]
    }
}

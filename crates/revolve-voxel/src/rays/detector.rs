//! Parallel rays on a detector.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::error::{at_least, countable, finite, length, positive, zeros};
use crate::rays::chord::Hint;
use crate::rays::cone::Batch;
use crate::rays::direction::Direction;
use crate::rays::silhouette::Silhouette;
use crate::rays::slabs::for_slabs;
use crate::{Body, Ray, RayCounters, RevolveError, Sample};

/// A flat detector of a parallel beam that turns about the lab's z axis.
///
/// At view angle theta (radians) bins run along (cos theta, sin theta, 0), rows along z, rays along
/// (-sin theta, cos theta, 0). Centre of bin k of n: `(k - (n-1)/2) * pitch + offset`, rows alike.
/// Images are indexed `[row][bin]`, bin fastest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParallelDetector {
    n_bins: usize,
    n_rows: usize,
    pitch: [f64; 2],
    offset: [f64; 2],
}

impl ParallelDetector {
    /// A detector centred on the axis of turning; `pitch` is [bin, row].
    ///
    /// # Errors
    /// [`RevolveError::TooFew`] without a bin or a row; [`RevolveError::NotPositive`], [`RevolveError::NotFinite`],
    /// [`RevolveError::TooLarge`].
    pub fn new(n_bins: usize, n_rows: usize, pitch: [f64; 2]) -> Result<Self, RevolveError> {
        countable("rays of a view", &[n_bins, n_rows])?;
        positive("bin pitch", pitch[0])?;
        positive("row pitch", pitch[1])?;
        Ok(Self {
            n_bins,
            n_rows,
            pitch,
            offset: [0.0; 2],
        })
    }

    /// The same detector with its centre at `offset` = [along the bins, along z].
    ///
    /// # Errors
    /// [`RevolveError::NotFinite`].
    pub fn with_offset(mut self, offset: [f64; 2]) -> Result<Self, RevolveError> {
        finite("bin offset", offset[0])?;
        finite("row offset", offset[1])?;
        self.offset = offset;
        Ok(self)
    }

    /// Steps [bin, row].
    pub fn pitch(&self) -> [f64; 2] {
        self.pitch
    }

    /// Where the centre sits, [along the bins, along z].
    pub fn offset(&self) -> [f64; 2] {
        self.offset
    }

    /// Bins in a row.
    pub fn n_bins(&self) -> usize {
        self.n_bins
    }

    /// Rows.
    pub fn n_rows(&self) -> usize {
        self.n_rows
    }

    /// The rays of one view.
    ///
    /// # Errors
    /// [`RevolveError::NotFinite`].
    pub fn rays(&self, theta: f64) -> Result<ParallelRays, RevolveError> {
        finite("view angle", theta)?;
        let (sin, cos) = theta.sin_cos();
        let bins = Vector3::new(cos, sin, 0.0);
        let at = |a: usize, n: usize| self.offset[a] - 0.5 * (n as f64 - 1.0) * self.pitch[a];
        ParallelRays::new(
            [self.n_bins, self.n_rows],
            Point3::from(bins * at(0, self.n_bins) + Vector3::z() * at(1, self.n_rows)),
            bins * self.pitch[0],
            Vector3::z() * self.pitch[1],
            Vector3::new(-sin, cos, 0.0),
        )
    }
}

/// A raster of parallel rays in any position: ray (bin, row) passes through `first + bin * bin_step + row * row_step`.
///
/// What is projected along them is an image `[row][bin]`; of rays that planes cut into slabs ([`ParallelRays::with_planes`]) it is
/// `[row][slab][bin]`.
#[derive(Debug, Clone, PartialEq)]
pub struct ParallelRays {
    n_bins: usize,
    n_rows: usize,
    /// Rows of the raster before the first of these.
    first_row: usize,
    /// Bound of all coordinates, those of rows left out too.
    farthest: f64,
    first: Point3<f64>,
    bin_step: Vector3<f64>,
    row_step: Vector3<f64>,
    direction: Vector3<f64>,
    planes: Arc<[f64]>,
}

impl ParallelRays {
    /// A raster of `[n_bins, n_rows]` rays; the direction is normalised.
    ///
    /// # Errors
    /// [`RevolveError::NotPositive`] for a count of zero or a zero direction, [`RevolveError::NotFinite`] for a number or for the last
    /// ray's place, [`RevolveError::TooLarge`].
    pub fn new(
        [n_bins, n_rows]: [usize; 2],
        first: Point3<f64>,
        bin_step: Vector3<f64>,
        row_step: Vector3<f64>,
        direction: Vector3<f64>,
    ) -> Result<Self, RevolveError> {
        countable("rays of a view", &[n_bins, n_rows])?;
        for v in bin_step.iter().chain(row_step.iter()) {
            finite("step between rays", *v)?;
        }
        let direction = Ray::new(first, direction)?.direction();
        let mut farthest = 0.0f64;
        for k in 0..3 {
            let (bins, rows) = (bin_step[k].abs(), row_step[k].abs());
            let reach = first[k].abs() + bins * n_bins as f64 + rows * n_rows as f64;
            farthest = farthest.max(finite("place of the farthest ray", reach)?);
        }
        Ok(Self {
            n_bins,
            n_rows,
            first_row: 0,
            farthest,
            first,
            bin_step,
            row_step,
            direction,
            planes: Arc::default(),
        })
    }

    /// The same rays cut into slabs by planes across them, so that what lies at each depth can be told apart: plane `t` is `t` ahead of
    /// a ray's point of the raster. Slab 0 is all before the first plane, the last one all beyond the last plane.
    ///
    /// ```
    /// use revolve_voxel::{Body, Meridian, ParallelDetector, Pose};
    /// let rod = Meridian::new(&[[-1.0, 0.5], [1.0, 0.5]])?;
    /// let body = Body::new(vec![rod], Pose::axis_along_z(0.0)?)?;
    /// let rays = ParallelDetector::new(1, 1, [1.0, 1.0])?.rays(0.0)?; // along +y, through the rod from -1/2 to 1/2
    /// let (slabs, _) = body.project::<f64>(&rays.with_planes(&[-0.25, 0.125])?, &[1.0])?;
    /// assert_eq!(slabs, [0.25, 0.375, 0.375]);
    /// # Ok::<(), revolve_voxel::RevolveError>(())
    /// ```
    ///
    /// # Errors
    /// [`RevolveError::NotFinite`] for a plane; [`RevolveError::NotPositive`] unless each is beyond the one before;
    /// [`RevolveError::TooLarge`].
    pub fn with_planes(mut self, planes: &[f64]) -> Result<Self, RevolveError> {
        for plane in planes {
            finite("plane across the rays", *plane)?;
        }
        for pair in planes.windows(2) {
            positive("distance between planes", pair[1] - pair[0])?;
        }
        countable(
            "rays of a view",
            &[self.n_bins, self.n_rows, planes.len() + 1],
        )?;
        self.planes = planes.into();
        Ok(self)
    }

    /// Slabs into which planes cut the rays; 1 without any.
    pub fn n_slabs(&self) -> usize {
        self.planes.len() + 1
    }

    pub(crate) fn planes(&self) -> &[f64] {
        &self.planes
    }

    /// Samples of an image.
    pub(crate) fn image_len(&self) -> usize {
        self.n_rows * self.n_slabs() * self.n_bins
    }

    /// Bins in a row.
    pub fn n_bins(&self) -> usize {
        self.n_bins
    }

    /// Rows.
    pub fn n_rows(&self) -> usize {
        self.n_rows
    }

    /// Unit direction of the rays.
    pub fn direction(&self) -> Vector3<f64> {
        self.direction
    }

    /// Some rows of the raster: what is computed for them is, bit for bit, the cut from the whole.
    ///
    /// # Errors
    /// [`RevolveError::TooFew`] without a row; [`RevolveError::WrongLength`] for rows beyond the raster.
    pub fn rows(&self, rows: Range<usize>) -> Result<Self, RevolveError> {
        at_least("rows", rows.len(), 1)?;
        if rows.end > self.n_rows {
            return Err(RevolveError::WrongLength {
                what: "rows (at most)",
                expected: self.n_rows,
                given: rows.end,
            });
        }
        Ok(Self {
            first_row: self.first_row + rows.start,
            n_rows: rows.len(),
            ..self.clone()
        })
    }

    /// One ray; none beyond the raster.
    pub fn ray(&self, bin: usize, row: usize) -> Option<Ray> {
        (bin < self.n_bins && row < self.n_rows).then(|| self.line(bin, row))
    }

    /// The line of a ray of the raster.
    #[expect(clippy::expect_used, reason = "validated when the raster was made")]
    pub(crate) fn line(&self, bin: usize, row: usize) -> Ray {
        let row = (self.first_row + row) as f64;
        let origin = self.first + self.bin_step * bin as f64 + self.row_step * row;
        Ray::new(origin, self.direction).expect("finite raster")
    }
}

impl Body {
    /// Line integrals of the activity along the rays, `[row][bin]`.
    ///
    /// Rows are shared among the threads of the current rayon pool; the result does not depend on their number.
    ///
    /// # Errors
    /// [`RevolveError::WrongLength`] or [`RevolveError::NotFinite`] for the activities, [`RevolveError::TooLarge`] for the image.
    pub fn project<T: Sample>(
        &self,
        rays: &ParallelRays,
        activity: &[f64],
    ) -> Result<(Vec<T>, RayCounters), RevolveError> {
        let mut out = zeros("rays of a view", rays.image_len())?;
        let counters = self.project_add(rays, activity, 1.0, &mut out)?;
        Ok((out, counters))
    }

    /// Adds `weight` times the line integrals to an image: the building block of time averages.
    ///
    /// # Errors
    /// [`RevolveError::WrongLength`] for a wrong image or number of activities, [`RevolveError::NotFinite`].
    pub fn project_add<T: Sample>(
        &self,
        rays: &ParallelRays,
        activity: &[f64],
        weight: f64,
        out: &mut [T],
    ) -> Result<RayCounters, RevolveError> {
        self.project_measured(rays, activity, weight, out, |_| |low, high, _| high - low)
    }

    /// Adds `weight` times the activity's integral along the rays, where a stretch of a line counts what `measure` says.
    ///
    /// `measure(ray)` gives a function of the ends of a stretch and of the parameter of the ray's origin, all on one scale.
    pub(crate) fn project_measured<T: Sample, M: Fn(f64, f64, f64) -> f64>(
        &self,
        rays: &ParallelRays,
        activity: &[f64],
        weight: f64,
        out: &mut [T],
        measure: impl Fn([usize; 2]) -> M + Sync,
    ) -> Result<RayCounters, RevolveError> {
        let weights = self.weights(activity)?;
        finite("weight", weight)?;
        length("image", rays.image_len(), out.len())?;
        let pose = self.pose();
        let (first, d) = (
            pose.to_body(&rays.first),
            pose.vector_to_body(&rays.direction),
        );
        let steps = [
            pose.vector_to_body(&rays.bin_step),
            pose.vector_to_body(&rays.row_step),
        ];
        let farthest = pose.farthest(rays.farthest);
        let views: Vec<LayerView> = (0..self.layers().len())
            .filter(|&k| weights[k] != 0.0)
            .map(|k| {
                let direction = Direction::new(&self.layers()[k], farthest, &d);
                LayerView {
                    silhouette: Silhouette::new(&self.layers()[k], &direction),
                    layer: k,
                    weight: weight * weights[k],
                    first: direction.coordinates(&first),
                    bin: direction.slopes(&steps[0]),
                    row: direction.slopes(&steps[1]),
                    direction,
                }
            })
            .collect();
        let arch = pulp::Arch::new();
        let counters = out
            .par_chunks_mut(rays.n_slabs() * rays.n_bins)
            .enumerate()
            .map_init(Scratch::default, |scratch, (row, image)| {
                let at = (rays.first_row + row) as f64;
                arch.dispatch(Row {
                    body: self,
                    views: &views,
                    planes: rays.planes(),
                    at,
                    image,
                    scratch,
                    measure: |bin| measure([bin, row]),
                })
            })
            .reduce(RayCounters::default, |a, b| a + b);
        Ok(counters)
    }

    #[inline(always)]
    fn project_row<T: Sample, M: Fn(f64, f64, f64) -> f64>(
        &self,
        views: &[LayerView],
        planes: &[f64],
        row: f64,
        image: &mut [T],
        scratch: &mut Scratch,
        measure: impl Fn(usize) -> M,
    ) -> RayCounters {
        let n_bins = image.len() / (planes.len() + 1);
        let mut counters = RayCounters::default();
        let start = |view: &LayerView| [0, 1, 2].map(|k| view.first[k] + view.row[k] * row);
        let Scratch {
            bins,
            sums,
            cast,
            chords,
            hints,
            batch,
        } = scratch;
        bins.clear();
        bins.extend(views.iter().map(|view| {
            let [w0, q0, _] = start(view);
            let step = [view.bin[0], view.bin[1]];
            view.silhouette.bins([w0, q0], step, n_bins)
        }));
        // Only the bins that some layer's silhouette reaches.
        let used = (bins.iter().filter(|bins| !bins.is_empty()).cloned())
            .reduce(|a, b| a.start.min(b.start)..a.end.max(b.end))
            .unwrap_or(0..0);
        sums.clear();
        sums.resize((planes.len() + 1) * used.len(), 0.0);
        cast.clear();
        cast.resize(used.len(), false);
        for (view, bins) in views.iter().zip(bins) {
            let meridian = &self.layers()[view.layer];
            let [w0, q0, t0] = start(view);
            hints.clear();
            hints.resize(meridian.chains().len(), Hint::default());
            chords.clear();
            chords.resize(sums.len(), 0.0);
            let mut chords = Chords {
                of: &mut chords[..],
                bins: used.clone(),
                planes,
                origin: |bin: usize| t0 + bin as f64 * view.bin[2],
                measure: &measure,
            };
            for bin in bins.clone() {
                let (w, q) = (w0 + bin as f64 * view.bin[0], q0 + bin as f64 * view.bin[1]);
                if !view.silhouette.holds(w, q) {
                    continue;
                }
                cast[bin - used.start] = true;
                for (sign, faces) in view.direction.intervals(meridian, [w, q], hints) {
                    batch.push([w, q], &faces, (bin, sign));
                    if batch.is_full() {
                        chords.add(&view.direction, batch);
                    }
                }
            }
            chords.add(&view.direction, batch);
            for (sum, chord) in sums.iter_mut().zip(&*chords.of) {
                if *chord > 0.0 {
                    *sum += view.weight * chord;
                    counters.hit += 1;
                }
            }
        }
        counters.cast = cast.iter().filter(|&&c| c).count() as u64;
        for (slab, sums) in image.chunks_mut(n_bins).zip(sums.chunks(used.len().max(1))) {
            for (pixel, sum) in slab[used.clone()].iter_mut().zip(sums) {
                if *sum != 0.0 {
                    *pixel += T::from_f64(*sum);
                }
            }
        }
        counters.skipped = n_bins as u64 - counters.cast;
        counters
    }
}

/// The work of a row, compiled for each kind of processor.
struct Row<'a, T, F> {
    body: &'a Body,
    views: &'a [LayerView],
    planes: &'a [f64],
    at: f64,
    image: &'a mut [T],
    scratch: &'a mut Scratch,
    measure: F,
}

impl<T: Sample, M: Fn(f64, f64, f64) -> f64, F: Fn(usize) -> M> pulp::WithSimd for Row<'_, T, F> {
    type Output = RayCounters;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> RayCounters {
        let Self { views, planes, .. } = self;
        (self.body).project_row(
            views,
            planes,
            self.at,
            self.image,
            self.scratch,
            self.measure,
        )
    }
}

/// What a row needs while it is projected.
#[derive(Default)]
struct Scratch {
    /// Of each layer.
    bins: Vec<Range<usize>>,
    /// Of each bin: the sum (of each slab), whether a ray was cast, and the chord in one layer (again of each slab).
    sums: Vec<f64>,
    cast: Vec<bool>,
    chords: Vec<f64>,
    /// Of each chain, where it was met.
    hints: Vec<Hint>,
    batch: Batch<(usize, f64)>,
}

/// The sums of a row's chords, and what a stretch of each line counts.
struct Chords<'a, O, F> {
    /// `[slab][bin]`.
    of: &'a mut [f64],
    bins: Range<usize>,
    planes: &'a [f64],
    /// Parameter of a bin's origin.
    origin: O,
    measure: F,
}

impl<O: Fn(usize) -> f64, M: Fn(f64, f64, f64) -> f64, F: Fn(usize) -> M> Chords<'_, O, F> {
    /// Adds the intervals of some lines, each of a bin and with a sign.
    #[inline(always)]
    fn add(&mut self, direction: &Direction, batch: &mut Batch<(usize, f64)>) {
        for ((bin, sign), [entry, exit]) in batch.drain(direction) {
            let (measure, origin) = ((self.measure)(bin), (self.origin)(bin));
            let at = bin - self.bins.start;
            for_slabs(self.planes, origin, [entry, exit], |slab, [low, high]| {
                self.of[slab * self.bins.len() + at] += sign * measure(low, high, origin);
            });
        }
    }
}

/// A layer seen along one direction: (w, q, t) of the first ray and their steps.
struct LayerView {
    layer: usize,
    weight: f64,
    direction: Direction,
    silhouette: Silhouette,
    first: [f64; 3],
    bin: [f64; 3],
    row: [f64; 3],
}

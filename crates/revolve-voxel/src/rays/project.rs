//! Projections of bodies, and their implementation for rasters of parallel rays.

use std::ops::Range;

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::error::{finite, length, zeros};
use crate::rays::chord::Hint;
use crate::rays::cone::Batch;
use crate::rays::direction::Direction;
use crate::rays::silhouette::Silhouette;
use crate::rays::slabs::for_slabs;
use crate::{Body, Lines, Meridian, PointRaster, Pose, RayCounters, RevolveError, Sample};

/// Rays that a task projects at least; a smaller image is one task, because waking another thread would take a part of its time.
const TASK: usize = 1024;

impl Body {
    /// Returns the line integrals of the activity along the rays, `[row][bin]`. Parts of the body beside the rays are omitted without an error.
    ///
    /// A ray of a [`ParallelDetector`](crate::ParallelDetector) passes through the centre of a bin; a sample is not the mean over the bin. The
    /// sum of samples times the area of a bin therefore differs from the integral of the activity: for a wall of 0.5 cm around a spheroid of
    /// 3 x 2 cm, on a detector of 10 cm, by 1.2 % with 25 x 25 bins, 0.3 % with 50 x 50 and 0.01 % with 100 x 100.
    /// [`BinValue::Average`](crate::BinValue::Average) in a [`View`](crate::View) gives means over bins, as does the mean over finer bins.
    ///
    /// Rows are distributed over the threads of the current rayon pool; the result does not depend on their number.
    ///
    /// # Errors
    /// [`RevolveError::WrongLength`] or [`RevolveError::NotFinite`] for the activities, [`RevolveError::TooLarge`] for the image.
    pub fn project<T: Sample>(
        &self,
        rays: &Lines,
        activity: &[f64],
    ) -> Result<(Vec<T>, RayCounters), RevolveError> {
        let mut out = zeros("rays of a view", rays.image_len())?;
        let counters = self.project_add(rays, activity, 1.0, &mut out)?;
        Ok((out, counters))
    }

    /// Adds `weight` times the line integrals to an image, for time averages.
    ///
    /// # Errors
    /// [`RevolveError::WrongLength`] for a wrong image or number of activities, [`RevolveError::NotFinite`].
    pub fn project_add<T: Sample>(
        &self,
        rays: &Lines,
        activity: &[f64],
        weight: f64,
        out: &mut [T],
    ) -> Result<RayCounters, RevolveError> {
        let weights = self.weights(activity)?;
        finite("weight", weight)?;
        length("image", rays.image_len(), out.len())?;
        let weights: Vec<f64> = weights.into_iter().map(|own| weight * own).collect();
        Ok(rays.project_body(self, &weights, out))
    }
}

impl Lines {
    /// Adds the integrals along parallel rays; `raster` and `d` are their points and direction in the body frame.
    pub(super) fn project_parallel<T: Sample>(
        &self,
        (raster, d): (PointRaster, Vector3<f64>),
        pose: &Pose,
        layers: &[(&Meridian, f64)],
        out: &mut [T],
    ) -> RayCounters {
        let farthest = pose.farthest(self.farthest);
        let spacing = raster.bin_step.norm().min(raster.row_step.norm());
        let views: Vec<LayerView> = (layers.iter())
            .map(|&(meridian, weight)| {
                let direction = Direction::new(meridian, farthest, &d);
                LayerView {
                    silhouette: Silhouette::new(meridian, &direction, spacing),
                    meridian,
                    weight,
                    first: direction.coordinates(&raster.first),
                    bin: direction.slopes(&raster.bin_step),
                    row: direction.slopes(&raster.row_step),
                    direction,
                }
            })
            .collect();
        let set = simd_set::Set::detect();
        let n_bins = self.size[0];
        out.par_chunks_mut(self.n_slabs() * n_bins)
            .with_min_len(TASK / n_bins)
            .enumerate()
            .map_init(Scratch::default, |scratch, (row, image)| {
                set.run(Row {
                    views: &views,
                    planes: self.planes(),
                    row: (self.first_row + row) as f64,
                    image,
                    scratch,
                })
            })
            .reduce(RayCounters::default, |a, b| a + b)
    }
}

/// The loop over a row, compiled for each instruction set.
struct Row<'a, T> {
    views: &'a [LayerView<'a>],
    planes: &'a [f64],
    row: f64,
    image: &'a mut [T],
    scratch: &'a mut Scratch,
}

impl<T: Sample> simd_set::Work for Row<'_, T> {
    type Out = RayCounters;

    #[inline(always)]
    fn run(self) -> RayCounters {
        let Self {
            views,
            planes,
            row,
            image,
            scratch,
        } = self;
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
        // Only bins inside the silhouette of a layer.
        let used = (bins.iter().filter(|bins| !bins.is_empty()).cloned())
            .reduce(|a, b| a.start.min(b.start)..a.end.max(b.end))
            .unwrap_or(0..0);
        sums.clear();
        sums.resize((planes.len() + 1) * used.len(), 0.0);
        cast.clear();
        cast.resize(used.len(), false);
        for (view, bins) in views.iter().zip(bins) {
            let meridian = view.meridian;
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

/// Scratch memory of a row.
#[derive(Default)]
struct Scratch {
    /// For each layer.
    bins: Vec<Range<usize>>,
    /// For each bin: the sum (per slab), whether a ray was cast, and the chord in one layer (per slab).
    sums: Vec<f64>,
    cast: Vec<bool>,
    chords: Vec<f64>,
    /// For each chain, the faces of the previous line.
    hints: Vec<Hint>,
    batch: Batch<(usize, f64)>,
}

/// The sums of the chords of a row.
struct Chords<'a, O> {
    /// `[slab][bin]`.
    of: &'a mut [f64],
    bins: Range<usize>,
    planes: &'a [f64],
    /// Parameter of the origin of a bin.
    origin: O,
}

impl<O: Fn(usize) -> f64> Chords<'_, O> {
    /// Adds the signed intervals of some lines to their bins.
    #[inline(always)]
    fn add(&mut self, direction: &Direction, batch: &mut Batch<(usize, f64)>) {
        for ((bin, sign), [entry, exit]) in batch.drain(|_| *direction) {
            let at = bin - self.bins.start;
            for_slabs(
                self.planes,
                (self.origin)(bin),
                [entry, exit],
                |slab, [low, high]| {
                    self.of[slab * self.bins.len() + at] += sign * (high - low);
                },
            );
        }
    }
}

/// A layer for one direction: (w, q, t) of the first ray and their steps.
struct LayerView<'a> {
    meridian: &'a Meridian,
    weight: f64,
    direction: Direction,
    silhouette: Silhouette,
    first: [f64; 3],
    bin: [f64; 3],
    row: [f64; 3],
}

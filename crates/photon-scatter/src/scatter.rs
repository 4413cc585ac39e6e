//! Histories in blocks until the tolerance is met, and the images of scatter.

use crate::angles::Angles;
use crate::camera::Grid;
use crate::error::{ScatterError, within};
use crate::history::{CELLS, DETECTIONS, Detection, Problem};
use crate::medium::in_front;
use crate::smoothing::smoothing;
use crate::sums::Sums;
use crate::{Camera, Medium, ScatterOptions, ScatterReport, Source, Spectrum};

/// Smallest number of blocks: their variation gives the standard error to a relative accuracy of 1 / sqrt(2 n), 6 %.
const LEAST_BLOCKS: usize = 128;
/// Number of blocks that are followed before their images are summed in order.
const BLOCKS_AT_ONCE: usize = 16;
/// Ratio of the number of histories to that required by the current standard error.
const RESERVE: f64 = 1.03;
/// Smallest number of histories of a block.
const LEAST_BLOCK: usize = 16;
/// Range of the factor by which blocks grow, half that of the required histories: below it blocks are added, not replaced by larger ones.
const BLOCK_GROWTH: [f64; 2] = [2.0, 32.0];
/// Progress in thousandths that the first blocks count, and the fraction of the remaining progress that the last expected blocks count.
const FIRST_ROUND: usize = 50;
const LAST_ROUND: f64 = 0.9;
/// Ratio of the number of histories that are expected, from the current standard error, to the limit, beyond which it cannot be met.
const UNCERTAIN: f64 = 2.0;
/// Bound on a random error in standard errors.
const STANDARD_ERRORS: f64 = 4.0;
/// First distances of nodes in cm and of views in radians where the options do not prescribe them.
const PITCH: f64 = 0.75;
/// Allowed distances of nodes in cm: at most about the mean free path in water at 600 keV, 11 cm.
const PITCHES: [f64; 2] = [0.01, 10.0];
const PITCH_OF_NODES: &str = "pitch of the nodes in cm";
const SPACING: f64 = 12.0 * std::f64::consts::PI / 180.0;

/// Scatter in every bin, view and energy window of a camera, with its standard error.
///
/// A sample is the average over its bin. It has the unit of a line integral of the activity, as the attenuated line integrals of the primary photons
/// have: activity per cm^3 times cm. The sum over a view times the area of a bin is the activity that emits as many photons, unattenuated, towards
/// the photopeak window of the camera as are scattered into the window.
#[doc(alias("Monte Carlo", "ESSE"))]
#[derive(Debug, Clone)]
pub struct Scatter {
    grid: Grid,
    /// Averages over blocks and their standard errors, `[view][window][row][column]` of nodes.
    images: Vec<f64>,
    errors: Vec<f64>,
    /// Projection sums and their standard errors, `[view][window]`.
    sums: Vec<[f64; 2]>,
    report: ScatterReport,
}

impl ScatterOptions {
    fn check(&self) -> Result<(), ScatterError> {
        within("relative tolerance", self.relative, [0.0, 1.0])?;
        let least = [f64::MIN_POSITIVE, 0.0][usize::from(self.relative > 0.0)];
        within("tolerance", self.tolerance, [least, f64::MAX])?;
        within("orders of scattering", self.orders as f64, [1.0, f64::MAX])?;
        let (block, most) = (self.block as f64, self.most_histories as f64);
        within("histories of a block", block, [LEAST_BLOCK as f64, 1e7])?;
        let least = (LEAST_BLOCKS * LEAST_BLOCK) as f64;
        within("largest number of histories", most, [least, f64::MAX])?;
        Ok(())
    }

    fn grid(&self, camera: &Camera, spectrum: &Spectrum) -> Result<Grid, ScatterError> {
        let (pitch, spacing) = (self.pitch.unwrap_or(PITCH), self.spacing.unwrap_or(SPACING));
        within(PITCH_OF_NODES, pitch, PITCHES)?;
        within("angle between views in radians", spacing, [0.0, 1.0])?;
        Grid::new(camera, spectrum.n_windows(), pitch)
    }
}

impl Scatter {
    /// Follows photon histories until no bin has a standard error above both tolerances, with nodes and views so close that the error of interpolation
    /// is not above them either, unless `options` prescribe their distance. Bitwise independent of the number of threads.
    ///
    /// # Errors
    /// [`ScatterError::OutOfRange`] for a tolerance that is not positive (0 is allowed with a relative one), a relative one outside 0 to 1, a pitch
    /// outside 0.01 to 10 cm or above the limit of [`ScatterOptions::pitch`], a spacing outside 0 to 1 rad, no order, fewer than 2048 histories,
    /// blocks outside 16 to 10^7 histories, a view whose face is in the medium or in front of it on the line through the axis, numbers of `source`
    /// that are not finite or negative, a mean weight of 1024 emissions outside 1e-100 to 1e100 (0 is allowed), a weight above 1e20 times this mean,
    /// and a [`Piece`](crate::Piece) of `medium` that is reversed, out of order, not finite or denser than 30 g/cm^3; [`ScatterError::Nodes`] for
    /// more than 2^27 nodes; [`ScatterError::Tolerance`] if `most_histories` do not suffice; [`ScatterError::Interpolation`] if no allowed distance
    /// of the nodes suffices or no histories are left for a smaller one.
    pub fn new(
        source: &dyn Source,
        medium: &dyn Medium,
        camera: &Camera,
        spectrum: &Spectrum,
        options: &ScatterOptions,
    ) -> Result<Self, ScatterError> {
        options.check()?;
        let mut attempt = Attempt {
            pitch: options.pitch.unwrap_or(PITCH),
            spacing: options.spacing.unwrap_or(SPACING),
            size: options.block,
            first_block: 0,
            report: ScatterReport::default(),
            done: 0,
        };
        let mut all = options.grid(camera, spectrum)?;
        in_front(medium, camera, &all)?;
        loop {
            let angles = Angles::new(camera.views(), attempt.spacing);
            let problem = Problem::new((source, medium), spectrum, &all, &angles, options)?;
            let error = match attempt.run(&problem, &all, &angles, options) {
                Err(error @ ScatterError::Interpolation { .. }) => error,
                end => return end,
            };
            if attempt.most_block(options) < LEAST_BLOCK {
                return Err(error);
            }
            let finer = options.with_pitch(attempt.pitch);
            all = finer.grid(camera, spectrum).map_err(|_| error)?;
        }
    }

    /// Estimates the memory of [`new`](Self::new) in bytes: in all, and in addition per thread. Automatic distances of nodes and views count with
    /// their first values; each halving of the pitch takes four times the memory.
    ///
    /// # Errors
    /// [`ScatterError::OutOfRange`] for a pitch outside 0.01 to 10 cm and a spacing outside 0 to 1 rad; [`ScatterError::Nodes`].
    pub fn bytes(
        camera: &Camera,
        spectrum: &Spectrum,
        options: &ScatterOptions,
    ) -> Result<[u64; 2], ScatterError> {
        let grid = options.grid(camera, spectrum)?;
        // Sums and estimates; images of the blocks that are not summed yet; the table of transmissions. Per thread: deposits, images of the views
        // in which photons are detected, and detections in vectors with up to twice the necessary capacity.
        let nodes = (40 + 4 * BLOCKS_AT_ONCE) * grid.n_nodes();
        let spacing = options.spacing.unwrap_or(SPACING);
        let own = grid.of_views(&Angles::new(camera.views(), spacing).nodes);
        let cells = size_of::<f64>() * CELLS.pow(3) * own.n_views();
        let detections = 2 * DETECTIONS as usize * size_of::<Detection>();
        let each = 4 * (own.n_deposits() + own.n_nodes()) + detections;
        Ok([nodes + cells, each].map(|bytes| bytes as u64))
    }

    /// Averages of scatter over the bins of a view, `[row][bin]`.
    ///
    /// # Panics
    /// If there is no such view or window.
    #[must_use]
    pub fn view(&self, window: usize, view: usize) -> Vec<f64> {
        let bins = (self.grid).to_bins(self.nodes(&self.images, window, view), true);
        // Cubics overshoot; samples are not negative.
        bins.into_iter().map(|value| value.max(0.0)).collect()
    }

    /// Standard error of [`view`](Self::view), averaged over each bin. At each node its variance is the average over the node and its eight
    /// neighbours, and it is at least the contribution of one photon, since it is itself an estimate. If no photon is recorded in a window, that
    /// contribution is estimated from the activity; the error is 0 only if source or medium are empty ([`Source::is_empty`], [`Medium::is_empty`]), or
    /// if the window records no photon of any energy. It does not contain the error of interpolation: [`ScatterReport::interpolation_error`].
    ///
    /// # Panics
    /// If there is no such view or window.
    #[must_use]
    pub fn standard_error(&self, window: usize, view: usize) -> Vec<f64> {
        self.grid
            .to_bins(self.nodes(&self.errors, window, view), false)
    }

    /// Projection sum of a view, its samples times the area of a bin, and the standard error of that sum from independent blocks of histories.
    ///
    /// As for samples, the error does not contain the error of interpolation, which is at most [`ScatterReport::interpolation_error`] times the area
    /// of the detector. All views and windows share the histories, so that errors of different sums are correlated: that of a sum over views is at
    /// most the sum of the errors. Every error is at least the contribution of one photon, which blocks may miss where few photons reach a view through
    /// dense matter.
    ///
    /// # Panics
    /// If there is no such view or window.
    #[must_use]
    pub fn sum(&self, window: usize, view: usize) -> [f64; 2] {
        assert!(window < self.grid.windows, "no such window");
        self.sums[view * self.grid.windows + window]
    }

    /// Bound on the error of all samples: four times [`ScatterReport::largest_standard_error`], which a fraction of 6e-5 of normally distributed
    /// errors exceeds, plus [`ScatterReport::interpolation_error`].
    #[must_use]
    pub fn largest_error(&self) -> f64 {
        STANDARD_ERRORS * self.report.largest_standard_error + self.report.interpolation_error
    }

    /// The errors and the work done.
    #[must_use]
    pub fn report(&self) -> &ScatterReport {
        &self.report
    }

    fn nodes<'a>(&self, all: &'a [f64], window: usize, view: usize) -> &'a [f64] {
        let len = self.grid.size[0] * self.grid.size[1];
        assert!(window < self.grid.windows, "no such window");
        assert!(view < self.grid.n_views(), "no such view");
        let first = (view * self.grid.windows + window) * len;
        &all[first..first + len]
    }
}

/// A computation with one distance of the nodes and of the views.
struct Attempt {
    pitch: f64,
    spacing: f64,
    /// Histories of a block, and the first block.
    size: usize,
    first_block: usize,
    /// Work that was discarded.
    report: ScatterReport,
    /// Progress in thousandths, estimated: the number of histories is not known in advance.
    done: usize,
}

impl Attempt {
    /// Follows histories until the tolerance is met. If the error of interpolation is above it, it is returned, and the distances are reduced.
    fn run(
        &mut self,
        problem: &Problem<'_>,
        all: &Grid,
        angles: &Angles,
        options: &ScatterOptions,
    ) -> Result<Scatter, ScatterError> {
        self.size = self.size.min(self.most_block(options));
        let mut sums = Sums::new(all, self.first_block);
        let (mut wanted, mut round) = (LEAST_BLOCKS, FIRST_ROUND * (1000 - self.done) / 1000);
        loop {
            let part = simd_set::part(self.done..self.done + round, 1000);
            let missing = wanted - sums.blocks;
            while sums.blocks < wanted {
                let blocks = (wanted - sums.blocks).min(BLOCKS_AT_ONCE);
                sums.add(problem, (all, angles), blocks, self.size, missing)?;
            }
            drop(part);
            self.done += round;
            let unseen = sums.unseen(problem);
            let (images, errors) = sums.estimate(all, &unseen);
            let reached = largest(all, &errors, false);
            let least = images.iter().zip(&errors);
            let least: Vec<f64> = least.map(|(own, error)| own - 3.0 * error).collect();
            let tolerance = (options.tolerance).max(options.relative * largest(all, &least, true));
            let interpolation = [
                self.error_of_nodes(&sums, all, [&images, &errors], options)?,
                angles.error(&images, &errors, all.n_nodes() / all.n_views()),
            ];
            let report = sums.finish(self.report, problem, [reached, interpolation.iter().sum()]);
            // The largest scatter itself, not reduced: a lower bound on the histories.
            let most = (options.tolerance).max(options.relative * largest(all, &images, true));
            let own = sums.report.histories as f64 * (reached / most).powi(2);
            let expected = self.report.histories as f64 + own;
            let limit = options.most_histories;
            let left = limit - report.histories;
            // Without a recorded photon the expected number is infinite: unknown.
            let beyond = expected.is_finite() && expected > UNCERTAIN * limit as f64;
            let exhausted = beyond || left < self.size as u64;
            if reached > tolerance && exhausted {
                return Err(ScatterError::Tolerance {
                    asked: tolerance,
                    reached,
                    expected,
                    report: Box::new(report),
                });
            }
            let growth = RESERVE * (reached / tolerance).powi(2);
            let pitch = self.pitch;
            if self.refine(options, interpolation, tolerance, growth) {
                self.discard(&sums);
                return Err(ScatterError::Interpolation {
                    asked: tolerance,
                    reached: interpolation.iter().sum(),
                    pitch,
                });
            }
            if reached <= tolerance {
                return Ok(Scatter {
                    grid: all.clone(),
                    sums: sums.of_views(&unseen),
                    images,
                    errors,
                    report,
                });
            }
            let expected;
            (wanted, expected) = self.grow(&mut sums, all, growth, left);
            round = (LAST_ROUND * expected * (1000 - self.done) as f64) as usize;
        }
    }

    /// Adds blocks, or replaces them by larger ones, within the histories left. Returns the number of blocks and the expected fraction of the
    /// remaining work.
    fn grow(&mut self, sums: &mut Sums, all: &Grid, growth: f64, left: u64) -> (usize, f64) {
        let most = left as f64 / (LEAST_BLOCKS * self.size) as f64;
        let larger = (0.5 * growth).min(BLOCK_GROWTH[1]).min(most);
        if larger < BLOCK_GROWTH[0] {
            // The standard error from the contribution of one photon is inversely proportional to the number of histories.
            let more = growth.min(2.0);
            let wanted = (sums.blocks as f64 * more).ceil() as usize;
            let most = sums.blocks + (left / self.size as u64) as usize;
            let wanted = wanted.next_multiple_of(BLOCKS_AT_ONCE).min(most);
            return (wanted, (more - 1.0) / (growth - 1.0));
        }
        // Earlier blocks are discarded, because all blocks have one size.
        self.size = (self.size as f64 * larger) as usize;
        self.discard(sums);
        *sums = Sums::new(all, self.first_block);
        (LEAST_BLOCKS, larger / growth)
    }

    /// Estimates the error of the nodes. If they are too far apart for the bound on it, it is infinite, or [`ScatterError::OutOfRange`] if their
    /// distance is prescribed.
    fn error_of_nodes(
        &self,
        sums: &Sums,
        all: &Grid,
        [images, errors]: [&[f64]; 2],
        options: &ScatterOptions,
    ) -> Result<f64, ScatterError> {
        let response = all.width(sums.nearest) * self.pitch;
        let coarsest = sums.depth().max(response).max(PITCHES[0]);
        if self.pitch <= coarsest {
            return Ok(smoothing(all, sums.nearest, images, errors));
        }
        let range = [PITCHES[0], coarsest];
        (options.pitch).map_or(Ok(f64::INFINITY), |pitch| {
            within(PITCH_OF_NODES, pitch, range)
        })
    }

    /// Returns the largest number of histories of the first blocks of an attempt.
    fn most_block(&self, options: &ScatterOptions) -> usize {
        let left = options.most_histories - self.report.histories;
        (left / LEAST_BLOCKS as u64) as usize
    }

    fn discard(&mut self, sums: &Sums) {
        self.report.add(&sums.report);
        self.first_block += sums.blocks;
    }

    /// Reduces the distance of nodes or of views, where options do not prescribe it, if their errors of interpolation exceed the tolerance.
    fn refine(
        &mut self,
        options: &ScatterOptions,
        errors: [f64; 2],
        tolerance: f64,
        growth: f64,
    ) -> bool {
        let free = [options.pitch.is_none(), options.spacing.is_none()];
        let [nodes, views] = [0, 1].map(|k| if free[k] { errors[k] } else { 0.0 });
        if nodes + views <= tolerance {
            return false;
        }
        let mut more = 0.5 * growth;
        if nodes >= views {
            let factor = (tolerance / nodes).sqrt().clamp(0.4, 0.8);
            self.pitch *= factor;
            more /= factor * factor;
        } else {
            self.spacing *= 0.5;
        }
        self.size = (self.size as f64 * more.clamp(1.0, BLOCK_GROWTH[1])) as usize;
        true
    }
}

/// Returns the largest average over a bin, or 0, of cubics or lines between the nodes.
fn largest(grid: &Grid, values: &[f64], cubic: bool) -> f64 {
    let images = values.chunks(grid.size[0] * grid.size[1]);
    let bins = images.flat_map(|image| grid.to_bins(image, cubic));
    bins.fold(0.0, f64::max)
}

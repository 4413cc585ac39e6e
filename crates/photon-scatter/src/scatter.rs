//! Histories in blocks until the tolerance is met, and the images with their standard errors.

use crate::camera::Grid;
use crate::error::{ScatterError, within};
use crate::history::{Problem, Tally};
use crate::{Camera, Medium, ScatterOptions, ScatterReport, Source, Spectrum};
use rayon::prelude::*;

/// Blocks at least: their scatter gives the standard error to 1 / sqrt(2 n) of itself, 9 %.
const LEAST_BLOCKS: usize = 64;
/// Blocks that are followed before their images are summed, in their order.
const BLOCKS_AT_ONCE: usize = 16;
/// More histories than the present standard error asks for, and the most by which their number grows at a time.
const RESERVE: f64 = 1.03;
const MOST_GROWTH: f64 = 8.0;

/// Scatter in every bin, view and energy window of a camera, with its standard error.
///
/// A sample has the unit of a line integral of the activity, as the attenuated line integrals of the primary photons have: activity
/// per cm^3 times cm. The sum over a view times the area of a bin is the activity that emits as many photons, unattenuated, towards the
/// photopeak window of the camera as are scattered into the window.
#[derive(Debug, Clone)]
pub struct Scatter {
    grid: Grid,
    /// Averages over blocks and their standard errors, `[view][window][row][column]` of nodes.
    images: Vec<f64>,
    errors: Vec<f64>,
    largest_error: f64,
    report: ScatterReport,
}

impl Scatter {
    /// Follows photon histories until no bin has a standard error above the tolerance. Bitwise independent of the number of threads.
    ///
    /// # Errors
    /// [`ScatterError::OutOfRange`] for a tolerance that is not positive, a pitch outside 0.01 to 100 cm, blocks outside 16 to 10^7 histories,
    /// more than 2^27 nodes, and for numbers of `source` or `medium` that are not finite or negative; [`ScatterError::Tolerance`] if
    /// `most_histories` do not suffice.
    pub fn new(
        source: &dyn Source,
        medium: &dyn Medium,
        camera: &Camera,
        spectrum: &Spectrum,
        options: &ScatterOptions,
    ) -> Result<Self, ScatterError> {
        within(
            "tolerance",
            options.tolerance,
            [f64::MIN_POSITIVE, f64::MAX],
        )?;
        within("pitch of the nodes in cm", options.pitch, [0.01, 100.0])?;
        within("histories of a block", options.block as f64, [16.0, 1e7])?;
        let grid = Grid::new(camera, spectrum.windows().len(), options.pitch)?;
        let problem = Problem {
            source,
            medium,
            spectrum,
            directions: grid.directions().collect(),
            grid,
            orders: options.orders,
            seed: options.seed,
        };
        let mut sums = Sums::new(problem.grid.n_nodes());
        let most = (options.most_histories / options.block as u64) as usize;
        let mut wanted = LEAST_BLOCKS;
        loop {
            while sums.blocks < wanted.min(most.max(LEAST_BLOCKS)) {
                sums.add(&problem, options.block)?;
            }
            let (images, errors) = sums.estimate(&problem.grid);
            let largest_error = largest(&problem.grid, &errors);
            let report = sums.report;
            if largest_error <= options.tolerance {
                return Ok(Self {
                    grid: problem.grid,
                    images,
                    errors,
                    largest_error,
                    report,
                });
            }
            if sums.blocks >= most {
                return Err(ScatterError::Tolerance {
                    asked: options.tolerance,
                    reached: largest_error,
                    report,
                });
            }
            let growth = RESERVE * (largest_error / options.tolerance).powi(2);
            let blocks = sums.blocks as f64 * growth.min(MOST_GROWTH);
            wanted = (blocks.ceil() as usize).max(sums.blocks + 1);
        }
    }

    /// Scatter in the bins of a view, `[row][bin]`.
    ///
    /// # Panics
    /// If there is no such view or window.
    pub fn view(&self, window: usize, view: usize) -> Vec<f64> {
        self.grid
            .to_bins(self.nodes(&self.images, window, view), true)
    }

    /// Standard error of [`view`](Self::view), bin by bin: at each node the largest of its own, its neighbours' and the contribution of one photon, since it is itself an estimate.
    ///
    /// # Panics
    /// If there is no such view or window.
    pub fn standard_error(&self, window: usize, view: usize) -> Vec<f64> {
        self.grid
            .to_bins(self.nodes(&self.errors, window, view), false)
    }

    /// The largest standard error of any bin in any view and window.
    pub fn largest_error(&self) -> f64 {
        self.largest_error
    }

    /// The work done.
    pub fn report(&self) -> &ScatterReport {
        &self.report
    }

    fn nodes<'a>(&self, all: &'a [f64], window: usize, view: usize) -> &'a [f64] {
        let len = self.grid.size[0] * self.grid.size[1];
        assert!(window < self.grid.windows, "no such window");
        let first = (view * self.grid.windows + window) * len;
        &all[first..first + len]
    }
}

/// Sums over blocks of their images and of the squares of these.
struct Sums {
    blocks: usize,
    first: Vec<f64>,
    second: Vec<f64>,
    report: ScatterReport,
}

impl Sums {
    fn new(len: usize) -> Self {
        Self {
            blocks: 0,
            first: vec![0.0; len],
            second: vec![0.0; len],
            report: ScatterReport::default(),
        }
    }

    /// Adds some blocks.
    fn add(&mut self, problem: &Problem<'_>, histories: usize) -> Result<(), ScatterError> {
        let blocks: Vec<_> = (self.blocks..self.blocks + BLOCKS_AT_ONCE)
            .into_par_iter()
            .map_init(Tally::default, |tally, block| {
                problem.block(block as u64, histories, tally)?;
                let each = 1.0 / histories as f32;
                Ok((problem.grid.images(&tally.deposits, each), tally.report))
            })
            .collect::<Result<_, ScatterError>>()?;
        self.blocks += blocks.len();
        for (images, report) in &blocks {
            self.report.add(report);
            let sums = self.first.iter_mut().zip(&mut self.second);
            for ((first, second), value) in sums.zip(images) {
                let value = f64::from(*value);
                *first += value;
                *second += value * value;
            }
        }
        Ok(())
    }

    /// Averages over the blocks and their standard errors.
    fn estimate(&self, grid: &Grid) -> (Vec<f64>, Vec<f64>) {
        let n = self.blocks as f64;
        let images: Vec<f64> = self.first.iter().map(|sum| sum / n).collect();
        let own: Vec<f64> = (images.iter().zip(&self.second))
            .map(|(mean, sum)| ((sum / n - mean * mean).max(0.0) / (n - 1.0)).sqrt())
            .collect();
        let mut errors = own.clone();
        let [nx, nz] = grid.size;
        for window in 0..grid.windows {
            let views = (0..own.len() / (nx * nz)).filter(|k| k % grid.windows == window);
            let nodes = views.clone().flat_map(|k| k * nx * nz..(k + 1) * nx * nz);
            let most = nodes
                .max_by(|a, b| own[*a].total_cmp(&own[*b]))
                .unwrap_or(0);
            // Of n equal contributions each is the variance over the mean.
            let one = match own[most] > 0.0 {
                true => own[most].powi(2) / images[most],
                false => 0.0,
            };
            for view in views {
                let (errors, own) = (&mut errors[view * nx * nz..], &own[view * nx * nz..]);
                for at in (1..nz - 1).flat_map(|row| row * nx + 1..(row + 1) * nx - 1) {
                    let lines = [at - nx, at, at + nx].map(|at| &own[at - 1..at + 2]);
                    errors[at] = lines.into_iter().flatten().fold(one, |a, b| b.max(a));
                }
            }
        }
        (images, errors)
    }
}

/// The largest standard error of the nodes that bins are interpolated from.
fn largest(grid: &Grid, errors: &[f64]) -> f64 {
    let [rows, columns] = grid.used();
    let used = errors.chunks(grid.size[0]).enumerate();
    used.filter(|(row, _)| rows.contains(&(row % grid.size[1])))
        .flat_map(|(_, line)| &line[columns.clone()])
        .fold(0.0, |most: f64, error| most.max(*error))
}

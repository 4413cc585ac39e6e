//! Sums over blocks of histories: images, projection sums, and their standard errors.

use crate::ScatterReport;
use crate::angles::Angles;
use crate::camera::Grid;
use crate::error::ScatterError;
use crate::history::{FULL_DETECTION, Problem, Tally};
use crate::medium::meets;
use rayon::prelude::*;

/// Sums over blocks of their images and of the squares of these.
pub(crate) struct Sums {
    /// Index of the first block.
    first_block: usize,
    pub(crate) blocks: usize,
    first: Vec<f64>,
    second: Vec<f64>,
    /// Projection sums, `[view][window]`, and those of all views by order.
    views: Vec<Moments>,
    orders: [Moments; ScatterReport::ORDERS],
    pub(crate) report: ScatterReport,
    /// Smallest distance of an emission from a face.
    pub(crate) nearest: f64,
    /// Sum of the distances in [`mean_distance`](Self::mean_distance).
    distance: f64,
}

impl Sums {
    pub(crate) fn new(grid: &Grid, first_block: usize) -> Self {
        let len = grid.n_nodes();
        Self {
            first_block,
            blocks: 0,
            first: vec![0.0; len],
            second: vec![0.0; len],
            views: vec![Moments::default(); grid.n_views() * grid.windows],
            orders: Default::default(),
            report: ScatterReport::default(),
            nearest: f64::INFINITY,
            distance: 0.0,
        }
    }

    /// Adds some blocks, among `of` that count as progress.
    pub(crate) fn add(
        &mut self,
        problem: &Problem<'_>,
        (all, angles): (&Grid, &Angles),
        blocks: usize,
        histories: usize,
        of: usize,
    ) -> Result<(), ScatterError> {
        let view_len = problem.grid.n_nodes() / problem.grid.n_views();
        let from = self.first_block + self.blocks;
        let blocks: Vec<_> = (from..from + blocks)
            .into_par_iter()
            .map_init(Tally::default, |tally, block| {
                simd_set::checkpoint();
                problem.block(block as u64, histories, tally)?;
                simd_set::unit(of);
                let each = 1.0 / histories as f32;
                let images = problem.grid.images(&tally.deposits, each);
                Ok((
                    angles.expand(&images, view_len),
                    tally.report,
                    [tally.nearest, tally.distance],
                ))
            })
            .collect::<Result<_, ScatterError>>()?;
        self.blocks += blocks.len();
        for (images, report, [nearest, distance]) in &blocks {
            self.report.add(report);
            self.nearest = self.nearest.min(*nearest);
            self.distance += distance;
            for (order, sum) in self.orders.iter_mut().zip(report.by_order) {
                order.add(problem.unit * sum / histories as f64);
            }
            for (view, image) in self
                .views
                .iter_mut()
                .zip(images.chunks(view_len / all.windows))
            {
                view.add(problem.unit * all.sum(image));
            }
            let sums = self.first.iter_mut().zip(&mut self.second);
            for ((first, second), value) in sums.zip(images) {
                let value = problem.unit * f64::from(*value);
                *first += value;
                *second += value * value;
            }
        }
        Ok(())
    }

    /// Projection sums and their standard errors, at least `unseen`.
    pub(crate) fn of_views(&self, unseen: f64) -> Vec<[f64; 2]> {
        let averages = self.views.iter().map(|view| view.average(self.blocks));
        averages
            .map(|[sum, error]| [sum, error.max(unseen)])
            .collect()
    }

    /// The report of these and of discarded histories.
    pub(crate) fn finish(
        &self,
        discarded: ScatterReport,
        standard: f64,
        interpolation: f64,
    ) -> ScatterReport {
        let mut report = discarded;
        report.add(&self.report);
        let orders = self.orders.map(|order| order.average(self.blocks));
        report.by_order = orders.map(|[average, _]| average);
        report.by_order_error = orders.map(|[_, error]| error);
        report.largest_standard_error = standard;
        report.interpolation_error = interpolation;
        report
    }

    /// Returns the mean distance of interactions from the emission or the previous interaction in cm; infinite without interactions.
    pub(crate) fn mean_distance(&self) -> f64 {
        match self.report.interactions {
            0 => f64::INFINITY,
            n => self.distance / n as f64,
        }
    }

    /// Estimates the contribution of one photon to a projection sum if none is recorded. It is 0 if one is recorded, without
    /// activity, and if neither a history nor a line through a node meets the medium.
    pub(crate) fn unseen(&self, problem: &Problem<'_>) -> Result<f64, ScatterError> {
        let active = self.nearest.is_finite();
        let none = active && self.first.iter().all(|sum| *sum == 0.0);
        let possible = |interactions| match interactions {
            0 => meets(problem.medium, &problem.grid),
            _ => Ok(true),
        };
        Ok(match none && possible(self.report.interactions)? {
            true => FULL_DETECTION * problem.unit / self.report.histories as f64,
            false => 0.0,
        })
    }

    /// Averages over the blocks and their standard errors, which are at least the contribution of one photon; `unseen` is not 0 if none is recorded.
    pub(crate) fn estimate(&self, grid: &Grid, unseen: f64) -> (Vec<f64>, Vec<f64>) {
        let n = self.blocks as f64;
        let images: Vec<f64> = self.first.iter().map(|sum| sum / n).collect();
        let variances: Vec<f64> = (images.iter().zip(&self.second))
            .map(|(mean, sum)| (sum / n - mean * mean).max(0.0) / (n - 1.0))
            .collect();
        let mut errors: Vec<f64> = variances.iter().map(|variance| variance.sqrt()).collect();
        let [nx, nz] = grid.size;
        for window in 0..grid.windows {
            let views = (0..variances.len() / (nx * nz)).filter(|k| k % grid.windows == window);
            let nodes = views.clone().flat_map(|k| k * nx * nz..(k + 1) * nx * nz);
            let most = nodes
                .max_by(|a, b| variances[*a].total_cmp(&variances[*b]))
                .unwrap_or(0);
            // Of n equal contributions each is the variance over the mean.
            let one = match variances[most] > 0.0 {
                true => variances[most] / images[most],
                false => 0.0,
            };
            for view in views {
                let from = view * nx * nz;
                let (errors, variances) = (&mut errors[from..], &variances[from..]);
                for at in (1..nz - 1).flat_map(|row| row * nx + 1..(row + 1) * nx - 1) {
                    let lines = [at - nx, at, at + nx].map(|at| &variances[at - 1..at + 2]);
                    let sum: f64 = lines.into_iter().flatten().sum();
                    errors[at] = (sum / 9.0).sqrt().max(one);
                }
            }
        }
        if unseen > 0.0 {
            errors.fill(unseen / grid.area());
        }
        (images, errors)
    }
}

/// Sums over blocks of a value and its square.
#[derive(Debug, Clone, Copy, Default)]
struct Moments([f64; 2]);

impl Moments {
    fn add(&mut self, value: f64) {
        self.0[0] += value;
        self.0[1] += value * value;
    }

    /// The average over n blocks and its standard error.
    fn average(self, n: usize) -> [f64; 2] {
        let n = n as f64;
        let [first, second] = self.0.map(|sum| sum / n);
        let variance = (second - first * first).max(0.0) / (n - 1.0);
        [first, variance.sqrt()]
    }
}

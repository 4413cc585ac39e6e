//! Sums over blocks of histories: images, projection sums, and their standard errors.

use crate::ScatterReport;
use crate::angles::Angles;
use crate::camera::Grid;
use crate::error::ScatterError;
use crate::history::{FULL_DETECTION, Problem, Tally};
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
    /// Largest weight of a history at its first interaction.
    heaviest: f64,
    /// Numerator and denominator of [`depth`](Self::depth).
    depth: [f64; 2],
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
            heaviest: 0.0,
            depth: [0.0; 2],
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
                    (tally.nearest, tally.heaviest, tally.depth),
                ))
            })
            .collect::<Result<_, ScatterError>>()?;
        self.blocks += blocks.len();
        for (images, report, (nearest, heaviest, depth)) in &blocks {
            self.report.add(report);
            self.nearest = self.nearest.min(*nearest);
            self.heaviest = self.heaviest.max(*heaviest);
            self.depth = [0, 1].map(|k| self.depth[k] + depth[k]);
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

    /// Projection sums and their standard errors, at least those of [`unseen`](Self::unseen) photons.
    pub(crate) fn of_views(&self, unseen: &[f64]) -> Vec<[f64; 2]> {
        let views = self.views.iter().zip(unseen.iter().cycle());
        views
            .map(|(view, unseen)| view.average(self.blocks, *unseen))
            .collect()
    }

    /// The report of these and of discarded histories.
    pub(crate) fn finish(
        &self,
        discarded: ScatterReport,
        problem: &Problem<'_>,
        [standard, interpolation]: [f64; 2],
    ) -> ScatterReport {
        let mut report = discarded;
        report.add(&self.report);
        let most = problem.totals.iter().fold(0.0, |most: f64, x| most.max(*x));
        let unseen = most * self.unseen(problem)[0];
        for (k, order) in self.orders.iter().enumerate() {
            let least = if k < problem.orders { unseen } else { 0.0 };
            [report.by_order[k], report.by_order_error[k]] = order.average(self.blocks, least);
        }
        report.largest_standard_error = standard;
        report.interpolation_error = interpolation;
        report
    }

    /// Returns the mean depth of interactions in cm, weighted by the squares of their densities; infinite without interactions. A depth is the column
    /// density of the path in the scatterer, from the emission, the previous interaction or the entry, over the density at the interaction.
    pub(crate) fn depth(&self) -> f64 {
        match self.depth {
            [_, 0.0] => f64::INFINITY,
            [sum, weights] => sum / weights,
        }
    }

    /// Contribution of one photon to a projection sum in each window, of the largest weight followed; of the first emissions if none has a weight.
    /// Rare photons that no history follows may contribute as much. It is 0 if source or medium are empty, and in a window that records no photon of
    /// any energy.
    pub(crate) fn unseen(&self, problem: &Problem<'_>) -> Vec<f64> {
        let empty = problem.source.is_empty() || problem.medium.is_empty();
        let weight = match self.heaviest {
            _ if empty => 0.0,
            0.0 => problem.heaviest,
            heaviest => heaviest,
        };
        let one = FULL_DETECTION * problem.unit * weight / self.report.histories as f64;
        let fractions = (0..problem.grid.windows).map(|window| problem.spectrum.fraction(window));
        fractions.map(|fraction| one * fraction).collect()
    }

    /// Averages over the blocks and their standard errors, which are at least the contribution of one photon, in windows without any of an [`unseen`](Self::unseen) one.
    pub(crate) fn estimate(&self, grid: &Grid, unseen: &[f64]) -> (Vec<f64>, Vec<f64>) {
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
                false => unseen[window] / grid.least_area(),
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

    /// The average over n blocks and its standard error, at least another one.
    fn average(self, n: usize, least: f64) -> [f64; 2] {
        let n = n as f64;
        let [first, second] = self.0.map(|sum| sum / n);
        let variance = (second - first * first).max(0.0) / (n - 1.0);
        [first, variance.sqrt().max(least)]
    }
}

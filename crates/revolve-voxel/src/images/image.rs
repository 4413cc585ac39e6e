//! Images of assemblies behind a response, by quadrature over the rays between outlines.
//!
//! ```text
//! sample(bin, row) = integral over u, v, t of a(u, v, t) exp(-attenuation from t to the detector) k(bin - u; sigma(t)) k(row - v; sigma(t))
//! ```
//!
//! with k the Gaussian, averaged over the bin. Heights v are Gauss-Legendre nodes between the extreme heights of all solids, positions u of a row
//! are those of [`add_panel`] between the positions where an outline crosses the row; along a ray the integral is exact for the polynomials of
//! [`DepthResponse`]. In each panel the integrand is smooth at the scale of the response, so the error falls exponentially with the density of
//! nodes, and the number of rays does not depend on the number of bins.

use std::ops::Range;

use rayon::prelude::*;

use crate::error::positive;
use crate::images::depth::DepthResponse;
use crate::images::kernel::{Axis, BinValue, REACH, Weights};
use crate::images::outline::{Path, add_organ_heights, add_organ_positions};
use crate::images::plane::{RayPlane, RayRow};
use crate::images::rule::{Ends, add_panel};
use crate::rays::assembly::{Assembly, Finder, Shown, for_contents};
use crate::{ParallelDetector, RayCounters, RevolveError};

/// Below this fraction of the pitch the edges of bins divide panels, because the weights of bins are steps at the scale of the pitch.
const NARROW: f64 = 0.125;
/// Standard deviations around the edge of a bin within which such weights change.
const STEP: f64 = 4.0;
/// Scales by which a panel is longer for its number of nodes.
const MORE: f64 = 2.0;
/// Breaks closer than this, relative to the largest coordinate, are one.
const SAME: f64 = 1e-9;

/// A view: rays, bins, response, and the density of the quadrature.
#[derive(Debug, Clone)]
pub struct View<'a> {
    plane: RayPlane,
    axes: [Axis; 2],
    response: &'a DepthResponse,
    /// For each node of the response, along u and v.
    weights: Vec<[Weights; 2]>,
    density: f64,
}

/// The image of some bins and rows, `[row][bin]`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Image {
    /// The bins.
    pub bins: Range<usize>,
    /// The rows.
    pub rows: Range<usize>,
    /// Samples of these bins and rows.
    pub samples: Vec<f64>,
    /// Largest absolute line integral; relative to it [`DepthResponse::error`] bounds the error of interpolation in depth.
    pub largest_line: f64,
    /// Rays that were cast; none are skipped.
    pub rays: RayCounters,
}

/// A row of the quadrature: for each node of the response its bins.
struct Line {
    v: f64,
    weight: f64,
    /// Of all nodes, `[node][bin]`, from the first bin.
    sums: Vec<f64>,
    bins: Range<usize>,
    largest: f64,
    rays: u64,
    hit: u64,
}

impl<'a> View<'a> {
    /// A view on a detector, which is centred at (u, v) = (0, 0), with `density` nodes per standard deviation of the narrowest response (per bin where
    /// that is narrower than an eighth of a bin). With a density of 1 errors are near 1e-2 of the largest sample, with 1.5 near 1e-3, with 2 near
    /// 1e-4. A response that depends on depth needs parallel rays.
    ///
    /// # Errors
    /// [`RevolveError::NotPositive`], [`RevolveError::NotFinite`] for the density, and for a response of width zero at the centre of bins.
    pub fn new(
        plane: RayPlane,
        detector: &ParallelDetector,
        value: BinValue,
        response: &'a DepthResponse,
        density: f64,
    ) -> Result<Self, RevolveError> {
        let (counts, pitch) = ([detector.n_bins(), detector.n_rows()], detector.pitch());
        if value == BinValue::Centre {
            positive("standard deviation", response.extremes()[0])?;
        }
        let axes = [0, 1].map(|k| Axis {
            n: counts[k],
            pitch: pitch[k],
            value,
        });
        let weights = |sigma: &f64| axes.map(|axis| Weights::new(axis, *sigma));
        Ok(Self {
            plane,
            axes,
            response,
            weights: response.sigmas.iter().map(weights).collect(),
            density: positive("density of nodes", density)?,
        })
    }

    /// Returns the image of some rows. Its samples are bitwise identical to those of all rows, for any number of threads.
    pub fn image(&self, assembly: &Assembly<'_>, shown: Shown, rows: Range<usize>) -> Image {
        let body = assembly.body().filter(|_| shown == Shown::Change);
        let layers = body
            .iter()
            .flat_map(|body| body.layers().iter().map(|layer| Path::new(body, layer)));
        let paths: Vec<Path<'_>> = layers.collect();
        let heights = self.heights(assembly, &paths);
        let reached = |v: f64| {
            self.weights.iter().any(|[_, across]| {
                let bins = across.bins(v);
                bins.start < rows.end && rows.start < bins.end
            })
        };
        let lines: Vec<Line> = (heights.into_par_iter())
            .filter(|[v, _]| reached(*v))
            .map_init(Work::default, |work, [v, weight]| {
                self.line((assembly, shown), &paths, [v, weight], work)
            })
            .collect();
        self.sum(&lines, rows)
    }

    /// The heights of the rows with their weights.
    fn heights(&self, assembly: &Assembly<'_>, paths: &[Path<'_>]) -> Vec<[f64; 2]> {
        let mut breaks = Vec::new();
        paths
            .iter()
            .for_each(|path| path.add_heights(&self.plane, &mut breaks));
        let bounds = match paths {
            [] => [f64::NEG_INFINITY, f64::INFINITY],
            _ => extremes(&breaks),
        };
        for organ in assembly.surroundings() {
            add_organ_heights(organ, &self.plane, &mut breaks);
        }
        let mut nodes = Vec::new();
        self.add_panels(1, bounds, &mut breaks, Ends::Smooth, &mut nodes);
        nodes
    }

    /// Divides an axis at the breaks within bounds and within the reach of the detector, and appends the nodes of the panels.
    fn add_panels(
        &self,
        axis: usize,
        [low, high]: [f64; 2],
        breaks: &mut Vec<f64>,
        ends: Ends,
        nodes: &mut Vec<[f64; 2]>,
    ) {
        let ([narrowest, widest], Axis { n, pitch, .. }) =
            (self.response.extremes(), self.axes[axis]);
        let reach = self.axes[axis].edge(n) + REACH * widest;
        let [low, high] = [low.max(-reach), high.min(reach)];
        if low >= high {
            return;
        }
        breaks.retain(|x| low < *x && *x < high);
        breaks.extend([low, high]);
        let is_narrow = narrowest < NARROW * pitch;
        let step = STEP * narrowest;
        if is_narrow {
            let edges = (0..=n).map(|k| self.axes[axis].edge(k));
            let around = edges.flat_map(|edge| [edge - step, edge + step]);
            breaks.extend(around.filter(|x| low < *x && *x < high));
        }
        breaks.sort_unstable_by(f64::total_cmp);
        let same = SAME * low.abs().max(high.abs());
        breaks.dedup_by(|next, own| *next - *own <= same);
        for pair in breaks.windows(2) {
            let [from, to] = [pair[0], pair[1]];
            // In the middle of a bin the weights are constant.
            let place = 0.5 * (from + to) / pitch + 0.5 * n as f64;
            let scale = match is_narrow && (place - place.round()).abs() * pitch >= step {
                true => pitch,
                false => narrowest,
            };
            let count = (self.density * (MORE + (to - from) / scale)).ceil();
            add_panel([from, to], count.min(1e7) as usize, ends, nodes);
        }
    }

    /// Projects the rays of a row.
    fn line(
        &self,
        (assembly, shown): (&Assembly<'_>, Shown),
        paths: &[Path<'_>],
        [v, weight]: [f64; 2],
        work: &mut Work,
    ) -> Line {
        let Work {
            finder,
            breaks,
            nodes,
            integrals,
            depths,
        } = work;
        let row = self.plane.row(v);
        breaks.clear();
        paths
            .iter()
            .for_each(|path| path.add_positions(&row, breaks));
        let of_body = extremes(breaks);
        let organs = assembly.surroundings();
        organs.for_each(|organ| add_organ_positions(organ, &row, breaks));
        let bounds = match shown {
            Shown::Organs => extremes(breaks),
            Shown::Change => of_body,
        };
        nodes.clear();
        self.add_panels(0, bounds, breaks, Ends::Roots, nodes);
        let bins = self.bins_of(nodes);
        let n_nodes = self.response.n_nodes();
        let mut line = Line {
            v,
            weight,
            sums: vec![0.0; n_nodes * bins.len()],
            bins,
            largest: 0.0,
            rays: nodes.len() as u64,
            hit: 0,
        };
        simd_set::Set::detect().run(Cast {
            view: self,
            assembly,
            shown,
            row: &row,
            nodes,
            finder,
            integrals: [integrals, depths],
            line: &mut line,
        });
        line
    }

    /// The bins that content at any of the nodes reaches.
    fn bins_of(&self, nodes: &[[f64; 2]]) -> Range<usize> {
        let (Some([first, _]), Some([last, _])) = (nodes.first(), nodes.last()) else {
            return 0..0;
        };
        self.weights.iter().fold(usize::MAX..0, |bins, [along, _]| {
            let [from, to] = [first, last].map(|at| along.bins(*at));
            bins.start.min(from.start)..bins.end.max(to.end)
        })
    }

    /// Sums the rows of the quadrature, in their order, to rows of samples.
    fn sum(&self, lines: &[Line], rows: Range<usize>) -> Image {
        let used = lines.iter().filter(|line| !line.bins.is_empty());
        let bins = used.fold(usize::MAX..0, |bins, line| {
            bins.start.min(line.bins.start)..bins.end.max(line.bins.end)
        });
        let bins = if bins.start < bins.end { bins } else { 0..0 };
        let mut image = Image {
            samples: vec![0.0; rows.len() * bins.len()],
            bins: bins.clone(),
            rows: rows.clone(),
            ..Image::default()
        };
        let mut weights = Vec::new();
        for line in lines {
            image.largest_line = image.largest_line.max(line.largest);
            image.rays.cast += line.rays;
            image.rays.hit += line.hit;
            if line.bins.is_empty() {
                continue;
            }
            for (sums, [_, across]) in line.sums.chunks(line.bins.len()).zip(&self.weights) {
                weights.clear();
                weights.resize(rows.len(), 0.0);
                across.add(line.v, line.weight, rows.start, &mut weights);
                for (row, weight) in weights
                    .iter()
                    .enumerate()
                    .filter(|(_, weight)| **weight != 0.0)
                {
                    let at = row * bins.len() + line.bins.start - bins.start;
                    let samples = &mut image.samples[at..][..sums.len()];
                    for (sample, sum) in samples.iter_mut().zip(sums) {
                        *sample += weight * sum;
                    }
                }
            }
        }
        image
    }
}

/// The rays of a row, compiled for each instruction set.
struct Cast<'a, 'b> {
    view: &'a View<'a>,
    assembly: &'a Assembly<'b>,
    shown: Shown,
    row: &'a RayRow,
    nodes: &'a [[f64; 2]],
    finder: &'a mut Finder,
    integrals: [&'a mut Vec<f64>; 2],
    line: &'a mut Line,
}

impl simd_set::Work for Cast<'_, '_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let (response, line) = (self.view.response, self.line);
        let [integrals, depths] = self.integrals;
        for &[u, weight] in self.nodes {
            let stretches = (self.finder).stretches(self.assembly, self.shown, &self.row.ray(u));
            if stretches.is_empty() {
                continue;
            }
            line.hit += 1;
            for sums in [&mut *integrals, &mut *depths] {
                sums.clear();
                sums.resize(response.n_nodes(), 0.0);
            }
            for_contents(stretches, |ends, amount, attenuation| {
                response.add_integrals(ends, amount, attenuation, integrals);
            });
            line.largest = line.largest.max(integrals[0].abs());
            response.add_nodes(integrals, weight, depths);
            let sums = line.sums.chunks_exact_mut(line.bins.len().max(1));
            for ((sums, depth), [along, _]) in sums.zip(&*depths).zip(&self.view.weights) {
                along.add(u, *depth, line.bins.start, sums);
            }
        }
    }
}

/// Work arrays of a row.
#[derive(Debug, Default)]
struct Work {
    finder: Finder,
    breaks: Vec<f64>,
    nodes: Vec<[f64; 2]>,
    /// Integrals of Chebyshev polynomials, and those of the nodes of the response.
    integrals: Vec<f64>,
    depths: Vec<f64>,
}

/// The smallest and the largest of some numbers.
fn extremes(numbers: &[f64]) -> [f64; 2] {
    let fold = |[low, high]: [f64; 2], x: &f64| [low.min(*x), high.max(*x)];
    numbers
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], fold)
}

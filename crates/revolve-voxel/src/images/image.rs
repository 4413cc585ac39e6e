//! Images of assemblies behind a response, by quadrature over the rays between outlines.
//!
//! ```text
//! sample(bin, row) = integral over u, v, t of a(u, v, t) exp(-attenuation from t to the detector) k(bin - u; sigma(t)) k(row - v; sigma(t))
//! ```
//!
//! with k the Gaussian, averaged over the bin or at its centre. Heights v are quadrature nodes between the extreme heights of all solids; positions
//! u of a row are those of a [`Panel`] between the positions where an outline crosses the row. Along a ray the integral is exact for the
//! polynomials of [`DepthResponse`]. In each panel the integrand of smooth solids is smooth at the scale of the response, so the error falls
//! exponentially with the density of nodes. From a density of 1 on, the outlines of sectors divide panels too, except those of twisted sides within
//! their edges (order 5/2 of the density) and jags that are small compared with the response. Behind a response, small corners of a meridian do not
//! divide panels (order 2, and 3 from a density of 2 on). The number of rays does not depend on the number of bins, except for values at the
//! centres of bins wider than the response, which need only the rays within its reach. Organs are smooth at their own scale, so that few rays
//! suffice in a large panel: their integrals are interpolated to the nodes that the response needs.

use std::collections::BTreeMap;
use std::ops::Range;

use rayon::prelude::*;

use crate::error::{check_range, positive, within};
use crate::images::depth::DepthResponse;
use crate::images::kernel::{Axis, BinValue, REACH, Weights};
use crate::images::outline::{add_organ_heights, add_organ_positions};
use crate::images::plane::{RayPlane, RayRow};
use crate::images::rule::{Ends, Panel};
use crate::images::sides::Outlines;
use crate::rays::assembly::{Assembly, Emission, Finder, Shown, emissions};
use crate::{Lines, ParallelDetector, RayCounters, RevolveError};

/// Standard deviations around the edge of a bin within which such weights change.
const STEP: f64 = 4.0;
/// Nodes that resolve organs in a panel: a number, and as many for each unit of the density.
const ORGANS: [f64; 2] = [4.0, 6.0];
/// Nodes of a panel at a density of 1, in addition to its size in standard deviations; two more at twice the density, and one less for each
/// power of ten by which the panel is smaller than a standard deviation.
const LEAST: f64 = 3.0;
/// In bins without such a response, exponent of the size of a panel, in pitches, in its number of nodes: the contributions of large and small
/// panels to the error are balanced.
const SMALL_PANEL: f64 = 0.25;
/// Density from which the outlines of sectors divide panels: at lower ones, nodes in the additional panels would be more than are saved.
const SECTORS: f64 = 1.0;
/// The density in errors, and its range; the number of rays is about proportional to its square.
const DENSITY: &str = "density of nodes";
const DENSITIES: [f64; 2] = [0.1, 1000.0];
/// Rows of rays, at a density of 1, beyond those that the height of the image needs: of short panels.
const PANEL_ROWS: f64 = 40.0;
/// Breaks closer than this, relative to the largest coordinate, are one.
const SAME: f64 = 1e-9;

/// A view: rays, bins, response, and the density of the quadrature.
#[derive(Debug, Clone, PartialEq)]
pub struct View<'a> {
    plane: RayPlane,
    pub(super) axes: [Axis; 2],
    pub(super) response: &'a DepthResponse,
    /// For each node of the response, along u and v.
    weights: Vec<[Weights; 2]>,
    pub(super) density: f64,
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

/// A row of rays at a height, with its weight: the integrals over u for each node of the response, `[node][bin]` from the first bin.
struct Line {
    height: [f64; 2],
    sums: Vec<f64>,
    bins: Range<usize>,
    largest: f64,
    rays: u64,
    hit: u64,
}

impl<'a> View<'a> {
    /// Below this fraction of the pitch a response is narrow: for averages the edges of bins divide panels, because the weights of bins are steps at
    /// the scale of the pitch, and the density is that of nodes per bin.
    pub const NARROW: f64 = 0.125;

    /// A view along lines in a raster with bins and rows of `pitch` cm on the detector, with `density` nodes per standard deviation of the narrowest
    /// response (for averages, per bin where that is narrower than an eighth of a bin), 0.1 to 1000. The error is not estimated: compare two densities,
    /// and add [`corner_error`](Self::corner_error). A response that depends on depth needs parallel rays. Planes between slabs have no effect.
    ///
    /// # Errors
    /// [`RevolveError::NotPositive`], [`RevolveError::NotFinite`], [`RevolveError::OutOfRange`] for the density;
    /// [`RevolveError::NotPositive`] for the pitch, and for a response of width zero at the centre of bins; [`RevolveError::NotRaster`] for a list of
    /// lines; [`RevolveError::NoDirection`] if the source moves along the bins, because the rays of a row then lie in no plane, or if bins or rows
    /// have no width across the rays.
    pub fn new(
        lines: &Lines,
        pitch: [f64; 2],
        value: BinValue,
        response: &'a DepthResponse,
        density: f64,
    ) -> Result<Self, RevolveError> {
        for width in pitch {
            positive("pitch", width)?;
        }
        if value == BinValue::Centre {
            positive("standard deviation", response.extremes()[0])?;
        }
        let axes = Axis::both(lines.size(), pitch, value);
        let weights = |sigma: &f64| axes.map(|axis| Weights::new(axis, *sigma));
        Ok(Self {
            plane: RayPlane::new(lines, pitch)?,
            axes,
            response,
            weights: response.sigmas.iter().map(weights).collect(),
            density: within(DENSITY, positive(DENSITY, density)?, DENSITIES)?,
        })
    }

    /// Returns about the bytes of a view and of an image of objects higher than the detector and the reach of the response.
    #[must_use]
    pub fn bytes(
        detector: &ParallelDetector,
        value: BinValue,
        response: &DepthResponse,
        density: f64,
    ) -> f64 {
        let size = [detector.n_bins(), detector.n_rows()];
        let axes = Axis::both(size, detector.pitch(), value);
        let tables = axes.iter().flat_map(|axis| {
            let sigmas = response.sigmas.iter();
            sigmas.map(|sigma| Weights::bytes(*axis, *sigma))
        });
        let [narrowest, widest] = response.extremes();
        let Axis { n, pitch, .. } = axes[1];
        let reach = 2.0 * REACH * widest;
        let [high, step] = match value {
            BinValue::Average => [pitch, narrowest.max(Self::NARROW * pitch)],
            BinValue::Centre => [pitch.min(reach), narrowest],
        };
        let rows = PANEL_ROWS + (n as f64 * high + reach) / step;
        let sums = density * rows * (response.n_nodes() * size[0]) as f64;
        size_of::<f64>() as f64 * sums + tables.sum::<usize>() as f64
    }

    /// Returns the image of some rows. Its samples are bitwise identical to those of all rows, for any number of threads.
    ///
    /// # Errors
    /// [`RevolveError::BadRange`] for rows beyond the detector.
    pub fn image(
        &self,
        assembly: &Assembly<'_>,
        shown: Shown,
        rows: Range<usize>,
    ) -> Result<Image, RevolveError> {
        check_range("rows", &rows, self.axes[1].n)?;
        let outlines = match shown {
            Shown::Change => Outlines::new(assembly, self.corner(), self.finest()),
            Shown::Organs => Outlines::default(),
        };
        let panels = self.heights(assembly, shown, &outlines);
        let heights: Vec<[f64; 2]> = (panels.iter().flat_map(Panel::nodes))
            .filter(|[v, _]| self.reaches(*v, &rows))
            .collect();
        let lines: Vec<Line> = (heights.into_par_iter())
            .map_init(Work::default, |work, height| {
                simd_set::checkpoint();
                self.line((assembly, shown), &outlines, height, work)
            })
            .collect();
        Ok(self.sum(&lines, rows))
    }

    /// Whether samples are averages over bins or rows against which the response is narrow.
    pub(super) fn is_narrow(&self, axis: usize) -> bool {
        let Axis { pitch, value, .. } = self.axes[axis];
        value == BinValue::Average && self.response.extremes()[0] < Self::NARROW * pitch
    }

    /// The scale of details of sectors that matter, 0 without a response or with a narrow one; `None` if sectors do not divide panels.
    fn finest(&self) -> Option<f64> {
        (self.density >= SECTORS).then(|| match self.is_narrow(0) || self.is_narrow(1) {
            true => 0.0,
            false => self.response.extremes()[0] / self.density.powi(2),
        })
    }

    /// Whether content at a height reaches any of the rows.
    fn reaches(&self, v: f64, rows: &Range<usize>) -> bool {
        self.weights.iter().any(|[_, across]| {
            let bins = across.bins(v);
            bins.start < rows.end && rows.start < bins.end
        })
    }

    /// The panels of heights.
    fn heights(
        &self,
        assembly: &Assembly<'_>,
        shown: Shown,
        outlines: &Outlines<'_>,
    ) -> Vec<Panel> {
        let mut breaks = Vec::new();
        outlines.add_heights(&self.plane, &mut breaks);
        let bounds = match shown {
            Shown::Organs => [f64::NEG_INFINITY, f64::INFINITY],
            Shown::Change => extremes(&breaks),
        };
        for organ in assembly.surroundings() {
            add_organ_heights(organ, &self.plane, &mut breaks);
        }
        let mut panels = Vec::new();
        self.add_panels((1, shown), bounds, &mut breaks, &mut panels);
        panels
    }

    /// Divides an axis at the breaks within bounds and within the reach of the detector.
    fn add_panels(
        &self,
        (axis, shown): (usize, Shown),
        [low, high]: [f64; 2],
        breaks: &mut Vec<f64>,
        panels: &mut Vec<Panel>,
    ) {
        panels.clear();
        let ([narrowest, widest], Axis { n, pitch, value }) =
            (self.response.extremes(), self.axes[axis]);
        let reach = self.axes[axis].edge(n) + REACH * widest;
        let [low, high] = [low.max(-reach), high.min(reach)];
        if low >= high {
            return;
        }
        breaks.retain(|x| low < *x && *x < high);
        breaks.extend([low, high]);
        let is_narrow = self.is_narrow(axis);
        let step = STEP * narrowest;
        let mut divide = |near: f64, distance: f64| {
            let around = [near - distance, near + distance];
            breaks.extend(around.into_iter().filter(|x| low < *x && *x < high));
        };
        if is_narrow {
            (0..=n).for_each(|k| divide(self.axes[axis].edge(k), step));
        }
        // Content farther than this from the centre of a bin contributes to no sample.
        let window = match value {
            BinValue::Average => pitch,
            BinValue::Centre => REACH * widest,
        };
        if window < 0.5 * pitch {
            (0..n).for_each(|k| divide(self.axes[axis].edge(k) + 0.5 * pitch, window));
        }
        breaks.sort_unstable_by(f64::total_cmp);
        let same = SAME * low.abs().max(high.abs());
        breaks.dedup_by(|next, own| *next - *own <= same);
        let kind = if axis == 0 { Ends::Roots } else { Ends::Smooth };
        // The outlines move along the rows of samples.
        let own = match (axis, shown) {
            (0, Shown::Organs) => (ORGANS[0] + ORGANS[1] * self.density) as usize,
            _ => usize::MAX,
        };
        // Two densities that differ by the root of two have different numbers of nodes in any panel except very short ones. Steps of the weights, and
        // corners of an outline at the edge of a bin, are of low order: then the numbers differ by the same factor.
        let least = |size: f64| match is_narrow {
            true => 4.0 * self.density * size.min(1.0).powf(SMALL_PANEL),
            // Each further node reduces the error of a panel by about a factor of ten.
            false => {
                let least = (LEAST + 2.0 * self.density.log2()).round();
                least - (-size.log10()).floor().clamp(0.0, (least - 1.0).max(0.0))
            }
        };
        for pair in breaks.windows(2) {
            let [from, to] = [pair[0], pair[1]];
            let place = 0.5 * (from + to) / pitch + 0.5 * n as f64;
            if (place - place.floor() - 0.5).abs() * pitch > window {
                continue;
            }
            // In the middle of a bin the weights of averages are constant.
            let scale = match is_narrow && (place - place.round()).abs() * pitch >= step {
                true => pitch,
                false => narrowest,
            };
            let size = (to - from) / scale;
            let fine = least(size).round().max(1.0) + (self.density * size).ceil().max(1.0) - 1.0;
            panels.push(Panel::new([from, to], kind, fine.min(1e7) as usize, own));
        }
    }

    /// Projects the rays of a row.
    fn line(
        &self,
        (assembly, shown): (&Assembly<'_>, Shown),
        outlines: &Outlines<'_>,
        height: [f64; 2],
        work: &mut Work,
    ) -> Line {
        let (breaks, mut panels) = (&mut work.breaks, std::mem::take(&mut work.panels));
        let row = self.plane.row(height[0]);
        breaks.clear();
        outlines.add_positions(&row, breaks);
        let of_body = extremes(breaks);
        let organs = assembly.surroundings();
        organs.for_each(|organ| add_organ_positions(organ, &row, breaks));
        let bounds = match shown {
            Shown::Organs => extremes(breaks),
            Shown::Change => of_body,
        };
        self.add_panels((0, shown), bounds, breaks, &mut panels);
        let bins = self.bins_of(&panels);
        let mut line = Line {
            height,
            sums: vec![0.0; self.response.n_nodes() * bins.len()],
            bins,
            largest: 0.0,
            rays: 0,
            hit: 0,
        };
        simd_set::Set::detect().run(Cast {
            view: self,
            assembly,
            shown,
            row: &row,
            panels: &panels,
            work,
            line: &mut line,
        });
        work.panels = panels;
        line
    }

    /// The bins that content of any of the panels reaches.
    fn bins_of(&self, panels: &[Panel]) -> Range<usize> {
        let ends = panels.iter().flat_map(|panel| panel.ends);
        let [low, high] = extremes(&ends.collect::<Vec<_>>());
        if low > high {
            return 0..0;
        }
        let of = |[along, _]: &[Weights; 2]| along.bins(low).start..along.bins(high).end;
        self.weights.iter().map(of).reduce(union).unwrap_or(0..0)
    }

    /// Sums the rows of rays, in their order, to rows of samples.
    fn sum(&self, lines: &[Line], rows: Range<usize>) -> Image {
        let used = lines.iter().map(|line| line.bins.clone());
        let used = used.filter(|bins| !bins.is_empty());
        let bins = used.reduce(union).unwrap_or(0..0);
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
            let [v, weight] = line.height;
            for (sums, [_, across]) in line.sums.chunks(line.bins.len()).zip(&self.weights) {
                weights.clear();
                weights.resize(rows.len(), 0.0);
                across.add(v, weight, rows.start, &mut weights);
                for (row, weight) in weights.iter().enumerate().filter(|(_, w)| **w != 0.0) {
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
    panels: &'a [Panel],
    work: &'a mut Work,
    line: &'a mut Line,
}

impl simd_set::Work for Cast<'_, '_> {
    type Out = ();

    #[inline(always)]
    fn run(mut self) {
        let n_nodes = self.view.response.n_nodes();
        let mut mixed = vec![0.0; n_nodes];
        for panel in self.panels {
            let positions = panel.positions();
            self.work.depths.clear();
            self.work.depths.resize(positions.len() * n_nodes, 0.0);
            for (k, u) in positions.iter().enumerate() {
                self.cast(*u, k * n_nodes);
            }
            let nodes = panel.nodes();
            if !panel.interpolates() {
                for ([u, weight], depths) in nodes.iter().zip(self.work.depths.chunks(n_nodes)) {
                    add_to_bins(self.view, self.line, *u, *weight, depths);
                }
                continue;
            }
            let Work {
                matrices, depths, ..
            } = &mut *self.work;
            let matrix = (matrices.entry(panel.sizes())).or_insert_with(|| panel.interpolation());
            for ([u, weight], parts) in nodes.iter().zip(matrix.chunks(positions.len())) {
                mixed.fill(0.0);
                for (part, depths) in parts.iter().zip(depths.chunks(n_nodes)) {
                    for (sum, depth) in mixed.iter_mut().zip(depths) {
                        *sum += part * depth;
                    }
                }
                add_to_bins(self.view, self.line, *u, *weight, &mixed);
            }
        }
    }
}

impl Cast<'_, '_> {
    /// Writes the integrals of the nodes of the response along a ray.
    #[inline(always)]
    fn cast(&mut self, u: f64, at: usize) {
        let response = self.view.response;
        let Work {
            finder,
            integrals,
            depths,
            emissions: found,
            ..
        } = &mut *self.work;
        self.line.rays += 1;
        let stretches = finder.stretches(self.assembly, self.shown, &self.row.ray(u));
        if stretches.is_empty() {
            return;
        }
        self.line.hit += 1;
        integrals.clear();
        integrals.resize(response.n_nodes(), 0.0);
        emissions(stretches, found);
        for own in found.iter() {
            response.add_integrals(own, integrals);
        }
        self.line.largest = self.line.largest.max(integrals[0].abs());
        response.add_nodes(integrals, &mut depths[at..][..response.n_nodes()]);
    }
}

/// Adds the integrals of the nodes of the response at a position to the bins of a row.
#[inline(always)]
fn add_to_bins(view: &View<'_>, line: &mut Line, u: f64, weight: f64, depths: &[f64]) {
    let sums = line.sums.chunks_exact_mut(line.bins.len().max(1));
    for ((sums, depth), [along, _]) in sums.zip(depths).zip(&view.weights) {
        along.add(u, weight * depth, line.bins.start, sums);
    }
}

/// Work arrays of a row.
#[derive(Debug, Default)]
struct Work {
    finder: Finder,
    breaks: Vec<f64>,
    panels: Vec<Panel>,
    /// Integrals of Chebyshev polynomials along a ray, and those of the nodes of the response for the rays of a panel, `[ray][node]`.
    integrals: Vec<f64>,
    depths: Vec<f64>,
    emissions: Vec<Emission>,
    /// Those of [`Panel::interpolation`], by the numbers of nodes.
    matrices: BTreeMap<[usize; 2], Vec<f64>>,
}

fn union(a: Range<usize>, b: Range<usize>) -> Range<usize> {
    a.start.min(b.start)..a.end.max(b.end)
}

/// The smallest and the largest of some numbers.
fn extremes(numbers: &[f64]) -> [f64; 2] {
    let fold = |[low, high]: [f64; 2], x: &f64| [low.min(*x), high.max(*x)];
    numbers
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], fold)
}

//! The parallel-hole camera, and the coarse grid on which its scatter images are collected.

use crate::error::{ScatterError, within};
use std::f64::consts::PI;

/// Number of variances of Gaussians between which a point is distributed, by its depth.
const LEVELS: usize = 8;
/// Variance of a point that is spread to its neighbours, in squares of the pitch.
const SPREAD: f64 = 1.0 / 6.0;
/// Smallest variance of a Gaussian, likewise.
const LEAST: f64 = 1e-3;
/// Largest angle of a view in radians: two turns and their rounding errors; angles in degrees are larger.
const MOST_ANGLE: f64 = 4.0 * PI + 1e-6;
/// Margin of the grid around the detector, in standard deviations of the widest Gaussian.
const TAILS: f64 = 4.0;
/// Largest number of nodes of all views, windows and widths: 512 MB per thread.
const MOST_NODES: f64 = 134_217_728.0;

/// One view: an angle, and the distance of the collimator's face from the axis.
///
/// Bins lie along `(cos angle, sin angle, 0)`, rows along z; the detector faces the body from `radius (-sin angle, cos angle, 0)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Angle in radians: `90f64.to_radians()` for a quarter turn.
    pub angle: f64,
    /// Distance of the face from the axis of rotation in cm.
    pub radius: f64,
}

/// The Gaussian response of collimator and crystal: `sigma(d)^2 = (slope d + at_face)^2 + intrinsic^2` at the distance d from the face,
/// lengths in cm. Points behind the face are imaged as points on it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Response {
    /// Growth of the geometric standard deviation with distance.
    pub slope: f64,
    /// Geometric standard deviation at the face.
    pub at_face: f64,
    /// Standard deviation of the crystal.
    pub intrinsic: f64,
}

impl Response {
    fn variance(&self, distance: f64) -> f64 {
        (self.slope * distance.max(0.0) + self.at_face).powi(2) + self.intrinsic.powi(2)
    }
}

/// A parallel-hole camera. Bin k of n is centred at `(k - (n - 1) / 2) pitch`, rows likewise.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    size: [usize; 2],
    pitch: [f64; 2],
    views: Vec<View>,
    response: Response,
}

impl Camera {
    /// A camera of `size` bins and rows that are `pitch` cm apart.
    ///
    /// # Errors
    /// [`ScatterError::OutOfRange`] for no view or more than 100 000, no bin or row or more than 16 384, a pitch outside 1e-4 to 1e3 cm, an
    /// angle beyond 4 pi, or beyond pi if all angles are whole numbers (degrees as radians), a radius that is not positive or above 1e3 cm, and
    /// widths outside 0 to 100 cm.
    pub fn new(
        size: [usize; 2],
        pitch: [f64; 2],
        views: &[View],
        response: Response,
    ) -> Result<Self, ScatterError> {
        within("number of views", views.len() as f64, [1.0, 1e5])?;
        for axis in 0..2 {
            within("number of bins or rows", size[axis] as f64, [1.0, 16_384.0])?;
            within("pitch in cm", pitch[axis], [1e-4, 1e3])?;
        }
        let (what, most) = match views.iter().all(|view| view.angle.fract() == 0.0) {
            true => (
                "angle of a view in radians, a whole number as degrees are,",
                PI,
            ),
            false => ("angle of a view in radians", MOST_ANGLE),
        };
        for view in views {
            within(what, view.angle, [-most, most])?;
            let radii = [f64::MIN_POSITIVE, 1e3];
            within("radius of a view in cm", view.radius, radii)?;
        }
        within("slope of the response", response.slope, [0.0, 1.0])?;
        within("width at the face in cm", response.at_face, [0.0, 100.0])?;
        within("intrinsic width in cm", response.intrinsic, [0.0, 100.0])?;
        Ok(Self {
            size,
            pitch,
            views: views.to_vec(),
            response,
        })
    }

    pub(crate) fn views(&self) -> &[View] {
        &self.views
    }
}

/// The nodes of the coarse grid, and the distribution of points to them.
#[derive(Debug, Clone)]
pub(crate) struct Grid {
    camera: Camera,
    /// Directions of the bins and towards the detector for each view.
    axes: Vec<[[f64; 2]; 2]>,
    pub(crate) windows: usize,
    /// Pitch of the nodes, columns and rows of them.
    pitch: f64,
    pub(crate) size: [usize; 2],
    /// Variances of the Gaussians, in squares of the pitch; [`SPREAD`], the variance of the points, may be larger.
    variances: Vec<f64>,
    /// Weights of columns and rows in the sum over the bins times their area.
    totals: [Vec<f64>; 2],
}

impl Grid {
    pub(crate) fn new(camera: &Camera, windows: usize, pitch: f64) -> Result<Self, ScatterError> {
        let axes = camera.views.iter().map(|view| {
            let (sine, cosine) = view.angle.sin_cos();
            [[cosine, sine], [-sine, cosine]]
        });
        let radii = camera.views.iter().map(|view| view.radius);
        let widest = radii.fold(0.0, f64::max);
        let ends = [0.0, 2.0 * widest].map(|d| camera.response.variance(d) / pitch.powi(2));
        let [near, far] = ends.map(|variance| variance.max(LEAST));
        let levels = if far > near { LEVELS } else { 1 };
        let level = |k: usize| near * (far / near).powf(k as f64 / (levels - 1).max(1) as f64);
        let margin = TAILS * camera.response.variance(2.0 * widest).sqrt() + 4.0 * pitch;
        let size = [0, 1].map(|axis| {
            let half = 0.5 * camera.size[axis] as f64 * camera.pitch[axis] + margin;
            2 * (half / pitch).ceil() as usize + 1
        });
        let images = (camera.views.len() * windows * levels) as f64;
        let nodes = size[0] as f64 * size[1] as f64 * images;
        if nodes > MOST_NODES {
            return Err(ScatterError::Nodes {
                nodes,
                most: MOST_NODES,
                size,
                pitch,
            });
        }
        let mut grid = Self {
            axes: axes.collect(),
            camera: camera.clone(),
            windows,
            pitch,
            size,
            variances: (0..levels).map(level).collect(),
            totals: [Vec::new(), Vec::new()],
        };
        grid.totals = grid.bin_totals();
        Ok(grid)
    }

    /// The same nodes for some of the views.
    pub(crate) fn of_views(&self, views: &[usize]) -> Self {
        let mut some = self.clone();
        some.camera.views = views.iter().map(|view| self.camera.views[*view]).collect();
        some.axes = views.iter().map(|view| self.axes[*view]).collect();
        some
    }

    /// Number of values that points are added to.
    pub(crate) fn n_deposits(&self) -> usize {
        self.variances.len() * self.n_nodes()
    }

    /// Number of nodes of all views and windows.
    pub(crate) fn n_nodes(&self) -> usize {
        self.size[0] * self.size[1] * self.axes.len() * self.windows
    }

    pub(crate) fn n_views(&self) -> usize {
        self.axes.len()
    }

    /// Standard deviation of the response at a distance from the face, in pitches.
    pub(crate) fn width(&self, distance: f64) -> f64 {
        let variance = self.camera.response.variance(distance) / self.pitch.powi(2);
        variance.max(LEAST).sqrt()
    }

    /// Distance of a point from the nearest face.
    pub(crate) fn nearest(&self, [x, y, _]: [f64; 3]) -> f64 {
        let views = self.camera.views.iter().zip(&self.axes);
        let distances = views.map(|(view, [_, [dx, dy]])| view.radius - (x * dx + y * dy));
        distances.fold(f64::INFINITY, f64::min)
    }

    /// Direction towards the detector of each view.
    pub(crate) fn directions(&self) -> impl Iterator<Item = [f64; 3]> {
        self.axes.iter().map(|[_, [x, y]]| [*x, *y, 0.0])
    }

    /// Smallest area in cm^2 over which a photon is averaged: of a bin, or of the response at the face.
    pub(crate) fn least_area(&self) -> f64 {
        let [across, along] = self.camera.pitch;
        (across * along).max(2.0 * PI * self.camera.response.variance(0.0))
    }

    /// Half-widths of the nodes along x, y and z in cm, from any direction.
    pub(crate) fn half_widths(&self) -> [f64; 3] {
        let [across, along] = self.size.map(|n| 0.5 * (n - 1) as f64 * self.pitch);
        [across, across, along]
    }

    /// Whether any point at this height is on the grid.
    pub(crate) fn has_row(&self, z: f64) -> bool {
        z.abs() < 0.5 * (self.size[1] - 1) as f64 * self.pitch
    }

    /// Place of a point in a view; `None` outside the grid.
    #[inline]
    pub(crate) fn place(&self, view: usize, [x, y, z]: [f64; 3]) -> Option<Place> {
        let [[bx, by], [dx, dy]] = self.axes[view];
        let at = [x * bx + y * by, z];
        let mut place = Place::default();
        for axis in 0..2 {
            let node = at[axis] / self.pitch + 0.5 * (self.size[axis] - 1) as f64;
            if !(node >= 0.0 && node < (self.size[axis] - 1) as f64) {
                return None;
            }
            place.node[axis] = node as usize;
            place.share[axis] = node - node.floor();
        }
        place.distance = self.camera.views[view].radius - (x * dx + y * dy);
        place.first = (view * self.size[1] + place.node[1]) * self.size[0] + place.node[0];
        Some(place)
    }

    /// Adds a value per window at a place to deposits `[view][row][column][window][level]`.
    #[inline]
    pub(crate) fn add(&self, place: &Place, values: impl Fn(usize) -> f64, deposits: &mut [f32]) {
        let variance = self.camera.response.variance(place.distance) / self.pitch.powi(2);
        let levels = self.variances.len();
        let above = self.variances.partition_point(|level| *level <= variance);
        let lower = above.saturating_sub(1).min(levels.saturating_sub(2));
        let upper = match self.variances.get(lower + 1) {
            Some(next) => (variance - self.variances[lower]) / (next - self.variances[lower]),
            None => 0.0,
        };
        let upper = upper.clamp(0.0, 1.0);
        let area = self.pitch * self.pitch;
        let [columns, rows] = place.share.map(|share| [1.0 - share, share]);
        for (dz, row) in rows.into_iter().enumerate() {
            for (dx, column) in columns.into_iter().enumerate() {
                let node = place.first + dz * self.size[0] + dx;
                for window in 0..self.windows {
                    let value = row * column * values(window) / area;
                    let at = (node * self.windows + window) * levels + lower;
                    deposits[at] += (value * (1.0 - upper)) as f32;
                    if upper > 0.0 {
                        deposits[at + 1] += (value * upper) as f32;
                    }
                }
            }
        }
    }

    /// Blurs deposits into images on the nodes, `[view][window][row][column]`, times a factor.
    pub(crate) fn images(&self, deposits: &[f32], factor: f32) -> Vec<f32> {
        let [nx, nz] = self.size;
        let levels = self.variances.len();
        let stride = self.windows * levels;
        let mut images = vec![0.0f32; self.n_nodes()];
        let mut scratch = vec![0.0f32; nx];
        for (image_idx, image) in images.chunks_mut(nx * nz).enumerate() {
            let (view, window) = (image_idx / self.windows, image_idx % self.windows);
            let own = &deposits[view * nx * nz * stride..(view + 1) * nx * nz * stride];
            // The order is from the widest to the narrowest: each is blurred by its difference from the next.
            for level in (0..levels).rev() {
                let at = window * levels + level;
                for (value, deposit) in image.iter_mut().zip(own.chunks(stride)) {
                    *value += deposit[at] * factor;
                }
                let next = level.checked_sub(1).map_or(SPREAD, |k| self.variances[k]);
                blur(image, nx, self.variances[level] - next, &mut scratch);
            }
        }
        images
    }

    /// First node and the weights of nodes in the average over each bin or row of the cubics, or lines, between the nodes.
    fn taps(&self, axis: usize, cubic: bool) -> Vec<(usize, Vec<f64>)> {
        let n = self.camera.size[axis];
        let edge = |k: usize| {
            let at = (k as f64 - 0.5 * n as f64) * self.camera.pitch[axis];
            at / self.pitch + 0.5 * (self.size[axis] - 1) as f64
        };
        let tap = |k: usize| {
            let (from, to) = (edge(k), edge(k + 1));
            let first = from as usize;
            let mut averages = vec![0.0; to.ceil() as usize - first + 3];
            for cell in first..to.ceil() as usize {
                let start = cell as f64;
                let (low, high) = (from.max(start), to.min(start + 1.0));
                // Two Gaussian points integrate cubics exactly.
                for side in [-1.0, 1.0] {
                    let t = 0.5 * (low + high + side * (high - low) / 3f64.sqrt()) - start;
                    let part = 0.5 * (high - low) / (to - from);
                    let own = averages[cell - first..].iter_mut();
                    own.zip(weights(t, cubic)).for_each(|(a, b)| *a += part * b);
                }
            }
            (first - 1, averages)
        };
        (0..n).map(tap).collect()
    }

    /// Weights of the columns and rows of nodes in the sum over the bins times their area.
    fn bin_totals(&self) -> [Vec<f64>; 2] {
        [0, 1].map(|axis| {
            let mut totals = vec![0.0; self.size[axis]];
            for (first, weights) in self.taps(axis, true) {
                for (k, weight) in weights.into_iter().enumerate() {
                    totals[first + k] += weight * self.camera.pitch[axis];
                }
            }
            totals
        })
    }

    /// Sum over the bins of an image on the nodes, times their area.
    pub(crate) fn sum(&self, image: &[f32]) -> f64 {
        let lines = image.chunks(self.size[0]).zip(&self.totals[1]);
        let lines = lines.filter(|(_, weight)| **weight != 0.0);
        let line = |values: &[f32]| -> f64 {
            let pairs = values.iter().zip(&self.totals[0]);
            let products = pairs.map(|(value, weight)| f64::from(*value) * weight);
            products.sum()
        };
        lines.map(|(values, weight)| weight * line(values)).sum()
    }

    /// Averages a view of images on the nodes over the bins, `[row][bin]`: of cubics, or linear.
    pub(crate) fn to_bins(&self, image: &[f64], cubic: bool) -> Vec<f64> {
        let taps = [0, 1].map(|axis| self.taps(axis, cubic));
        let mut out = Vec::with_capacity(taps[0].len() * taps[1].len());
        for (row, down) in &taps[1] {
            for (column, across) in &taps[0] {
                let lines = image[row * self.size[0] + column..].chunks(self.size[0]);
                let line = |(nodes, weight): (&[f64], &f64)| {
                    let products = nodes.iter().zip(across).map(|(a, b)| a * b);
                    weight * products.sum::<f64>()
                };
                out.push(lines.zip(down).map(line).sum());
            }
        }
        out
    }

    /// Rows and columns of the nodes from which bins are interpolated.
    pub(crate) fn used(&self) -> [std::ops::Range<usize>; 2] {
        [1, 0].map(|axis| {
            let half = 0.5 * self.camera.size[axis] as f64 * self.camera.pitch[axis];
            let reach = (half / self.pitch).ceil() as usize;
            let middle = (self.size[axis] - 1) / 2;
            middle - reach..middle + reach + 1
        })
    }
}

/// The position of a point on the grid of a view.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Place {
    node: [usize; 2],
    share: [f64; 2],
    /// Distance from the face.
    distance: f64,
    first: usize,
}

/// Weights of four neighbours for the place t in [0, 1) between the inner two: Lagrange's cubic or the line.
fn weights(t: f64, cubic: bool) -> [f64; 4] {
    if !cubic {
        return [0.0, 1.0 - t, t, 0.0];
    }
    let (a, b, c) = (t + 1.0, t - 1.0, t - 2.0);
    [
        -t * b * c / 6.0,
        a * b * c / 2.0,
        -a * t * c / 2.0,
        a * t * b / 6.0,
    ]
}

/// Blurs an image in place by a kernel of exact variance (squares of the pitch) along both axes: repeated three-point averages, which sharpen
/// if the variance is negative (at least -1/6). Averages of variance 1/3 have the fourth cumulant of a Gaussian, 0.
fn blur(image: &mut [f32], nx: usize, variance: f64, scratch: &mut [f32]) {
    let passes = (3.0 * variance.abs()).round().max(1.0) as usize;
    let side = (0.5 * variance / passes as f64) as f32;
    for _ in 0..passes {
        for line in image.chunks_mut(nx) {
            scratch.copy_from_slice(line);
            for (value, three) in line[1..].iter_mut().zip(scratch.windows(3)) {
                *value += side * (three[0] + three[2] - 2.0 * three[1]);
            }
        }
        // The original value of the previous line.
        scratch.fill(0.0);
        let rows = image.len() / nx;
        for row in 0..rows {
            let (here, below) = image[row * nx..].split_at_mut(nx);
            let above = scratch.iter_mut().zip(&mut *here);
            if row + 1 == rows {
                above.for_each(|(above, here)| *here += side * (*above - 2.0 * *here));
                break;
            }
            for ((above, here), below) in above.zip(&*below) {
                let own = *here;
                *here += side * (*above + below - 2.0 * own);
                *above = own;
            }
        }
    }
}

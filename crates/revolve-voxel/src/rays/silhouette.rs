//! The silhouette of a body along one direction, with a small margin: rays outside it are never cast.

use std::ops::Range;

use crate::rays::direction::Direction;
use crate::solid::meridian::Meridian;

/// Most bands of |q|; the bounds of a band are those at its inner edge, where the silhouette is widest.
const MOST_BANDS: usize = 64;
/// Bands per spacing of the rays: narrower bands exclude few further rays, and wider ones take less time to bound.
const BANDS: f64 = 4.0;

/// Number of boxes for a silhouette accurate to a few per cent of the size of the body.
const BLOCKS: usize = 64;

/// Bounds of w over bands of |q|.
#[derive(Debug, Clone)]
pub(crate) struct Silhouette {
    bands: Vec<[f64; 2]>,
    per_q: f64,
    r_max: f64,
}

/// The bounds of all bands by blocks: the widest bands of each block first, contiguous in memory.
struct Bounds<'a> {
    /// [x_min, x_max, r_min, r_max].
    blocks: &'a [[f64; 4]],
    mid: f64,
    direction: [f64; 2],
    margin: f64,
    /// Inner edges of the bands, signed, and their squares with that sign.
    edges: &'a [f64],
    squares: &'a [f64],
}

impl simd_set::Work for Bounds<'_> {
    type Out = Vec<[f64; 2]>;

    #[inline(always)]
    fn run(self) -> Self::Out {
        let [s, c] = self.direction;
        let mut least = [f64::INFINITY; MOST_BANDS + 1];
        let mut most = [f64::NEG_INFINITY; MOST_BANDS + 1];
        for &[x0, x1, _, r] in self.blocks {
            let [x0, x1] = [x0 - self.mid, x1 - self.mid];
            let n = self.edges.partition_point(|q| *q <= r);
            let bands = least.iter_mut().zip(&mut most).zip(self.squares);
            for ((least, most), square) in bands.take(n) {
                let y = c * (r * r - square).max(0.0).sqrt();
                // None is NaN: comparisons take half the time of `min` and `max`.
                let (low, high) = (-s * x1 - y - self.margin, -s * x0 + y + self.margin);
                *least = if low < *least { low } else { *least };
                *most = if high > *most { high } else { *most };
            }
        }
        let bands = least.into_iter().zip(most).take(self.edges.len());
        bands.map(<[f64; 2]>::from).collect()
    }
}

impl Silhouette {
    /// `spacing` is the least distance of parallel rays from each other.
    pub(crate) fn new(meridian: &Meridian, direction: &Direction, spacing: f64) -> Self {
        let r_max = meridian.r_max();
        let n_bands = (BANDS * r_max / spacing).clamp(1.0, MOST_BANDS as f64) as usize;
        // Outward by more than the rounding of w.
        let [low, high] = meridian.x_range();
        let edge = |k: usize| (k as f64 - 1e-6) * r_max / n_bands as f64;
        let edges: [f64; MOST_BANDS + 1] = std::array::from_fn(edge);
        let squares = edges.map(|q| q * q.abs());
        let bands = simd_set::Set::detect().run(Bounds {
            blocks: meridian.boxes().level(BLOCKS),
            mid: meridian.mid(),
            direction: [direction.s, direction.c.abs()],
            margin: 1e-12 * (high - low + r_max) + direction.near,
            edges: &edges[..=n_bands],
            squares: &squares[..=n_bands],
        });
        Self {
            bands,
            per_q: n_bands as f64 / r_max,
            r_max,
        }
    }

    #[inline(always)]
    pub(crate) fn holds(&self, w: f64, q: f64) -> bool {
        let band = (q.abs() * self.per_q) as usize;
        self.bands.get(band).is_some_and(|b| b[0] <= w && w <= b[1])
    }

    /// The bins of a row (start + k step) within the silhouette's bounding box.
    pub(crate) fn bins(&self, start: [f64; 2], step: [f64; 2], n: usize) -> Range<usize> {
        let [a, b] = self.bands[0];
        let wide = interval(start[0], step[0], [a, b], n);
        let high = interval(start[1], step[1], [-self.r_max, self.r_max], n);
        wide.start.max(high.start)..wide.end.min(high.end)
    }
}

/// Indices k in 0..n with start + k step in [low, high], widened by one on either side.
fn interval(start: f64, step: f64, [low, high]: [f64; 2], n: usize) -> Range<usize> {
    if step == 0.0 {
        return if low <= start && start <= high {
            0..n
        } else {
            0..0
        };
    }
    let (a, b) = ((low - start) / step, (high - start) / step);
    let first = (a.min(b).ceil() - 1.0).max(0.0);
    let end = (a.max(b).floor() + 2.0).min(n as f64);
    if first < end {
        first as usize..end as usize
    } else {
        0..0
    }
}

//! Averages over sub-bins: one ray where the image is smooth, a lattice of rays where an edge crosses.
//!
//! With `f` the image before any blur and `h` the sub-bin, the average over a sub-bin is `f + h^2 f'' / 24 + O(h^4)` along each axis. The second
//! difference of the samples at the centres gives the correction. It fails at silhouettes, where `f` is the root of the distance, and at edges of the
//! base or of a defect. Third differences over 24 bound the failure: where they exceed a threshold, the average is that over a
//! Fibonacci lattice of rays: of `F_m` rays number `k` is at `(k + 1/2) / F_m` of the width and at the fractional part of `(k F_(m-1) + 1/2) / F_m` of the
//! height (I. H. Sloan & S. Joe, Lattice Methods for Multiple Integration, 1994, section 4.2).

use revolve_voxel::Capsule;

/// Fibonacci lattices, `[F_(m-1), F_m]`: the first is the centre alone.
pub(crate) const LATTICES: [[usize; 2]; 7] = [
    [1, 1],
    [3, 5],
    [8, 13],
    [21, 34],
    [55, 89],
    [144, 233],
    [377, 610],
];
/// Width of third differences: rows and bins beyond those computed.
pub(super) const STENCIL: usize = 2;

/// Computation of the averages over sub-bins.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Averages {
    /// Positions of the rays in a sub-bin that contains an edge, from its centre in units of its sides.
    pub(crate) lattice: Vec<[f64; 2]>,
    /// Largest third difference over 24, in units of a sample, for which one ray represents a sub-bin.
    pub(crate) threshold: f64,
    /// Region whose sub-bins always use the lattice: a heart so small that single rays may miss it.
    pub(crate) dense: Option<Capsule>,
}

impl Averages {
    /// Uses one of the [`LATTICES`].
    pub(crate) fn new(lattice: usize, threshold: f64, dense: Option<Capsule>) -> Self {
        let [before, n] = LATTICES[lattice];
        let centre = |k: usize| (k as f64 + 0.5) / n as f64 - 0.5;
        Self {
            lattice: (0..n)
                .map(|k| [centre(k), centre(k * before % n)])
                .collect(),
            threshold,
            dense,
        }
    }
}

/// Dimensions of an unfinished image, `[row][slab][bin]`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Layout {
    pub(super) rows: usize,
    pub(super) slabs: usize,
    pub(super) bins: usize,
}

impl Layout {
    /// The sum over the slabs, and its first moment over depth (-1 to 1): `[row][bin]` both.
    pub(super) fn moments(self, image: &[f32]) -> [Vec<f32>; 2] {
        let Self { rows, slabs, bins } = self;
        let mut moments = [vec![0.0f32; rows * bins], vec![0.0f32; rows * bins]];
        for (k, line) in image.chunks(bins).enumerate() {
            let (row, slab) = (k / slabs, k % slabs);
            let depth = (2 * slab + 1) as f32 / slabs as f32 - 1.0;
            for (moment, weight) in moments.iter_mut().zip([1.0, depth]) {
                let sums = &mut moment[row * bins..][..bins];
                for (sum, value) in sums.iter_mut().zip(line) {
                    *sum += weight * value;
                }
            }
        }
        moments
    }

    /// The sub-bins in which one ray is not enough.
    pub(super) fn flags(self, image: &[f32], threshold: f64) -> Vec<bool> {
        let Self { rows, bins, .. } = self;
        let mut flags = vec![false; rows * bins];
        let most = (24.0 * threshold) as f32;
        for moment in self.moments(image) {
            let mut flag = |[a, b, c, d]: [usize; 4]| {
                let third = moment[d] - moment[a] + 3.0 * (moment[b] - moment[c]);
                if third.abs() > most {
                    flags[b] = true;
                    flags[c] = true;
                }
            };
            for row in 0..rows {
                for bin in 0..bins {
                    let at = row * bins + bin;
                    if bin + 3 < bins {
                        flag([0, 1, 2, 3].map(|k| at + k));
                    }
                    if row + 3 < rows {
                        flag([0, 1, 2, 3].map(|k| at + k * bins));
                    }
                }
            }
        }
        flags
    }

    /// Converts samples at centres to averages: flagged ones become zero, the others gain 1/24 of their second differences.
    pub(super) fn average(self, image: &mut [f32], flags: &[bool]) {
        let Self { rows, slabs, bins } = self;
        if image.is_empty() {
            return;
        }
        let line = slabs * bins;
        // The unmodified previous row.
        let mut before: Vec<f32> = Vec::new();
        for row in 0..rows {
            let (here, after) = image[row * line..].split_at_mut(line);
            let own = here.to_vec();
            let after = after.get(..line);
            for slab in 0..slabs {
                for bin in 0..bins {
                    let at = slab * bins + bin;
                    if flags[row * bins + bin] {
                        here[at] = 0.0;
                        continue;
                    }
                    let mut second = 0.0;
                    if bin > 0 && bin + 1 < bins {
                        second += own[at - 1] - 2.0 * own[at] + own[at + 1];
                    }
                    if let (false, Some(after)) = (before.is_empty(), after) {
                        second += before[at] - 2.0 * own[at] + after[at];
                    }
                    here[at] += second / 24.0;
                }
            }
            before = own;
        }
    }
}

//! How many rays of a bin its mean takes.

use super::Phantom;
use crate::Acquisition;
use crate::error::PhantomError;
use crate::scan::{BinSample, Scan, lattice};

/// Rays of each bin, and the estimated relative error of the views (Euclidean norm) that they make.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize))]
#[non_exhaustive]
pub struct BinMeans {
    /// Rays of each bin.
    pub rays: usize,
    /// Half the difference from what some 2.6 times fewer rays make, in two views of the smallest heart.
    pub error: f64,
}

impl Phantom {
    /// How the means over bins are made; `None` where samples are lines ([`BinSample::Centres`]). It is tried once, on the first view and
    /// the middle one, lines before any blur, the heart as small as it gets: then its edges count most.
    ///
    /// # Errors
    /// [`PhantomError::BinMeans`] if that takes too many rays; what solving the shape can return.
    pub fn bin_means(&self) -> Result<Option<BinMeans>, PhantomError> {
        Ok(self.tried_lattice()?.map(|(means, _)| means))
    }

    /// Where the rays of each bin are, from its middle in shares of its sides.
    pub(super) fn lattice(&self) -> Result<Vec<[f64; 2]>, PhantomError> {
        let at = self.tried_lattice()?.map_or(0, |(_, at)| at);
        Ok(lattice(BinSample::LATTICES[at]))
    }

    fn tried_lattice(&self) -> Result<Option<(BinMeans, usize)>, PhantomError> {
        let BinSample::Means { tolerance } = self.scene().camera.samples else {
            return Ok(None);
        };
        if let Some(known) = self.bins.get() {
            return Ok(Some(*known));
        }
        let mut before = self.two_views(0)?;
        let mut reached = f64::INFINITY;
        for at in 1..BinSample::LATTICES.len() {
            let views = self.two_views(at)?;
            let square = |v: f64| v * v;
            let off: f64 = views
                .iter()
                .zip(&before)
                .map(|(a, b)| square(f64::from(a - b)))
                .sum();
            let all: f64 = views.iter().map(|v| square(f64::from(*v))).sum();
            reached = if all > 0.0 {
                0.5 * (off / all).sqrt()
            } else {
                0.0
            };
            if reached <= tolerance {
                let [_, rays] = BinSample::LATTICES[at];
                let means = BinMeans {
                    rays,
                    error: reached,
                };
                return Ok(Some(*self.bins.get_or_init(|| (means, at))));
            }
            before = views;
        }
        let rays = BinSample::LATTICES[BinSample::LATTICES.len() - 1][1];
        Err(PhantomError::BinMeans {
            reached,
            tolerance,
            rays,
        })
    }

    /// Lines of the first view and of the middle one by some lattice.
    fn two_views(&self, at: usize) -> Result<Vec<f32>, PhantomError> {
        let small = self.extreme_phases()[0];
        let scan = Scan {
            lattice: lattice(BinSample::LATTICES[at]),
            ..self.scan(self.camera(), 0, Acquisition::still(small))
        };
        let mut samples = Vec::new();
        for view_idx in [0, self.camera().n_views() / 2] {
            let taken = scan.rows(view_idx..view_idx + 1, 0..self.camera().n_rows(), &|_| ())?;
            self.work.rays(taken.rays);
            samples.extend(taken.samples);
        }
        Ok(samples)
    }
}

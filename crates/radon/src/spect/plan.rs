//! The plan: everything that does not depend on the samples.

use rayon::prelude::*;

use super::attenuation::Escape;
use super::axial::Axial;
use super::depth::Frame;
use super::lanes::{LANES, Lanes};
use super::turned::{Turned, View, reach};
use super::{SpectGeometry, SpectOptions};
use crate::error::{RadonError, length, product, within, zeros};
use crate::iterative::{check_not_negative, check_samples};
use crate::{ImageGrid, InstructionSet, Sample, SliceAxis};

/// Margin of bins and rows beyond the detector in standard deviations, for blur into and out of the detector.
const MARGIN: f64 = 4.0;

/// Views and their common data.
#[derive(Debug)]
pub(crate) struct Plan<T> {
    pub(super) geometry: SpectGeometry,
    pub(super) views: Vec<View<T>>,
    pub(super) axial: Axial<T>,
    /// Samples of a volume.
    pub(super) n_voxels: usize,
    /// Bins and rows with their margins.
    pub(super) frame: Frame,
    /// Bins and rows of the margin before the detector's.
    pub(super) margin: [usize; 2],
    pub(super) attenuation: Option<Attenuation<T>>,
    pub(super) instructions: InstructionSet,
}

/// An attenuation map in blocks of rows.
#[derive(Debug)]
pub(super) struct Attenuation<T> {
    pub(super) map: Vec<Lanes<T>>,
    pub(super) escape: Escape<T>,
}

impl<T: Sample> Plan<T> {
    pub(crate) fn new(
        geometry: &SpectGeometry,
        grid: &ImageGrid,
        layers: &SliceAxis,
        options: &SpectOptions<T>,
    ) -> Result<Self, RadonError> {
        within("tolerance", options.tolerance, 1e-6, 0.1)?;
        let (views, rows) = (geometry.views(), geometry.rows());
        let [dx, dy] = grid.spacing();
        for (pitch, spacing) in [
            (views.pitch(), dx),
            (views.pitch(), dy),
            (rows.spacing(), layers.spacing()),
        ] {
            within("pitch in voxels", pitch / spacing, 1e-2, 1e2)?;
        }
        let n_voxels = product("volume", grid.image_len(), layers.n_slices())?;
        let farthest = geometry.radii().iter().fold(0.0, |m: f64, &r| m.max(r)) + reach(grid);
        let widest = options.collimator.sigma(farthest);
        let mut margin = [0; 2];
        for (margin, pitch) in margin.iter_mut().zip([views.pitch(), rows.spacing()]) {
            let bins = MARGIN * widest / pitch;
            within("margin in bins", bins, 0.0, 1e4)?;
            *margin = bins.ceil() as usize;
        }
        let [bins, before] = [margin[0], margin[1].next_multiple_of(LANES)];
        let frame = Frame {
            n_bins: views.n_bins() + 2 * bins,
            n_blocks: (before + rows.n_slices() + margin[1]).div_ceil(LANES),
        };
        product("frame", frame.n_bins, LANES * frame.n_blocks)?;
        let turned = Turned::new(geometry, grid, frame.n_bins, bins)?;
        let axial = Axial::new(grid, layers, rows, before, frame.n_blocks)?;
        let attenuation = match options.attenuation.as_slice() {
            [] => None,
            map => {
                length("attenuation map", map.len(), n_voxels)?;
                check_samples("attenuation map", map)?;
                check_not_negative("attenuation map", map)?;
                Some(Attenuation::new(map, &axial, turned.depth)?)
            }
        };
        let of_view = |view| {
            simd_set::checkpoint();
            turned.view(view, &axial, &options.collimator, options.tolerance)
        };
        let views = (0..views.n_views()).into_par_iter().map(of_view);
        let views = views.collect::<Result<_, _>>()?;
        Ok(Self {
            geometry: geometry.clone(),
            views,
            axial,
            n_voxels,
            frame,
            margin: [bins, before],
            attenuation,
            instructions: InstructionSet::detect(),
        })
    }
}

impl<T: Sample> Attenuation<T> {
    fn new(map: &[T], axial: &Axial<T>, depth: f64) -> Result<Self, RadonError> {
        let most = map.iter().fold(0.0, |m: f64, x| m.max(x.f64()));
        within("optical thickness of a voxel", most * depth, 0.0, 1e6)?;
        let mut blocks = zeros("attenuation map", axial.block_len, axial.blocks.len())?;
        axial.read(map, &mut blocks);
        Ok(Self {
            map: blocks,
            escape: Escape::new(most * depth),
        })
    }
}

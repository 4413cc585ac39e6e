//! The plan: everything that does not depend on the samples.

use rayon::prelude::*;

use super::attenuation::Escape;
use super::axial::Axial;
use super::blur::Blur;
use super::turned::{Turned, View, reach};
use super::{SpectGeometry, SpectOptions};
use crate::error::{RadonError, length, product, within, zeros};
use crate::iterative::{check_not_negative, check_samples};
use crate::simd::Lanes;
use crate::{ImageGrid, InstructionSet, Sample, SliceAxis};

/// Largest standard deviation of a response, in bins or rows.
const WIDEST: f64 = 2500.0;

/// Views and their common data.
#[derive(Debug)]
pub(crate) struct Plan<T> {
    pub(super) geometry: SpectGeometry,
    pub(super) views: Vec<View<T>>,
    pub(super) axial: Axial<T>,
    /// Samples of a volume.
    pub(super) n_voxels: usize,
    pub(super) blur: Blur<T>,
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
        let turned = Turned::new(geometry, grid)?;
        let (collimator, beyond) = (&options.collimator, reach(grid) + turned.depth);
        let ends = [
            (f64::INFINITY, f64::min as fn(f64, f64) -> f64, -beyond),
            (0.0, f64::max, beyond),
        ];
        let ends = ends
            .map(|(start, of, beyond)| geometry.radii().iter().copied().fold(start, of) + beyond);
        let pitch = [views.pitch(), rows.spacing()];
        for pitch in pitch {
            within(
                "width of the response in bins",
                collimator.sigma(ends[1]) / pitch,
                0.0,
                WIDEST,
            )?;
        }
        let variances = ends.map(|distance| turned.variance(collimator, distance));
        let blur = Blur::new(variances, pitch, options.tolerance, views.n_bins())?;
        let [margin, margin_of_rows] = blur.margin();
        let turned = turned.with_margin(margin)?;
        let axial = Axial::new(grid, layers, rows, margin_of_rows)?;
        let attenuation = match options.attenuation.as_slice() {
            [] => None,
            map => {
                length("attenuation map", map.len(), n_voxels)?;
                check_samples("attenuation map", map)?;
                check_not_negative("attenuation map", map)?;
                Some(Attenuation::new(map, &axial, turned.depth)?)
            }
        };
        let mut attenuates = vec![false; axial.block_len];
        for (k, _) in options
            .attenuation
            .iter()
            .enumerate()
            .filter(|(_, x)| **x > T::ZERO)
        {
            let pixel = k % grid.image_len();
            attenuates[axial.place(pixel % grid.nx(), pixel / grid.nx())] = true;
        }
        let of_view = |view| turned.view(view, &axial, (collimator, &blur), &attenuates);
        let views = (0..views.n_views()).into_par_iter().map(of_view);
        let views = views.collect::<Result<_, _>>()?;
        Ok(Self {
            geometry: geometry.clone(),
            views,
            axial,
            n_voxels,
            blur,
            attenuation,
            instructions: InstructionSet::detect(),
        })
    }
}

impl<T: Sample> Attenuation<T> {
    fn new(map: &[T], axial: &Axial<T>, depth: f64) -> Result<Self, RadonError> {
        let most = map.iter().fold(0.0, |m: f64, x| m.max(x.f64()));
        within("optical thickness of a voxel", most * depth, 0.0, 1e6)?;
        let mut blocks = zeros("attenuation map", axial.block_len, axial.rows.n_blocks)?;
        axial.read(InstructionSet::detect(), map, &mut blocks);
        Ok(Self {
            map: blocks,
            escape: Escape::new(most * depth),
        })
    }
}

//! The plan: everything that does not depend on the samples.

use std::sync::Arc;

use super::attenuation::Escape;
use super::axial::Axial;
use super::blur::Blur;
use super::collimator::Collimator;
use super::geometry::SpectGeometry;
use super::options::SpectOptions;
use super::turned::{Turned, View, reach};
use crate::error::{RadonError, length, product, room, within, zeros};
use crate::iterative::{check_not_negative, check_samples};
use crate::simd::Lanes;
use crate::{ImageGrid, InstructionSet, Sample, SliceAxis, parallel};

/// Largest optical thickness of a voxel: 0.7 % of the photons pass, and the map is probably in another unit.
const THICKEST: f64 = 5.0;
/// Fraction of the largest attenuation coefficient that voxels of the body exceed; noise in the air of a measured map does not.
const BODY: f64 = 0.05;
/// Largest standard deviation of a response, in bins or rows.
const WIDEST: f64 = 2500.0;

/// Views and their common data.
#[derive(Debug)]
pub(crate) struct Plan<T> {
    pub(super) frame: Arc<Frame<T>>,
    pub(super) views: Arc<Vec<View<T>>>,
    /// For each pixel whether any layer attenuates.
    attenuates: Vec<bool>,
    pub(super) attenuation: Option<Attenuation<T>>,
}

/// Everything that does not depend on the attenuation.
#[derive(Debug)]
pub(super) struct Frame<T> {
    pub(super) geometry: SpectGeometry,
    grid: ImageGrid,
    collimator: Collimator,
    pub(super) axial: Axial<T>,
    /// Samples of a volume.
    pub(super) n_voxels: usize,
    pub(super) blur: Blur<T>,
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
        let [_, margin] = blur.margin();
        drop(room::<T>("a view", rows.n_slices(), views.n_bins())?);
        let frame = Frame {
            geometry: geometry.clone(),
            grid: *grid,
            collimator: *collimator,
            axial: Axial::new(grid, layers, rows, margin)?,
            n_voxels: product("volume", grid.image_len(), layers.n_slices())?,
            blur,
            instructions: InstructionSet::detect(),
        };
        Self::with_map(Arc::new(frame), &options.attenuation, None)
    }

    /// Plans the same views with another attenuation map, or with none if it is empty.
    pub(crate) fn with_attenuation(&self, map: &[T]) -> Result<Self, RadonError> {
        Self::with_map(Arc::clone(&self.frame), map, Some(self))
    }

    /// Plans views with a map; `other` has views of the same frame.
    fn with_map(frame: Arc<Frame<T>>, map: &[T], other: Option<&Self>) -> Result<Self, RadonError> {
        let Frame { grid, axial, .. } = &*frame;
        let turned = Turned::new(&frame.geometry, grid)?;
        let attenuation = match map {
            [] => None,
            map => {
                length("attenuation map", map.len(), frame.n_voxels)?;
                check_samples("attenuation map", map)?;
                check_not_negative("attenuation map", map)?;
                in_front(&frame.geometry, grid, map)?;
                Some(Attenuation::new(map, axial, turned.depth)?)
            }
        };
        let mut attenuates = vec![false; axial.block_len];
        for (k, _) in map.iter().enumerate().filter(|(_, x)| **x > T::ZERO) {
            let pixel = k % grid.image_len();
            attenuates[axial.place(pixel % grid.nx(), pixel / grid.nx())] = true;
        }
        let views = match other.filter(|other| other.attenuates == attenuates) {
            Some(other) => Arc::clone(&other.views),
            None => {
                let turned = turned.with_margin(frame.blur.margin()[0])?;
                let responses = (&frame.collimator, &frame.blur);
                let n_views = frame.geometry.views().n_views();
                let views = parallel::collect(n_views, &|view| {
                    simd_set::unit(n_views);
                    turned.view(view, axial, responses, &attenuates)
                });
                Arc::new(views.into_iter().collect::<Result<_, _>>()?)
            }
        };
        Ok(Self {
            frame,
            views,
            attenuates,
            attenuation,
        })
    }
}

/// `Ok` if no attenuating voxel is behind the face of a view by more than the diagonal of a pixel.
fn in_front<T: Sample>(
    geometry: &SpectGeometry,
    grid: &ImageGrid,
    map: &[T],
) -> Result<(), RadonError> {
    let most = map.iter().fold(T::ZERO, |m, &x| if x > m { x } else { m });
    let (n_pixels, [dx, dy]) = (grid.image_len(), grid.spacing());
    let mut body = vec![false; n_pixels];
    for (k, &x) in map.iter().enumerate() {
        body[k % n_pixels] |= x > T::of(BODY) * most;
    }
    let places = (0..n_pixels).filter(|&k| body[k]);
    let places: Vec<_> = places
        .map(|k| grid.pixel_centre(k % grid.nx(), k / grid.nx()))
        .collect();
    for (theta, &radius) in geometry.views().angles().iter().zip(geometry.radii()) {
        let (sin, cos) = theta.sin_cos();
        let farthest = places.iter().map(|[x, y]| y * cos - x * sin);
        let least = farthest.fold(f64::MIN, f64::max) - dx.hypot(dy);
        within(
            "radius of the orbit outside the attenuating voxels",
            radius,
            least,
            f64::MAX,
        )?;
    }
    Ok(())
}

impl<T: Sample> Attenuation<T> {
    fn new(map: &[T], axial: &Axial<T>, depth: f64) -> Result<Self, RadonError> {
        let most = map.iter().fold(0.0, |m: f64, x| m.max(x.f64()));
        within("optical thickness of a voxel", most * depth, 0.0, THICKEST)?;
        let mut blocks = zeros("attenuation map", axial.block_len, axial.rows.n_blocks)?;
        axial.read(InstructionSet::detect(), map, &mut blocks);
        Ok(Self {
            map: blocks,
            escape: Escape::new(most * depth),
        })
    }
}

//! Quadrature of images behind a response, or averaged over bins: options, responses of all views, memory.

use super::camera::Camera;
use crate::error::{PhantomError, check};
use crate::ranges::UNEVEN;
use radon::Collimator;
use revolve_voxel::{BinValue, DepthResponse, RayCounters, View};
use std::sync::OnceLock;

/// Bound on the weights beyond the reach of the response, and on the interpolation between tabulated weights, relative to the largest line
/// integral.
const TAILS: f64 = 1.2e-6;

/// Name of a limited quantity in errors.
const RATIO: &str =
    "ratio of the widest to the narrowest of the collimator's blur over the depth of the objects";

/// The resolution of the quadrature of an image.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct Resolution {
    /// Quadrature nodes per standard deviation of the narrowest response. If this standard deviation is less than an eighth of a bin: nodes
    /// per bin ([`revolve_voxel::View`]).
    pub density: f64,
    /// Tolerance of the interpolation of the response in depth ([`DepthResponse`]).
    pub depth_tolerance: f64,
}

/// The collimator face of a view and the extent of objects in front of it, cm from the axis towards the face.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Facing {
    pub(crate) radius: f64,
    /// Extent of the heart, and of all activity.
    pub(crate) heart: [f64; 2],
    pub(crate) seen: [f64; 2],
    /// Extent of all objects towards the face.
    pub(crate) body: f64,
}

/// The samples of a view that do not depend on the shape of the heart.
#[derive(Debug)]
pub(crate) struct Fixed {
    /// `[row][bin]` of all rows.
    pub(crate) samples: Vec<f32>,
    /// Largest line integral.
    pub(crate) largest_line: f64,
    pub(crate) rays: RayCounters,
}

/// The response of the detector, the definition of a sample, and the resolutions of heart and surroundings with the error that remains.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ImagingOptions {
    pub(crate) response: Collimator,
    pub(crate) value: BinValue,
    pub(crate) resolutions: [Resolution; 2],
    /// Relative to the largest sample.
    pub(crate) error: f64,
}

/// Computation of images.
#[derive(Debug)]
pub(crate) struct Imaging {
    pub(crate) options: ImagingOptions,
    /// For each view the response to the change by the heart, and to the surroundings.
    pub(super) responses: Vec<[DepthResponse; 2]>,
    pub(super) fixed: Vec<OnceLock<Fixed>>,
}

impl Imaging {
    /// Interpolates the response in the depth of each view; `deep` if the heart changes the image of the activity behind it.
    pub(crate) fn new(
        options: ImagingOptions,
        views: &[Facing],
        deep: bool,
    ) -> Result<Self, PhantomError> {
        let response = &options.response;
        let of = |view: &Facing, [low, high]: [f64; 2], tolerance: f64| {
            if response.slope() == 0.0 {
                return DepthResponse::constant(response.sigma(0.0));
            }
            let sigma = |t: f64| response.sigma(view.radius - t);
            DepthResponse::new(sigma, [low, high], tolerance)
        };
        let [heart, around] = options.resolutions.map(|own| own.depth_tolerance);
        let mut responses: Vec<[DepthResponse; 2]> = Vec::with_capacity(views.len());
        for (k, view) in views.iter().enumerate() {
            let made = match k.checked_sub(1).filter(|before| views[*before] == *view) {
                Some(before) => responses[before].clone(),
                None => {
                    let range = if deep { view.seen } else { view.heart };
                    [of(view, range, heart)?, of(view, view.seen, around)?]
                }
            };
            let extremes = made.each_ref().map(DepthResponse::extremes);
            if let Some([narrowest, widest]) = (extremes.into_iter()).find(|[a, b]| *b > UNEVEN * a)
            {
                check(RATIO, widest / narrowest, [1.0, UNEVEN])?;
            }
            responses.push(made);
        }
        Ok(Self {
            options,
            responses,
            fixed: views.iter().map(|_| OnceLock::new()).collect(),
        })
    }

    /// Bound on the omitted weights, relative to the largest line integral.
    pub(crate) fn tails(&self) -> f64 {
        match self.options.response.variance(f64::MAX) > 0.0 {
            true => TAILS,
            false => 0.0,
        }
    }

    /// Evaluations of the response in a view, rays times nodes in depth: those of the heart, and those of fixed surroundings.
    pub(crate) fn evaluations(&self, view_idx: usize, of_heart: RayCounters) -> u64 {
        let fixed = self.fixed[view_idx].get().map(|fixed| fixed.rays);
        let rays = [of_heart, fixed.unwrap_or_default()].map(|rays| rays.cast);
        let nodes = self.responses[view_idx]
            .each_ref()
            .map(DepthResponse::n_nodes);
        rays[0] * nodes[0] as u64 + rays[1] * nodes[1] as u64
    }

    /// Bytes of an unfinished image: its rows (nodes along the rows, nodes in depth, bins) and the tabulated weights.
    pub(crate) fn view_bytes(&self, camera: &Camera) -> usize {
        let of = |part: usize| {
            let (value, density) = (self.options.value, self.options.resolutions[part].density);
            let responses = self.responses.iter().map(|both| &both[part]);
            let bytes = responses.map(|own| View::bytes(camera.detector(), value, own, density));
            bytes.fold(0.0, f64::max)
        };
        of(0).max(of(1)) as usize
    }
}

//! One phantom with its exact sinogram and image.

#![allow(dead_code)] // each bench uses a part

use radon::{
    BinSampling, FbpOptions, FbpPlan, ImageGrid, ParallelGeometry, Phantom2, disc_mask, rmse_within,
};

/// Phantom, its exact sinogram of bin means, and its image of pixel means.
pub(crate) struct Case {
    pub(crate) n: usize,
    pub(crate) geometry: ParallelGeometry,
    pub(crate) grid: ImageGrid,
    pub(crate) sinogram: Vec<f32>,
    pub(crate) image: Vec<f32>,
}

pub(crate) fn case(n: usize, n_views: usize) -> Case {
    let geometry = ParallelGeometry::half_turn(n_views, n, 1.0).unwrap();
    let grid = ImageGrid::square(n, 1.0).unwrap();
    let phantom = Phantom2::shepp_logan(n as f64 / 2.0).unwrap();
    let (sinogram, image) = (
        phantom
            .sinogram(&geometry, BinSampling::Mean)
            .expect("room"),
        phantom.image(&grid).expect("room"),
    );
    Case {
        n,
        geometry,
        grid,
        sinogram,
        image,
    }
}

impl Case {
    pub(crate) fn rmse(&self, image: &[f32]) -> f64 {
        let mask = disc_mask(&self.grid, self.n as f64 / 2.0 - 1.0).expect("room");
        rmse_within(image, &self.image, &mask).unwrap().unwrap()
    }

    /// Relative L2 distance of a sinogram from the exact bin means.
    pub(crate) fn distance(&self, rays: &[f32]) -> f64 {
        let norm = |v: &[f32]| v.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>().sqrt();
        let pairs = rays.iter().zip(&self.sinogram);
        let difference: Vec<f32> = pairs.map(|(a, b)| a - b).collect();
        norm(&difference) / norm(&self.sinogram)
    }

    pub(crate) fn plan(&self, options: FbpOptions) -> FbpPlan<f32> {
        FbpPlan::new(&self.geometry, &self.grid, &options).unwrap()
    }

    /// The same slice `n_slices` times, `[slice][view][bin]`.
    pub(crate) fn stack(&self, n_slices: usize) -> Vec<f32> {
        self.sinogram.repeat(n_slices)
    }
}

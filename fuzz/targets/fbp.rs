//! A geometry (bins, pixels along x and y, pitch, side of a pixel, offset, centre of the grid, then angles): FBP of ones is finite.
#![no_main]

use fuzz::numbers;
use libfuzzer_sys::fuzz_target;
use radon::{ArcPolicy, FbpMethod, FbpOptions, FbpPlan, ImageGrid, ParallelGeometry};

fuzz_target!(|text: &str| {
    let Some(numbers) = numbers(text) else { return };
    let Some((sizes, angles)) = numbers.split_first_chunk::<8>() else {
        return;
    };
    let [n_bins, nx, ny] = [0, 1, 2].map(|k| sizes[k].abs() as usize % 48);
    let [pitch, side, offset, x, y] = [3, 4, 5, 6, 7].map(|k| sizes[k]);
    let angles = &angles[..angles.len().min(24)];
    let geometry = ParallelGeometry::new(angles.to_vec(), n_bins, pitch);
    let Ok(geometry) = geometry.and_then(|geometry| geometry.with_offset(offset)) else {
        return;
    };
    let grid = ImageGrid::new(nx, ny, side).and_then(|grid| grid.with_centre([x, y]));
    let Ok(grid) = grid else { return };
    for method in [FbpMethod::Direct, FbpMethod::Fourier { tolerance: 1e-3 }] {
        let options = FbpOptions::default()
            .with_method(method)
            .with_arc(ArcPolicy::Extend);
        let Ok(plan) = FbpPlan::<f32>::new(&geometry, &grid, &options) else {
            continue;
        };
        let image = plan
            .reconstruct(&vec![1.0; plan.sinogram_len()])
            .expect("finite samples");
        assert!(image.len() == nx * ny && image.iter().all(|x| x.is_finite()));
    }
});

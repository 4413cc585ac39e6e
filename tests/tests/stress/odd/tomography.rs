//! Geometries, projectors, reconstructions, analytic objects.

use super::{ODD, SIZES, back, pairs};
use radon::{
    ArcPolicy, BinSampling, CglsOptions, Collimator, CountScale, EdgePolicy, EmOptions, FbpOptions,
    FbpPlan, FourierProjector, ImageGrid, Kernel, LinearOperator, MaskedStats, ParallelGeometry,
    Phantom2, Phantom3, Projector, Shape2, Shape3, SirtOptions, SliceAxis, StackOrder, Stopping,
    Window, cgls, mlem, poisson_counts, ramp_sample, rmse_within, sirt,
};

#[test]
fn radon_accepts_any_input() {
    let mut geometries = Vec::new();
    let mut grids = Vec::new();
    for [a, b] in pairs() {
        geometries.extend(back(ParallelGeometry::arc_radians(3, a, 4, b)));
        back(ParallelGeometry::new([a, b], 3, 1.0));
        geometries.extend(back(ParallelGeometry::from_radians([a, b], 3, 1.0)));
        let moved = ParallelGeometry::arc_radians(3, 3.1, 4, 1.0);
        geometries.extend(back(
            moved.and_then(|g| g.with_offset(a)?.with_rotation_bin(b)),
        ));
        grids.extend(back(ImageGrid::anisotropic(3, 2, [a, b])));
        grids.extend(back(
            ImageGrid::square(3, 1.0).and_then(|g| g.with_centre([a, b])),
        ));
        if let Some(slices) = back(SliceAxis::new(2, a).and_then(|s| s.with_centre(b))) {
            let _ = slices.slice_centre(usize::MAX);
        }
        if let Some(response) = back(Collimator::new(a, b, 0.1)) {
            let _ = response.sigma(b);
        }
        back(poisson_counts(&[a as f32, 1.0], CountScale::PerUnit(b), 7));
        back(poisson_counts(&[a, 1.0], CountScale::Total(b), 7));
        let _ = Window::Hann.gain(a);
        let _ = Window::Butterworth { order: u32::MAX }.gain(a);
        back(MaskedStats::of(&[a, b], &[true; 2]));
        back(rmse_within(&[a], &[b], &[true]));
    }
    for n in SIZES {
        back(ParallelGeometry::arc_radians(n, 3.0, 4, 1.0));
        back(ParallelGeometry::arc_radians(2, 3.0, n, 1.0));
        back(ImageGrid::square(n, 1.0));
        back(SliceAxis::new(n, 1.0));
        let _ = ramp_sample(n as i64);
    }
    geometries.extend(back(ParallelGeometry::arc_radians(3, 3.1, 4, 1.0)));
    grids.extend(back(ImageGrid::square(3, 1.0)));
    let policies = [
        ArcPolicy::Complete,
        ArcPolicy::Extend,
        ArcPolicy::Truncate,
        ArcPolicy::Rescale,
    ];
    let edges = [EdgePolicy::Zero, EdgePolicy::Ellipse];
    for (k, geometry) in geometries.iter().enumerate() {
        for policy in policies {
            back(geometry.view_weights(policy));
        }
        let _ = geometry.bin_centre(usize::MAX);
        let _ = geometry.bin_at(f64::NAN);
        let mut options = FbpOptions::default()
            .with_arc(ArcPolicy::Rescale)
            .with_edge(edges[k % 2])
            .with_cutoff(if k % 3 == 0 { ODD[k % ODD.len()] } else { 1.0 })
            .with_memory(if k % 7 == 0 { SIZES[k % 6] } else { 1 << 24 });
        options.region = (k % 5 == 0).then(|| (SIZES[k % 6]..SIZES[k / 6 % 6], 0..2));
        for grid in [&grids[k % grids.len()], &grids[grids.len() - 1]] {
            reconstructions(geometry, grid, &options);
            projections(geometry, grid, [Kernel::Joseph, Kernel::Strip][k % 2]);
        }
    }
    for pitch in [1e-200, 1e-6, 1.0, 100.0, 1e6, 1e200] {
        let geometry = ParallelGeometry::arc_radians(3, 3.1, 40, pitch).expect("views");
        for grid in grids.iter().step_by(3) {
            let Some(made) = back(FourierProjector::<f64>::new(&geometry, grid, 1e-3)) else {
                continue;
            };
            back(made.forward(&vec![1.0; grid.image_len()]));
            back(made.adjoint(&vec![1.0; geometry.sinogram_len()]));
        }
    }
    shapes();
}

fn reconstructions(geometry: &ParallelGeometry, grid: &ImageGrid, options: &FbpOptions) {
    let order = StackOrder::ViewSliceBin;
    let Some(plan) = back(FbpPlan::<f64>::new(geometry, grid, options)) else {
        return;
    };
    for value in [1.0, f64::NAN, f64::INFINITY, 1e300, 5e-324] {
        let sinogram = vec![value; geometry.sinogram_len()];
        back(plan.reconstruct(&sinogram));
        assert!(matches!(
            plan.reconstruct(&sinogram[1..]),
            Err(radon::RadonError::WrongLength { .. })
        ));
        let mut scratch = radon::FbpScratch::default();
        for (start, end) in [(0, 1), (1, 0), (0, 2), (usize::MAX, 0), (5, usize::MAX)] {
            let slices = start..end;
            let mut slab = vec![0.0; plan.image_len()];
            back(plan.reconstruct_slab_into(&sinogram, 1, order, slices, &mut slab, &mut scratch));
        }
    }
    for n in SIZES {
        back(plan.work_bytes(n));
    }
    for n in SIZES {
        back(plan.reconstruct_stack(&[], n, order));
    }
}

fn projections(geometry: &ParallelGeometry, grid: &ImageGrid, kernel: Kernel) {
    let Some(projector) = back(Projector::new(geometry, grid, kernel)) else {
        return;
    };
    let n = geometry.sinogram_len();
    let order = StackOrder::SliceViewBin;
    for value in [1.0, f64::NAN, f64::INFINITY, 1e300, 5e-324, -1.0] {
        let image = vec![value; grid.image_len()];
        let data = vec![value; n];
        back(projector.forward(&image));
        back(projector.adjoint(&data));
        assert!(matches!(
            projector.forward(&image[1..]),
            Err(radon::RadonError::WrongLength { .. })
        ));
        assert!(matches!(
            projector.adjoint(&[value; 1][..0]),
            Err(radon::RadonError::WrongLength { .. })
        ));
        let stopping = Stopping::default()
            .with_max_iterations(2)
            .with_residual(value);
        let start = || vec![1.0; grid.image_len()];
        back(cgls(
            &projector,
            &data,
            &mut start(),
            &CglsOptions::default().with_stopping(stopping),
            radon::no_observer,
        ));
        back(sirt(
            &projector,
            &data,
            &mut start(),
            &SirtOptions::default()
                .with_relaxation(value)
                .with_lower(value)
                .with_upper(-value)
                .with_stopping(stopping),
            radon::no_observer,
        ));
        let options = EmOptions::default().with_stopping(stopping);
        back(mlem(
            &projector,
            &data,
            &mut start(),
            &options,
            radon::no_observer,
        ));
        let wrong = options.with_background(vec![value; 1]);
        back(mlem(
            &projector,
            &data,
            &mut start(),
            &wrong,
            radon::no_observer,
        ));
        assert!(matches!(
            mlem(&projector, &[], &mut [], &wrong, radon::no_observer),
            Err(radon::RadonError::WrongLength { .. })
        ));
    }
    for k in SIZES {
        if let Some(stack) = back(projector.stack_operator::<f32>(k, order)) {
            back(stack.forward(&[]));
            back(stack.adjoint(&[]));
        }
        if let Some(stack) = back(projector.stack_operator::<f32>(k.min(4), order)) {
            back(stack.subsets(k));
        }
    }
}

fn shapes() {
    let (geometry, grid) = (
        ParallelGeometry::arc_radians(2, 3.1, 3, 1.0).expect("views"),
        ImageGrid::square(3, 1.0).expect("pixels"),
    );
    let slices = SliceAxis::new(2, 1.0).expect("slices");
    let upright = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for [a, b] in pairs() {
        let plane = [
            back(Shape2::ellipse([a, 0.0], [1.0, b], 0.3)),
            back(Shape2::gaussian([a, 0.0], [1.0, b], 0.3)),
            back(Shape2::rectangle([a, 0.0], [1.0, b], 0.3)),
            back(Shape2::polygon(vec![[0.0, a], [b, 0.0], [1.0, 1.0]])),
        ];
        for shape in plane.into_iter().flatten() {
            for [x, y] in [[a, b], [b, a], [0.3, a], [b, 0.3], [0.3, 0.1]] {
                let _ = shape.value([x, y]);
                let _ = shape.line_integral(x, y);
                let _ = shape.bin_mean(0.3, x, y);
                let _ = shape.bin_mean(x, y, 0.5);
                let _ = shape.rectangle_mean([x, 0.1], [0.5, y]);
                let _ = shape.rectangle_mean([0.2, 0.1], [x, y]);
            }
            let solid = back(Shape3::prism(shape.clone(), [a, b]));
            if let Some(phantom) = back(Phantom2::new([(1.0, shape)])) {
                back(phantom.image::<f32>(&grid));
                back(phantom.sinogram::<f64>(&geometry, BinSampling::Mean));
            }
            solid_means(solid, [a, b]);
        }
        for solid in [
            Shape3::ellipsoid([a, 0.0, 0.1], [1.0, b, 2.0], upright),
            Shape3::gaussian([0.0, a, 0.1], [1.0, 0.5, b], upright),
            Shape3::ellipsoid([0.0; 3], [1.0; 3], [[a, b, 0.0]; 3]),
        ] {
            let solid = back(solid);
            if let Some(phantom) = solid
                .clone()
                .and_then(|solid| back(Phantom3::new([(1.0, solid)])))
            {
                back(phantom.volume::<f32>(&grid, &slices));
                let sampling = BinSampling::Mean;
                let order = StackOrder::ViewSliceBin;
                back(phantom.sinogram::<f32>(&geometry, &slices, sampling, order));
            }
            solid_means(solid, [a, b]);
        }
        back(Phantom2::shepp_logan(a));
        back(Phantom3::shepp_logan(b));
    }
    assert!(matches!(
        Shape2::polygon(vec![]),
        Err(radon::RadonError::DegeneratePolygon { .. })
    ));
}

fn solid_means(solid: Option<Shape3>, [a, b]: [f64; 2]) {
    let Some(solid) = solid else {
        return;
    };
    for [x, y] in [[a, b], [0.3, b], [a, 0.1], [0.3, 0.1]] {
        let _ = solid.value([x, y, 0.1]);
        let _ = solid.line_integral(x, y, 0.1);
        let _ = solid.line_integral(0.3, x, y);
        let _ = solid.bin_mean(0.3, [x, 0.1], [y, 0.5]);
        let _ = solid.bin_mean(0.3, [0.2, 0.1], [x, y]);
        let _ = solid.box_mean([x, 0.1, 0.2], [0.5, y, 0.5]);
        let _ = solid.box_mean([0.1, 0.1, 0.2], [x, 0.5, y]);
    }
    let _ = solid.integral();
    let _ = solid.bounding_ball();
}

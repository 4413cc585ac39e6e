//! Sizes beyond any memory, indices beyond any array, NaN and infinity: errors before any work.

use radon::{
    ArcPolicy, BinSampling, EdgePolicy, FbpOptions, FbpPlan, ImageGrid, Interpolation, Kernel,
    LinearOperator, ParallelGeometry, Phantom2, Phantom3, Projector, RadonError, Shape2, Shape3,
    SliceAxis, SpectGeometry, SpectOperator, SpectOptions, StackOrder, Subset, Window, disc_mask,
    osem, padded_len, ramp_response,
};

const VIEWS_FIRST: StackOrder = StackOrder::ViewSliceBin;

fn too_large<T: std::fmt::Debug>(outcome: Result<T, RadonError>) -> bool {
    matches!(outcome, Err(RadonError::TooLarge { .. }))
}

/// Counts whose product is representable but exceeds any memory.
#[test]
fn sizes_beyond_any_memory_are_rejected() {
    let wide = ParallelGeometry::half_turn(2, 1 << 50, 1.0).unwrap();
    let large = ImageGrid::square(1 << 26, 1.0).unwrap();
    let (small, grid) = (
        ParallelGeometry::half_turn(2, 4, 1.0).unwrap(),
        ImageGrid::square(4, 1.0).unwrap(),
    );
    assert!(too_large(ParallelGeometry::arc_radians(
        1 << 55,
        1.0,
        1,
        1.0
    )));
    assert!(too_large(disc_mask(&large, 1.0)));

    let disc = Shape2::ellipse([0.0; 2], [1.0; 2], 0.0).unwrap();
    let plane = Phantom2::new([(1.0, disc.clone())]).unwrap();
    assert!(too_large(plane.image::<f64>(&large)));
    assert!(too_large(plane.sinogram::<f32>(&wide, BinSampling::Mean)));
    let rod = Shape3::prism(disc, [0.0, 1.0]).unwrap();
    let solid = Phantom3::new([(1.0, rod)]).unwrap();
    let tall = SliceAxis::new(1 << 50, 1.0).unwrap();
    assert!(too_large(solid.volume::<f32>(&grid, &tall)));
    let sampling = BinSampling::Centre;
    assert!(too_large(solid.sinogram::<f32>(
        &small,
        &tall,
        sampling,
        VIEWS_FIRST
    )));

    let narrow = ParallelGeometry::half_turn(2, 1 << 50, 1e-9).unwrap();
    let projector = Projector::new(&narrow, &grid, Kernel::Joseph).unwrap();
    assert!(too_large(projector.forward(&[1.0f32; 16])));
    let plan = FbpPlan::<f32>::new(&small, &large, &FbpOptions::default()).unwrap();
    assert!(too_large(plan.reconstruct(&[1.0; 8])));
    for options in [
        FbpOptions::default(),
        FbpOptions::default().with_window(Window::Hann),
        FbpOptions::default()
            .with_interpolation(Interpolation::BandLimited)
            .with_edge(EdgePolicy::Ellipse),
    ] {
        for bins in [(1 << 20) + 1, 1 << 50] {
            let wide = ParallelGeometry::half_turn(2, bins, 1.0).unwrap();
            let refused = FbpPlan::<f32>::new(&wide, &grid, &options);
            assert!(matches!(refused, Err(RadonError::OutOfRange { .. })));
        }
    }
}

/// Subsets store lists of their samples, whose number is an argument.
#[test]
fn subsets_beyond_the_memory_are_rejected() {
    let geometry = ParallelGeometry::half_turn(4, 4, 1.0).unwrap();
    let grid = ImageGrid::square(4, 1.0).unwrap();
    let projector = Projector::new(&geometry, &grid, Kernel::Joseph).unwrap();
    for order in [StackOrder::ViewSliceBin, StackOrder::SliceViewBin] {
        let stack = projector.stack_operator::<f32>(1 << 50, order).unwrap();
        for n_subsets in [1, 2, 4] {
            assert!(too_large(stack.subsets(n_subsets).map(|made| made.len())));
        }
    }
}

/// Lists of a few numbers per view, when the angles themselves have used the memory: in a separate process with 1 GiB, of which 2^25 angles use a
/// quarter.
#[cfg(target_os = "linux")]
#[test]
fn views_beyond_the_memory_are_rejected() {
    const ALONE: &str = "RADON_TEST_WITH_LITTLE_MEMORY";
    if std::env::var_os(ALONE).is_some() {
        let many = ParallelGeometry::half_turn(1 << 25, 1, 1.0).unwrap();
        let grid = ImageGrid::square(4, 1.0).unwrap();
        assert!(too_large(many.view_weights(ArcPolicy::Complete)));
        assert!(too_large(Projector::new(&many, &grid, Kernel::Joseph)));
        let plan = FbpPlan::<f64>::new(&many, &grid, &FbpOptions::default());
        assert!(too_large(plan));
        return;
    }
    let exe = std::env::current_exe().unwrap();
    let limited = std::process::Command::new("sh")
        .args(["-c", "ulimit -v 1048576 && exec \"$0\" \"$@\""])
        .arg(exe)
        .args(["--exact", "--test-threads=1"])
        .arg("odd_inputs::views_beyond_the_memory_are_rejected")
        .env(ALONE, "1")
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&limited.stdout);
    assert!(
        limited.status.success() && said.contains("1 passed"),
        "{limited:?}"
    );
}

/// The data, not the argument, determine the length of a stack.
#[test]
fn numbers_of_slices_without_data_are_rejected() {
    let geometry = ParallelGeometry::arc_radians(2, 3.0, 4, 1.0).unwrap();
    let grid = ImageGrid::square(4, 1.0).unwrap();
    let projector = Projector::new(&geometry, &grid, Kernel::Strip).unwrap();
    let plan = FbpPlan::<f64>::new(&geometry, &grid, &FbpOptions::default()).unwrap();
    for n in [1, 1 << 40, usize::MAX / 16] {
        for error in [
            projector
                .stack_operator::<f64>(n, VIEWS_FIRST)
                .and_then(|a| a.forward(&[]))
                .err(),
            projector
                .stack_operator::<f64>(n, VIEWS_FIRST)
                .and_then(|a| a.adjoint(&[]))
                .err(),
            plan.reconstruct_stack(&[], n, VIEWS_FIRST).err(),
        ] {
            assert!(matches!(
                error,
                Some(RadonError::WrongLength { given: 0, .. } | RadonError::TooLarge { .. })
            ));
        }
    }
}

#[test]
fn layers_beyond_the_memory_are_rejected() {
    let geometry = ParallelGeometry::half_turn(4, 4, 1.0).unwrap();
    let rows = SliceAxis::new(2, 1.0).unwrap();
    let spect = SpectGeometry::circular(&geometry, &rows, 6.0).unwrap();
    let grid = ImageGrid::square(4, 1.0).unwrap();
    for n in [1 << 50, usize::MAX / 8, usize::MAX] {
        let layers = SliceAxis::new(n, 1.0).unwrap();
        let made = SpectOperator::<f64>::new(&spect, &grid, &layers, &SpectOptions::default());
        assert!(too_large(made.map(drop)), "{n}");
    }
    // A single view exceeds the address space.
    let rows = SliceAxis::new(1 << 50, 1.0).unwrap();
    let spect = SpectGeometry::circular(&geometry, &rows, 6.0).unwrap();
    let layers = SliceAxis::new(2, 1.0).unwrap();
    let made = SpectOperator::<f64>::new(&spect, &grid, &layers, &SpectOptions::default());
    assert!(too_large(made.map(drop)));
}

#[test]
fn filters_of_any_length_and_windows_of_no_gains() {
    for gains in [vec![], vec![1.0]] {
        let window = Window::Custom(gains);
        for nu in [0.0, 0.5, 1.0, f64::NAN] {
            assert!(window.gain(nu).is_nan());
        }
        let refused = ramp_response(&window, 1.0, 8);
        assert!(
            matches!(refused, Err(RadonError::TooFew { .. })),
            "{refused:?}"
        );
    }
    let window = Window::Custom(vec![1.0, 0.5]);
    assert_eq!((window.gain(0.5), window.gain(1.0)), (0.75, 0.5));
    assert_eq!(padded_len(0), Ok(2));
    assert_eq!(padded_len(1 << 23), Ok(1 << 23));
    for len in [(1 << 23) + 1, usize::MAX] {
        assert!(matches!(
            padded_len(len),
            Err(RadonError::OutOfRange { .. })
        ));
        assert!(matches!(
            ramp_response(&Window::Hann, 1.0, len),
            Err(RadonError::OutOfRange { .. })
        ));
    }
}

/// An operator of one number, and a subset with a large index.
#[test]
fn subsets_beyond_the_data() {
    #[derive(Debug)]
    struct One;
    impl LinearOperator<f64> for One {
        fn image_len(&self) -> usize {
            1
        }
        fn data_len(&self) -> usize {
            1
        }
        fn forward_into(&self, image: &[f64], data: &mut [f64]) -> Result<(), RadonError> {
            data.copy_from_slice(image);
            Ok(())
        }
        fn adjoint_into(&self, data: &[f64], image: &mut [f64]) -> Result<(), RadonError> {
            image.copy_from_slice(data);
            Ok(())
        }
    }
    let subset = Subset::new(One, vec![usize::MAX]);
    let refused = osem(
        &[subset],
        &[1.0],
        &mut [1.0],
        &Default::default(),
        radon::no_observer,
    );
    assert!(matches!(
        refused,
        Err(RadonError::WrongLength {
            expected: usize::MAX,
            ..
        })
    ));
}

/// Every argument of the means of a shape may be negative, zero, infinite or NaN.
#[test]
fn means_over_odd_rectangles() {
    let odd = [
        f64::NAN,
        f64::INFINITY,
        f64::NEG_INFINITY,
        0.0,
        -1.0,
        1e-300,
        1e300,
        -1e300,
        0.7,
    ];
    let shapes = [
        Shape2::ellipse([0.1, 0.2], [2.0, 1.0], 0.3).unwrap(),
        Shape2::ellipse([0.1, 0.2], [2.0, 1.0], 0.0).unwrap(),
        Shape2::rectangle([0.1, 0.2], [2.0, 1.0], 0.3).unwrap(),
        Shape2::polygon(vec![[0.0, 0.0], [2.0, 0.0], [0.0, 1.0]]).unwrap(),
        Shape2::gaussian([0.1, 0.2], [2.0, 1.0], 0.3).unwrap(),
    ];
    for shape in &shapes {
        for a in odd {
            for b in odd {
                let mean = shape.rectangle_mean([a, 0.1], [b, 1.0]);
                assert!(!(a.is_nan() || b.is_nan()) || mean.is_nan());
                let _ = shape.rectangle_mean([0.1, 0.2], [a, b]);
                for c in odd {
                    let _ = shape.bin_mean(a, b, c);
                }
                let _ = shape.line_integral(a, b);
                let _ = shape.value([a, b]);
            }
        }
        // Without area: the value at the centre, also on the axes of the shape, inside and beyond.
        for along in [-2.5, -1.5, -0.6, 0.0, 0.4, 0.9, 1.6] {
            let (sin, cos) = f64::sin_cos(0.3);
            for [u, v] in [[along, 0.0], [0.0, along]] {
                let at = [0.1 + u * cos - v * sin, 0.2 + u * sin + v * cos];
                let of_upright = [0.1 + u, 0.2 + v];
                for at in [at, of_upright] {
                    assert_eq!(shape.rectangle_mean(at, [0.0; 2]), shape.value(at));
                }
            }
        }
        // The sign of a side has no effect.
        let at = |side: f64| shape.rectangle_mean([0.4, 0.3], [side, 0.5]);
        assert_eq!(at(-0.8), at(0.8));
    }
}

/// Sizes and positions whose products are finite give finite values everywhere; others are rejected.
#[test]
fn shapes_of_any_size_give_finite_values_or_are_rejected() {
    let upright = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let plane = |centre: [f64; 2], sizes: [f64; 2], angle: f64| {
        let shapes = [
            Shape2::ellipse(centre, sizes, angle),
            Shape2::gaussian(centre, sizes, angle),
            Shape2::rectangle(centre, sizes, angle),
        ];
        shapes.into_iter()
    };
    let solid = |centre: [f64; 2], [a, b]: [f64; 2]| {
        let centre = [centre[0], centre[1], -centre[0]];
        let shapes = [
            Shape3::ellipsoid(centre, [a, b, a], upright),
            Shape3::gaussian(centre, [a, b, b], upright),
        ];
        shapes.into_iter()
    };
    for bad in [5e-324, 1e-300, 1e-51, 1e51, 1e200, f64::MAX] {
        let refused = |error| matches!(error, Some(RadonError::OutOfRange { .. }));
        let of_plane = |centre, size| plane(centre, size, 0.3).all(|s| refused(s.err()));
        let of_solid = |centre, size| solid(centre, size).all(|s| refused(s.err()));
        assert!(of_plane([0.0; 2], [bad, 1.0]), "{bad}");
        assert!(of_solid([0.0; 2], [1.0, bad]), "{bad}");
        if bad > 1.0 {
            assert!(of_plane([0.0, -bad], [1.0; 2]), "{bad}");
            assert!(of_solid([bad, 0.0], [1.0; 2]), "{bad}");
            let polygon = Shape2::polygon(vec![[0.0, 0.0], [bad, 0.0], [0.0, 1.0]]);
            assert!(refused(polygon.err()), "{bad}");
            let disc = Shape2::ellipse([0.0; 2], [1.0; 2], 0.0).unwrap();
            assert!(refused(Shape3::prism(disc, [-1.0, bad]).err()), "{bad}");
        }
    }
    let refused = Shape2::ellipse([1e200, 0.0], [1.0; 2], 0.0).unwrap_err();
    let expected = "shape position must lie in [-1e50, 1e50], got 1e200";
    assert_eq!(refused.to_string(), expected);
    let sizes = [1e-50, 1.0, 1e50];
    let places = [0.0, 1.0, -1e50];
    let widths = [0.0, 1e-300, 1e-12, 1e50];
    let pairs = |of: &[f64]| -> Vec<[f64; 2]> {
        let pair = |&a: &f64| of.iter().map(move |&b| [a, b]);
        of.iter().flat_map(pair).collect()
    };
    fn positive(x: f64, of: impl std::fmt::Debug) {
        assert!(x >= 0.0 && x.is_finite(), "{x} {of:?}");
    }
    fn share(x: f64, of: impl std::fmt::Debug) {
        assert!((0.0..=1.0 + 1e-12).contains(&x), "{x} {of:?}");
    }
    for size in pairs(&sizes) {
        for centre in pairs(&places) {
            for shape in plane(centre, size, 0.7).flatten() {
                positive(shape.integral(), &shape);
                for at in pairs(&places) {
                    share(shape.value(at), (&shape, at));
                    positive(shape.line_integral(at[0], at[1]), (&shape, at));
                    for width in pairs(&widths) {
                        share(shape.rectangle_mean(at, width), (&shape, at, width));
                    }
                    for width in widths {
                        positive(shape.bin_mean(at[0], at[1], width), (&shape, at, width));
                    }
                }
            }
            for shape in solid(centre, size).flatten() {
                positive(shape.integral(), &shape);
                for [s, z] in pairs(&places) {
                    share(shape.value([s, z, z]), (&shape, s, z));
                    positive(shape.line_integral(0.3, s, z), (&shape, s, z));
                    for [a, b] in pairs(&widths) {
                        share(shape.box_mean([s, z, z], [a, b, b]), (&shape, s, z, a, b));
                        positive(shape.bin_mean(0.3, [s, z], [a, b]), (&shape, s, z, a, b));
                    }
                }
            }
        }
    }
}

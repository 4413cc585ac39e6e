//! Every invalid input is a typed error with its values, before any work.

use crate::common;

use common::half_turn;
use radon::{
    ArcPolicy, FbpOptions, FbpPlan, ImageGrid, InstructionSet, ParallelGeometry, RadonError,
    StackOrder, Window,
};

fn plan(options: FbpOptions) -> Result<FbpPlan<f32>, RadonError> {
    FbpPlan::new(
        &half_turn(10, 16, 1.0),
        &ImageGrid::square(16, 1.0).unwrap(),
        &options,
    )
}

#[test]
fn geometry() {
    use RadonError::*;
    assert!(matches!(
        ParallelGeometry::new([], 8, 1.0),
        Err(TooFew {
            what: "n_views",
            given: 0,
            least: 1
        })
    ));
    assert!(matches!(
        ParallelGeometry::new([0.0], 0, 1.0),
        Err(TooFew {
            what: "n_bins",
            given: 0,
            ..
        })
    ));
    assert!(matches!(
        ParallelGeometry::new([0.0], 8, 0.0),
        Err(NotPositive {
            what: "pitch",
            given: 0.0
        })
    ));
    assert!(matches!(
        ParallelGeometry::new([0.0], 8, -1.0),
        Err(NotPositive { .. })
    ));
    assert!(matches!(
        ParallelGeometry::new([0.0, f64::NAN], 8, 1.0),
        Err(NotFinite { what: "angle", .. })
    ));
    assert!(matches!(
        ParallelGeometry::new([0.0], 8, f64::INFINITY),
        Err(NotFinite { .. })
    ));
    assert!(matches!(
        ParallelGeometry::arc_radians(0, 1.0, 8, 1.0),
        Err(TooFew { .. })
    ));
    assert!(matches!(
        ParallelGeometry::arc_radians(3, 0.0, 8, 1.0),
        Err(NotPositive { what: "arc", .. })
    ));
    assert!(matches!(
        ParallelGeometry::arc_radians(usize::MAX, 1.0, 8, 1.0),
        Err(TooLarge { .. })
    ));
    let geometry = half_turn(4, 8, 1.0);
    assert!(matches!(
        geometry.clone().with_offset(f64::NAN),
        Err(NotFinite { what: "offset", .. })
    ));
    assert!(matches!(
        geometry.with_rotation_bin(f64::INFINITY),
        Err(NotFinite { .. })
    ));
}

#[test]
fn grid() {
    use RadonError::*;
    assert!(matches!(
        ImageGrid::new(0, 4, 1.0),
        Err(TooFew { what: "nx", .. })
    ));
    assert!(matches!(
        ImageGrid::new(4, 0, 1.0),
        Err(TooFew { what: "ny", .. })
    ));
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for spacing in [[bad, 1.0], [1.0, bad]] {
            assert!(matches!(
                ImageGrid::anisotropic(4, 4, spacing),
                Err(NotFinite {
                    what: "spacing",
                    ..
                })
            ));
        }
        assert!(matches!(ImageGrid::new(4, 4, bad), Err(NotFinite { .. })));
    }
    for given in [0.0, -0.0, -2.0] {
        for spacing in [[given, 1.0], [1.0, given]] {
            assert_eq!(
                ImageGrid::anisotropic(4, 4, spacing).unwrap_err(),
                NotPositive {
                    what: "spacing",
                    given
                }
            );
        }
    }
    assert!(matches!(
        ImageGrid::anisotropic(4, 4, [1.0, 1e308]),
        Err(NotFinite { what: "extent", .. })
    ));
    assert!(matches!(
        ImageGrid::new(usize::MAX, 2, 1.0),
        Err(TooLarge { .. })
    ));
    assert!(matches!(
        ImageGrid::new(4, 4, 1.0)
            .unwrap()
            .with_centre([0.0, f64::NAN]),
        Err(NotFinite { .. })
    ));
}

#[test]
fn options() {
    use RadonError::*;
    let with = |window| FbpOptions::default().with_window(window);
    for cutoff in [0.0, -0.5, 1.5, f64::NAN] {
        let refused = plan(FbpOptions::default().with_cutoff(cutoff)).err();
        assert!(
            matches!(
                refused,
                Some(
                    OutOfRange { what: "cutoff", .. }
                        | NotPositive { what: "cutoff", .. }
                        | NotFinite { what: "cutoff", .. }
                )
            ),
            "cutoff {cutoff}: {refused:?}"
        );
    }
    assert!(matches!(
        plan(FbpOptions::default().with_cutoff(1.5)),
        Err(OutOfRange {
            given: 1.5,
            most: 1.0,
            ..
        })
    ));
    assert!(matches!(
        plan(with(Window::Butterworth { order: 0 })),
        Err(TooFew {
            given: 0,
            least: 1,
            ..
        })
    ));
    assert!(matches!(
        plan(with(Window::Custom(vec![1.0]))),
        Err(TooFew {
            given: 1,
            least: 2,
            ..
        })
    ));
    assert!(matches!(
        plan(with(Window::Custom(vec![1.0, f64::NAN]))),
        Err(NotFinite { .. })
    ));
    for (x, y) in [(0..0, 0..4), (0..17, 0..4), (0..4, 20..30)] {
        assert!(matches!(
            plan(FbpOptions::default().with_region(x, y)),
            Err(BadRange { len: 16, .. })
        ));
    }
    let missing = [
        InstructionSet::Avx2,
        InstructionSet::Avx512,
        InstructionSet::Neon,
    ]
    .into_iter()
    .find(|s| !s.is_available());
    // No machine has both AVX and NEON.
    let instructions = missing.unwrap();
    assert!(matches!(
        plan(FbpOptions::default().with_instructions(instructions)),
        Err(InstructionSetMissing { .. })
    ));
}

#[test]
fn short_arcs_are_rejected_without_a_policy() {
    let geometry = ParallelGeometry::arc_radians(60, 2.0, 16, 1.0).unwrap();
    let grid = ImageGrid::square(16, 1.0).unwrap();
    let error = geometry
        .view_weights(radon::ArcPolicy::Complete)
        .unwrap_err();
    let expected = "views leave a gap of 1.17 rad between neighbouring directions, 35.2 times the mean of the others (at most 4.0 allowed)";
    assert_eq!(error.to_string(), expected);
    match FbpPlan::<f64>::new(&geometry, &grid, &FbpOptions::default()) {
        Err(RadonError::ShortArc {
            gap,
            ratio,
            most,
            furthest,
        }) => {
            assert_eq!(furthest, geometry.angles()[59]);
            assert!(
                (gap - (std::f64::consts::PI - 59.0 / 30.0)).abs() < 1e-12
                    && ratio > 30.0
                    && most == 4.0
            );
        }
        other => panic!("{other:?}"),
    }
    for arc in [ArcPolicy::Extend, ArcPolicy::Truncate, ArcPolicy::Rescale] {
        assert!(
            FbpPlan::<f64>::new(&geometry, &grid, &FbpOptions::default().with_arc(arc)).is_ok()
        );
    }
}

#[test]
fn data() {
    use RadonError::*;
    let plan = plan(FbpOptions::default()).unwrap();
    assert!(matches!(
        plan.reconstruct(&[0.0; 159]),
        Err(WrongLength {
            given: 159,
            expected: 160,
            ..
        })
    ));
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut sinogram = [1.0; 160];
        sinogram[77] = bad;
        assert!(matches!(
            plan.reconstruct(&sinogram),
            Err(BadSample { index: 77, .. })
        ));
    }
    let order = StackOrder::ViewSliceBin;
    let mut scratch = radon::FbpScratch::default();
    let wrong =
        plan.reconstruct_slab_into(&[0.0; 320], 2, order, 0..2, &mut [0.0; 511], &mut scratch);
    assert!(matches!(
        wrong,
        Err(WrongLength {
            given: 511,
            expected: 512,
            ..
        })
    ));
    let wrong =
        plan.reconstruct_slab_into(&[0.0; 320], 2, order, 1..3, &mut [0.0; 512], &mut scratch);
    assert!(matches!(
        wrong,
        Err(BadRange {
            start: 1,
            end: 3,
            len: 2,
            ..
        })
    ));
    assert!(matches!(
        plan.reconstruct_stack(&[0.0; 160], usize::MAX, order),
        Err(TooLarge { .. })
    ));
    assert_eq!(plan.reconstruct_stack(&[], 0, order), Ok(vec![]));
}

#[test]
fn extreme_but_finite_geometry_neither_panics_nor_hangs() {
    let sinogram = [1.0_f32; 4 * 5];
    for pitch in [1e-300, 1e-9, 1e9, 1e300] {
        for spacing in [1e-300, 1e-9, 1e9, 1e300] {
            for centre in [0.0, 1e300] {
                let Ok(geometry) = ParallelGeometry::arc_radians(4, 3.0, 5, pitch)
                    .unwrap()
                    .with_offset(centre / 3.0)
                else {
                    continue;
                };
                let grid = ImageGrid::new(33, 3, spacing)
                    .unwrap()
                    .with_centre([centre, -centre])
                    .unwrap();
                match FbpPlan::<f32>::new(&geometry, &grid, &FbpOptions::default()) {
                    Ok(plan) => assert_eq!(plan.reconstruct(&sinogram).unwrap().len(), 99),
                    // The reciprocal of the pitch exceeds `f32`.
                    Err(error) => assert!(
                        pitch == 1e-300 && matches!(error, RadonError::NotFinite { .. }),
                        "{error}"
                    ),
                }
                let plan = FbpPlan::<f64>::new(&geometry, &grid, &FbpOptions::default()).unwrap();
                let image = plan.reconstruct(&sinogram.map(f64::from)).unwrap();
                assert_eq!(image.len(), 99);
            }
        }
    }
}

#[test]
fn a_pitch_whose_reciprocal_overflows_is_an_error() {
    fn of<T: radon::Sample>(pitch: f64) -> Result<(), RadonError> {
        let geometry = half_turn(3, 8, pitch);
        let grid = ImageGrid::square(4, pitch)?;
        FbpPlan::<T>::new(&geometry, &grid, &FbpOptions::default()).map(drop)
    }
    for error in [of::<f64>(1e-310), of::<f32>(1e-44)] {
        assert!(
            matches!(error, Err(RadonError::NotFinite { .. })),
            "{error:?}"
        );
    }
    assert_eq!(of::<f64>(1e-300), Ok(()));
    assert_eq!(of::<f32>(1e-37), Ok(()));
}

#[test]
fn gains_that_overflow_in_the_type_of_samples_are_an_error() {
    let (geometry, grid) = (half_turn(8, 16, 1.0), ImageGrid::square(4, 1.0).unwrap());
    let of = |gain: f64| FbpOptions::default().with_window(Window::Custom(vec![gain; 2]));
    let refused = FbpPlan::<f32>::new(&geometry, &grid, &of(1e300)).unwrap_err();
    let message = "sample 0 of the response of the filter is inf; it must be finite";
    assert_eq!(refused.to_string(), message);
    FbpPlan::<f64>::new(&geometry, &grid, &of(1e300)).unwrap();
    // The slope between gains overflows.
    let opposite = Window::Custom(vec![f64::MAX, -f64::MAX]);
    let options = FbpOptions::default().with_window(opposite);
    assert!(FbpPlan::<f64>::new(&geometry, &grid, &options).is_err());
}

//! Rejected input of the SPECT operator.

use super::*;

#[test]
fn invalid_input_is_rejected() {
    let small = small();
    let (views, rows) = (small.geometry.views(), small.geometry.rows());
    let orbit = |radii: Vec<f64>| SpectGeometry::new(views, rows, radii).unwrap_err();
    let wrong = orbit(vec![5.0; 5]);
    assert!(
        matches!(
            wrong,
            RadonError::WrongLength {
                given: 5,
                expected: 6,
                ..
            }
        ),
        "{wrong}"
    );
    let wrong = orbit(vec![5.0, 5.0, 5.0, 0.0, 5.0, 5.0]);
    assert!(
        matches!(wrong, RadonError::NotPositive { given: 0.0, .. }),
        "{wrong}"
    );
    let wrong = orbit(vec![5.0, 5.0, 5.0, f64::NAN, 5.0, 5.0]);
    assert!(matches!(wrong, RadonError::NotFinite { .. }), "{wrong}");

    let collimator = Collimator::new(0.1, 0.2, 0.3).unwrap();
    assert!(collimator.sigma(f64::NAN).is_nan());
    assert_eq!(collimator.sigma(-1.0), collimator.sigma(0.0));
    let wrong = Collimator::new(-0.1, 0.0, 0.0).unwrap_err();
    assert!(
        matches!(wrong, RadonError::OutOfRange { given: -0.1, .. }),
        "{wrong}"
    );
    let wrong = Collimator::new(0.1, f64::INFINITY, 0.0).unwrap_err();
    assert!(matches!(wrong, RadonError::NotFinite { .. }), "{wrong}");
    let holes = |diameter, length, attenuation| {
        let holes = ParallelHoles {
            diameter,
            length,
            attenuation,
            response: HoleResponse::Anger,
        };
        Collimator::parallel_holes(&holes, 0.38).unwrap_err()
    };
    for (wrong, expected) in [
        (holes(0.0, 3.5, 27.0), "hole diameter"),
        (holes(0.15, -1.0, 27.0), "hole length"),
        (holes(0.15, 3.5, 0.0), "attenuation of the septa"),
        (holes(0.15, 3.5, 0.5), "effective hole length"),
    ] {
        assert!(
            matches!(wrong, RadonError::NotPositive { what, .. } if what == expected),
            "{wrong}"
        );
    }
    assert_eq!(
        holes(3.5, 0.15, 27.0).to_string(),
        "hole diameter (at most the length) must lie in [0.0, 0.15], got 3.5"
    );
    let wrong = Collimator::parallel_holes(&ParallelHoles::GE_LEHR, -0.1).unwrap_err();
    assert!(
        matches!(wrong, RadonError::OutOfRange { given: -0.1, .. }),
        "{wrong}"
    );

    let plan = |options: &SpectOptions<f64>| {
        SpectOperator::new(&small.geometry, &small.grid, &small.layers, options).unwrap_err()
    };
    let mapped = |map: Vec<f64>| plan(&SpectOptions::default().with_attenuation(map));
    let wrong = mapped(vec![0.1; 7]);
    assert!(
        matches!(wrong, RadonError::WrongLength { given: 7, .. }),
        "{wrong}"
    );
    let mut map: Vec<f64> = small.map();
    map[3] = f64::NAN;
    let wrong = mapped(map.clone());
    assert!(
        matches!(wrong, RadonError::BadSample { index: 3, .. }),
        "{wrong}"
    );
    map[3] = -1e-3;
    let wrong = mapped(map.clone());
    assert!(
        matches!(wrong, RadonError::NegativeSample { index: 3, .. }),
        "{wrong}"
    );
    // A voxel is 0.5 cm deep; water in 1/m is 15.
    map[3] = 9.9;
    small.operator(&SpectOptions::default().with_attenuation(map.clone()));
    map[3] = 15.0;
    let wrong = mapped(map);
    assert!(
        matches!(wrong, RadonError::OutOfRange { given, most: 5.0, .. } if (given - 7.5).abs() < 1e-12),
        "{wrong}"
    );
    for tolerance in [0.0, 0.2] {
        let wrong = plan(&SpectOptions::default().with_tolerance(tolerance));
        assert!(
            matches!(
                wrong,
                RadonError::OutOfRange {
                    what: "tolerance",
                    ..
                }
            ),
            "{wrong}"
        );
    }
    let wrong =
        plan(&SpectOptions::default().with_collimator(Collimator::new(1e9, 0.0, 0.0).unwrap()));
    assert!(matches!(wrong, RadonError::OutOfRange { .. }), "{wrong}");

    let placed = |views: &ParallelGeometry, grid: &ImageGrid, layers: &SliceAxis| {
        let geometry = SpectGeometry::circular(views, rows, 9.0).unwrap();
        let options = SpectOptions::<f64>::default();
        SpectOperator::new(&geometry, grid, layers, &options).unwrap_err()
    };
    let (grid, layers) = (small.grid, small.layers);
    let far = grid.with_centre([0.0, -1e300]).unwrap();
    let beside = views.clone().with_offset(1e300).unwrap();
    let flat = SliceAxis::new(3, 1e-3).unwrap();
    let tiny = ImageGrid::square(3, 1e-3).unwrap();
    for (wrong, expected) in [
        (placed(views, &far, &layers), "planes of a view"),
        (placed(&beside, &grid, &layers), "bins from the axis"),
        (placed(views, &grid, &flat), "pitch in voxels"),
        (placed(views, &tiny, &layers), "pitch in voxels"),
    ] {
        assert!(
            matches!(wrong, RadonError::OutOfRange { what, .. } if what == expected),
            "{wrong}"
        );
    }

    let operator = small.operator::<f64>(&SpectOptions::default());
    let (mut x, mut y) = (
        vec![0.0; operator.image_len()],
        vec![0.0; operator.data_len()],
    );
    let wrong = operator.forward_into(&x[1..], &mut y).unwrap_err();
    assert!(
        matches!(wrong, RadonError::WrongLength { what: "volume", .. }),
        "{wrong}"
    );
    let wrong = operator.adjoint_into(&y[1..], &mut x).unwrap_err();
    assert!(
        matches!(wrong, RadonError::WrongLength { what: "views", .. }),
        "{wrong}"
    );
    x[5] = f64::INFINITY;
    let wrong = operator.forward_into(&x, &mut y).unwrap_err();
    assert!(
        matches!(wrong, RadonError::BadSample { index: 5, .. }),
        "{wrong}"
    );
    y[6] = f64::NAN;
    let wrong = operator.adjoint_into(&y, &mut x).unwrap_err();
    assert!(
        matches!(wrong, RadonError::BadSample { index: 6, .. }),
        "{wrong}"
    );
    let wrong = operator.subsets(0).unwrap_err();
    assert!(matches!(wrong, RadonError::TooFew { .. }), "{wrong}");
    let wrong = operator.subsets(7).unwrap_err();
    assert!(
        matches!(wrong, RadonError::OutOfRange { most: 6.0, .. }),
        "{wrong}"
    );
}

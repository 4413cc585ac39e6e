//! Rejected input of iterative solvers.

use super::*;

#[test]
fn bad_input_is_rejected_with_its_values() {
    let a = not_negative(4, 3, 1);
    let (b, x) = (vec![1.0; 4], vec![1.0; 3]);
    let all = |b: &[f64], x: &[f64]| {
        let x = || x.to_vec();
        [
            sirt(&a, b, &mut x(), &SirtOptions::default(), radon::no_observer).unwrap_err(),
            cgls(&a, b, &mut x(), &CglsOptions::default(), radon::no_observer).unwrap_err(),
            mlem(&a, b, &mut x(), &EmOptions::default(), radon::no_observer).unwrap_err(),
        ]
    };
    for error in all(&b[1..], &x) {
        assert_eq!(
            error,
            RadonError::WrongLength {
                what: "data",
                given: 3,
                expected: 4
            }
        );
    }
    for error in all(&b, &x[..2]) {
        assert_eq!(
            error,
            RadonError::WrongLength {
                what: "image",
                given: 2,
                expected: 3
            }
        );
    }
    for error in all(&[1.0, 1.0, f64::NAN, 1.0], &x) {
        assert!(matches!(
            error,
            RadonError::BadSample {
                what: "data",
                index: 2,
                ..
            }
        ));
    }
    for error in all(&b, &[1.0, f64::INFINITY, 1.0]) {
        assert!(matches!(
            error,
            RadonError::BadSample {
                what: "image",
                index: 1,
                ..
            }
        ));
    }
    let em = |b: &[f64], x: &[f64], s: Vec<f64>| {
        mlem(
            &a,
            b,
            &mut x.to_vec(),
            &EmOptions::default().with_background(s),
            radon::no_observer,
        )
        .unwrap_err()
    };
    let negative = |what, index, given| RadonError::NegativeSample { what, index, given };
    assert_eq!(
        em(&[1.0, -2.0, 1.0, 1.0], &x, vec![]),
        negative("data", 1, -2.0)
    );
    assert_eq!(
        em(&b, &[1.0, 1.0, -0.5], vec![]),
        negative("image", 2, -0.5)
    );
    assert_eq!(
        em(&b, &x, vec![0.0, 0.0, 0.0, -1.0]),
        negative("background", 3, -1.0)
    );
    assert!(matches!(
        em(&b, &x, vec![1.0]),
        RadonError::WrongLength {
            what: "background",
            given: 1,
            expected: 4
        }
    ));
    for relaxation in [0.0, -1.0, 2.0, f64::NAN] {
        let options = SirtOptions::default().with_relaxation(relaxation);
        let refused = sirt(&a, &b, &mut x.clone(), &options, radon::no_observer);
        assert!(
            matches!(
                refused,
                Err(RadonError::OutOfRange { .. }
                    | RadonError::NotPositive { .. }
                    | RadonError::NotFinite { .. })
            ),
            "{relaxation}: {refused:?}"
        );
    }
    let crossed = SirtOptions::default().with_lower(1.0).with_upper(0.0);
    assert!(matches!(
        sirt(&a, &b, &mut x.clone(), &crossed, radon::no_observer),
        Err(RadonError::OutOfRange {
            what: "upper bound",
            ..
        })
    ));
    assert_eq!(
        em(&b, &[0.0; 3], vec![]).to_string(),
        "largest pixel of the first image must be greater than zero, got 0.0"
    );
    let mut dark = [0.0; 3];
    let report = mlem(
        &a,
        &[0.0; 4],
        &mut dark,
        &EmOptions::default(),
        radon::no_observer,
    );
    assert!(report.is_ok() && dark == [0.0; 3]);
    let some = [Subset::new(Dense(vec![vec![1.0, 2.0, 3.0]; 2]), vec![0, 2])];
    let refused = osem(
        &some,
        &b,
        &mut x.clone(),
        &EmOptions::default(),
        radon::no_observer,
    );
    assert!(matches!(
        refused,
        Err(RadonError::WrongLength {
            what: "subsets together",
            given: 2,
            expected: 4
        })
    ));
    let twice = [0, 1].map(|_| Subset::new(Dense(vec![vec![1.0, 2.0, 3.0]; 4]), vec![0, 1, 2, 3]));
    let (mut image, options) = (x.clone(), EmOptions::default());
    let refused = osem(&twice, &b, &mut image, &options, radon::no_observer);
    assert!(matches!(
        refused,
        Err(RadonError::WrongLength {
            given: 8,
            expected: 4,
            ..
        })
    ));
    let whole = SirtOptions::default().with_stopping(Stopping::default().with_residual(1.0));
    let refused = sirt(&a, &b, &mut x.clone(), &whole, radon::no_observer).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "residual rule must lie in [0.0, 1.0), got 1.0"
    );
    let options = SirtOptions::default().with_relaxation(0.0);
    let refused = sirt(&a, &b, &mut x.clone(), &options, radon::no_observer).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "relaxation must lie in (0.0, 2.0), got 0.0"
    );
    let rule = Stopping::default().with_residual(f64::NAN);
    for options in [
        CglsOptions::default().with_stopping(rule),
        CglsOptions::default().with_gradient(-1.0),
    ] {
        let refused = cgls(&a, &b, &mut x.clone(), &options, radon::no_observer);
        assert!(
            matches!(
                refused,
                Err(RadonError::OutOfRange { least: 0.0, .. } | RadonError::NotFinite { .. })
            ),
            "{refused:?}"
        );
    }
    let mixed = Dense(vec![vec![1.0, -3.0]]);
    assert!(matches!(
        sirt(
            &mixed,
            &[1.0],
            &mut [0.0; 2],
            &SirtOptions::default(),
            radon::no_observer
        ),
        Err(RadonError::NegativeSample {
            what: "row sums",
            ..
        })
    ));
    assert!(matches!(
        mlem(
            &mixed,
            &[1.0],
            &mut [1.0; 2],
            &EmOptions::default(),
            radon::no_observer
        ),
        Err(RadonError::NegativeSample {
            what: "column sums",
            ..
        })
    ));
    let none: [Subset<Dense, f64>; 0] = [];
    assert!(matches!(
        osem(
            &none,
            &b,
            &mut x.clone(),
            &EmOptions::default(),
            radon::no_observer
        ),
        Err(RadonError::TooFew { .. })
    ));
    let subset = |data| [Subset::new(not_negative(2, 3, 1), data)];
    assert!(matches!(
        osem(
            &subset(vec![0, 4]),
            &b,
            &mut x.clone(),
            &EmOptions::default(),
            radon::no_observer
        ),
        Err(RadonError::WrongLength {
            what: "data",
            given: 4,
            expected: 5
        })
    ));
    assert!(matches!(
        osem(
            &subset(vec![0]),
            &b,
            &mut x.clone(),
            &EmOptions::default(),
            radon::no_observer
        ),
        Err(RadonError::WrongLength { what: "subset", .. })
    ));
}

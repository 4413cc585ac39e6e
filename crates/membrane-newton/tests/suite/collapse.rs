//! Curves that enclose no body are not results.

use membrane_newton::{
    Control, Discretisation, Equilibrium, Membrane, NewtonError, NewtonOptions, PressureLaw,
    ReferenceShape, Solver, Stiffness,
};

/// Whether any two of 600 segments of the curve cross: all pairs.
fn crosses(solved: &Equilibrium) -> bool {
    let n = 600;
    let points: Vec<[f64; 2]> = (0..=n)
        .map(|k| solved.at(f64::from(k) / f64::from(n)).position)
        .collect();
    let turn = |p: [f64; 2], q: [f64; 2], r: [f64; 2]| {
        (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
    };
    let segments: Vec<&[[f64; 2]]> = points.windows(2).collect();
    let meet = |a: &[[f64; 2]], b: &[[f64; 2]]| {
        turn(a[0], a[1], b[0]) * turn(a[0], a[1], b[1]) < 0.0
            && turn(b[0], b[1], a[0]) * turn(b[0], b[1], a[1]) < 0.0
    };
    (0..segments.len()).any(|k| (k + 2..segments.len()).any(|l| meet(segments[k], segments[l])))
}

/// Under suction walls cross beside the axis, or the membrane is turned inside out.
#[test]
fn walls_that_cross_beside_the_axis_are_no_result() {
    let soft = |s: f64| {
        if (s - 0.5).abs() < 0.35 && (s - 0.5).abs() > 0.15 {
            0.05
        } else {
            1.0
        }
    };
    let soft = Stiffness::function(soft, &[0.15, 0.35, 0.65, 0.85]).unwrap();
    let cup = [
        [0.0, 1.0],
        [1.5, 1.6],
        [2.0, 0.5],
        [2.0, -0.5],
        [1.5, -1.6],
        [0.0, -1.0],
    ];
    let shapes = [
        ReferenceShape::balloon(1.5, 1.4).unwrap(),
        ReferenceShape::balloon(8.5, 1.75).unwrap(),
        ReferenceShape::polyline(&cup).unwrap(),
    ];
    let (mut collapsed, mut solved) = (0, 0);
    for shape in shapes {
        let even = Membrane::new(shape);
        for membrane in [even.clone(), even.with_stiffness(soft.clone())] {
            for law in [
                PressureLaw::PerMaterialLength,
                PressureLaw::PerCurrentLength,
            ] {
                let membrane = membrane.clone().with_law(law);
                for how in [
                    Discretisation::FiniteDifferences { nodes: 201 },
                    Discretisation::Spectral {
                        degree: 24,
                        per_piece: 1,
                    },
                ] {
                    let solver = Solver::new(&membrane, how).unwrap();
                    let loads = [-0.3, -1.9, -3.0, -6.0, -30.0, -100.0, 5.0].map(Control::Load);
                    let gains = [-0.3, -0.5, -0.9, -1.5, 0.5].map(Control::VolumeGain);
                    for control in loads.into_iter().chain(gains) {
                        match solver.solve(control, &NewtonOptions::default()) {
                            Ok(found) => {
                                let volume = found.measures.volume;
                                assert!(volume > 0.0, "{how:?} {control:?}: {volume}");
                                assert!(!crosses(&found), "{how:?} {control:?}: {volume}");
                                solved += 1;
                            }
                            Err(NewtonError::Collapsed { s }) => {
                                assert!((0.0..=1.0).contains(&s));
                                collapsed += 1;
                            }
                            Err(_) => (),
                        }
                    }
                }
            }
        }
    }
    assert!(collapsed > 20 && solved > 60, "{collapsed} {solved}");
}

/// A cone is pushed through its base without a crossing.
#[test]
fn caps_are_pushed_through() {
    let cone = ReferenceShape::polyline(&[[0.0, 2.0], [0.3, 0.0], [0.0, -2.0]]).unwrap();
    for nodes in [50, 201] {
        let solver = Solver::new(
            &Membrane::new(cone.clone()),
            Discretisation::FiniteDifferences { nodes },
        );
        let pushed = solver
            .unwrap()
            .solve(Control::Load(-3.0), &NewtonOptions::default())
            .unwrap();
        assert!(pushed.measures.volume < -1.0 && !crosses(&pushed));
    }
}

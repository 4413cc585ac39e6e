//! Curves between their nodes against the closed form, and products of band matrices.

use membrane_forces::{
    BandMatrix, CurvePoint, DiscreteMembrane, FiniteDifferences, LinearEquilibrium, Membrane,
    PressureLaw, ReferenceShape, SpectralElements, Stiffness,
};

const KAPPA: f64 = 2.3;

/// A disc under pressure per current length; a stiffness with `skew` has no mirror image and does not change the exact curve here.
fn disc(skew: f64) -> (Membrane, LinearEquilibrium) {
    let stiffness = Stiffness::function(move |s| 1.0 + skew * s, &[]).unwrap();
    let membrane = Membrane::new(ReferenceShape::disc(1.3).unwrap())
        .with_stiffness(stiffness)
        .with_law(PressureLaw::PerCurrentLength);
    (membrane, LinearEquilibrium::disc(1.3, KAPPA, 1.0).unwrap())
}

/// The exact curve at the nodes of a state.
fn sampled(d: &dyn DiscreteMembrane, exact: &LinearEquilibrium) -> Vec<f64> {
    let positions = d.positions().into_iter().take(d.start().len() / 2);
    let mut state: Vec<f64> = positions.flat_map(|s| exact.at(s).position).collect();
    d.fixed().iter().for_each(|&k| state[k] = d.start()[k]);
    state
}

/// Largest errors of position, first and second derivative at 97 places.
fn errors(d: &dyn DiscreteMembrane, exact: &LinearEquilibrium) -> [f64; 3] {
    let state = sampled(d, exact);
    let mut largest = [0.0f64; 3];
    for k in 0..=96 {
        let s = f64::from(k) / 96.0;
        let (found, wanted) = (d.at(&state, s).unwrap(), exact.at(s));
        let parts = |at: CurvePoint| [at.position, at.first, at.second];
        for (most, (a, b)) in (largest.iter_mut()).zip(parts(found).into_iter().zip(parts(wanted)))
        {
            *most = most.max((a[0] - b[0]).hypot(a[1] - b[1]));
        }
    }
    largest
}

#[test]
fn curves_between_nodes_have_the_accuracy_of_their_discretisation() {
    for skew in [0.0, 0.3] {
        let (membrane, exact) = disc(skew);
        let differences = |n| FiniteDifferences::half(&membrane, n).unwrap();
        assert_eq!(differences(41).is_half(), skew == 0.0);
        for n in [40, 41] {
            let coarse = errors(&differences(n), &exact);
            let fine = errors(&differences(2 * n - 1), &exact);
            // slopes by differences of second order
            for (k, order) in [3.0, 2.0, 1.0].into_iter().enumerate() {
                let found = (coarse[k] / fine[k]).log2();
                assert!(
                    found > order - 0.3,
                    "N {n}, derivative {k}: {coarse:?}, {fine:?}"
                );
            }
            assert!(fine[0] < 1e-3 && fine[1] < 0.1, "N {n}: {fine:?}");
        }
        let spectral = SpectralElements::new(&membrane, 18, 2).unwrap();
        assert_eq!(spectral.is_half(), skew == 0.0);
        assert_eq!((spectral.degree(), spectral.n_elements()), (18, 2));
        let found = errors(&spectral, &exact);
        // rounding, amplified by p^2 per derivative and by the number of elements
        assert!(
            found[0] < 1e-13 && found[1] < 1e-10 && found[2] < 1e-7,
            "{found:?}"
        );
        // the pieces are the same curve, end to end
        let state = sampled(&spectral, &exact);
        let pieces = spectral.pieces(&state).unwrap();
        assert_eq!(pieces.len(), if skew == 0.0 { 4 } else { 2 });
        let mut end = 0.0;
        for piece in &pieces {
            assert!((piece.from - end).abs() < 1e-15);
            end = piece.to;
            let s = 0.4 * piece.from + 0.6 * piece.to;
            assert_eq!(piece.at(s), spectral.at(&state, s).unwrap());
            let (point, wanted) = (piece.at(s), exact.at(s));
            // an arc that turns clockwise by kappa
            let curvature = -(0.5 * KAPPA).sin() / 1.3;
            assert!((point.curvature() / curvature - 1.0).abs() < 1e-8);
            let (tangent, wanted) = (point.tangent(), wanted.tangent());
            assert!((tangent[0] - wanted[0]).hypot(tangent[1] - wanted[1]) < 1e-10);
        }
        assert_eq!(end, 1.0);
    }
}

#[test]
fn samples_are_joined_by_lines() {
    let samples = Stiffness::samples(&[1.0, 3.0, 2.0]).unwrap();
    for (s, value) in [
        (0.0, 1.0),
        (0.125, 1.5),
        (0.5, 3.0),
        (0.75, 2.5),
        (1.0, 2.0),
    ] {
        assert_eq!(samples.at(s), Ok(value));
    }
    let cone = ReferenceShape::polyline(&[[0.0, 3.0], [4.0, 0.0], [4.0, -5.0], [0.0, -5.0]]);
    let cone = cone.unwrap();
    let breaks = [0.0, 5.0, 10.0, 14.0].map(|length| length / 14.0);
    assert_eq!(cone.breakpoints(), breaks);
    let [x, y] = cone.at(7.5 / 14.0).position;
    assert!(x == 4.0 && (y + 2.5).abs() < 1e-15);
}

#[test]
fn products_of_bands_agree_with_dense_matrices() {
    for (lower, upper) in [(0, 0), (1, 0), (0, 2), (2, 3), (3, 3), (4, 4), (5, 4)] {
        for n in [1, 2, 3, 6, 9, 10, 25] {
            let entry = |i: usize, j: usize| 1.0 + ((7 * i + 3 * j) as f64).sin();
            let inside = |i: usize, j: usize| j + lower >= i && j <= i + upper;
            let all = (0..n * n).map(|k| (k / n, k % n));
            let entries = all.filter(|&(i, j)| inside(i, j));
            let entries = entries.map(|(i, j)| (i, j, 0.5 * entry(i, j)));
            // each twice: values of one entry add
            let mut band = BandMatrix::zeros(n, lower, upper).unwrap();
            for (i, j, value) in entries.clone().chain(entries) {
                band.add(i, j, value).unwrap();
            }
            let x: Vec<f64> = (0..n).map(|i| (i as f64).cos()).collect();
            let mut product = vec![f64::NAN; n];
            band.mul_into(&x, &mut product);
            for i in 0..n {
                let row = (0..n).filter(|&j| inside(i, j));
                let dense: f64 = row.map(|j| entry(i, j) * x[j]).sum();
                assert!(
                    (product[i] - dense).abs() < 1e-14 * 9.0,
                    "{n} {lower} {upper}, row {i}"
                );
                for j in 0..n {
                    let wanted = if inside(i, j) { entry(i, j) } else { 0.0 };
                    assert_eq!(band.get(i, j), Some(wanted));
                }
            }
            band.scale(-2.0);
            assert_eq!(band.get(n - 1, n - 1), Some(-2.0 * entry(n - 1, n - 1)));
            band.clear();
            assert!(band.rows().flatten().all(|&value| value == 0.0));
            assert_eq!((band.len(), band.is_empty()), (n, false));
        }
    }
}

/// Functions cannot be compared: they are equal if they are shared.
#[test]
fn membranes_of_equal_parts_are_equal() {
    let balloon = |radius| Membrane::new(ReferenceShape::balloon(8.5, radius).unwrap());
    assert_eq!(balloon(1.75), balloon(1.75));
    assert_ne!(balloon(1.75), balloon(1.8));
    assert_ne!(
        balloon(1.75),
        Membrane::new(ReferenceShape::disc(1.75).unwrap())
    );
    let law = PressureLaw::TotalForce;
    assert_ne!(balloon(1.75), balloon(1.75).with_law(law));
    let stiff = |stiffness: &Stiffness| balloon(1.75).with_stiffness(stiffness.clone());
    let constant = |value| Stiffness::constant(value).unwrap();
    assert_eq!(stiff(&constant(2.0)), stiff(&constant(2.0)));
    assert_ne!(stiff(&constant(2.0)), stiff(&constant(3.0)));
    let samples = |last| Stiffness::samples(&[1.0, last]).unwrap();
    assert_eq!(stiff(&samples(2.0)), stiff(&samples(2.0)));
    assert_ne!(stiff(&samples(2.0)), stiff(&samples(1.0)));
    let function = || Stiffness::function(|s| 1.0 + s, &[]).unwrap();
    let shared = function();
    assert_eq!(stiff(&shared), stiff(&shared));
    assert_ne!(stiff(&shared), stiff(&function()));
    let line = |s: f64| CurvePoint {
        position: [0.0, 1.0 - 2.0 * s],
        first: [0.0, -2.0],
        second: [0.0; 2],
    };
    let shape = ReferenceShape::from_function(line, &[]).unwrap();
    assert_eq!(shape, shape.clone());
    assert_ne!(shape, ReferenceShape::from_function(line, &[]).unwrap());
}

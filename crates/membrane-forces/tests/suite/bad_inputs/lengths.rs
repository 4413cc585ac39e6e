//! States, results and bands of other lengths.

use super::*;

#[test]
fn states_of_another_length_are_rejected() {
    let membrane = Membrane::new(ReferenceShape::balloon(8.5, 1.75).unwrap());
    let whole = FiniteDifferences::new(&membrane, 21).unwrap();
    let half = FiniteDifferences::half(&membrane, 21).unwrap();
    let spectral = SpectralElements::new(&membrane, 6, 1).unwrap();
    for given in [0, 1, 2, 3, 21, 1000] {
        let state = vec![1.0; given];
        for d in [&whole, &half] {
            let expected = d.start().len();
            let refused = MembraneError::WrongLength {
                what: "nodes",
                given,
                expected,
            };
            assert_eq!(d.measure(Measure::Length, &state).unwrap_err(), refused);
            assert_eq!(d.measures(&state).unwrap_err(), refused);
            assert_eq!(d.points(&state).unwrap_err(), refused);
        }
        let expected = spectral.start().len();
        let refused = MembraneError::WrongLength {
            what: "nodes",
            given,
            expected,
        };
        let measure = spectral.measure(Measure::Area, &state);
        assert_eq!(measure.unwrap_err(), refused);
        assert_eq!(spectral.measures(&state).unwrap_err(), refused);
        assert_eq!(spectral.points(&state).unwrap_err(), refused);
        assert_eq!(spectral.pieces(&state).unwrap_err(), refused);
        assert_eq!(spectral.at(&state, 0.5).unwrap_err(), refused);
    }
}

/// Every function that returns a `Result` rejects slices and matrices of another size, and writes nothing.
#[test]
fn results_of_another_length_are_rejected() {
    let refused = |what, given, expected| {
        Err(MembraneError::WrongLength {
            what,
            given,
            expected,
        })
    };
    let membrane = Membrane::new(ReferenceShape::balloon(8.5, 1.75).unwrap());
    for law in [PressureLaw::PerMaterialLength, PressureLaw::TotalForce] {
        let membrane = membrane.clone().with_law(law);
        let d = FiniteDifferences::new(&membrane, 11).unwrap();
        let (state, mut good) = (d.start(), vec![7.0; 22]);
        let (mut bad, untouched) = (vec![7.0; 21], vec![7.0; 22]);
        let force = d.pressure_force_into(&bad, 1.0, &mut good);
        assert_eq!(force, refused("nodes", 21, 22));
        let force = d.pressure_force_into(state, 1.0, &mut bad);
        assert_eq!(force, refused("forces", 21, 22));
        assert_eq!((&good, &bad[..]), (&untouched, &untouched[..21]));
    }
    let d = FiniteDifferences::new(&membrane, 11).unwrap();
    let long = BandMatrix::zeros(24, 3, 3).unwrap();
    let narrow = BandMatrix::zeros(22, 3, 2).unwrap();
    let few = MembraneError::TooFew {
        what: "diagonals on either side",
        given: 2,
        least: 3,
    };
    for (band, expected) in [
        (long, refused("rows of the band", 24, 22)),
        (narrow, Err(few)),
    ] {
        let mut tangent = d.tangent();
        tangent.band = band;
        let before = tangent.clone();
        assert_eq!(d.tangent_into(d.start(), 1.0, &mut tangent), expected);
        assert_eq!(tangent, before);
    }
    let spectral = SpectralElements::new(&membrane, 6, 2).unwrap();
    let mut state = spectral.start().to_vec();
    let (elements, numbers) = (spectral.n_elements(), state.len());
    let rows = 2 * (elements + 1);
    let mut tangent = d.tangent();
    let other = spectral.tangent_into(&state, 1.0, &mut tangent);
    assert_eq!(other, refused("blocks", 0, elements));
    let mut tangent = spectral.tangent();
    assert_eq!(
        d.tangent_into(d.start(), 1.0, &mut tangent),
        refused("blocks", elements, 0)
    );
    tangent.blocks[1].pop();
    let short = spectral.tangent_into(&state, 1.0, &mut tangent);
    assert_eq!(short, refused("numbers of a block", 195, 196));
    tangent.band = BandMatrix::zeros(5, 3, 3).unwrap();
    let small = spectral.tangent_into(&state, 1.0, &mut tangent);
    assert_eq!(small, refused("rows of the band", 5, rows));
    let force = spectral.pressure_force_into(&state, 1.0, &mut [0.0; 3]);
    assert_eq!(force, refused("forces", 3, numbers));
    state.pop();
    let nodes = spectral.tangent_into(&state, 1.0, &mut tangent);
    assert_eq!(nodes, refused("nodes", numbers - 1, numbers));
}

#[test]
fn curves_of_fewer_than_two_nodes_have_zero_measures() {
    let nothing = Measures {
        length: 0.0,
        area: 0.0,
        surface: 0.0,
        volume: 0.0,
    };
    for nodes in [&[][..], &[[3.0, 4.0]]] {
        assert_eq!(Measures::of(nodes), nothing);
        let still = vec![[0.0; 2]; nodes.len()];
        for measure in [Measure::Length, Measure::Area] {
            assert_eq!(measure.rate(nodes, &still), Ok(0.0));
            let refused = MembraneError::WrongLength {
                what: "velocities",
                given: 2,
                expected: nodes.len(),
            };
            assert_eq!(measure.rate(nodes, &[[0.0; 2]; 2]), Err(refused));
        }
    }
}

#[test]
fn entries_outside_a_band() {
    let mut band = BandMatrix::zeros(4, 1, 2).unwrap();
    for (i, j) in [(0, 3), (2, 0), (3, 4), (4, 3), (4, 4), (usize::MAX, 0)] {
        assert_eq!(
            band.add(i, j, 1.0).unwrap_err(),
            MembraneError::OutsideBand {
                row: i,
                column: j,
                n: 4,
                lower: 1,
                upper: 2
            }
        );
    }
    assert!(band.rows().flatten().all(|v| *v == 0.0));
    assert_eq!((band.get(0, 3), band.get(2, 0)), (Some(0.0), Some(0.0)));
    for (i, j) in [(3, 4), (4, 3), (0, usize::MAX), (usize::MAX, usize::MAX)] {
        assert_eq!(band.get(i, j), None);
    }
    for (n, lower, upper) in [
        (usize::MAX, 1, 1),
        (1, usize::MAX, usize::MAX),
        (0, usize::MAX, 0),
        (1 << 40, 3, 3),
        (20_000_001, 4, 5),
    ] {
        assert!(matches!(
            BandMatrix::zeros(n, lower, upper),
            Err(MembraneError::TooMany { given, most, .. }) if given > most
        ));
    }
    let nothing = BandMatrix::zeros(0, 1, 1).unwrap();
    assert!(nothing.is_empty() && nothing.rows().len() == 0 && nothing.get(0, 0).is_none());
    nothing.mul_into(&[], &mut []);
}

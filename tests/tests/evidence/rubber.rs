//! An inflated disc of neo-Hookean rubber beside solid and membrane elements of other programs. `tests/peers` has the scripts that computed
//! their pressures.

use membrane_newton::{
    Control, Discretisation, Membrane, NewtonOptions, ReferenceShape, Rubber, Solver, StrainEnergy,
    Thickness,
};

/// Volumes over R^3.
const VOLUMES: [f64; 3] = [0.5, 1.191_818_771_67, 3.0];

/// Pressures over mu h / R at [`VOLUMES`] for h / R = 0.1, 0.05, 0.025, 0.0125 (`disc_felupe.py`): the edge free to rotate and to become thinner.
const HINGED: [[f64; 4]; 3] = [
    [0.298_685_62, 0.292_695_05, 0.291_088_13, 0.290_673_06],
    [1.311_116_86, 1.310_129_71, 1.309_925_64, 1.309_881_29],
    [1.877_976_83, 1.876_863_64, 1.876_594_83, 1.876_529_04],
];

/// The same with all points of the edge fixed.
const CLAMPED: [[f64; 4]; 3] = [
    [0.424_399_14, 0.359_019_09, 0.325_088_81, 0.307_876_02],
    [1.449_607_87, 1.382_224_38, 1.346_758_77, 1.328_504_74],
    [1.957_529_98, 1.917_244_65, 1.896_948_78, 1.886_748_88],
];

/// Pressure over mu h / R of our membrane.
fn pressure(volume: f64) -> f64 {
    let rubber = Rubber::new(StrainEnergy::NeoHookean { mu: 1.0 }, Thickness::UNIT).unwrap();
    let disc = Membrane::new(ReferenceShape::disc(1.0).unwrap()).with_rubber(rubber);
    let discretisation = Discretisation::Spectral {
        degree: 28,
        per_piece: 1,
    };
    let solver = Solver::new(&disc, discretisation).unwrap();
    let found = solver.solve(Control::Volume(volume), &NewtonOptions::default());
    found.unwrap().intensity
}

/// Slope of the line through the logarithms of the differences (least squares); each thickness is half of the one before.
fn order(differences: [f64; 4]) -> f64 {
    let logarithms = differences.map(f64::log2);
    (3.0 * (logarithms[0] - logarithms[3]) + logarithms[1] - logarithms[2]) / 10.0
}

#[test]
fn a_disc_of_solid_elements_approaches_the_membrane_with_its_thickness() {
    for (k, volume) in VOLUMES.into_iter().enumerate() {
        let membrane = pressure(volume);
        // Bending and the change of the tension across the thickness are of the order (h/R)^2. The terms of higher order are largest at the
        // second volume, where that of order 2 is small: its orders from one thickness to the next fall from 2.26 to 2.13.
        let found = order(HINGED[k].map(|solid| solid - membrane));
        assert!((found - 2.0).abs() < 0.2, "{volume}: order {found}");
        // The pressures of solid elements are given to 1e-8.
        let [.., thin] = HINGED[k];
        assert!((thin / membrane - 1.0).abs() < 5e-4, "{thin} {membrane}");
        // A fixed edge cannot rotate or become thinner in a zone of the width of the thickness, a fraction h/R of the disc.
        let found = order(CLAMPED[k].map(|solid| solid - membrane));
        assert!((found - 1.0).abs() < 0.1, "{volume}: order {found}");
    }
}

#[test]
fn a_disc_of_membrane_elements_has_the_pressure_of_the_membrane() {
    // `disc_sfepy.py`: triangles of membrane elements on 16 and 32 rings, extrapolated. The error of the extrapolation is a fifteenth of its change
    // from 8 and 16 to 16 and 32 rings, 2.7e-5.
    let (coarse, fine) = (1.315_634_20, 1.311_308_93);
    let extrapolated = fine + (fine - coarse) / 3.0;
    assert!((extrapolated / pressure(VOLUMES[1]) - 1.0).abs() < 1.8e-6);
}

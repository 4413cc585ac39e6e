//! A rubber balloon: the first maximum of its pressure, its branch of equilibria, the stretch at its apex and its stability.
//!
//! `cargo run -p membrane-newton --example balloon`

use membrane_newton::{
    Control, Discretisation, Membrane, NewtonError, NewtonOptions, ReferenceShape, Rubber, Solver,
    StrainEnergy, Thickness,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // latex of 400 kPa, 0.5 mm thick: pressures are in kPa
    let latex = Rubber::new(
        StrainEnergy::NeoHookean { mu: 400.0 },
        Thickness::constant(0.05)?,
    )?;
    let balloon = Membrane::new(ReferenceShape::balloon(8.5, 1.75)?).with_rubber(latex);
    let spectral = Discretisation::Spectral {
        degree: 20,
        per_piece: 2,
    };
    let solver = Solver::new(&balloon, spectral)?;
    let options = NewtonOptions::default();

    // the first maximum of the pressure; for this energy it is the largest one
    match solver.solve(Control::Load(1e3), &options) {
        Err(NewtonError::LimitPoint { reached, .. }) => {
            println!("limit pressure {reached:.4} kPa")
        }
        other => println!("no limit pressure: {other:?}"),
    }

    // along the branch of equilibria, also past it
    let rest = solver.start_measures().volume;
    println!("  V/V0   p, kPa   dp/dV    apex stretch   unstable at constant p, V");
    let mut solved = solver.solve(Control::Volume(1.2 * rest), &options)?;
    for k in 1..=10 {
        let volume = Control::Volume(rest * (1.0 + 0.2 * f64::from(k)));
        solved = solver.solve_from(&solved, volume, &options)?;
        let stability = solved.stability()?;
        println!(
            "{:6.2} {:8.4} {:8.1e} {:12.4} {:12} {:12}",
            solved.measures.volume / rest,
            solved.intensity,
            solved.sensitivity(volume)?.intensity,
            solved.rubber_state(0.5)?.stretches[0],
            stability.at_pressure.unstable,
            stability.at_volume.unstable,
        );
    }
    Ok(())
}

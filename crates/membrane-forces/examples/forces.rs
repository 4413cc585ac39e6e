//! Forces on a membrane and its measures: the residual force of a balloon under pressure in both discretisations.
//!
//! `cargo run -p membrane-forces --example forces`

use membrane_forces::{
    DiscreteMembrane, FiniteDifferences, LinearEquilibrium, Measure, Membrane, MembraneError,
    PressureLaw, ReferenceShape, SpectralElements, Stiffness,
};

fn main() -> Result<(), MembraneError> {
    // a cylinder of 8.5 cm with a hemisphere of 1.75 cm; stiffness and pressure per current length in kPa
    let (stiffness, pressure) = (2.5, 3.0);
    let membrane = Membrane::new(ReferenceShape::balloon(8.5, 1.75)?)
        .with_stiffness(Stiffness::constant(stiffness)?)
        .with_law(PressureLaw::PerCurrentLength);

    // of constant stiffness this law has a closed form
    let exact = LinearEquilibrium::balloon(8.5, 1.75, pressure, stiffness)?;
    println!(
        "reference volume {:8.3} cm^3",
        LinearEquilibrium::balloon(8.5, 1.75, 0.0, stiffness)?
            .measures()
            .volume
    );
    println!(
        "volume           {:8.3} cm^3 under {pressure} kPa",
        exact.measures().volume
    );

    let differences = FiniteDifferences::half(&membrane, 201)?;
    let spectral = SpectralElements::new(&membrane, 16, 1)?;
    let both: [(&str, &dyn DiscreteMembrane); 2] =
        [("differences", &differences), ("spectral", &spectral)];
    for (name, discrete) in both {
        // the closed form at the nodes: its forces are the error of the discretisation
        let count = discrete.start().len();
        let positions = discrete.positions();
        let nodes: Vec<f64> = (positions.iter().take(count / 2))
            .flat_map(|s| exact.at(*s).position)
            .collect();
        let (mut work, mut forces) = (vec![0.0; count], vec![0.0; count]);
        discrete.forces_into(&nodes, pressure, &mut work, &mut forces)?;
        let largest = forces.iter().fold(0.0f64, |m, force| m.max(force.abs()));
        discrete.forces_into(discrete.start(), pressure, &mut work, &mut forces)?;
        let at_rest = forces.iter().fold(0.0f64, |m, force| m.max(force.abs()));
        let volume = discrete.measure(Measure::Volume, &nodes)?;
        println!(
            "{name:>12}: {} nodes, force {at_rest:.1e} in the reference configuration and {largest:.1e} at the exact shape, volume {volume:.3} cm^3",
            positions.len()
        );
    }
    Ok(())
}

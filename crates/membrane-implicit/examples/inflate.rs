//! The inner balloon of Rohmer et al. 2006 under a sudden load: apex and volume until equilibrium.
//!
//! `cargo run --release -p membrane-implicit --example inflate -- [steps]`

use membrane_implicit::{Body, Load, Membrane, Motion, ReferenceShape, Scheme, Stop, TimeStep};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let steps: u32 = std::env::args().nth(1).map_or(Ok(500), |n| n.parse())?;
    let membrane = Membrane::new(ReferenceShape::balloon(8.5, 1.75)?);
    for scheme in [Scheme::Splitting6, Scheme::Midpoint, Scheme::TrBdf2] {
        let body = Body::springs(&membrane, 101)?.with_damping(1.0)?;
        let mut motion = Motion::new(body, Load::intensity(|_| 17.5), scheme)?;
        for second in 1..=5 {
            motion.run(
                TimeStep::Fixed(5.0 / f64::from(steps)),
                &[Stop::Time(f64::from(second))],
            )?;
            let state = motion.state();
            println!(
                "{scheme:?} t = {second} s: apex {:.6} cm, {:.6} cm^3",
                state.points[50][0],
                state.volume()
            );
        }
        let energy = motion.energy();
        println!(
            "  {energy:?}\n  {:?}, imbalance {:.1e}",
            motion.work(),
            energy.imbalance()
        );
    }
    Ok(())
}

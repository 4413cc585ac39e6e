//! A membrane that is connected to a closed elastic vessel: a load with memory.
//!
//! `cargo run --release -p membrane-implicit --example windkessel`

use membrane_implicit::{
    Body, Feedback, Load, LoadState, Membrane, Motion, PressureLaw, ReferenceShape, Scheme,
    Stiffness, Stop, TimeStep,
};

/// C p' = -V' - p / R with the volume V of the membrane, by the trapezoidal rule, which keeps the second order of the scheme.
#[derive(Clone)]
struct Windkessel {
    /// C, cm^3/kPa.
    compliance: f64,
    /// R, kPa s/cm^3.
    resistance: f64,
    /// p at the last accepted state, kPa.
    pressure: f64,
    last: Option<LoadState>,
}

impl Feedback for Windkessel {
    fn intensity(&self, now: &LoadState) -> f64 {
        let Some(last) = self.last else {
            return self.pressure;
        };
        let ejected = last.volume - now.volume;
        let leak = 0.5 * (now.time - last.time) / self.resistance;
        ((self.compliance - leak) * self.pressure + ejected) / (self.compliance + leak)
    }

    fn accepted(&mut self, now: &LoadState) {
        self.pressure = self.intensity(now);
        self.last = Some(*now);
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // under this law the intensity is a pressure, in the unit of the stiffness: kPa
    let membrane = Membrane::new(ReferenceShape::balloon(8.5, 1.75)?)
        .with_stiffness(Stiffness::constant(10.0)?)
        .with_law(PressureLaw::PerCurrentLength);
    let body = Body::springs(&membrane, 51)?.with_damping(5.0)?;
    let vessel = Windkessel {
        compliance: 10.0,
        resistance: 2.0,
        pressure: 4.0,
        last: None,
    };
    let mut motion = Motion::new(body, Load::feedback(vessel), Scheme::TrBdf2)?;
    for second in 0..=5 {
        motion.run(TimeStep::Fixed(0.01), &[Stop::Time(f64::from(second))])?;
        let state = motion.state();
        println!(
            "t = {second} s: {:.2} cm^3 at {:.3} kPa",
            state.volume(),
            state.pressure()
        );
    }
    // the vessel has emptied into the membrane and through its resistance
    assert!(motion.state().pressure() < 4.0);
    Ok(())
}

//! A membrane that empties into a closed elastic vessel: a load with memory.
//!
//! `cargo run --release -p membrane-implicit --example windkessel`

use membrane_implicit::{
    Body, Feedback, Load, LoadState, Membrane, Motion, ReferenceShape, Scheme, Stop, TimeStep,
};

/// C p' = -V' - p / R with the volume V of the membrane, by backward Euler.
#[derive(Clone)]
struct Windkessel {
    compliance: f64,
    resistance: f64,
    pressure: f64,
    last: Option<LoadState>,
}

impl Feedback for Windkessel {
    fn intensity(&self, now: &LoadState) -> f64 {
        let Some(last) = self.last else {
            return self.pressure;
        };
        let ejected = last.volume - now.volume;
        let leak = (now.time - last.time) / self.resistance;
        (self.compliance * self.pressure + ejected) / (self.compliance + leak)
    }

    fn accepted(&mut self, now: &LoadState) {
        self.pressure = self.intensity(now);
        self.last = Some(*now);
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let membrane = Membrane::new(ReferenceShape::balloon(8.5, 1.75)?);
    let body = Body::springs(&membrane, 51)?.with_damping(1.0)?;
    let vessel = Windkessel {
        compliance: 4.0,
        resistance: 5.0,
        pressure: 10.0,
        last: None,
    };
    let mut motion = Motion::new(body, Load::feedback(vessel), Scheme::TrBdf2)?;
    for second in 0..=5 {
        motion.run(TimeStep::Fixed(0.01), &[Stop::Time(f64::from(second))])?;
        let state = motion.state();
        println!(
            "t = {second} s: {:.2} cm^3 at {:.3}",
            state.volume(),
            state.intensity
        );
    }
    // it has emptied into the membrane
    assert!(motion.state().intensity < 10.0);
    Ok(())
}

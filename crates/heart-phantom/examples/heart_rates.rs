//! Motion artefacts over heart rates: one instant per view, one view per second. At 60 beats per minute every view has the same phase, so that no
//! motion is visible; at other rates the views are inconsistent.
//!
//! `cargo run --release -p heart-phantom --example heart_rates`

use heart_phantom::{Mode, Scene};
use heart_phantom::{Phantom, PhantomError, no_observer};
use std::collections::BTreeSet;

fn main() -> Result<(), PhantomError> {
    println!("beats/min   phases   streaks outside   wall sd/mean   wall blur (mm)");
    for beats_per_minute in [50.0, 60.0, 61.0, 65.0, 72.0, 80.0, 90.0] {
        let mut scene = Scene::default().with_size(96).with_mode(Mode::Instants);
        scene.cycle.beats_per_minute = beats_per_minute;
        let phantom = Phantom::new(scene)?;
        let views = phantom.sinograms(0, &no_observer)?;
        let times = phantom.view_times(0)?;
        let phases: BTreeSet<u64> = times.iter().map(|time| time.phase.to_bits()).collect();
        let volume = phantom.reconstruct(0, &views.samples)?;
        let found = phantom.artefacts(0, &volume, &phantom.truth(0)?)?;
        println!(
            "{beats_per_minute:9}   {:6}   {:15.4}   {:12.4}   {:14.2}",
            phases.len(),
            found.streaks_outside.unwrap_or(f64::NAN),
            found.wall_unevenness.unwrap_or(f64::NAN),
            found.wall_blur_mm.unwrap_or(f64::NAN)
        );
    }
    Ok(())
}

//! List mode of a ring scanner: events with pairs of crystals and times, 1000 in each 10 ms, and the activity along their lines.
//!
//! `cargo run --release -p heart-phantom --example coincidence_lines`

use heart_phantom::revolve_voxel::nalgebra::Point3;
use heart_phantom::revolve_voxel::{Lines, Ray};
use heart_phantom::{Mode, Scene};
use heart_phantom::{Phantom, RayGeometry, no_observer};
use std::error::Error;
use std::f64::consts::TAU;

const CRYSTALS: u64 = 600;
const RINGS: u64 = 40;

/// The centre of a crystal of 0.4 cm in a ring of radius 40 cm.
fn crystal(number: u64) -> Point3<f64> {
    let (sin, cos) = (TAU * (number % CRYSTALS) as f64 / CRYSTALS as f64).sin_cos();
    let ring = (number / CRYSTALS % RINGS) as f64;
    Point3::new(40.0 * cos, 40.0 * sin, 0.4 * (ring - 19.5))
}

fn main() -> Result<(), Box<dyn Error>> {
    // Pairs of crystals within 60 degrees of opposite ones, from any generator.
    let mut state = 1u64;
    let mut next = |n: u64| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1);
        (state >> 33) % n
    };
    let mut event = || {
        let first = next(CRYSTALS);
        let second = first + CRYSTALS / 3 + next(CRYSTALS / 3);
        let [a, b] =
            [first % CRYSTALS, second % CRYSTALS].map(|n| crystal(n + CRYSTALS * next(RINGS)));
        Ray::new(a, b - a)
    };
    let (mut frames, mut times) = (Vec::new(), Vec::new());
    for frame in 0..92 {
        let rays = (0..1000).map(|_| event()).collect::<Result<Vec<_>, _>>()?;
        frames.push(Lines::each([1000, 1], rays)?);
        times.push(0.01 * f64::from(frame));
    }
    let lines = RayGeometry::from_lines(frames)?.with_times(&times)?;
    let phantom = Phantom::new(Scene::default().with_mode(Mode::Instants))?.along(lines)?;
    let events = phantom.sinograms(0, &no_observer)?;
    println!("time (s)   lines through the heart   mean activity x length (cm)");
    for (frame, samples) in events.samples.chunks(1000).enumerate().step_by(10) {
        let hit = samples.iter().filter(|sample| **sample > 0.0).count();
        let mean = samples.iter().sum::<f32>() / hit.max(1) as f32;
        println!("{:8.2}   {hit:23}   {mean:10.4}", times[frame]);
    }
    Ok(())
}

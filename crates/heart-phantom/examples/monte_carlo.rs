//! Voxels for a Monte Carlo code (GATE, SIMIND, MCNP, ...): labels of the materials and the activity at end-diastole, as
//! MetaImage and as raw samples with a JSON header.
//!
//! `cargo run --release -p heart-phantom --example monte_carlo -- DIR`

use heart_phantom::Scene;
use heart_phantom::files::{self, Format, Volume};
use heart_phantom::{Phantom, PhantomError};
use std::path::PathBuf;

fn main() -> Result<(), PhantomError> {
    let out = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| ".".into()));
    heart_phantom::files::create_writable_folder(&out)?;

    let phantom = Phantom::new(Scene::default().with_size(128))?;
    let [_, diastole] = phantom.cycle().extreme_phases();
    let labels = phantom.labels(diastole)?; // 0 outside, 1 blood, 2 wall
    let activity = phantom.activity(diastole)?; // per mL, averaged over each voxel
    let grid = *phantom.camera().grid();
    for (format, ending) in [(Format::MetaImage, "mhd"), (Format::RawJson, "json")] {
        let path = |name: &str| out.join(format!("{name}.{ending}"));
        files::write(
            &path("labels"),
            &Volume::new(grid, labels.as_slice())?,
            format,
        )?;
        files::write(
            &path("activity"),
            &Volume::new(grid, activity.as_slice())?,
            format,
        )?;
    }
    let wall = labels.iter().filter(|&&label| label == 2).count() as f64 * grid.voxel_volume();
    let exact = phantom.numbers()?.wall_volume;
    println!(
        "wall: {wall:.2} mL in voxels, {exact:.2} mL exactly; written to {}",
        out.display()
    );
    Ok(())
}

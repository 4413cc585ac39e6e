//! Validation of `camera.geometry`: non-parallel rays, and settings that require parallel rays.

use super::finding::{Check, spelled};
use super::{BeamSettings, HeadsSettings, Scene};
use crate::files::Format;
use crate::{Product, Rotation};

/// Finds settings that require parallel rays in a scene with other rays.
pub(super) fn check(scene: &Scene, c: &mut Check) {
    let (camera, heads) = (&scene.camera, scene.camera.heads);
    match camera.geometry {
        BeamSettings::Parallel => return,
        BeamSettings::Matrices(_) if heads != HeadsSettings::One => {
            c.fault("camera.heads", "two", "must be one with matrices");
        }
        _ => {}
    }
    needs_parallel(scene, c);
}

/// Finds settings that require parallel rays.
pub(crate) fn needs_parallel(scene: &Scene, c: &mut Check) {
    let (camera, output) = (&scene.camera, &scene.output);
    if scene.collimator.is_some() {
        c.fault(
            "collimator",
            "",
            "parallel holes need camera.geometry = \"parallel\"",
        );
    }
    if scene.counting.is_some() {
        let wanted =
            "is the sensitivity for parallel rays and needs camera.geometry = \"parallel\"";
        c.fault("counting", "", wanted);
    }
    if scene.scatter.is_some() {
        c.fault("scatter", "", "needs camera.geometry = \"parallel\"");
    }
    if camera.rotation == Rotation::Continuous {
        let wanted = "needs camera.geometry = \"parallel\"; other rays are those at the angle of the view during all its time";
        c.fault("camera.rotation", "continuous", wanted);
    }
    let reconstructed = [Product::Reconstruction, Product::Pictures];
    if let Some(product) = output
        .write
        .iter()
        .find(|product| reconstructed.contains(product))
    {
        let wanted = "needs camera.geometry = \"parallel\"; write projections for a reconstruction by RTK, ASTRA or TIGRE";
        c.fault("output.write", spelled(product), wanted);
    }
    let format = output.projections;
    if format != Format::Npy {
        let wanted = "stores parallel projections; choose npy (with vectors for ASTRA), or write for RTK with the library (files::write_rtk)";
        c.fault("output.projections", spelled(format), wanted);
    }
}

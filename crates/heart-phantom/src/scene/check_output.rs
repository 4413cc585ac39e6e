//! Validation of the section `[output]`.

use super::finding::{Check, spelled};
use super::*;
use crate::files::{Format, FormatInfo};
use crate::ranges;
use crate::{Camera, Product, ProjectionValues, Rotation};

pub(super) fn output(scene: &Scene, camera: Option<&Camera>, c: &mut Check) {
    let (output, mode) = (&scene.output, scene.acquisition.mode);
    let tolerance = output.mesh_tolerance;
    c.within("mesh_tolerance", tolerance, ranges::MESH_TOLERANCE);
    let (volumes, projections) = (output.volumes.info(), output.projections.info());
    for (name, format) in [
        ("volumes", output.volumes),
        ("projections", output.projections),
    ] {
        if let Err(error) = format.info().check_built() {
            c.fault(name, spelled(format), error.to_string());
        }
    }
    for (k, product) in output.write.iter().enumerate() {
        if output.write[..k].contains(product) {
            let given = format!("{} twice", spelled(product));
            c.fault("write", given, "name each product once");
        }
    }
    if output.has(Product::Pictures) && !cfg!(feature = "files") {
        let wanted = "needs a build with the feature `files`";
        c.fault("write", "pictures", wanted);
    }
    if scene.attenuates().is_none() && output.has(Product::Attenuation) {
        c.fault(
            "write",
            "attenuation",
            "needs a section [attenuation] or [chest]",
        );
    }
    if scene.scatter.is_none() && output.has(Product::Scatter) {
        c.fault("write", "scatter", "needs a section [scatter]");
    }
    if projections.projections.is_none() {
        let names = formats(|info| info.projections.is_some());
        let wanted = format!("cannot store the angles of projections; choose one of {names}");
        c.fault("projections", spelled(output.projections), wanted);
    } else if projections.even_steps
        && !projections.detectors
        && !camera.is_none_or(Camera::has_even_steps)
    {
        let wanted =
            "needs equal angle steps over both heads: an arc equal to the angle between them";
        c.fault("projections", spelled(output.projections), wanted);
    }
    if output.values == ProjectionValues::Counts && scene.noise.is_none() {
        c.fault("values", "counts", "needs a section [noise]");
    }
    if output.has(Product::Motion) && !volumes.fields {
        let names = formats(|info| info.fields);
        let wanted = format!("cannot store the components of motion; choose one of {names}");
        c.fault("volumes", spelled(output.volumes), wanted);
    }
    if let Some((field, format)) = output.without_gates(mode) {
        let wanted = "cannot store all gates in one file: choose another, or gates = \"each\"";
        c.fault(field, spelled(format), wanted);
    }
    let turns = scene.camera.rotation == Rotation::Continuous && mode.n_gates() > 1;
    if turns && output.one_file(mode) && output.has(Product::Projections) {
        let wanted = "must be each: with continuous rotation the gates have different angles";
        c.fault("gates", "one-file", wanted);
    }
}

/// Lists the names of the formats with a property, as scenes spell them.
pub(super) fn formats(has: impl Fn(&FormatInfo) -> bool) -> String {
    let with = Format::ALL.into_iter().filter(|format| has(&format.info()));
    with.map(spelled).collect::<Vec<_>>().join(", ")
}

//! Raw little-endian samples with a JSON header file, in centimetres and radians.

use super::names::data_beside;
use crate::error::PhantomError;
use crate::files::atomic::write_with_header;
use crate::files::{Projections, Samples, Volume};
use serde_json::{Value, json};
use std::path::Path;

pub(super) fn write_volume(path: &Path, volume: &Volume) -> Result<(), PhantomError> {
    let mut header = json!({
        "order": ["z", "y", "x"],
        "shape": volume.axes(),
        "spacing_cm": volume.grid.spacing(),
        "origin_cm": volume.grid.origin(),
        "axes": {"x": "left", "y": "posterior", "z": "superior"},
    });
    if volume.field().is_some() {
        header["order"] = json!(["z", "y", "x", "component"]);
    }
    of_gates(&mut header, volume.seconds_per_gate());
    write(path, header, volume.samples)
}

pub(super) fn write_projections(
    path: &Path,
    projections: &Projections,
) -> Result<(), PhantomError> {
    let mut header = json!({
        "order": ["view", "row", "bin"],
        "shape": projections.axes(),
        "pitch_cm": projections.detector.pitch(),
        "first_cm": projections.first(),
        "angles_rad": projections.angles,
        "radius_cm": match projections.radii {
            [radius] => json!(radius),
            radii => json!(radii),
        },
    });
    if let Some(counts) = projections.counts {
        header["counts_per_unit"] = counts.into();
    }
    of_gates(&mut header, projections.seconds_per_gate);
    write(path, header, projections.samples)
}

/// Fields of gates: another axis, and the time along it.
fn of_gates(header: &mut Value, seconds: Option<f64>) {
    let Some(seconds) = seconds else {
        return;
    };
    header["seconds_per_gate"] = seconds.into();
    if let Some(order) = header["order"].as_array_mut() {
        order.insert(0, "gate".into());
    }
}

fn write(path: &Path, mut header: Value, samples: Samples) -> Result<(), PhantomError> {
    let (data, name) = data_beside(path, "bin");
    header["data"] = name.into();
    header["type"] = match samples {
        Samples::F32(_) => "float32",
        Samples::U8(_) => "uint8",
        Samples::U16(_) => "uint16",
    }
    .into();
    header["byte_order"] = "little".into();
    write_with_header(path, format!("{header:#}\n").as_bytes(), &data, |out| {
        samples.write(out)
    })
}

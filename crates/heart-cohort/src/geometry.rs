//! `geometry.json` of a member: positions, times and units of its arrays.

use heart_phantom::{Phantom, PhantomError, ScenePhase};
use serde_json::{Value, json};

/// Millimetres of image files per centimetre of the lab.
const MM: f64 = 10.0;

/// Voxel size, affine, label names, gate times, angles and radii of the projections, counts per unit, volumes.
///
/// The affine maps voxel indices (x, y, z, 1) to the centre in mm in the convention of NIfTI: x right, y anterior, z superior.
/// Labels and attenuation, which are computed at `phases`, have the same affine. `projection_values` is the quantity of
/// the projections: `counts`, or `normalised`, which times `counts_per_unit` (`[gate][projection]`) are counts. `counts_per_unit` is `None`
/// if the member has no projections or no counts.
///
/// # Errors
/// Errors of the angles, radii and numbers of the phantom. With `has_views` the counts are those of the projections computed
/// before.
pub(crate) fn geometry(phantom: &Phantom, has_views: bool) -> Result<Value, PhantomError> {
    let camera = phantom.camera();
    let (grid, period) = (camera.grid(), phantom.cycle().period());
    let [nx, ny, nz] = grid.shape();
    let (spacing, origin) = (grid.spacing(), grid.origin());
    // In the lab x is left and y posterior.
    let signs = [-MM, -MM, MM];
    let mut affine = [[0.0; 4]; 4];
    for a in 0..3 {
        affine[a][a] = signs[a] * spacing[a];
        affine[a][3] = signs[a] * origin[a];
    }
    affine[3][3] = 1.0;
    let phases = phantom.phases().into_iter().map(|ScenePhase { of, at, .. }| {
        json!({ "of": of.to_string(), "phase": at.phase, "seconds": at.phase * period, "breath": at.breath })
    });
    let (mut gates, mut counts) = (Vec::new(), Vec::new());
    for gate in 0..phantom.n_gates() {
        let times = phantom.view_times(gate)?;
        let of = |value: fn(&heart_phantom::ViewTime) -> f64| -> Vec<f64> {
            times.iter().map(value).collect()
        };
        gates.push(json!({
            "angle_degrees": of(|time| time.angle.to_degrees()), "start_seconds": of(|time| time.start),
            "window_seconds": of(|time| time.window),
        }));
        if has_views && let Some(of_gate) = phantom.counts_per_unit(gate)? {
            counts.push(of_gate);
        }
    }
    let [bin, row] = camera.detector().pitch();
    let radii: Vec<f64> = phantom.radii()?.iter().map(|radius| MM * radius).collect();
    let numbers = phantom.numbers()?;
    Ok(json!({
        "shape_zyx": [nz, ny, nx],
        "voxel_mm": spacing.map(|edge| MM * edge),
        "affine": affine,
        "label_names": phantom.label_names(),
        "phases": phases.collect::<Vec<Value>>(),
        "cycle_seconds": period,
        "gates": gates,
        "radius_mm": radii,
        "bin_mm": MM * bin,
        "row_mm": MM * row,
        "projection_values": phantom.scene().output.values,
        "counts_per_unit": (!counts.is_empty()).then_some(counts),
        "edv_ml": numbers.edv,
        "esv_ml": numbers.esv,
        "ejection_fraction": numbers.ejection_fraction,
    }))
}

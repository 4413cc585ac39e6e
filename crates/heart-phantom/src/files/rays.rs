//! Projections along the rays of a fan or cone beam, for RTK and ASTRA.

use super::npy::put_f64;
use crate::RayGeometry;
use crate::error::{PhantomError, check_length};
use crate::files::{Volume, metaimage, write_atomically};
use revolve_voxel::nalgebra::{Point3, Vector3};
use revolve_voxel::{PointRaster, VoxelGrid};
use std::fmt::Write as _;
use std::path::Path;

/// Largest relative difference of the detector's axes from perpendicular axes of one pitch that RTK can store.
const UNEVEN: f64 = 1e-6;

/// Writes projections `[view][row][bin]` as RTK reads them: a MetaImage `name.mha` (mm, centred) and its geometry beside it, `name.xml`.
///
/// The axes of RTK are x, z and -y of the lab: it rotates about its second axis, and its gantry angle is the view angle.
///
/// # Errors
/// [`PhantomError::Unsupported`] unless all views have one source and a detector with perpendicular axes and one pitch, not seen from
/// behind; [`PhantomError::WrongLength`], [`PhantomError::File`].
pub fn write_rtk(path: &Path, rays: &RayGeometry, samples: &[f32]) -> Result<(), PhantomError> {
    check_samples(rays, samples)?;
    let unsupported = |what| PhantomError::Unsupported {
        format: "RTK",
        what,
    };
    let (mut xml, mut spacing) = (String::new(), None);
    for view_idx in 0..rays.n_views() {
        let (source, bins) = cone(rays, view_idx, "RTK")?;
        let to_rtk = |v: Vector3<f64>| Vector3::new(v.x, v.z, -v.y) * 10.0;
        let [u, v] = [bins.bin_step, bins.row_step].map(to_rtk);
        let pitch = [u.norm(), v.norm()];
        let [width, height] = *spacing.get_or_insert(pitch);
        let even = (pitch[0] / width - 1.0)
            .abs()
            .max((pitch[1] / height - 1.0).abs());
        let (r, c) = (u.normalize(), v.normalize());
        if even.max(r.dot(&c).abs()) > UNEVEN {
            return Err(unsupported(
                "detector axes that are oblique or change their pitch",
            ));
        }
        let n = r.cross(&c);
        let (s, middle) = (to_rtk(source.coords), to_rtk(centre(rays, &bins).coords));
        let (sid, sdd) = (n.dot(&s), n.dot(&(s - middle)));
        if !(sid > 0.0 && sdd > 0.0) {
            return Err(unsupported(
                "a mirrored detector; reverse the order of its rows",
            ));
        }
        // The rows of Rz(-in plane) Rx(-out of plane) Ry(-gantry) are r, c and n.
        let out_of_plane = -n.y.clamp(-1.0, 1.0).asin();
        let (in_plane, gantry) = match n.x.hypot(n.z) > 1e-12 {
            true => (r.y.atan2(c.y), n.x.atan2(n.z)),
            false => (0.0, -r.z.atan2(r.x)),
        };
        let [px, py] = [r.dot(&middle), c.dot(&middle)];
        let [sx, sy] = [r.dot(&s), c.dot(&s)];
        // `w (u, v, 1) = matrix (x, 1)` with w the distance from the source against n.
        let depth = [n.x, n.y, n.z, -n.dot(&s)];
        let row = |axis: Vector3<f64>, shift: f64| {
            let own = [axis.x, axis.y, axis.z, -axis.dot(&s)];
            [0, 1, 2, 3].map(|k| shift * depth[k] - sdd * own[k])
        };
        let rows = [row(r, sx - px), row(c, sy - py), depth];
        let numbers = [
            ("SourceToIsocenterDistance", sid),
            ("SourceToDetectorDistance", sdd),
            ("GantryAngle", gantry.to_degrees().rem_euclid(360.0)),
            ("OutOfPlaneAngle", out_of_plane.to_degrees()),
            ("InPlaneAngle", in_plane.to_degrees()),
            ("ProjectionOffsetX", px),
            ("ProjectionOffsetY", py),
            ("SourceOffsetX", sx),
            ("SourceOffsetY", sy),
        ];
        xml.push_str("  <Projection>\n");
        for (name, value) in numbers {
            // Writing to a String does not fail.
            let _ = writeln!(xml, "    <{name}>{value}</{name}>");
        }
        xml.push_str("    <Matrix>\n");
        for [a, b, c, d] in rows {
            let _ = writeln!(xml, "      {a} {b} {c} {d}");
        }
        xml.push_str("    </Matrix>\n  </Projection>\n");
    }
    let [width, height] = spacing.unwrap_or([1.0; 2]);
    let (n_bins, n_rows) = (rays.detector().n_bins(), rays.detector().n_rows());
    let first = |n: usize, pitch: f64| -0.5 * (n as f64 - 1.0) * pitch;
    // The third axis is that of the views.
    let grid = VoxelGrid::new(
        [n_bins, n_rows, rays.n_views()],
        [0.1 * width, 0.1 * height, 0.1],
        [0.1 * first(n_bins, width), 0.1 * first(n_rows, height), 0.0],
    )?;
    metaimage::write_mha(&path.with_extension("mha"), &Volume::new(grid, samples)?)?;
    write_atomically(&path.with_extension("xml"), |out| {
        writeln!(out, "<?xml version=\"1.0\"?>\n<!DOCTYPE RTKGEOMETRY>")?;
        writeln!(
            out,
            "<RTKThreeDCircularGeometry version=\"3\">\n{xml}</RTKThreeDCircularGeometry>"
        )
    })
}

/// Writes projections `[view][row][bin]` in the format of ASTRA: the array `name.npy` as `[row][view][bin]`, and `name-vectors.npy` with the
/// twelve numbers of a `cone_vec` geometry per view, in cm of the lab: source, centre of the detector, step of a bin, step of a row.
///
/// # Errors
/// [`PhantomError::Unsupported`] unless all views have one source; [`PhantomError::WrongLength`], [`PhantomError::File`].
pub fn write_astra(path: &Path, rays: &RayGeometry, samples: &[f32]) -> Result<(), PhantomError> {
    check_samples(rays, samples)?;
    let mut vectors = Vec::new();
    for view_idx in 0..rays.n_views() {
        let (source, bins) = cone(rays, view_idx, "ASTRA")?;
        let four = [
            source.coords,
            centre(rays, &bins).coords,
            bins.bin_step,
            bins.row_step,
        ];
        vectors.extend(four.iter().flat_map(|v| [v.x, v.y, v.z]));
    }
    let (n_bins, n_rows) = (rays.detector().n_bins(), rays.detector().n_rows());
    let rows = (0..n_rows).flat_map(|row| samples.chunks(n_bins).skip(row).step_by(n_rows));
    let ordered: Vec<f32> = rows.flatten().copied().collect();
    let shape = [n_rows, rays.n_views(), n_bins];
    super::write_npy(&path.with_extension("npy"), &shape, &ordered)?;
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    write_atomically(&path.with_file_name(format!("{stem}-vectors.npy")), |out| {
        put_f64(out, &[rays.n_views(), 12], &vectors)
    })
}

fn check_samples(rays: &RayGeometry, samples: &[f32]) -> Result<(), PhantomError> {
    let view_len = rays.detector().n_bins() * rays.detector().n_rows();
    check_length(
        "samples of projections",
        samples.len(),
        rays.n_views() * view_len,
    )
}

/// Source and bins of a view.
fn cone(
    rays: &RayGeometry,
    view_idx: usize,
    format: &'static str,
) -> Result<(Point3<f64>, PointRaster), PhantomError> {
    let what = "rays without a common source in each view";
    let one_row = rays.detector().n_rows() == 1;
    match rays.rasters(view_idx) {
        Some([source, bins]) if one_row || source.row_step == Vector3::zeros() => {
            Ok((source.first, bins))
        }
        _ => Err(PhantomError::Unsupported { format, what }),
    }
}

/// The centre of the detector.
fn centre(rays: &RayGeometry, bins: &PointRaster) -> Point3<f64> {
    let half = [rays.detector().n_bins(), rays.detector().n_rows()].map(|n| 0.5 * (n as f64 - 1.0));
    bins.first + bins.bin_step * half[0] + bins.row_step * half[1]
}

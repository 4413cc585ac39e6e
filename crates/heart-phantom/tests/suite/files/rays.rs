//! Geometries for RTK and ASTRA: the numbers in the files give the lines of the views.

use heart_phantom::files::{read_npy, write_astra, write_rtk};
use heart_phantom::{PhantomError, RayGeometry};
use nalgebra::{Matrix3, Matrix3x4, Matrix4, Rotation3, Vector3, Vector4};
use revolve_voxel::ParallelDetector;
use std::f64::consts::FRAC_PI_2;
use std::fs;
use std::path::Path;

const SIZE: [usize; 2] = [7, 4];
const PITCH: [f64; 2] = [0.4, 0.7];
type Writer = fn(&Path, &RayGeometry, &[f32]) -> Result<(), PhantomError>;

/// Rounding of some tens of centimetres, in mm.
const ROUNDING: f64 = 1e-9;

/// Pinhole cameras with axes of any direction, and the detector shifted in its plane.
fn cameras(mirrored: bool) -> RayGeometry {
    let matrices: Vec<_> = (0..20)
        .map(|k| {
            let [a, b, c] = [1.3, 2.1, 0.7].map(|step| step * f64::from(k));
            // The last one sees along the axis of RTK's gantry.
            let turn = match k {
                19 => Rotation3::from_axis_angle(&Vector3::x_axis(), 0.0),
                _ => Rotation3::from_euler_angles(a, b, c),
            };
            let source = Vector3::new(a.sin(), b.cos(), c.sin()) * 5.0
                - turn.inverse() * Vector3::new(0.0, 0.0, 60.0);
            let rows = if mirrored { -1.0 } else { 1.0 };
            // Distance of the detector over the pitch of bins and rows, and the bin and row at the foot of the source.
            let [u, v] = PITCH.map(|pitch| 100.0 / pitch);
            let [foot_u, foot_v] = [3.0 + a.cos(), 1.5 + 2.0 * b.sin()];
            let k = Matrix3::new(u, 0.0, foot_u, 0.0, -rows * v, foot_v, 0.0, 0.0, 1.0);
            let block = k * turn.into_inner();
            let last = -(block * source);
            [0, 1, 2].map(|i| [block[(i, 0)], block[(i, 1)], block[(i, 2)], last[i]])
        })
        .collect();
    let detector = ParallelDetector::new(SIZE[0], SIZE[1], PITCH).unwrap();
    RayGeometry::from_matrices(&matrices, detector).unwrap()
}

fn samples(rays: &RayGeometry) -> Vec<f32> {
    (0..rays.n_views() * SIZE[0] * SIZE[1])
        .map(|k| k as f32)
        .collect()
}

/// The values of a tag, in the order of the file.
fn values<'a>(xml: &'a str, tag: &str) -> Vec<&'a str> {
    let (open, close) = (format!("<{tag}>"), format!("</{tag}>"));
    xml.split(&open)
        .skip(1)
        .map(|rest| rest.split(&close).next().unwrap())
        .collect()
}

/// The projection matrix of RTK's parameters, with the order Z X Y of its rotations.
fn of_parameters(number: impl Fn(&str) -> f64) -> Matrix3x4<f64> {
    let angle = |name| -number(name).to_radians();
    let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), angle("InPlaneAngle"))
        * Rotation3::from_axis_angle(&Vector3::x_axis(), angle("OutOfPlaneAngle"))
        * Rotation3::from_axis_angle(&Vector3::y_axis(), angle("GantryAngle"));
    let [sx, sy] = ["SourceOffsetX", "SourceOffsetY"].map(&number);
    let [px, py] = ["ProjectionOffsetX", "ProjectionOffsetY"].map(&number);
    let (sid, sdd) = (
        number("SourceToIsocenterDistance"),
        number("SourceToDetectorDistance"),
    );
    let shift = Matrix3::new(1.0, 0.0, sx - px, 0.0, 1.0, sy - py, 0.0, 0.0, 1.0);
    let project = Matrix3x4::from_row_slice(&[
        -sdd, 0.0, 0.0, 0.0, 0.0, -sdd, 0.0, 0.0, 0.0, 0.0, 1.0, -sid,
    ]);
    let to_source = Matrix4::new_translation(&Vector3::new(-sx, -sy, 0.0));
    shift * project * to_source * turn.to_homogeneous()
}

/// Points of a ray in the coordinates of RTK are projected to the centre of its bin, by the matrix and by the parameters of each view.
#[test]
fn the_geometry_of_rtk_projects_rays_to_their_bins() {
    let folder = tempfile::tempdir().unwrap();
    let detector = ParallelDetector::new(SIZE[0], SIZE[1], PITCH).unwrap();
    let angles: Vec<f64> = (0..4).map(|k| 0.1 + FRAC_PI_2 * f64::from(k)).collect();
    let cone = RayGeometry::cone([60.0, 100.0], &angles, detector).unwrap();
    for rays in [cone, cameras(false)] {
        let samples = samples(&rays);
        write_rtk(&folder.path().join("p"), &rays, &samples).unwrap();
        let xml = fs::read_to_string(folder.path().join("p.xml")).unwrap();
        let mha = fs::read(folder.path().join("p.mha")).unwrap();
        let data = mha.len() - 4 * samples.len();
        let header = std::str::from_utf8(&mha[..data]).unwrap();
        let of_header = |key: &str| -> Vec<f64> {
            let line = header.lines().find_map(|line| line.strip_prefix(key));
            let numbers = line.unwrap().trim_start_matches(" = ").split(' ');
            numbers.map(|number| number.parse().unwrap()).collect()
        };
        let dims = [SIZE[0], SIZE[1], rays.n_views()].map(|n| n as f64);
        assert_eq!(of_header("DimSize"), dims);
        let bytes: Vec<u8> = samples.iter().flat_map(|v| v.to_le_bytes()).collect();
        assert!(mha[data..] == bytes);
        let (spacing, offset) = (of_header("ElementSpacing"), of_header("Offset"));
        assert!(
            spacing
                .iter()
                .zip(PITCH)
                .all(|(mm, cm)| (mm - 10.0 * cm).abs() < ROUNDING)
        );

        let matrices = values(&xml, "Matrix");
        assert_eq!(matrices.len(), rays.n_views());
        for (view_idx, text) in matrices.iter().enumerate() {
            let numbers = text
                .split_whitespace()
                .map(|number| number.parse().unwrap());
            let matrix = Matrix3x4::from_row_iterator(numbers);
            let number = |tag: &str| -> f64 { values(&xml, tag)[view_idx].parse().unwrap() };
            let off = (of_parameters(number) - matrix).norm() / matrix.norm();
            assert!(off < 1e-12, "view {view_idx}: {off:e}");
            let lines = rays.lines(view_idx).unwrap();
            for (bin, row, along) in [(0, 0, 30.0), (6, 0, 70.0), (2, 3, 55.0), (5, 1, 99.0)] {
                let p = lines.ray(bin, row).unwrap().at(along) * 10.0;
                let p = matrix * Vector4::new(p.x, p.z, -p.y, 1.0);
                for (k, idx) in [bin, row].into_iter().enumerate() {
                    let centre = offset[k] + idx as f64 * spacing[k];
                    assert!(
                        (p[k] / p.z - centre).abs() < ROUNDING,
                        "{view_idx} {bin} {row}"
                    );
                }
                // Before the source, at its distance along the normal of the detector.
                assert!(p.z < 0.0);
            }
        }
    }
}

/// The line from the source to `centre + (bin - 3) u + (row - 1.5) v` is the ray of the bin.
#[test]
fn the_vectors_of_astra_give_the_rays() {
    let folder = tempfile::tempdir().unwrap();
    for rays in [cameras(false), cameras(true)] {
        let samples = samples(&rays);
        write_astra(&folder.path().join("p"), &rays, &samples).unwrap();
        let ordered = read_npy(&folder.path().join("p.npy")).unwrap();
        assert_eq!(ordered.shape, [SIZE[1], rays.n_views(), SIZE[0]]);
        let vectors = fs::read(folder.path().join("p-vectors.npy")).unwrap();
        let vectors: Vec<f64> = vectors[vectors.len() - 8 * 12 * rays.n_views()..]
            .chunks(8)
            .map(|bytes| f64::from_le_bytes(bytes.try_into().unwrap()))
            .collect();
        for (view_idx, twelve) in vectors.chunks(12).enumerate() {
            let [source, centre, u, v] =
                [0, 3, 6, 9].map(|k| Vector3::from_column_slice(&twelve[k..k + 3]));
            let lines = rays.lines(view_idx).unwrap();
            for (bin, row) in [(0, 0), (6, 0), (2, 3), (5, 1)] {
                let end = centre + u * (bin as f64 - 3.0) + v * (row as f64 - 1.5);
                let ray = lines.ray(bin, row).unwrap();
                for point in [source, end] {
                    let off = ray.direction().cross(&(point - ray.origin().coords)).norm();
                    assert!(off < 0.1 * ROUNDING, "{view_idx} {bin} {row} {off:e}");
                }
                assert!((end - source).dot(&ray.direction()) > 0.0);
                let at = (row * rays.n_views() + view_idx) * SIZE[0] + bin;
                let sample = (view_idx * SIZE[1] + row) * SIZE[0] + bin;
                assert_eq!(ordered.samples[at], samples[sample]);
            }
        }
    }
}

#[test]
fn rays_that_the_formats_cannot_store_are_rejected() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("p");
    let unsupported = |rays: &RayGeometry, write: Writer, what: &str| {
        let written = write(&path, rays, &samples(rays));
        let Err(PhantomError::Unsupported { what: given, .. }) = written else {
            panic!("{what}: {written:?}");
        };
        assert!(given.contains(what), "{given}");
    };
    let detector = ParallelDetector::new(SIZE[0], SIZE[1], PITCH).unwrap();
    let cone = |far| RayGeometry::cone([60.0, far], &[0.3], detector).unwrap();
    unsupported(&cameras(true), write_rtk, "mirrored");
    let fan = RayGeometry::fan([60.0, 100.0], &[0.3], detector).unwrap();
    unsupported(&fan, write_rtk, "common source");
    unsupported(&fan, write_astra, "common source");
    let list = RayGeometry::from_lines(vec![cone(100.0).lines(0).unwrap()]).unwrap();
    unsupported(&list, write_rtk, "common source");
    // Rows that are not perpendicular to bins.
    let oblique = [
        [100.0, 1e-3, 0.0, 0.0],
        [0.0, 100.0, 0.0, 0.0],
        [0.0, 0.0, 1.0, 60.0],
    ];
    let oblique = RayGeometry::from_matrices(&[oblique], detector).unwrap();
    unsupported(&oblique, write_rtk, "oblique");
    for write in [write_rtk, write_astra] {
        assert!(matches!(
            write(&path, &cone(100.0), &[0.0; 3]),
            Err(PhantomError::WrongLength { .. })
        ));
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    // The rays of one row of a fan have a common source.
    let row = ParallelDetector::new(SIZE[0], 1, PITCH).unwrap();
    let row = RayGeometry::fan([60.0, 100.0], &[0.3], row).unwrap();
    write_rtk(&path, &row, &[0.0; 7]).unwrap();
}

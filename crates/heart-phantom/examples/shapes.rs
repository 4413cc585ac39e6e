//! Chords of a cylinder, a cone and organs along the rays of random projection matrices, for comparison with RTK (`tests/readers/shapes.py`):
//! `cylinder.mha`, `cone.mha`, `ellipsoid.mha` and `trunk.mha`, each with its geometry.
//!
//! `cargo run --release -p heart-phantom --example shapes -- FOLDER`

use heart_phantom::RayGeometry;
use heart_phantom::files::write_rtk;
use heart_phantom::revolve_voxel::nalgebra::{Matrix3, Rotation3, Vector3};
use heart_phantom::revolve_voxel::{Body, Meridian, OrganShape, ParallelDetector, Pose, Ray, Span};
use std::error::Error;
use std::path::PathBuf;

/// The length of a ray in a shape.
type Chord<'a> = &'a dyn Fn(&Ray) -> f64;

const VIEWS: usize = 100;
const BINS: usize = 64;

/// Numbers between -1 and 1.
fn random(seed: &mut u64) -> f64 {
    *seed = seed
        .wrapping_mul(6364136223846793005)
        .wrapping_add(1442695040888963407);
    (*seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// The projection matrix of a source 45 to 75 cm from a point near the heart, in any direction.
fn matrix(seed: &mut u64) -> [[f64; 4]; 3] {
    let mut next = || random(seed);
    let rotation = Rotation3::from_euler_angles(3.0 * next(), 3.0 * next(), 3.0 * next());
    let near = Vector3::new(next(), next(), next()) * 3.0;
    let source = near - rotation.inverse() * Vector3::new(0.0, 0.0, 60.0 + 15.0 * next());
    let (focal, middle) = (160.0 + 40.0 * next(), 0.5 * BINS as f64);
    let principal = [middle + 4.0 * next(), middle + 4.0 * next()];
    // RTK's rows go up.
    let camera = Matrix3::new(
        focal,
        0.0,
        principal[0],
        0.0,
        -focal,
        principal[1],
        0.0,
        0.0,
        1.0,
    );
    let block = camera * rotation.into_inner();
    let last = -(block * source);
    [0, 1, 2].map(|i| [block[(i, 0)], block[(i, 1)], block[(i, 2)], last[i]])
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| ".".into()));
    let mut seed = 2006;
    let matrices: Vec<_> = (0..VIEWS).map(|_| matrix(&mut seed)).collect();
    let rays =
        RayGeometry::from_matrices(&matrices, ParallelDetector::new(BINS, BINS, [0.25; 2])?)?;
    let pose = Pose::identity()
        .rotated_y(0.7)?
        .rotated_z(-0.4)?
        .shifted(Vector3::new(0.5, -1.0, 0.8))?;
    let cylinder = Body::new(vec![Meridian::new(&[[-3.0, 2.0], [4.0, 2.0]])?], pose)?;
    let cone = Body::new(vec![Meridian::new(&[[-3.0, 2.5], [4.0, 0.0]])?], pose)?;
    let ellipsoid = OrganShape::ellipsoid([1.0, -2.0, 0.5], [3.0, 5.0, 4.0])?;
    let trunk = OrganShape::cylinder([-1.0, 0.5], [19.0, 11.0])?;
    let length = |span: Option<Span>| span.map_or(0.0, |span| span.length());
    let shapes: [(&str, Chord); 4] = [
        ("cylinder", &|ray| {
            cylinder.chord(0, ray).unwrap_or(f64::NAN)
        }),
        ("cone", &|ray| cone.chord(0, ray).unwrap_or(f64::NAN)),
        ("ellipsoid", &|ray| length(ellipsoid.span(ray))),
        ("trunk", &|ray| length(trunk.span(ray))),
    ];
    for (name, chord) in shapes {
        let mut samples = Vec::new();
        for view_idx in 0..VIEWS {
            let lines = rays.lines(view_idx)?;
            for k in 0..BINS * BINS {
                let ray = lines.ray(k % BINS, k / BINS).ok_or("every bin has a ray")?;
                samples.push(chord(&ray) as f32);
            }
        }
        write_rtk(&folder.join(name), &rays, &samples)?;
    }
    Ok(())
}

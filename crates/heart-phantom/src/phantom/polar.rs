//! Measurements of the left ventricle in an image, as clinical software makes them: polar map and volume of the cavity.

use super::Phantom;
use crate::error::{PhantomError, check_count, check_length};
use revolve_voxel::nalgebra::{Point3, Vector3};
use std::f64::consts::{FRAC_1_SQRT_2, TAU};

/// Rings from the base to the inner apex (a third each basal, mid and apical), and azimuths per ring.
const RINGS: usize = 24;
const AZIMUTHS: usize = 72;
/// Samples along a radius.
const SAMPLES: usize = 200;
/// Lines through the apical cap, in addition to the axis.
const LINES: usize = 6;

/// A polar map of an image, and the volume of the cavity measured in it.
///
/// Rays run outwards from the known axis of the heart, 72 at each of 24 heights between base and inner apex. The value of a ray is its largest
/// sample (circumferential profile). The endocardium is at half of this value towards the axis.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize))]
#[non_exhaustive]
#[doc(alias("LVEF", "bullseye", "17 segments"))]
pub struct PolarMap {
    /// Mean value of the rays of each of the 17 segments of the American Heart Association (Cerqueira et al. 2002,
    /// doi:10.1161/hc0402.102975): 1 to 6 basal anterior, anteroseptal, inferoseptal, inferior, inferolateral, anterolateral; 7 to 12 mid
    /// in the same order; 13 to 16 apical anterior, septal, inferior, lateral; 17 apex. Anterior is the side of the wall that is
    /// farthest towards the patient's front and head.
    pub segments: [f64; 17],
    /// Volume within the measured endocardium, mL.
    pub cavity_ml: f64,
}

impl Phantom {
    /// Returns the polar map of an image of a gate, `[z][y][x]`. The geometry is that of the heart at the phase that represents the gate
    /// ([`Phantom::phases`]), at end-diastole for an ungated image.
    ///
    /// # Errors
    /// [`PhantomError::Count`] if there is no such gate; [`PhantomError::WrongLength`] for another number of voxels; errors of the
    /// solver.
    pub fn polar_map(&self, gate: usize, image: &[f32]) -> Result<PolarMap, PhantomError> {
        check_count("gate", gate, [0, self.n_gates() - 1])?;
        let grid = self.camera().grid();
        check_length("image", image.len(), grid.len())?;
        let phases = self.phases();
        let at = &phases[if phases.len() == self.n_gates() {
            gate
        } else {
            0
        }];
        let shape = self.shape(at.phase)?;
        let body = shape.body().with_pose(self.pose(at.breath)?);
        let pose = body.pose();
        let (length, radius) = (shape.cavity_length(), 1.3 * shape.radius());
        let base = shape.solution().inner.at(0.0).position[0];
        // Anterior; azimuths increase towards the septum, counter-clockwise seen from the apex.
        let up = Point3::new(0.0, -FRAC_1_SQRT_2, FRAC_1_SQRT_2);
        let up = pose.to_body(&up) - pose.to_body(&Point3::origin());
        let anterior = Vector3::new(0.0, up.y, up.z).try_normalize(1e-9);
        let anterior = anterior.unwrap_or_else(Vector3::y);
        let septal = Vector3::x().cross(&anterior);
        let samples = |from: Vector3<f64>, to: Vector3<f64>| {
            let ends = [from, to].map(|end| pose.to_lab(&end.into()));
            grid.profile(image, ends, SAMPLES)
        };
        let mut sums = [[0.0, 0.0]; 17];
        let mut add = |segment: usize, value: f64| {
            sums[segment][0] += value;
            sums[segment][1] += 1.0;
        };
        let mut volume = 0.0;
        for ring in 0..RINGS {
            let height = (ring as f64 + 0.5) / RINGS as f64;
            let axis = Vector3::x() * (base + length * height);
            for azimuth in 0..AZIMUTHS {
                let turn = (azimuth as f64 + 0.5) / AZIMUTHS as f64;
                let (sin, cos) = (TAU * turn).sin_cos();
                let ray = samples(axis, axis + radius * (cos * anterior + sin * septal))?;
                let (value, inner) = wall_of(ray.values());
                let part = |n: usize| (turn * n as f64 + 0.5) as usize % n;
                match 3 * ring / RINGS {
                    0 => add(part(6), value),
                    1 => add(6 + part(6), value),
                    _ => add(12 + part(4), value),
                }
                volume += 0.5 * (inner * radius).powi(2);
            }
        }
        // Parallel to the axis, from the last ring through the cap.
        for line in 0..=LINES {
            let (sin, cos) = (TAU * line as f64 / LINES as f64).sin_cos();
            let off = match line {
                LINES => Vector3::zeros(),
                _ => 0.1 * radius * (cos * anterior + sin * septal),
            };
            let along = |x: f64| Vector3::x() * (base + x) + off;
            let ray = samples(along(0.9 * length), along(length + 0.5 * radius))?;
            add(16, wall_of(ray.values()).0);
        }
        Ok(PolarMap {
            segments: sums.map(|[sum, n]| sum / n),
            cavity_ml: volume * (length / RINGS as f64) * (TAU / AZIMUTHS as f64),
        })
    }
}

/// Returns the largest sample of a ray, and the position of half of it towards the start, as a fraction of the ray's length.
fn wall_of(ray: &[f64]) -> (f64, f64) {
    let mut peak = 0;
    for (k, value) in ray.iter().enumerate() {
        if *value > ray[peak] {
            peak = k;
        }
    }
    let half = 0.5 * ray[peak];
    let edge = (1..=peak).rev().find(|&k| ray[k - 1] < half);
    let at = edge.map_or(0.0, |k| {
        (k - 1) as f64 + (half - ray[k - 1]) / (ray[k] - ray[k - 1])
    });
    (ray[peak], at / (ray.len() - 1) as f64)
}

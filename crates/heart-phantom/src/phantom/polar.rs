//! Measurements of the left ventricle in an image, as clinical software makes them: polar map and volume of the cavity.

use super::Phantom;
use crate::error::{PhantomError, check_count, check_finite, check_length};
use revolve_voxel::nalgebra::{Point3, Vector3};
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, TAU};

/// Circles from the base to two thirds of the cavity, half of them basal and half mid; polar angles of the apical part; azimuths of each.
const CIRCLES: usize = 16;
const ANGLES: usize = 12;
const AZIMUTHS: usize = 72;
/// Samples along a radius.
const SAMPLES: usize = 200;
/// Polar angles from the axis in the apical segment.
const APEX: usize = 3;

/// A polar map of an image, and the volume of the cavity measured in it.
///
/// Rays run outwards from the known axis of the heart, at 72 azimuths: perpendicular to it at 16 heights over the basal two thirds of the cavity,
/// and at 12 polar angles from the point at two thirds (the sampling of Germano et al., J. Nucl. Med. 36, 2138, 1995, without its ellipsoid).
/// The value of a ray f(t) is its largest sample f(p) (circumferential profile). The endocardium is by two rules at
///
/// ```text
/// half maximum       the largest t < p with f(t) = f(p) / 2
/// steepest gradient  the t < p with the largest f(t + h/2) - f(t - h/2), h the side of a voxel; the vertex of the parabola through
///                    this difference at t - h, t, t + h
/// ```
///
/// and on the axis if there is none, as in a ray without a positive sample. Volumes end at the plane of the base, which is known. Resolution and voxel size bias both volumes,
/// mostly towards small ones; the polar map of the ground truth of the same scene shows by how much.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[non_exhaustive]
#[doc(alias("LVEF", "bullseye", "17 segments"))]
pub struct PolarMap {
    /// Mean value of the rays of each of the 17 segments of the American Heart Association (Cerqueira et al. 2002,
    /// doi:10.1161/hc0402.102975): 1 to 6 basal anterior, anteroseptal, inferoseptal, inferior, inferolateral, anterolateral; 7 to 12 mid
    /// in the same order; 13 to 16 apical anterior, septal, inferior, lateral; 17 apex. Anterior is the side of the wall that is
    /// farthest towards the patient's front and head.
    pub segments: [f64; 17],
    /// Volume within the endocardium at half maximum, mL; `None` if no ray has one.
    pub cavity_ml: Option<f64>,
    /// Volume within the endocardium at the steepest gradient, mL; `None` if no ray has one.
    pub cavity_gradient_ml: Option<f64>,
}

impl Phantom {
    /// Returns the polar map of an image of a gate, `[z][y][x]`. The geometry is that of the heart at the phase that represents the gate
    /// ([`Phantom::phases`]), at end-diastole for an ungated image.
    ///
    /// # Errors
    /// [`PhantomError::Count`] if there is no such gate; [`PhantomError::WrongLength`] for another number of voxels;
    /// [`PhantomError::OutOfRange`] for a voxel that is not finite; errors of the solver.
    pub fn polar_map(&self, gate: usize, image: &[f32]) -> Result<PolarMap, PhantomError> {
        check_count("gate", gate, [0, self.n_gates() - 1])?;
        let grid = self.camera().grid();
        check_length("image", image.len(), grid.len())?;
        check_finite("a voxel", image)?;
        let phases = self.phases();
        let of_gates = phases.len() == self.n_gates();
        let at = phases[if of_gates { gate } else { 0 }].at;
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
        let window = grid.spacing()[0] * (SAMPLES - 1) as f64 / (2.0 * radius);
        let window = (window.round() as usize).max(1);
        // Value of a ray from the axis, and the distances of both edges.
        let ray = |x: f64, direction: Vector3<f64>| -> Result<_, PhantomError> {
            let from = Vector3::x() * (base + x);
            let ends = [from, from + radius * direction].map(|end| pose.to_lab(&end.into()));
            let (value, edges) = wall_of(grid.profile(image, ends, SAMPLES)?.values(), window);
            Ok((value, edges.map(|edge| edge * radius)))
        };
        let mut sums = [[0.0, 0.0]; 17];
        let mut add = |segment: usize, value: f64| {
            sums[segment][0] += value;
            sums[segment][1] += 1.0;
        };
        let (mut volumes, apical) = ([0.0; 2], length * 2.0 / 3.0);
        for azimuth in 0..AZIMUTHS {
            let turn = (azimuth as f64 + 0.5) / AZIMUTHS as f64;
            let (sin, cos) = (TAU * turn).sin_cos();
            let outwards = cos * anterior + sin * septal;
            let part = |n: usize| (turn * n as f64 + 0.5) as usize % n;
            for circle in 0..CIRCLES {
                let (value, edges) =
                    ray(apical * (circle as f64 + 0.5) / CIRCLES as f64, outwards)?;
                add(6 * (2 * circle / CIRCLES) + part(6), value);
                for (volume, edge) in volumes.iter_mut().zip(edges) {
                    *volume += edge.powi(2) / 2.0 * apical / CIRCLES as f64;
                }
            }
            for angle in 0..ANGLES {
                let polar = |k: f64| FRAC_PI_2 * k / ANGLES as f64;
                let (sin, cos) = polar(angle as f64 + 0.5).sin_cos();
                let (value, edges) = ray(apical, cos * Vector3::x() + sin * outwards)?;
                add(if angle < APEX { 16 } else { 12 + part(4) }, value);
                let band = polar(angle as f64).cos() - polar(angle as f64 + 1.0).cos();
                for (volume, edge) in volumes.iter_mut().zip(edges) {
                    *volume += edge.powi(3) / 3.0 * band;
                }
            }
        }
        let [cavity_ml, cavity_gradient_ml] =
            volumes.map(|v| (v > 0.0).then_some(v * TAU / AZIMUTHS as f64));
        Ok(PolarMap {
            segments: sums.map(|[sum, n]| sum / n),
            cavity_ml,
            cavity_gradient_ml,
        })
    }
}

/// Returns the largest sample of a ray, and the positions of its edges by both rules of [`PolarMap`] as fractions of its length; a voxel
/// has `2 window` samples.
fn wall_of(ray: &[f64], window: usize) -> (f64, [f64; 2]) {
    let mut peak = 0;
    for (k, value) in ray.iter().enumerate() {
        if *value > ray[peak] {
            peak = k;
        }
    }
    let half = 0.5 * ray[peak].max(0.0);
    let edge = (1..=peak).rev().find(|&k| half > 0.0 && ray[k - 1] < half);
    let at_half = edge.map_or(0.0, |k| {
        (k - 1) as f64 + (half - ray[k - 1]) / (ray[k] - ray[k - 1])
    });
    let last = (ray.len() - 1).saturating_sub(window);
    let rise = |k: usize| ray[k + window] - ray[k - window];
    let inside = window..=peak.min(last);
    let steepest = inside.max_by(|&a, &b| rise(a).total_cmp(&rise(b)));
    // Interpolation of a constant image has rounding errors.
    let steepest = steepest.filter(|&k| half > 0.0 && rise(k) > 1e-6 * half);
    let at_steepest = steepest.map_or(0.0, |k| {
        let fits = k >= 3 * window && k + 2 * window <= last;
        let bend = |[a, b, c]: [f64; 3]| (a - c) / (2.0 * (a - 2.0 * b + c));
        let vertex = fits.then(|| bend([rise(k - 2 * window), rise(k), rise(k + 2 * window)]));
        // At a maximum the vertex is within half of the distance of the three positions.
        let vertex = vertex.filter(|vertex| vertex.abs() <= 0.5);
        k as f64 + vertex.unwrap_or(0.0) * 2.0 * window as f64
    });
    let length = (ray.len() - 1) as f64;
    (ray[peak], [at_half / length, at_steepest / length])
}

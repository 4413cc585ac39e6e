//! What the camera sees: sinograms of the heart at rest, of instants, of whole cycles.

use crate::error::{PhantomError, check, check_count};
use crate::{Camera, Cycle, Heart, HeartShape};
use rayon::prelude::*;
use revolve_voxel::{ParallelRays, RayCounters};
use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// When each view is taken.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Acquisition {
    /// All views at one phase of the cycle: nothing moves.
    Static {
        /// The phase; 0 is rest.
        phase: f64,
    },
    /// View `k` is an instant at `t = k * interval` seconds.
    Instants {
        /// Seconds from a view to the next.
        interval: f64,
    },
    /// Each view is the mean over one whole cycle, by the trapezoidal rule on `points` equally
    /// spaced phases, which for a periodic function is the Gauss rule. Even, so that the half of
    /// them gives an error estimate for nothing.
    WholeCycle {
        /// Number of phases.
        points: usize,
    },
}

impl Acquisition {
    /// The phases that the views see: one for all (static), one each (instants), or those over
    /// which every view is averaged (whole cycle).
    ///
    /// # Errors
    /// [`PhantomError::OutOfRange`] for a phase or interval that is not finite;
    /// [`PhantomError::Count`] or [`PhantomError::Odd`] for a number of quadrature points that is
    /// not even or not within 2 to 65536.
    pub fn phases(&self, cycle: &Cycle, n_views: usize) -> Result<Vec<f64>, PhantomError> {
        match *self {
            Acquisition::Static { phase } => Ok(vec![check("phase", phase, -1e9, 1e9)?]),
            Acquisition::Instants { interval } => {
                check("interval", interval, 0.0, 1e9)?;
                Ok((0..n_views)
                    .map(|k| cycle.phase(k as f64 * interval))
                    .collect())
            }
            Acquisition::WholeCycle { points } => {
                check_count("quadrature points", points, 2, 65536)?;
                if !points.is_multiple_of(2) {
                    return Err(PhantomError::Odd {
                        what: "quadrature points",
                        given: points,
                    });
                }
                Ok((0..points).map(|j| j as f64 / points as f64).collect())
            }
        }
    }
}

/// The sinograms of an acquisition and how they came about.
#[derive(Debug, Clone)]
pub struct Sinograms {
    /// Line integrals in cm times activity, index order `[view][row][bin]`, bin fastest.
    pub samples: Vec<f32>,
    /// Distinct phases that the views see.
    pub distinct_phases: usize,
    /// Distinct shapes that those phases need: mirrored phases share one.
    pub distinct_shapes: usize,
    /// For whole cycles: `|s_n - s_(n/2)| / |s_n|` (Euclidean norms over all samples), the
    /// difference between `n` phases and half of them. It bounds the error of `n` from above
    /// where the rule converges at all.
    pub quadrature_error: Option<f64>,
    /// Rays cast and skipped.
    pub rays: RayCounters,
}

/// Takes all views of an acquisition; `activity` is that of the cavity and of the wall.
///
/// Line integrals are those of the exact body, no voxels are involved. Equal shapes are solved
/// once; the result has the same bits for any number of threads. `progress` is called with the
/// number of views done.
///
/// # Errors
/// [`PhantomError::Count`] unless the number of quadrature points is even and at most 65536; what
/// solving the shapes can return.
pub fn acquire(
    heart: &Heart,
    camera: &Camera,
    cycle: &Cycle,
    acquisition: Acquisition,
    activity: [f64; 2],
    progress: &(dyn Fn(usize) + Sync),
) -> Result<Sinograms, PhantomError> {
    let n_views = camera.n_views();
    let phases = acquisition.phases(cycle, n_views)?;
    let gains: Vec<f64> = phases.iter().map(|&phase| cycle.gain(phase)).collect();
    let shapes = heart.shapes(&gains)?;

    let mut samples = vec![0.0f32; n_views * camera.size() * camera.size()];
    let done = AtomicUsize::new(0);
    let shared = matches!(acquisition, Acquisition::WholeCycle { .. }).then(|| merge(&shapes));
    let views: Vec<View> = samples
        .par_chunks_mut(camera.size() * camera.size())
        .enumerate()
        .map(|(view_idx, image)| {
            let rays = camera.rays(view_idx)?;
            let view = match &shared {
                Some(exposures) => average(exposures, &rays, &activity, image)?,
                None => View {
                    rays: shapes[view_idx % shapes.len()]
                        .body()
                        .project_add(&rays, &activity, 1.0, image)?,
                    ..View::default()
                },
            };
            progress(1 + done.fetch_add(1, Ordering::Relaxed));
            Ok(view)
        })
        .collect::<Result<_, PhantomError>>()?;

    // Summed in the order of the views, whatever thread took them.
    let total = views.iter().fold(View::default(), |sum, view| View {
        rays: sum.rays + view.rays,
        square: sum.square + view.square,
        difference: sum.difference + view.difference,
    });
    Ok(Sinograms {
        samples,
        distinct_phases: count_distinct(&phases),
        distinct_shapes: count_distinct(&gains),
        quadrature_error: shared.map(|_| {
            if total.square > 0.0 {
                (total.difference / total.square).sqrt()
            } else {
                0.0
            }
        }),
        rays: total.rays,
    })
}

/// A shape with its weight in the even and in the odd half of the quadrature.
pub(crate) struct Exposure {
    pub(crate) shape: Arc<HeartShape>,
    pub(crate) weights: [f64; 2],
}

/// What one view adds to the totals.
#[derive(Default)]
struct View {
    rays: RayCounters,
    /// Sum of the squared samples.
    square: f64,
    /// Sum of the squared differences from the rule with half the points.
    difference: f64,
}

/// Equal shapes merged, in the order of their first phase.
pub(crate) fn merge(shapes: &[Arc<HeartShape>]) -> Vec<Exposure> {
    let weight = 1.0 / shapes.len() as f64;
    let mut exposures: Vec<Exposure> = Vec::new();
    for (j, shape) in shapes.iter().enumerate() {
        let known = exposures
            .iter_mut()
            .find(|exposure| Arc::ptr_eq(&exposure.shape, shape));
        match known {
            Some(exposure) => exposure.weights[j % 2] += weight,
            None => {
                let mut weights = [0.0; 2];
                weights[j % 2] = weight;
                exposures.push(Exposure {
                    shape: shape.clone(),
                    weights,
                });
            }
        }
    }
    exposures
}

/// Writes the mean over the exposures to `image`.
fn average(
    exposures: &[Exposure],
    rays: &ParallelRays,
    activity: &[f64],
    image: &mut [f32],
) -> Result<View, PhantomError> {
    let mut view = View::default();
    let mut odd = vec![0.0f32; image.len()];
    for exposure in exposures {
        for (half, &weight) in exposure.weights.iter().enumerate() {
            if weight > 0.0 {
                let target = if half == 0 { &mut *image } else { &mut odd[..] };
                let body = exposure.shape.body();
                view.rays = view.rays + body.project_add(rays, activity, weight, target)?;
            }
        }
    }
    // The rule is the sum of its halves, the one with half the points twice the even half.
    for (even, odd) in image.iter_mut().zip(&odd) {
        view.difference += f64::from(odd - *even).powi(2);
        *even += odd;
        view.square += f64::from(*even).powi(2);
    }
    Ok(view)
}

fn count_distinct(values: &[f64]) -> usize {
    values
        .iter()
        .map(|v| v.to_bits())
        .collect::<BTreeSet<_>>()
        .len()
}

//! Views of the organs around a body, which replaces them.

use rayon::prelude::*;

use crate::error::{finite, length, positive};
use crate::rays::cylinder::across;
use crate::rays::slabs::for_slabs;
use crate::{Attenuator, Body, Organs, ParallelRays, Ray, RayCounters, RevolveError, Sample, Span};

impl Organs {
    /// Adds `weight` times the integral of the organs' activity along the rays, wherever the body is not, to an image; weakened by an
    /// attenuator if there is one (the detector is ahead of the rays).
    ///
    /// # Errors
    /// [`RevolveError::WrongLength`] for a wrong image, [`RevolveError::NotFinite`] for the weight, [`RevolveError::NotPositive`] for rays
    /// along z.
    pub fn project_around_add<T: Sample>(
        &self,
        body: &Body,
        rays: &ParallelRays,
        weight: f64,
        attenuator: Option<&Attenuator>,
        out: &mut [T],
    ) -> Result<RayCounters, RevolveError> {
        finite("weight", weight)?;
        length("image", rays.image_len(), out.len())?;
        positive("rays' part across the torso", across(&rays.direction()))?;
        let n_bins = rays.n_bins();
        let active = |ray: &Ray| -> Vec<(Span, f64)> {
            let pieces = self.pieces(ray).into_iter();
            let held = pieces.map(|(span, organ)| (span, weight * organ.activity));
            held.filter(|(_, activity)| *activity != 0.0).collect()
        };
        out.par_chunks_mut(rays.n_slabs() * n_bins)
            .enumerate()
            .for_each(|(row, image)| {
                for bin in 0..n_bins {
                    let ray = rays.line(bin, row);
                    let pieces = active(&ray);
                    if pieces.is_empty() {
                        continue;
                    }
                    let way = attenuator.map(|medium| medium.along(&ray));
                    for (span, activity) in pieces {
                        for_slabs(
                            rays.planes(),
                            0.0,
                            [span.enter, span.exit],
                            |slab, [p, q]| {
                                let seen = way.as_ref().map_or(q - p, |way| way.integral(p, q));
                                image[slab * n_bins + bin] += T::from_f64(activity * seen);
                            },
                        );
                    }
                }
            });
        // The body replaces them all: what they have within it is taken away.
        let all = vec![-1.0; body.layers().len()];
        body.project_measured(rays, &all, 1.0, out, |[bin, row]| {
            let ray = rays.line(bin, row);
            let pieces = active(&ray);
            let way = attenuator.map(|medium| medium.along(&ray));
            move |low: f64, high: f64, origin: f64| {
                let (low, high) = (low - origin, high - origin);
                let within = |(span, activity): &(Span, f64)| {
                    let (p, q) = (low.max(span.enter), high.min(span.exit));
                    match &way {
                        _ if q <= p => 0.0,
                        None => activity * (q - p),
                        Some(way) => activity * way.integral(p, q),
                    }
                };
                pieces.iter().map(within).sum()
            }
        })
    }
}

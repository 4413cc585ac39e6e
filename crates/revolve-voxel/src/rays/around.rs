//! Projections of the organs around a body that replaces them.

use rayon::prelude::*;

use crate::error::{finite, length};
use crate::rays::attenuation::without;
use crate::rays::organ::Finder;
use crate::rays::raster::Rays;
use crate::{Body, Capsule, Organ, Organs, RayCounters, RevolveError, Sample, Span};

/// A segment of a ray with its activity and attenuation.
#[derive(Debug, Clone, Copy)]
struct Piece {
    span: Span,
    activity: f64,
    mu: f64,
}

impl Organs {
    /// Adds `weight` times the line integrals of the activity of the organs to an image, with or without attenuation by the organs
    /// (the detector lies in the direction of the rays). [`Organs::project_replaced_add`] gives the change due to a body in their
    /// place.
    ///
    /// Cost: the logarithm of the number of planes, and one product per slab that contains an organ.
    ///
    /// # Errors
    /// [`RevolveError::WrongLength`] for a wrong image, [`RevolveError::NotFinite`] for the weight, [`RevolveError::NotPositive`] for rays
    /// along z.
    pub fn project_add<T: Sample>(
        &self,
        rays: &impl Rays,
        weight: f64,
        attenuated: bool,
        out: &mut [T],
    ) -> Result<(), RevolveError> {
        check(rays, weight, out.len())?;
        let n_bins = rays.row_len();
        out.par_chunks_mut((rays.planes().len() + 1) * n_bins)
            .enumerate()
            .for_each_init(Scratch::default, |scratch, (row, image)| {
                let mask = rays.mask_of_row(row);
                for bin in 0..n_bins {
                    if mask.is_some_and(|mask| !mask[bin]) {
                        continue;
                    }
                    let Scratch { finder, pieces, .. } = scratch;
                    pieces.clear();
                    let found = finder.pieces(self, &rays.line(bin, row)).iter();
                    pieces.extend(found.map(|(span, organ)| piece(*span, organ, attenuated)));
                    add(pieces, rays.planes(), weight, &mut image[bin..], n_bins);
                }
            });
        Ok(())
    }

    /// Adds `weight` times the change of [`Organs::project_add`] by a body that replaces the organs to an image. The activity of
    /// the organs inside the body is removed. If the attenuation `mu` of the body is given, the rest is attenuated by body and
    /// organs. The change is zero for rays that miss the body. The activity of the body is not included.
    ///
    /// # Errors
    /// As [`Organs::project_add`]; [`RevolveError::Negative`] for an attenuation below zero.
    pub fn project_replaced_add<T: Sample>(
        &self,
        body: &Body,
        rays: &impl Rays,
        weight: f64,
        mu: Option<f64>,
        out: &mut [T],
    ) -> Result<RayCounters, RevolveError> {
        check(rays, weight, out.len())?;
        if let Some(given) = mu
            && finite("attenuation", given)? < 0.0
        {
            let what = "attenuation";
            return Err(RevolveError::Negative { what, given });
        }
        let n_bins = rays.row_len();
        let outermost = &body.layers()[body.layers().len() - 1];
        let capsule = Capsule::around([body]);
        let counters = out
            .par_chunks_mut((rays.planes().len() + 1) * n_bins)
            .enumerate()
            .map_init(Scratch::default, |scratch, (row, image)| {
                let mut counters = RayCounters::default();
                let mask = rays.mask_of_row(row);
                for bin in 0..n_bins {
                    if mask.is_some_and(|mask| !mask[bin]) {
                        continue;
                    }
                    let ray = rays.line(bin, row);
                    if !capsule.as_ref().is_some_and(|capsule| capsule.meets(&ray)) {
                        counters.skipped += 1;
                        continue;
                    }
                    let own = body.spans_in(outermost, &ray);
                    counters.cast += 1;
                    if own.is_empty() {
                        continue;
                    }
                    counters.hit += 1;
                    let Scratch {
                        finder,
                        pieces,
                        alone,
                    } = scratch;
                    pieces.clear();
                    alone.clear();
                    for (span, organ) in finder.pieces(self, &ray) {
                        alone.push(piece(*span, organ, mu.is_some()));
                        let left = without(*span, &own);
                        pieces.extend(left.map(|span| piece(span, organ, mu.is_some())));
                    }
                    pieces.extend(own.iter().map(|span| Piece {
                        span: *span,
                        activity: 0.0,
                        mu: mu.unwrap_or(0.0),
                    }));
                    pieces.sort_by(|a, b| a.span.enter.total_cmp(&b.span.enter));
                    for (pieces, weight) in [(pieces, weight), (alone, -weight)] {
                        add(pieces, rays.planes(), weight, &mut image[bin..], n_bins);
                    }
                }
                counters
            })
            .reduce(RayCounters::default, |a, b| a + b);
        Ok(counters)
    }
}

/// Work arrays of a ray.
#[derive(Default)]
struct Scratch {
    finder: Finder,
    pieces: Vec<Piece>,
    /// Segments of the organs without the body.
    alone: Vec<Piece>,
}

fn check(rays: &impl Rays, weight: f64, len: usize) -> Result<(), RevolveError> {
    finite("weight", weight)?;
    length("image", rays.image_len(), len)?;
    rays.check_across()
}

fn piece(span: Span, organ: &Organ, attenuated: bool) -> Piece {
    let (activity, mu) = (
        organ.activity,
        if attenuated { organ.attenuation } else { 0.0 },
    );
    Piece { span, activity, mu }
}

/// Adds `weight` times the attenuated integrals of disjoint, ordered pieces of a ray to the slabs of a bin, which are `n_bins`
/// samples apart. Starts at the detector, so that the transmission is a product.
fn add<T: Sample>(pieces: &[Piece], planes: &[f64], weight: f64, image: &mut [T], n_bins: usize) {
    let mut through = 1.0;
    // Slabs have one thickness, so their exponential is constant.
    let (mut thickness, mut optical, mut within) = (0.0, 0.0, [0.0; 2]);
    for &Piece { span, activity, mu } in pieces.iter().rev() {
        if activity == 0.0 {
            through *= (-mu * span.length()).exp();
            continue;
        }
        let mut slab = planes.partition_point(|plane| *plane < span.exit);
        let mut right = span.exit;
        loop {
            let below = slab.checked_sub(1).map(|below| planes[below]);
            let left = below.map_or(span.enter, |plane| plane.max(span.enter));
            let length = right - left;
            // The thickness equals that of the previous slab up to rounding.
            if optical != mu || (length - thickness).abs() > 1e-13 * length.abs() {
                (thickness, optical) = (length, mu);
                let mean = match mu > 0.0 {
                    true => -(-mu * length).exp_m1() / mu,
                    false => length,
                };
                within = [mean, 1.0 - mu * mean];
            }
            image[slab * n_bins] += T::from_f64(weight * activity * through * within[0]);
            through *= within[1];
            right = left;
            if right <= span.enter {
                break;
            }
            slab -= 1;
        }
    }
}

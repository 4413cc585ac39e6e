//! Views of the organs around a body, which replaces them.

use rayon::prelude::*;

use crate::error::{finite, length, positive};
use crate::rays::attenuation::without;
use crate::rays::cylinder::across;
use crate::rays::organ::Finder;
use crate::{Body, Capsule, Organ, Organs, ParallelRays, RayCounters, RevolveError, Sample, Span};

/// A stretch of a ray with what it holds and how it weakens.
#[derive(Debug, Clone, Copy)]
struct Piece {
    span: Span,
    activity: f64,
    mu: f64,
}

impl Organs {
    /// Adds `weight` times the integral of the organs' activity along all rays to an image; `attenuated` by the organs, or not (the detector
    /// is ahead of the rays). A body in their place changes it by [`Organs::project_replaced_add`].
    ///
    /// Cost: a logarithm of the planes and a product for each slab that an organ is in.
    ///
    /// # Errors
    /// [`RevolveError::WrongLength`] for a wrong image, [`RevolveError::NotFinite`] for the weight, [`RevolveError::NotPositive`] for rays
    /// along z.
    pub fn project_add<T: Sample>(
        &self,
        rays: &ParallelRays,
        weight: f64,
        attenuated: bool,
        out: &mut [T],
    ) -> Result<(), RevolveError> {
        check(rays, weight, out.len())?;
        let n_bins = rays.n_bins();
        out.par_chunks_mut(rays.n_slabs() * n_bins)
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

    /// Adds `weight` times the change of [`Organs::project_add`] by a body that replaces the organs to an image: their activity is where the body
    /// is not; attenuated, if the body's attenuation `mu` is given, by it and by their own. The change is zero along rays that miss the
    /// body. The body's own activity is not included.
    ///
    /// # Errors
    /// As [`Organs::project_add`]; [`RevolveError::Negative`] for an attenuation below zero.
    pub fn project_replaced_add<T: Sample>(
        &self,
        body: &Body,
        rays: &ParallelRays,
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
        let n_bins = rays.n_bins();
        let outermost = &body.layers()[body.layers().len() - 1];
        let capsule = Capsule::around([body]);
        let counters = out
            .par_chunks_mut(rays.n_slabs() * n_bins)
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
    /// Those of the organs alone.
    alone: Vec<Piece>,
}

fn check(rays: &ParallelRays, weight: f64, len: usize) -> Result<(), RevolveError> {
    finite("weight", weight)?;
    length("image", rays.image_len(), len)?;
    positive("rays' part across the torso", across(&rays.direction())).map(drop)
}

fn piece(span: Span, organ: &Organ, attenuated: bool) -> Piece {
    let (activity, mu) = (
        organ.activity,
        if attenuated { organ.attenuation } else { 0.0 },
    );
    Piece { span, activity, mu }
}

/// Adds `weight` times the attenuated integral of pieces, which do not overlap and stand in their order along the ray, to the slabs of a
/// bin, `n_bins` samples from one to the next. It goes from the detector inwards, so that what gets through is a product.
fn add<T: Sample>(pieces: &[Piece], planes: &[f64], weight: f64, image: &mut [T], n_bins: usize) {
    let mut through = 1.0;
    // Slabs are of one thickness, so that their exponential is, too.
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
            // As thick as the last one but for rounding.
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

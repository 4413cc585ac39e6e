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
    /// Adds `weight` times the integral of the organs' activity along all rays that pass the capsule by to an image: what a body within it
    /// has to do with them is nothing, so that this is done once for all its shapes. They are weakened by what they are `weakened` by, the
    /// organs' own attenuation, or by nothing (the detector is ahead of the rays).
    ///
    /// Cost: a logarithm of the planes and a product for each slab that an organ is in.
    ///
    /// # Errors
    /// [`RevolveError::WrongLength`] for a wrong image, [`RevolveError::NotFinite`] for the weight, [`RevolveError::NotPositive`] for rays
    /// along z.
    pub fn project_past_add<T: Sample>(
        &self,
        capsule: &Capsule,
        rays: &ParallelRays,
        weight: f64,
        weakened: bool,
        out: &mut [T],
    ) -> Result<(), RevolveError> {
        check(rays, weight, out.len())?;
        let n_bins = rays.n_bins();
        out.par_chunks_mut(rays.n_slabs() * n_bins)
            .enumerate()
            .for_each_init(Scratch::default, |scratch, (row, image)| {
                for bin in 0..n_bins {
                    let ray = rays.line(bin, row);
                    if capsule.meets(&ray) {
                        continue;
                    }
                    let Scratch { finder, pieces } = scratch;
                    pieces.clear();
                    let found = finder.pieces(self, &ray).iter();
                    pieces.extend(found.map(|(span, organ)| piece(*span, organ, weakened)));
                    add(pieces, rays.planes(), weight, &mut image[bin..], n_bins);
                }
            });
        Ok(())
    }

    /// Adds `weight` times the integral of the organs' activity, wherever the body is not, along the rays through a capsule that holds it
    /// to an image; weakened, if the body's attenuation `mu` is given, by it and by their own.
    ///
    /// # Errors
    /// As [`Organs::project_past_add`]; [`RevolveError::Negative`] for an attenuation below zero.
    pub fn project_around_add<T: Sample>(
        &self,
        body: &Body,
        capsule: &Capsule,
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
        let counters = out
            .par_chunks_mut(rays.n_slabs() * n_bins)
            .enumerate()
            .map_init(Scratch::default, |scratch, (row, image)| {
                let mut counters = RayCounters::default();
                for bin in 0..n_bins {
                    let ray = rays.line(bin, row);
                    if !capsule.meets(&ray) {
                        counters.skipped += 1;
                        continue;
                    }
                    let own = body.spans_in(outermost, &ray);
                    counters.cast += 1;
                    counters.hit += u64::from(!own.is_empty());
                    let Scratch { finder, pieces } = scratch;
                    pieces.clear();
                    for (span, organ) in finder.pieces(self, &ray) {
                        let left = without(*span, &own);
                        pieces.extend(left.map(|span| piece(span, organ, mu.is_some())));
                    }
                    pieces.extend(own.iter().map(|span| Piece {
                        span: *span,
                        activity: 0.0,
                        mu: mu.unwrap_or(0.0),
                    }));
                    pieces.sort_by(|a, b| a.span.enter.total_cmp(&b.span.enter));
                    add(pieces, rays.planes(), weight, &mut image[bin..], n_bins);
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
}

fn check(rays: &ParallelRays, weight: f64, len: usize) -> Result<(), RevolveError> {
    finite("weight", weight)?;
    length("image", rays.image_len(), len)?;
    positive("rays' part across the torso", across(&rays.direction())).map(drop)
}

fn piece(span: Span, organ: &Organ, weakened: bool) -> Piece {
    let (activity, mu) = (
        organ.activity,
        if weakened { organ.attenuation } else { 0.0 },
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

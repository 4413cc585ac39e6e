//! Line integrals that are weakened on the way to the detector, exactly.
//!
//! Along a ray with parameter t the detector is ahead, at `t = +infinity`: a view's rays run towards it. With l(t) the length
//! of the ray from t to the detector within a medium of constant attenuation mu (1/cm), activity a gives
//!
//! ```text
//! integral of a(t) exp(-mu l(t)) dt        over a stretch [p, q] of constant a within the medium:
//!                                          a exp(-mu l(q)) (1 - exp(-mu (q - p))) / mu
//! ```
//!
//! (the attenuated Radon transform: Boman and Stroemberg, J. Geom. Anal. 14 (2004), Eq. 1.1 and 1.2; with constant
//! attenuation in a convex domain: Kim et al., IEEE Trans. Nucl. Sci. 31 (1984) 538,
//! <https://doi.org/10.1109/TNS.1984.4333314>).

use std::ops::Range;

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::error::{finite, length, positive};
use crate::solid::segment::ROUNDING;
use crate::voxels::coverage::check_range;
use crate::{Body, Error, Organs, ParallelRays, Ray, RayCounters, Sample, Span, VoxelGrid};

/// A cylinder of elliptic section along the lab's z axis, without ends: a torso.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EllipticCylinder {
    centre: [f64; 2],
    semi_axes: [f64; 2],
}

/// What weakens the rays.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Medium<'a> {
    /// All that is within one layer of a body.
    Layer(&'a Body, usize),
    /// Everything within a torso.
    Torso(EllipticCylinder),
    /// Organs with attenuations of their own around a body, whose outermost layer replaces them all.
    Around(&'a Organs, &'a Body),
}

/// What weakens the rays, and how much.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Attenuator<'a> {
    mu: f64,
    medium: Medium<'a>,
}

impl EllipticCylinder {
    /// The cylinder about the axis through `centre` (x, y) with half-widths `semi_axes` along x and y, in cm.
    ///
    /// # Errors
    /// [`Error::NotFinite`], [`Error::NotPositive`].
    pub fn new(centre: [f64; 2], semi_axes: [f64; 2]) -> Result<Self, Error> {
        for k in 0..2 {
            finite("centre of the torso", centre[k])?;
            positive("semi-axis of the torso", semi_axes[k])?;
        }
        Ok(Self { centre, semi_axes })
    }

    /// Centre (x, y).
    pub fn centre(&self) -> [f64; 2] {
        self.centre
    }

    /// Half-widths along x and y.
    pub fn semi_axes(&self) -> [f64; 2] {
        self.semi_axes
    }

    /// The stretch of a ray within the cylinder; none for a ray along z, whose stretch would have no ends.
    pub fn span(&self, ray: &Ray) -> Option<Span> {
        let [o, d] = [ray.origin().coords, ray.direction()];
        // In coordinates in which the section is the unit circle.
        let p = [0, 1].map(|k| (o[k] - self.centre[k]) / self.semi_axes[k]);
        let v = [0, 1].map(|k| d[k] / self.semi_axes[k]);
        let vv = v[0] * v[0] + v[1] * v[1];
        if across(&d) == 0.0 {
            return None;
        }
        let cross = p[0] * v[1] - p[1] * v[0];
        let middle = -(p[0] * v[0] + p[1] * v[1]) / vv;
        let half = ((1.0 - cross / vv.sqrt()) * (1.0 + cross / vv.sqrt()) / vv).max(0.0);
        (half > 0.0).then(|| Span {
            enter: middle - half.sqrt(),
            exit: middle + half.sqrt(),
        })
    }

    /// Adds `value` times the covered fraction of every voxel in some slices to `out` (`[z][y][x]`, those slices only): an
    /// attenuation map, exact.
    ///
    /// # Errors
    /// [`Error::Length`] for slices or a buffer that do not fit, [`Error::NotFinite`] for the value.
    pub fn voxelize_add<T: Sample>(
        &self,
        grid: &VoxelGrid,
        slices: Range<usize>,
        value: f64,
        out: &mut [T],
    ) -> Result<(), Error> {
        finite("value", value)?;
        check_slices(grid, &slices, out.len())?;
        if out.is_empty() {
            return Ok(());
        }
        let ([nx, ny, _], h) = (grid.shape(), grid.spacing());
        // All slices are alike.
        let section: Vec<T> = (0..nx * ny)
            .into_par_iter()
            .map(|k| {
                let at = grid.centre(k % nx, k / nx, 0);
                let [x, y] = [0, 1].map(|a| {
                    let edge =
                        |side: f64| (at[a] - self.centre[a] + side * h[a]) / self.semi_axes[a];
                    [edge(-0.5), edge(0.5)]
                });
                let whole = (x[1] - x[0]) * (y[1] - y[0]);
                T::from_f64(value * (disc_in_box(x, y) / whole).clamp(0.0, 1.0))
            })
            .collect();
        out.par_chunks_mut(nx * ny).for_each(|slice| {
            for (v, add) in slice.iter_mut().zip(&section) {
                *v += *add;
            }
        });
        Ok(())
    }
}

impl<'a> Attenuator<'a> {
    /// A medium of attenuation `mu` in 1/cm; of a body with organs around it, `mu` is the body's.
    ///
    /// # Errors
    /// [`Error::NotFinite`], [`Error::Negative`] for mu; [`Error::NoSuchLayer`].
    pub fn new(mu: f64, medium: Medium<'a>) -> Result<Self, Error> {
        if finite("attenuation", mu)? < 0.0 {
            return Err(Error::Negative {
                what: "attenuation",
                given: mu,
            });
        }
        if let Medium::Layer(body, layer) = medium
            && layer >= body.layers().len()
        {
            return Err(Error::NoSuchLayer {
                given: layer,
                layers: body.layers().len(),
            });
        }
        Ok(Self { mu, medium })
    }

    /// Attenuation in 1/cm.
    pub fn mu(&self) -> f64 {
        self.mu
    }

    /// What it fills.
    pub fn medium(&self) -> Medium<'a> {
        self.medium
    }

    /// Rays along a torso never leave it.
    pub(crate) fn check_direction(&self, d: &Vector3<f64>) -> Result<(), Error> {
        match self.medium {
            Medium::Layer(..) => Ok(()),
            Medium::Torso(_) | Medium::Around(..) => {
                positive("rays' part across the torso", across(d)).map(drop)
            }
        }
    }

    /// The medium along a ray.
    pub(crate) fn along(&self, ray: &Ray) -> Way {
        let mu = self.mu;
        let alike = |spans: Vec<Span>| spans.into_iter().map(|span| (span, mu)).collect();
        let mut pieces: Vec<(Span, f64)> = match self.medium {
            Medium::Layer(body, layer) => alike(body.spans_in(&body.layers()[layer], ray)),
            Medium::Torso(torso) => alike(torso.span(ray).into_iter().collect()),
            Medium::Around(organs, body) => {
                let outermost = &body.layers()[body.layers().len() - 1];
                let own = body.spans_in(outermost, ray);
                let around = organs.pieces(ray).into_iter();
                let around = around.map(|(span, organ)| (span, organ.attenuation));
                let mut pieces: Vec<_> = around.flat_map(|piece| without(piece, &own)).collect();
                pieces.extend(own.iter().map(|span| (*span, mu)));
                pieces.sort_by(|a, b| a.0.enter.total_cmp(&b.0.enter));
                pieces
            }
        };
        pieces.retain(|(_, mu)| *mu != 0.0);
        Way { pieces }
    }
}

/// How much of a unit direction is across a torso: none if it is along its axis but for rounding.
pub(crate) fn across(d: &Vector3<f64>) -> f64 {
    let across = d.x.hypot(d.y);
    if across > ROUNDING { across } else { 0.0 }
}

/// What other stretches, in their order, leave of a piece.
fn without((span, mu): (Span, f64), others: &[Span]) -> Vec<(Span, f64)> {
    let (mut left, mut enter) = (Vec::new(), span.enter);
    for other in others {
        let exit = other.enter.min(span.exit);
        if exit > enter {
            left.push((Span { enter, exit }, mu));
        }
        enter = enter.max(other.exit);
    }
    if span.exit > enter {
        let exit = span.exit;
        left.push((Span { enter, exit }, mu));
    }
    left
}

/// The way of one ray through a medium: stretches in their order, each with its attenuation.
#[derive(Debug, Clone, Default)]
pub(crate) struct Way {
    pieces: Vec<(Span, f64)>,
}

impl Way {
    /// The integral of `exp(-a(t))` over [p, q], with a(t) the attenuation of all that is beyond t.
    pub(crate) fn integral(&self, p: f64, q: f64) -> f64 {
        let (mut sum, mut right) = (0.0, q);
        // What is beyond: attenuations that are done with, and the length of the last one.
        let (mut done, mut last, mut beyond) = (0.0, 0.0, 0.0);
        // From the detector inwards: the stretch between this piece and the last, then this piece's own part.
        for &(span, mu) in self.pieces.iter().rev() {
            let gap = p.max(span.exit);
            if right > gap {
                sum += f64::exp(-(done + last * beyond)) * (right - gap);
                right = gap;
            }
            if mu != last {
                (done, last, beyond) = (done + last * beyond, mu, 0.0);
            }
            let low = p.max(span.enter);
            if right > low {
                let rest = beyond + (span.exit - right);
                sum += f64::exp(-(done + mu * rest)) * -(-mu * (right - low)).exp_m1() / mu;
                right = low;
            }
            if right <= p {
                return sum;
            }
            beyond += span.length();
        }
        if right > p {
            sum += f64::exp(-(done + last * beyond)) * (right - p);
        }
        sum
    }
}

impl Body {
    /// Adds `weight` times the attenuated line integrals of the activity to an image `[row][bin]`; the detector is ahead of
    /// the rays.
    ///
    /// # Errors
    /// As [`Body::project_add`]; [`Error::NotPositive`] for rays along the axis of a torso.
    ///
    /// ```
    /// use revolve_voxel::{Attenuator, Body, EllipticCylinder, Medium, Meridian, ParallelDetector, Pose};
    /// let rod = Meridian::new(&[[-1.0, 0.5], [1.0, 0.5]])?;
    /// let body = Body::new(vec![rod], Pose::axis_along_z(0.0)?)?;
    /// let torso = EllipticCylinder::new([0.0, 0.0], [10.0, 8.0])?;
    /// let attenuator = Attenuator::new(0.15, Medium::Torso(torso))?;
    /// let rays = ParallelDetector::new(1, 1, [1.0, 1.0])?.rays(0.0)?; // along +y
    /// let mut seen = [0.0_f64];
    /// body.project_attenuated_add(&rays, &[1.0], 1.0, &attenuator, &mut seen)?;
    /// let exact = (-0.15_f64 * 7.5).exp() * (1.0 - (-0.15_f64).exp()) / 0.15;
    /// assert!((seen[0] - exact).abs() < 1e-12);
    /// # Ok::<(), revolve_voxel::Error>(())
    /// ```
    pub fn project_attenuated_add<T: Sample>(
        &self,
        rays: &ParallelRays,
        activity: &[f64],
        weight: f64,
        attenuator: &Attenuator,
        out: &mut [T],
    ) -> Result<RayCounters, Error> {
        attenuator.check_direction(&rays.direction())?;
        self.project_measured(rays, activity, weight, out, |[bin, row]| {
            let way = attenuator.along(&rays.line(bin, row));
            move |low, high, origin| way.integral(low - origin, high - origin)
        })
    }
}

/// Slices of the grid, and a buffer of their size.
pub(crate) fn check_slices(
    grid: &VoxelGrid,
    slices: &Range<usize>,
    given: usize,
) -> Result<(), Error> {
    check_range(grid, slices)?;
    length("volume", grid.slice_len() * slices.len(), given)
}

/// Area of the unit disc within a rectangle.
fn disc_in_box(x: [f64; 2], y: [f64; 2]) -> f64 {
    // Below y, to the left of x, over the disc: the four corners' values give the rectangle's.
    let corner = |x: f64, y: f64| quadrant(x.clamp(-1.0, 1.0), y.clamp(-1.0, 1.0));
    let far = x[0].max(-x[1]).max(0.0).hypot(y[0].max(-y[1]).max(0.0));
    if far >= 1.0 {
        return 0.0;
    }
    if x[0].abs().max(x[1].abs()).hypot(y[0].abs().max(y[1].abs())) <= 1.0 {
        return (x[1] - x[0]) * (y[1] - y[0]);
    }
    corner(x[1], y[1]) - corner(x[0], y[1]) - corner(x[1], y[0]) + corner(x[0], y[0])
}

/// Signed area of the unit disc within the rectangle from the origin to (x, y), both in [-1, 1]: odd in x and in y.
fn quadrant(x: f64, y: f64) -> f64 {
    let (a, b) = (x.abs(), y.abs());
    let area = if a.hypot(b) <= 1.0 {
        a * b
    } else {
        // Under the arc from where it has height b to a.
        let from = ((1.0 - b) * (1.0 + b)).sqrt();
        let under = |t: f64| 0.5 * (t * ((1.0 - t) * (1.0 + t)).sqrt() + t.asin());
        b * from + under(a) - under(from)
    };
    area * x.signum() * y.signum()
}

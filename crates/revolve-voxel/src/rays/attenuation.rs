//! Exact attenuated line integrals.
//!
//! The detector lies in the direction of the ray, at `t = +infinity`. With l(t) the length of the ray from t to the detector within
//! a medium of constant attenuation mu (1/cm), an activity a contributes
//!
//! ```text
//! integral of a(t) exp(-mu l(t)) dt        over a stretch [p, q] of constant a within the medium:
//!                                          a exp(-mu l(q)) (1 - exp(-mu (q - p))) / mu
//! ```
//!
//! (the attenuated Radon transform: Boman and Stroemberg, J. Geom. Anal. 14 (2004), Eq. 1.1 and 1.2; with constant
//! attenuation in a convex domain: Kim et al., IEEE Trans. Nucl. Sci. 31 (1984) 538,
//! <https://doi.org/10.1109/TNS.1984.4333314>).

use nalgebra::Point3;

use crate::error::finite;
use crate::rays::raster::Rays;
use crate::{Body, EllipticCylinder, Organs, Ray, RayCounters, RevolveError, Sample, Span};

/// The attenuating medium.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Medium<'a> {
    /// The inside of one layer of a body.
    Layer(&'a Body, usize),
    /// The inside of a torso.
    Torso(EllipticCylinder),
    /// Organs with their own attenuation around a body; the outermost layer of the body replaces them.
    Around(&'a Organs, &'a Body),
}

/// An attenuating medium with its coefficient.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Attenuator<'a> {
    mu: f64,
    medium: Medium<'a>,
    /// Centre and squared radius of a ball around a body with organs: most rays miss it.
    ball: (Point3<f64>, f64),
}

impl<'a> Attenuator<'a> {
    /// A medium with attenuation `mu` in 1/cm; with organs `mu` is that of the body.
    ///
    /// # Errors
    /// [`RevolveError::NotFinite`], [`RevolveError::Negative`] for mu; [`RevolveError::NoSuchLayer`].
    pub fn new(mu: f64, medium: Medium<'a>) -> Result<Self, RevolveError> {
        if finite("attenuation", mu)? < 0.0 {
            return Err(RevolveError::Negative {
                what: "attenuation",
                given: mu,
            });
        }
        if let Medium::Layer(body, layer) = medium
            && layer >= body.layers().len()
        {
            return Err(RevolveError::NoSuchLayer {
                given: layer,
                layers: body.layers().len(),
            });
        }
        let mut ball = (Point3::origin(), 0.0);
        if let Medium::Around(_, body) = medium {
            let [low, high] = body.bounding_box(body.layers().len() - 1)?;
            let (low, high) = (low.coords, high.coords);
            // Larger than any rounding error.
            ball = (
                Point3::from((low + high) * 0.5),
                0.2501 * (high - low).norm_squared(),
            );
        }
        Ok(Self { mu, medium, ball })
    }

    /// Returns the attenuation in 1/cm.
    pub fn mu(&self) -> f64 {
        self.mu
    }

    /// Returns the medium.
    pub fn medium(&self) -> Medium<'a> {
        self.medium
    }

    /// Rays along the axis of a torso never leave it.
    pub(crate) fn check_directions(&self, rays: &impl Rays) -> Result<(), RevolveError> {
        match self.medium {
            Medium::Layer(..) => Ok(()),
            Medium::Torso(_) | Medium::Around(..) => rays.check_across(),
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
                let beside = (ray.origin() - self.ball.0).cross(&ray.direction());
                let own = match beside.norm_squared() <= self.ball.1 {
                    true => body.spans_in(outermost, ray),
                    false => Vec::new(),
                };
                let around = organs.pieces(ray).into_iter();
                let around = around.map(|(span, organ)| (span, organ.attenuation));
                let mut pieces: Vec<_> = around
                    .flat_map(|(span, mu)| without(span, &own).map(move |span| (span, mu)))
                    .collect();
                pieces.extend(own.iter().map(|span| (*span, mu)));
                pieces.sort_by(|a, b| a.0.enter.total_cmp(&b.0.enter));
                pieces
            }
        };
        pieces.retain(|(_, mu)| *mu != 0.0);
        Way { pieces }
    }
}

/// Returns the parts of a segment outside other, ordered segments.
pub(crate) fn without(span: Span, others: &[Span]) -> impl Iterator<Item = Span> + '_ {
    let ends = others
        .iter()
        .map(|other| other.enter)
        .chain([f64::INFINITY]);
    let starts = [f64::NEG_INFINITY].into_iter();
    let starts = starts.chain(others.iter().map(|other| other.exit));
    let gaps = starts.zip(ends).map(move |(enter, exit)| Span {
        enter: enter.max(span.enter),
        exit: exit.min(span.exit),
    });
    gaps.filter(|gap| gap.exit > gap.enter)
}

/// The ordered segments of one ray in a medium, each with its attenuation.
#[derive(Debug, Clone, Default)]
pub(crate) struct Way {
    pieces: Vec<(Span, f64)>,
}

impl Way {
    /// Returns the integral of `exp(-a(t))` over [p, q], with a(t) the attenuation between t and the detector.
    pub(crate) fn integral(&self, p: f64, q: f64) -> f64 {
        let (mut sum, mut right) = (0.0, q);
        // Attenuation beyond the segment: the completed part, and the length of the last segment.
        let (mut done, mut last, mut beyond) = (0.0, 0.0, 0.0);
        // From the detector inwards: the gap to the previous piece, then this piece.
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
    /// Adds `weight` times the attenuated line integrals of the activity to an image `[row][bin]`; the detector lies in the
    /// direction of the rays.
    ///
    /// # Errors
    /// As [`Body::project_add`]; [`RevolveError::NotPositive`] for rays along the axis of a torso.
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
    /// # Ok::<(), revolve_voxel::RevolveError>(())
    /// ```
    pub fn project_attenuated_add<T: Sample>(
        &self,
        rays: &impl Rays,
        activity: &[f64],
        weight: f64,
        attenuator: &Attenuator,
        out: &mut [T],
    ) -> Result<RayCounters, RevolveError> {
        attenuator.check_directions(rays)?;
        self.project_measured(rays, activity, weight, out, |[bin, row]| {
            let way = attenuator.along(&rays.line(bin, row));
            move |low, high, origin| way.integral(low - origin, high - origin)
        })
    }
}

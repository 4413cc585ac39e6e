//! Organs around a body: ellipsoids and elliptic cylinders, each active and attenuating, of which the last one counts.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::error::{finite, length, positive};
use crate::rays::attenuation::across;
use crate::rays::slabs::for_slabs;
use crate::{
    Attenuator, Body, EllipticCylinder, Error, ParallelRays, Ray, RayCounters, Sample, Span,
};

/// An ellipsoid with its axes along the lab's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ellipsoid {
    centre: [f64; 3],
    semi_axes: [f64; 3],
}

impl Ellipsoid {
    /// The ellipsoid about `centre` with half-widths `semi_axes` along x, y and z, in cm.
    ///
    /// # Errors
    /// [`Error::NotFinite`], [`Error::NotPositive`].
    pub fn new(centre: [f64; 3], semi_axes: [f64; 3]) -> Result<Self, Error> {
        for k in 0..3 {
            finite("centre of an organ", centre[k])?;
            positive("semi-axis of an organ", semi_axes[k])?;
        }
        Ok(Self { centre, semi_axes })
    }

    /// Centre (x, y, z).
    pub fn centre(&self) -> [f64; 3] {
        self.centre
    }

    /// Half-widths along x, y and z.
    pub fn semi_axes(&self) -> [f64; 3] {
        self.semi_axes
    }

    /// The stretch of a ray within the ellipsoid.
    pub fn span(&self, ray: &Ray) -> Option<Span> {
        // In coordinates in which it is the unit ball.
        let scaled = |v: Vector3<f64>| v.component_div(&Vector3::from(self.semi_axes));
        let (p, v) = (
            scaled(ray.origin() - Point3::from(self.centre)),
            scaled(ray.direction()),
        );
        let speed = v.norm();
        let middle = -p.dot(&v) / (speed * speed);
        let distance = p.cross(&v).norm() / speed;
        let half = ((1.0 - distance) * (1.0 + distance)).max(0.0).sqrt() / speed;
        (half > 0.0).then_some(Span {
            enter: middle - half,
            exit: middle + half,
        })
    }
}

/// What an organ fills.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum OrganShape {
    /// An elliptic cylinder along z, without ends.
    Cylinder(EllipticCylinder),
    /// An ellipsoid.
    Ellipsoid(Ellipsoid),
}

impl OrganShape {
    /// The stretch of a ray within it; none for a ray along a cylinder, whose stretch would have no ends.
    pub fn span(&self, ray: &Ray) -> Option<Span> {
        match self {
            Self::Cylinder(cylinder) => cylinder.span(ray),
            Self::Ellipsoid(ellipsoid) => ellipsoid.span(ray),
        }
    }
}

/// An organ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Organ {
    /// What it fills.
    pub shape: OrganShape,
    /// Activity per cm^3.
    pub activity: f64,
    /// Attenuation in 1/cm.
    pub attenuation: f64,
}

/// Organs, each of which replaces those before it where they overlap.
///
/// ```
/// use revolve_voxel::{Ellipsoid, EllipticCylinder, Organ, OrganShape, Organs, Ray};
/// use revolve_voxel::nalgebra::{Point3, Vector3};
/// let torso = OrganShape::Cylinder(EllipticCylinder::new([0.0; 2], [16.0, 11.0])?);
/// let lung = OrganShape::Ellipsoid(Ellipsoid::new([7.0, 0.0, 0.0], [5.0, 7.0, 10.0])?);
/// let organs = Organs::new(vec![
///     Organ { shape: torso, activity: 0.1, attenuation: 0.15 },
///     Organ { shape: lung, activity: 0.02, attenuation: 0.045 },
/// ])?;
/// let ray = Ray::new(Point3::new(7.0, 0.0, 0.0), Vector3::y())?;
/// let pieces = organs.pieces(&ray);
/// assert_eq!(pieces.len(), 3); // torso, lung, torso
/// assert_eq!(pieces[1].0.length(), 14.0);
/// # Ok::<(), revolve_voxel::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Organs(Vec<Organ>);

impl Organs {
    /// Organs in the order in which they replace each other.
    ///
    /// # Errors
    /// [`Error::NotFinite`], [`Error::Negative`] for an activity or an attenuation.
    pub fn new(organs: Vec<Organ>) -> Result<Self, Error> {
        for organ in &organs {
            for (what, given) in [
                ("activity of an organ", organ.activity),
                ("attenuation of an organ", organ.attenuation),
            ] {
                if finite(what, given)? < 0.0 {
                    return Err(Error::Negative { what, given });
                }
            }
        }
        Ok(Self(organs))
    }

    /// All of them.
    pub fn as_slice(&self) -> &[Organ] {
        &self.0
    }

    /// What a ray passes of them: stretches in their order along the ray, each with the one organ that counts there.
    pub fn pieces(&self, ray: &Ray) -> Vec<(Span, Organ)> {
        let spans: Vec<(Span, Organ)> = (self.0.iter())
            .filter_map(|organ| Some((organ.shape.span(ray)?, *organ)))
            .collect();
        let mut ends: Vec<f64> = (spans.iter())
            .flat_map(|(span, _)| [span.enter, span.exit])
            .collect();
        ends.sort_by(f64::total_cmp);
        ends.dedup();
        let mut pieces: Vec<(Span, Organ)> = Vec::with_capacity(ends.len());
        for pair in ends.windows(2) {
            let [enter, exit] = [pair[0], pair[1]];
            let counts =
                (spans.iter().rev()).find(|(span, _)| span.enter <= enter && exit <= span.exit);
            pieces.extend(counts.map(|(_, organ)| (Span { enter, exit }, *organ)));
        }
        pieces
    }

    /// Adds `weight` times the integral of the organs' activity along the rays, wherever the body is not, to an image; weakened by an
    /// attenuator if there is one (the detector is ahead of the rays).
    ///
    /// # Errors
    /// [`Error::Length`] for a wrong image, [`Error::NotFinite`] for the weight, [`Error::NotPositive`] for rays along z.
    pub fn project_around_add<T: Sample>(
        &self,
        body: &Body,
        rays: &ParallelRays,
        weight: f64,
        attenuator: Option<&Attenuator>,
        out: &mut [T],
    ) -> Result<RayCounters, Error> {
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

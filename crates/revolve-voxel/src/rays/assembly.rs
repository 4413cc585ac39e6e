//! Assemblies: organs, and a body with sectors that replaces them.

use crate::error::{finite, length};
use crate::rays::single::Search;
use crate::rays::slabs::{for_slabs, mean_transmission};
use crate::wall::body_line::BodyLine;
use crate::{Body, Lines, Organ, Organs, Ray, RayCounters, RevolveError, Sample, Sector, Span};

/// Activity and attenuation in space: organs, attenuating media, and a body that replaces them.
///
/// At a point, the last organ that contains it determines activity and attenuation. Media, if there are any, determine the attenuation instead of
/// the organs. Inside its outermost layer a body has its own activity, and its own attenuation if it is given; sectors add to its
/// activity.
#[derive(Debug, Clone)]
pub struct Assembly<'a> {
    organs: &'a Organs,
    media: Option<&'a Organs>,
    body: Option<Replacing<'a>>,
}

/// A body in an assembly.
#[derive(Debug, Clone)]
struct Replacing<'a> {
    body: &'a Body,
    /// Weight of each layer's indicator.
    weights: Vec<f64>,
    attenuation: Option<f64>,
    /// Sectors with an activity each.
    sectors: Vec<(Sector, f64)>,
}

impl<'a> Assembly<'a> {
    /// The organs alone.
    #[must_use]
    pub fn new(organs: &'a Organs) -> Self {
        Self {
            organs,
            media: None,
            body: None,
        }
    }

    /// Replaces the attenuation of the organs by that of others.
    #[must_use]
    pub fn with_media(self, media: &'a Organs) -> Self {
        let media = Some(media);
        Self { media, ..self }
    }

    /// Adds a body with an activity per cm^3 of each region ([`Body`]), and its attenuation in 1/cm; `None` for that of the media around it.
    ///
    /// # Errors
    /// [`RevolveError::WrongLength`] or [`RevolveError::NotFinite`] for the activities; [`RevolveError::NotFinite`],
    /// [`RevolveError::Negative`] for the attenuation.
    pub fn with_body(
        self,
        body: &'a Body,
        activity: &[f64],
        attenuation: Option<f64>,
    ) -> Result<Self, RevolveError> {
        let weights = body.weights(activity)?;
        if let Some(given) = attenuation
            && finite("attenuation", given)? < 0.0
        {
            let what = "attenuation";
            return Err(RevolveError::Negative { what, given });
        }
        let body = Some(Replacing {
            body,
            weights,
            attenuation,
            sectors: Vec::new(),
        });
        Ok(Self { body, ..self })
    }

    /// Adds an activity per cm^3 inside sectors; no effect without a body.
    ///
    /// # Errors
    /// [`RevolveError::NotFinite`].
    pub fn with_sectors(mut self, sectors: Vec<(Sector, f64)>) -> Result<Self, RevolveError> {
        for (_, activity) in &sectors {
            finite("activity", *activity)?;
        }
        if let Some(body) = &mut self.body {
            body.sectors = sectors;
        }
        Ok(self)
    }

    /// Returns the body.
    pub(crate) fn body(&self) -> Option<&'a Body> {
        self.body.as_ref().map(|own| own.body)
    }

    /// Returns the sectors.
    pub(crate) fn sectors(&self) -> impl Iterator<Item = &Sector> {
        let sectors = self.body.iter().flat_map(|own| &own.sectors);
        sectors.map(|(sector, _)| sector)
    }

    /// Returns the organs, then the media.
    pub(crate) fn surroundings(&self) -> impl Iterator<Item = &'a Organ> + use<'a> {
        let media = self.media.map(Organs::as_slice).unwrap_or_default();
        self.organs.as_slice().iter().chain(media)
    }
}

/// A stretch of a ray between surfaces, with its content and the content that the body replaces there; organs alone replace nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stretch {
    pub(crate) span: Span,
    pub(crate) with: Content,
    pub(crate) without: Content,
}

/// Activity per cm^3 and attenuation in 1/cm.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Content {
    pub(crate) activity: f64,
    pub(crate) attenuation: f64,
}

/// The contribution of a span of a ray to its content.
#[derive(Debug, Clone, Copy)]
enum Part {
    Organ(Content),
    Medium(f64),
    /// The outermost layer of the body.
    Body(Option<f64>),
    Activity(f64),
}

/// The projected part of an assembly.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Shown {
    /// Organs without the body.
    Organs,
    /// The change by the body: its activity, less that of the organs in its place, and its change of the attenuation. Zero along rays that miss
    /// its outermost layer.
    Change,
}

/// Finds the stretches of rays, with work arrays that rays share.
#[derive(Debug, Clone, Default)]
pub(crate) struct Finder {
    layers: Vec<Search>,
    sectors: Search,
    parts: Vec<(Span, Part)>,
    /// Spans of the body, which follow those of the organs.
    own: Vec<(Span, Part)>,
    ends: Vec<f64>,
    stretches: Vec<Stretch>,
}

impl Finder {
    /// Returns the stretches of a ray with activity or attenuation, in its order; none for the change by a body that the ray misses.
    #[inline(always)]
    pub(crate) fn stretches(
        &mut self,
        assembly: &Assembly<'_>,
        shown: Shown,
        ray: &Ray,
    ) -> &[Stretch] {
        self.own.clear();
        self.stretches.clear();
        if shown == Shown::Change {
            match &assembly.body {
                Some(own) => self.find_body(own, ray),
                None => return &[],
            }
            if self.own.is_empty() {
                return &[];
            }
        }
        self.find_surroundings(assembly, ray);
        self.parts.append(&mut self.own);
        self.ends.clear();
        let ends = self
            .parts
            .iter()
            .flat_map(|(span, _)| [span.enter, span.exit]);
        self.ends.extend(ends);
        self.ends.sort_unstable_by(f64::total_cmp);
        for pair in self.ends.windows(2) {
            let span = Span {
                enter: pair[0],
                exit: pair[1],
            };
            if span.enter < span.exit {
                let stretch = self.stretch(span, shown);
                if [stretch.with, stretch.without] != [Content::default(); 2] {
                    self.stretches.push(stretch);
                }
            }
        }
        &self.stretches
    }

    #[inline(always)]
    fn find_surroundings(&mut self, assembly: &Assembly<'_>, ray: &Ray) {
        self.parts.clear();
        for organ in assembly.organs.as_slice() {
            let content = Content {
                activity: organ.activity,
                attenuation: match assembly.media {
                    None => organ.attenuation,
                    Some(_) => 0.0,
                },
            };
            let span = organ.shape.span(ray);
            self.parts
                .extend(span.map(|span| (span, Part::Organ(content))));
        }
        for medium in assembly.media.map(Organs::as_slice).unwrap_or_default() {
            let span = medium.shape.span(ray);
            self.parts
                .extend(span.map(|span| (span, Part::Medium(medium.attenuation))));
        }
    }

    /// Finds the spans of a body and its sectors. The outermost layer is first, because it replaces the content there.
    #[inline(always)]
    fn find_body(&mut self, own: &Replacing<'_>, ray: &Ray) {
        let layers = own.body.layers();
        self.layers.resize(layers.len(), Search::default());
        for (k, layer) in layers.iter().enumerate().rev() {
            let outermost = k + 1 == layers.len();
            let (weight, parts) = (own.weights[k], &mut self.own);
            own.body.for_spans(layer, ray, &mut self.layers[k], |span| {
                if outermost {
                    parts.push((span, Part::Body(own.attenuation)));
                }
                parts.push((span, Part::Activity(weight)));
            });
        }
        if !self.own.is_empty() {
            self.find_sectors(&own.sectors, ray);
        }
    }

    /// Finds the spans of sectors; those in one pose share the line in its frame.
    fn find_sectors(&mut self, sectors: &[(Sector, f64)], ray: &Ray) {
        for in_pose in sectors.chunk_by(|(a, _), (b, _)| a.pose() == b.pose()) {
            let line = BodyLine::new(in_pose[0].0.pose(), ray);
            for (sector, activity) in in_pose {
                sector.for_spans(ray, &line, &mut self.sectors, |span| {
                    self.own.push((span, Part::Activity(*activity)));
                });
            }
        }
    }

    #[inline(always)]
    fn stretch(&self, span: Span, shown: Shown) -> Stretch {
        let [mut with, mut without] = [Content::default(); 2];
        for (own, part) in &self.parts {
            if own.enter <= span.enter && span.exit <= own.exit {
                match *part {
                    Part::Organ(content) => without = content,
                    Part::Medium(attenuation) => without.attenuation = attenuation,
                    Part::Body(attenuation) => {
                        let attenuation = attenuation.unwrap_or(without.attenuation);
                        with = Content {
                            activity: 0.0,
                            attenuation,
                        };
                        continue;
                    }
                    Part::Activity(activity) => {
                        with.activity += activity;
                        continue;
                    }
                }
                with = without;
            }
        }
        if shown == Shown::Organs {
            without.activity = 0.0;
        }
        Stretch {
            span,
            with,
            without,
        }
    }
}

impl Assembly<'_> {
    /// Adds `weight` times the attenuated line integrals of the activity to an image `[row][bin]`, or `[row][slab][bin]`; the detector lies in the
    /// direction of the rays:
    ///
    /// ```text
    /// integral of a(t) exp(-integral of mu from t to the detector) dt
    /// ```
    ///
    /// (the attenuated Radon transform: Boman and Stroemberg, J. Geom. Anal. 14 (2004), Eq. 1.1 and 1.2), a sum of closed forms over the stretches of
    /// constant activity and attenuation. Rows are distributed over the threads of the current rayon pool; the result does not depend on
    /// their number.
    ///
    /// ```
    /// use revolve_voxel::{Assembly, Body, Meridian, Organ, OrganShape, Organs, ParallelDetector, Pose, Shown};
    /// let rod = Meridian::new(&[[-1.0, 0.5], [1.0, 0.5]])?;
    /// let body = Body::new(vec![rod], Pose::axis_along_z(0.0)?)?;
    /// let shape = OrganShape::cylinder([0.0, 0.0], [10.0, 8.0])?;
    /// let torso = Organs::new(vec![Organ { shape, activity: 0.0, attenuation: 0.15 }])?;
    /// let assembly = Assembly::new(&torso).with_body(&body, &[1.0], None)?;
    /// let rays = ParallelDetector::new(1, 1, [1.0, 1.0])?.rays(0.0)?; // along +y
    /// let mut image = [0.0_f64];
    /// assembly.project_add(&rays, Shown::Change, 1.0, &mut image)?;
    /// let exact = (-0.15_f64 * 7.5).exp() * (1.0 - (-0.15_f64).exp()) / 0.15;
    /// assert!((image[0] - exact).abs() < 1e-12);
    /// # Ok::<(), revolve_voxel::RevolveError>(())
    /// ```
    ///
    /// # Errors
    /// [`RevolveError::WrongLength`] for a wrong image, [`RevolveError::NotFinite`] for the weight, [`RevolveError::NotPositive`] for rays
    /// along z with a cylinder.
    pub fn project_add<T: Sample>(
        &self,
        rays: &Lines,
        shown: Shown,
        weight: f64,
        out: &mut [T],
    ) -> Result<RayCounters, RevolveError> {
        finite("weight", weight)?;
        length("image", rays.image_len(), out.len())?;
        let is_endless = |organ: &Organ| organ.shape.is_cylinder();
        if self.surroundings().any(is_endless) {
            rays.check_across()?;
        }
        let body = self.body().filter(|_| shown == Shown::Change);
        let bounds = body.map(|body| (body.pose(), body.bounds()));
        let cast = |(finder, found): &mut (Finder, Vec<Emission>), ray: &Ray, slabs: &mut [f64]| {
            if let Some((pose, bounds)) = bounds {
                BodyLine::new(pose, ray).within(bounds)?;
            }
            let stretches = finder.stretches(self, shown, ray);
            emissions(stretches, found);
            (found.iter()).for_each(|own| add_to_slabs(rays.planes(), own, slabs));
            Some(!stretches.is_empty())
        };
        Ok(rays.add_each(body.map(Body::ball), weight, out, cast))
    }
}

/// The contribution of a stretch to a line integral: its activity times the transmission from its end to the detector, and its attenuation.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Emission {
    pub(crate) ends: [f64; 2],
    pub(crate) amount: f64,
    pub(crate) attenuation: f64,
}

/// Replaces `found` by the contributions of the stretches, from the detector on. A change by the body has both signs.
#[inline(always)]
pub(crate) fn emissions(stretches: &[Stretch], found: &mut Vec<Emission>) {
    found.clear();
    let [mut with, mut without] = [1.0f64; 2];
    // The attenuation of both that these transmissions do not include yet.
    let mut common = 0.0;
    for stretch in stretches.iter().rev() {
        let Span { enter, exit } = stretch.span;
        let (own, alone) = (&stretch.with, &stretch.without);
        if own == alone && with == without {
            common += own.attenuation * (exit - enter);
            continue;
        }
        let through = |attenuation: f64| match attenuation {
            0.0 => 1.0,
            attenuation => (-attenuation).exp(),
        };
        let both = through(std::mem::take(&mut common));
        (with, without) = (with * both, without * both);
        let parts = match own.attenuation == alone.attenuation {
            true => [with * own.activity - without * alone.activity, 0.0],
            false => [with * own.activity, -without * alone.activity],
        };
        for (amount, content) in parts.into_iter().zip([own, alone]) {
            if amount != 0.0 {
                found.push(Emission {
                    ends: [enter, exit],
                    amount,
                    attenuation: content.attenuation,
                });
            }
        }
        if own.attenuation == alone.attenuation {
            common = own.attenuation * (exit - enter);
        } else {
            with *= through(own.attenuation * (exit - enter));
            without *= through(alone.attenuation * (exit - enter));
        }
    }
}

/// Adds the integrals of `amount exp(-attenuation (high - t))` from `low` to `high` over each slab.
#[inline(always)]
fn add_to_slabs(planes: &[f64], own: &Emission, slabs: &mut [f64]) {
    for_slabs(planes, 0.0, own.ends, |slab, [from, to]| {
        let through = match own.ends[1] - to {
            0.0 => own.amount,
            rest => own.amount * (-own.attenuation * rest).exp(),
        };
        slabs[slab] += through * (to - from) * mean_transmission(own.attenuation * (to - from));
    });
}

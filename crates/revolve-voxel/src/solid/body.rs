//! Nested solids with an activity per region, and single rays through them.

use nalgebra::{Point3, Vector3};

use crate::error::{at_least, finite, length};
use crate::rays::chord::Hint;
use crate::rays::direction::Direction;
use crate::solid::meridian::Meridian;
use crate::{Error, Hit, Measures, Pose, Ray, Span};

/// Layers of solids about one axis, innermost first, standing in the lab.
///
/// Region 0 is the inside of layer 0; region k is what layer k holds beyond layer k-1 (a wall). The activity at a point is
/// `sum over k of (a_k - a_(k+1)) * inside_k`, where `inside_k` is 1 inside layer k and the activity after the last is 0: for
/// nested layers, each region's own activity. It is linear in the layers, so that line integrals and totals are exact
/// differences of those of the layers.
///
/// Layers need not be nested. Where layer k reaches outside layer k+1 the formula gives `a_k - a_(k+1)` beyond whatever the
/// outer layers add, which is negative for a cold cavity that pokes through a warm wall; the coverage of region k+1 is
/// negative there in the same way, so that sums over regions stay right. [`Body::check_nested`] tells before any work.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    layers: Vec<Meridian>,
    pose: Pose,
}

impl Body {
    /// A body from its layers, innermost first.
    ///
    /// # Errors
    /// [`Error::TooFew`] without a layer.
    pub fn new(layers: Vec<Meridian>, pose: Pose) -> Result<Self, Error> {
        at_least("layers of a body", layers.len(), 1)?;
        Ok(Self { layers, pose })
    }

    /// The layers, innermost first.
    pub fn layers(&self) -> &[Meridian] {
        &self.layers
    }

    /// One of the layers.
    pub(crate) fn layer(&self, layer: usize) -> Result<&Meridian, Error> {
        self.layers.get(layer).ok_or(Error::NoSuchLayer {
            given: layer,
            layers: self.layers.len(),
        })
    }

    /// Where the body stands.
    pub fn pose(&self) -> &Pose {
        &self.pose
    }

    /// Measures of one region in the body frame: those of its layer less those of the layer within.
    ///
    /// # Errors
    /// [`Error::NoSuchLayer`].
    pub fn region_measures(&self, region: usize) -> Result<Measures, Error> {
        let layer = self.layer(region)?;
        Ok(match region.checked_sub(1) {
            None => layer.measures(),
            Some(within) => layer.measures() - self.layers[within].measures(),
        })
    }

    /// Smallest box in the lab, along its axes, that holds one layer: its lowest and highest corner.
    ///
    /// # Errors
    /// [`Error::NoSuchLayer`].
    pub fn bounding_box(&self, layer: usize) -> Result<[Point3<f64>; 2], Error> {
        let layer = self.layer(layer)?;
        let axis = self.pose.axis();
        let origin = self.pose.to_lab(&Point3::origin());
        let mut corners = [Point3::origin(); 2];
        for e in 0..3 {
            // A parallel of radius r reaches r sin(angle between axis and e) to either side of its centre.
            let across = (0..3)
                .filter(|&k| k != e)
                .map(|k| axis[k] * axis[k])
                .sum::<f64>()
                .sqrt();
            let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
            for s in layer.segments() {
                for [x, r] in [s.start(), s.end()] {
                    low = low.min(x * axis[e] - r * across);
                    high = high.max(x * axis[e] + r * across);
                }
            }
            corners[0][e] = origin[e] + low;
            corners[1][e] = origin[e] + high;
        }
        Ok(corners)
    }

    /// Signed distance of a lab point from one layer's surface: negative inside.
    ///
    /// # Errors
    /// [`Error::NoSuchLayer`].
    pub fn signed_distance(&self, layer: usize, p: &Point3<f64>) -> Result<f64, Error> {
        Ok(self.layer(layer)?.signed_distance(&self.pose.to_body(p)))
    }

    /// Is each layer inside the next, to within `tolerance`?
    ///
    /// Nothing else requires it: where an inner layer reaches outside, the activity there is as the formula above says.
    ///
    /// # Errors
    /// [`Error::NotNested`] with the worst place; [`Error::NotFinite`].
    pub fn check_nested(&self, tolerance: f64) -> Result<(), Error> {
        finite("tolerance", tolerance)?;
        for (layer, pair) in self.layers.windows(2).enumerate() {
            let (inner, outer) = (&pair[0], &pair[1]);
            // A vertex of the inner one outside, or a corner of the outer one inside: one or the other if they cross.
            let outside = inner.segments().iter().map(|s| {
                let [x, r] = s.start();
                (outer.distance_at(x, r), x, r)
            });
            let poking = outer.segments().iter().map(|s| {
                let [x, r] = s.start();
                (-inner.distance_at(x, r), x, r)
            });
            let (depth, x, r) =
                outside
                    .chain(poking)
                    .fold(
                        (f64::NEG_INFINITY, 0.0, 0.0),
                        |a, b| if b.0 > a.0 { b } else { a },
                    );
            if depth > tolerance {
                return Err(Error::NotNested { layer, depth, x, r });
            }
        }
        Ok(())
    }

    /// Weight of each layer's indicator: differences of activities.
    pub(crate) fn weights(&self, activity: &[f64]) -> Result<Vec<f64>, Error> {
        length(
            "activities (one per region)",
            self.layers.len(),
            activity.len(),
        )?;
        for &a in activity {
            finite("activity", a)?;
        }
        Ok((0..activity.len())
            .map(|k| activity[k] - activity.get(k + 1).copied().unwrap_or(0.0))
            .collect())
    }

    /// Length of the line inside one layer.
    ///
    /// A continuous function of the line but for lines along the surface, which count as if just beside it
    /// ([conventions](crate#conventions)).
    ///
    /// Cost: the logarithm of the number of segments.
    ///
    /// # Errors
    /// [`Error::NoSuchLayer`].
    pub fn chord(&self, layer: usize, ray: &Ray) -> Result<f64, Error> {
        Ok(self.chord_in(self.layer(layer)?, ray))
    }

    fn chord_in(&self, layer: &Meridian, ray: &Ray) -> f64 {
        let mut sum = 0.0;
        self.intervals(layer, ray, |sign, [low, high]| {
            sum += sign * (high.t - low.t)
        });
        sum.max(0.0)
    }

    /// Line integral of the activity along the whole line.
    ///
    /// # Errors
    /// [`Error::Length`] or [`Error::NotFinite`] for the activities.
    pub fn line_integral(&self, ray: &Ray, activity: &[f64]) -> Result<f64, Error> {
        let weights = self.weights(activity)?;
        let chords = self.layers.iter().map(|layer| self.chord_in(layer, ray));
        Ok(weights.iter().zip(chords).map(|(w, chord)| w * chord).sum())
    }

    /// Sorted, disjoint intervals of the line inside one layer.
    ///
    /// # Errors
    /// [`Error::NoSuchLayer`].
    pub fn spans(&self, layer: usize, ray: &Ray) -> Result<Vec<Span>, Error> {
        Ok(self.spans_in(self.layer(layer)?, ray))
    }

    pub(crate) fn spans_in(&self, layer: &Meridian, ray: &Ray) -> Vec<Span> {
        self.surface_spans(layer, ray)
            .iter()
            .map(|[a, b]| Span {
                enter: a.t,
                exit: b.t,
            })
            .collect()
    }

    /// The first point with `t >= 0` where the ray enters one layer, with the outward normal there, if it does.
    ///
    /// # Errors
    /// [`Error::NoSuchLayer`].
    pub fn first_hit(&self, layer: usize, ray: &Ray) -> Result<Option<Hit>, Error> {
        let spans = self.surface_spans(self.layer(layer)?, ray);
        let Some([enter, _]) = spans.iter().find(|[enter, _]| enter.t >= 0.0) else {
            return Ok(None);
        };
        let point = ray.at(enter.t);
        let body = self.pose.to_body(&point);
        // Scaled, since next to the axis a root of squares has no digits.
        let most = body.y.abs().max(body.z.abs());
        let normal = match enter.normal {
            Some([nx, nr]) if most > 0.0 => {
                let [y, z] = [body.y / most, body.z / most];
                let r = y.hypot(z);
                Vector3::new(nx, nr * y / r, nr * z / r)
            }
            Some([nx, _]) => Vector3::new(nx.signum(), 0.0, 0.0),
            // A disc, met from outside: it faces the ray.
            None => Vector3::new(
                -self.pose.vector_to_body(&ray.direction()).x.signum(),
                0.0,
                0.0,
            ),
        };
        Ok(Some(Hit {
            t: enter.t,
            point,
            normal: self.pose.isometry().rotation * normal,
            layer,
        }))
    }

    /// Calls `each` with the sign and ends of every chain's interval.
    fn intervals(
        &self,
        meridian: &Meridian,
        ray: &Ray,
        mut each: impl FnMut(f64, [SurfacePoint; 2]),
    ) {
        let farthest = self.pose.farthest(ray.origin().coords.amax());
        let d = self.pose.vector_to_body(&ray.direction());
        let direction = Direction::new(meridian, farthest, &d);
        let [w, q, shift] = direction.coordinates(&self.pose.to_body(&ray.origin()));
        let mut hints = vec![Hint::default(); meridian.chains().len()];
        for (sign, faces) in direction.intervals(meridian, [w, q], &mut hints) {
            let ends = direction.ends([w, q], &faces);
            let point = |k: usize| SurfacePoint {
                t: ends[k] - shift,
                normal: faces[k].normal().map(|n| n.map(|v| v * sign)),
            };
            each(sign, [point(0), point(1)]);
        }
    }

    /// The spans with their ends' normals: a sweep over the chains' ends, in which shared planes cancel.
    fn surface_spans(&self, layer: &Meridian, ray: &Ray) -> Vec<[SurfacePoint; 2]> {
        let mut ends: Vec<(SurfacePoint, f64)> = Vec::new();
        self.intervals(layer, ray, |sign, [low, high]| {
            ends.push((low, sign));
            ends.push((high, -sign));
        });
        ends.sort_by(|a, b| a.0.t.total_cmp(&b.0.t));
        let mut spans = Vec::new();
        let (mut depth, mut enter) = (0.0, None);
        let mut k = 0;
        while k < ends.len() {
            // Ends at one parameter act together; of two surfaces there, a cone has the better normal.
            let (mut point, before) = (ends[k].0, depth);
            while k < ends.len() && ends[k].0.t == point.t {
                depth += ends[k].1;
                point.normal = point.normal.or(ends[k].0.normal);
                k += 1;
            }
            if before < 0.5 && depth > 0.5 {
                enter = Some(point);
            } else if before > 0.5 && depth < 0.5 {
                spans.extend(enter.take().map(|e| [e, point]));
            }
        }
        spans
    }
}

/// A point of a line on the surface, with the normal (x, r) unless on a plane.
#[derive(Debug, Clone, Copy)]
struct SurfacePoint {
    t: f64,
    normal: Option<[f64; 2]>,
}

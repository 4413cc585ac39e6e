//! Nested solids with an activity per region, and single rays through them.

use nalgebra::Vector3;

use crate::crossing::{Crossing, Direction};
use crate::error::{finite, length};
use crate::meridian::Meridian;
use crate::{Error, Hit, Measures, Pose, Ray, Span};

/// Layers of solids about one axis, innermost first, standing in the lab.
///
/// Region 0 is the inside of layer 0; region k is what layer k holds beyond layer k-1 (a wall). The activity at a point is
/// `sum over k of (a_k - a_(k+1)) * inside_k`, where `inside_k` is 1 inside layer k and the activity after the last is 0: for nested layers, each region's own
/// activity; linear in the layers, so that line integrals and totals are differences of those of the layers.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    layers: Vec<Meridian>,
    pose: Pose,
}

impl Body {
    /// A body from its layers, innermost first.
    ///
    /// # Errors
    /// [`Error::Length`] without a layer.
    pub fn new(layers: Vec<Meridian>, pose: Pose) -> Result<Self, Error> {
        if layers.is_empty() {
            return Err(Error::Length {
                what: "layers (at least)",
                expected: 1,
                given: 0,
            });
        }
        Ok(Self { layers, pose })
    }

    /// The layers, innermost first.
    pub fn layers(&self) -> &[Meridian] {
        &self.layers
    }

    /// Where the body stands.
    pub fn pose(&self) -> &Pose {
        &self.pose
    }

    /// Measures of one region in the body frame: those of its layer less those of the layer within.
    ///
    /// # Panics
    /// If there is no such region.
    pub fn region_measures(&self, region: usize) -> Measures {
        let own = self.layers[region].measures();
        if region == 0 {
            own
        } else {
            own - self.layers[region - 1].measures()
        }
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

    fn layer_crossings(&self, layer: usize, ray: &Ray, found: impl FnMut(Crossing)) -> f64 {
        let meridian = &self.layers[layer];
        let direction = Direction::new(meridian, &self.pose.vector_to_body(&ray.direction()));
        let [w, q, t] = direction.coordinates(&self.pose.to_body(&ray.origin()));
        direction.crossings(meridian, w, q, found);
        t
    }

    /// Length of the ray inside one layer.
    ///
    /// # Panics
    /// If there is no such layer.
    pub fn chord(&self, layer: usize, ray: &Ray) -> f64 {
        let mut sum = 0.0;
        self.layer_crossings(layer, ray, |x| sum += if x.enters { -x.t } else { x.t });
        sum.max(0.0)
    }

    /// Line integral of the activity along the whole line.
    ///
    /// # Errors
    /// [`Error::Length`] or [`Error::NotFinite`] for the activities.
    pub fn line_integral(&self, ray: &Ray, activity: &[f64]) -> Result<f64, Error> {
        let weights = self.weights(activity)?;
        Ok((0..self.layers.len())
            .map(|k| weights[k] * self.chord(k, ray))
            .sum())
    }

    /// Sorted, disjoint intervals of the line inside one layer.
    ///
    /// # Panics
    /// If there is no such layer.
    pub fn spans(&self, layer: usize, ray: &Ray) -> Vec<Span> {
        let mut crossings = Vec::new();
        let shift = self.layer_crossings(layer, ray, |x| crossings.push(x));
        // Where two solids touch, the entry comes first and the spans join.
        crossings.sort_by(|a, b| a.t.total_cmp(&b.t).then(b.enters.cmp(&a.enters)));
        let mut spans = Vec::new();
        let (mut depth, mut enter) = (0i32, 0.0);
        for x in crossings {
            if x.enters {
                depth += 1;
                if depth == 1 {
                    enter = x.t;
                }
            } else {
                depth -= 1;
                if depth == 0 && x.t > enter {
                    spans.push(Span {
                        enter: enter - shift,
                        exit: x.t - shift,
                    });
                }
            }
        }
        spans
    }

    /// The first point with `t >= 0` where the ray enters one layer, with the outward normal there.
    ///
    /// # Panics
    /// If there is no such layer.
    pub fn first_hit(&self, layer: usize, ray: &Ray) -> Option<Hit> {
        let mut first: Option<Crossing> = None;
        let meridian = &self.layers[layer];
        let direction = Direction::new(meridian, &self.pose.vector_to_body(&ray.direction()));
        let [w, q, shift] = direction.coordinates(&self.pose.to_body(&ray.origin()));
        direction.crossings(meridian, w, q, |x| {
            if x.enters && x.t >= shift && first.is_none_or(|f| x.t < f.t) {
                first = Some(x);
            }
        });
        first.map(|x| {
            let t = x.t - shift;
            let point = ray.at(t);
            let body = self.pose.to_body(&point);
            let s = &meridian.segments()[x.segment];
            let r = body.y.hypot(body.z);
            let normal = if r > 0.0 {
                Vector3::new(-s.tr, s.tx * body.y / r, s.tx * body.z / r)
            } else {
                Vector3::new(-s.tr.signum(), 0.0, 0.0)
            };
            Hit {
                t,
                point,
                normal: self.pose.isometry().rotation * normal,
                layer,
            }
        })
    }
}

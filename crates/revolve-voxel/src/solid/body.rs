//! Nested solids with an activity per region.

use std::sync::Arc;

use nalgebra::Point3;

use crate::error::{at_least, finite, length};
use crate::solid::meridian::Meridian;
use crate::{Measures, Pose, RevolveError};

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
    /// Shared by all that stands elsewhere.
    layers: Arc<[Meridian]>,
    pose: Pose,
}

impl Body {
    /// A body from its layers, innermost first.
    ///
    /// # Errors
    /// [`RevolveError::TooFew`] without a layer.
    pub fn new(layers: Vec<Meridian>, pose: Pose) -> Result<Self, RevolveError> {
        at_least("layers of a body", layers.len(), 1)?;
        let layers = layers.into();
        Ok(Self { layers, pose })
    }

    /// The same body in another place; its layers are shared, so that it costs next to nothing.
    ///
    /// ```
    /// use revolve_voxel::nalgebra::Vector3;
    /// use revolve_voxel::{Body, Meridian, Pose};
    /// let rod = Body::new(vec![Meridian::new(&[[0.0, 1.0], [3.0, 1.0]])?], Pose::identity())?;
    /// let moved = rod.standing(rod.pose().shifted(Vector3::new(0.0, 0.0, 2.0))?);
    /// assert_eq!(moved.bounding_box(0)?[0].z, 1.0);
    /// # Ok::<(), revolve_voxel::RevolveError>(())
    /// ```
    pub fn standing(&self, pose: Pose) -> Self {
        Self {
            layers: self.layers.clone(),
            pose,
        }
    }

    /// The layers, innermost first.
    pub fn layers(&self) -> &[Meridian] {
        &self.layers
    }

    /// One of the layers.
    pub(crate) fn layer(&self, layer: usize) -> Result<&Meridian, RevolveError> {
        self.layers.get(layer).ok_or(RevolveError::NoSuchLayer {
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
    /// [`RevolveError::NoSuchLayer`].
    pub fn region_measures(&self, region: usize) -> Result<Measures, RevolveError> {
        let layer = self.layer(region)?;
        Ok(match region.checked_sub(1) {
            None => layer.measures(),
            Some(within) => layer.measures() - self.layers[within].measures(),
        })
    }

    /// Smallest box in the lab, along its axes, that holds one layer: its lowest and highest corner.
    ///
    /// # Errors
    /// [`RevolveError::NoSuchLayer`].
    pub fn bounding_box(&self, layer: usize) -> Result<[Point3<f64>; 2], RevolveError> {
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
    /// [`RevolveError::NoSuchLayer`].
    pub fn signed_distance(&self, layer: usize, p: &Point3<f64>) -> Result<f64, RevolveError> {
        Ok(self.layer(layer)?.signed_distance(&self.pose.to_body(p)))
    }

    /// Is each layer inside the next, to within `tolerance`?
    ///
    /// Nothing else requires it: where an inner layer reaches outside, the activity there is as the formula above says.
    ///
    /// # Errors
    /// [`RevolveError::NotNested`] with the worst place; [`RevolveError::NotFinite`].
    pub fn check_nested(&self, tolerance: f64) -> Result<(), RevolveError> {
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
                return Err(RevolveError::NotNested { layer, depth, x, r });
            }
        }
        Ok(())
    }

    /// Weight of each layer's indicator: differences of activities.
    pub(crate) fn weights(&self, activity: &[f64]) -> Result<Vec<f64>, RevolveError> {
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
}

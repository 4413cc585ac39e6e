//! Nested solids with an activity per region.

use std::sync::Arc;

use nalgebra::Point3;

use crate::error::{at_least, finite, length, within};
use crate::solid::meridian::Meridian;
use crate::{MassProperties, Pose, RevolveError};

/// A body in the lab: coaxial solids as layers, innermost first.
///
/// Region 0 is the inside of layer 0; region k is the part of layer k outside layer k-1 (a wall). The activity at a point is `sum
/// over k of (a_k - a_(k+1)) * inside_k`, where `inside_k` is 1 inside layer k and the activity after the last layer is 0. For
/// nested layers this is the activity of each region. It is linear in the layers, so line integrals and totals are exact
/// differences of those of the layers.
///
/// A layer is the whole solid inside its meridian, a region the part between it and the layer within. The same index counts both: functions with a
/// `layer` treat the filled solid, those with an activity or a `region` the regions.
///
/// Layers need not be nested, but their volumes do not decrease. Where layer k extends outside layer k+1 the formula adds `a_k - a_(k+1)`, which is
/// negative for a cold cavity that extends beyond a warm wall. The coverage of region k+1 is negative there too, so sums over regions remain exact.
/// [`Body::nested`] rejects layers that are not nested.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// Shared by copies in other poses.
    layers: Arc<[Meridian]>,
    pose: Pose,
}

impl Body {
    /// Creates a body from its layers, innermost first. They need not be nested: [`Body::nested`] checks that they are.
    ///
    /// # Errors
    /// [`RevolveError::TooFew`] without a layer; [`RevolveError::NotNested`] for a layer of a larger volume than the next, as with the outer
    /// layer first.
    pub fn new(layers: Vec<Meridian>, pose: Pose) -> Result<Self, RevolveError> {
        at_least("layers of a body", layers.len(), 1)?;
        let layers = layers.into();
        let body = Self { layers, pose };
        let volume = |layer: &Meridian| layer.mass_properties().volume;
        // Less by rounding errors.
        let shrinks = |pair: &[Meridian]| volume(&pair[1]) < volume(&pair[0]) * (1.0 - 1e-9);
        if body.layers.windows(2).any(shrinks) {
            body.check_nested(0.0)?;
        }
        Ok(body)
    }

    /// Creates a body from nested layers, innermost first, each inside the next to within `tolerance`: a cavity, then its wall.
    ///
    /// ```
    /// use revolve_voxel::{Body, Meridian, Pose, RevolveError};
    /// let cylinder = |r: f64| Meridian::new(&[[0.0, r], [3.0, r]]);
    /// let body = Body::nested(vec![cylinder(1.0)?, cylinder(1.5)?], Pose::identity(), 1e-9)?;
    /// assert!(body.region_measures(1)?.volume > 0.0);
    /// let outer_first = Body::nested(vec![cylinder(1.5)?, cylinder(1.0)?], Pose::identity(), 1e-9);
    /// assert!(matches!(outer_first, Err(RevolveError::NotNested { layer: 0, .. })));
    /// # Ok::<(), RevolveError>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`Body::new`]; [`RevolveError::NotNested`] with the worst position; [`RevolveError::NotFinite`] or
    /// [`RevolveError::OutOfRange`] for a tolerance below zero or above the radius of the innermost layer.
    pub fn nested(layers: Vec<Meridian>, pose: Pose, tolerance: f64) -> Result<Self, RevolveError> {
        let body = Self::new(layers, pose)?;
        body.check_nested(tolerance)?;
        Ok(body)
    }

    /// Returns the body in another pose. The layers are shared, so the cost is negligible.
    ///
    /// ```
    /// use revolve_voxel::nalgebra::Vector3;
    /// use revolve_voxel::{Body, Meridian, Pose};
    /// let rod = Body::new(vec![Meridian::new(&[[0.0, 1.0], [3.0, 1.0]])?], Pose::identity())?;
    /// let moved = rod.with_pose(rod.pose().shifted(Vector3::new(0.0, 0.0, 2.0))?);
    /// assert_eq!(moved.bounding_box(0)?[0].z, 1.0);
    /// # Ok::<(), revolve_voxel::RevolveError>(())
    /// ```
    #[must_use]
    pub fn with_pose(&self, pose: Pose) -> Self {
        Self {
            layers: self.layers.clone(),
            pose,
        }
    }

    /// Returns the layers, innermost first.
    #[must_use]
    pub fn layers(&self) -> &[Meridian] {
        &self.layers
    }

    /// Returns a layer.
    pub(crate) fn layer(&self, layer: usize) -> Result<&Meridian, RevolveError> {
        self.layers.get(layer).ok_or(RevolveError::NoSuchLayer {
            given: layer,
            layers: self.layers.len(),
        })
    }

    /// Returns the pose.
    #[must_use]
    pub fn pose(&self) -> &Pose {
        &self.pose
    }

    /// Returns the measures of one region in the body frame: those of its layer minus those of the next inner layer. `surface` is the area of
    /// the boundary of the region: both faces of a wall, and its flat ends without the faces that both layers have in common.
    ///
    /// ```
    /// use revolve_voxel::{Body, Meridian, Pose};
    /// let cylinder = |r: f64| Meridian::new(&[[0.0, r], [3.0, r]]);
    /// let tube = Body::nested(vec![cylinder(1.0)?, cylinder(2.0)?], Pose::identity(), 0.0)?;
    /// let pi = std::f64::consts::PI;
    /// let exact = 6.0 * pi + 12.0 * pi + 2.0 * (4.0 - 1.0) * pi; // inside, outside, two rings
    /// assert!((tube.region_measures(1)?.surface / exact - 1.0).abs() < 1e-14);
    /// # Ok::<(), revolve_voxel::RevolveError>(())
    /// ```
    ///
    /// # Errors
    /// [`RevolveError::NoSuchLayer`].
    pub fn region_measures(&self, region: usize) -> Result<MassProperties, RevolveError> {
        let layer = self.layer(region)?;
        Ok(match region.checked_sub(1) {
            None => layer.mass_properties(),
            Some(within) => {
                let within = &self.layers[within];
                let (outer, inner) = (layer.mass_properties(), within.mass_properties());
                // Planes closer than rounding errors coincide.
                let reach = 1e-12 * layer.size();
                let common =
                    MassProperties::common_faces(layer.segments(), within.segments(), reach);
                MassProperties {
                    surface: outer.surface + inner.surface - 2.0 * common,
                    ..outer - inner
                }
            }
        })
    }

    /// Returns the axis-aligned bounding box of one layer in the lab: lowest and highest corner.
    ///
    /// # Errors
    /// [`RevolveError::NoSuchLayer`].
    pub fn bounding_box(&self, layer: usize) -> Result<[Point3<f64>; 2], RevolveError> {
        let layer = self.layer(layer)?;
        let axis = self.pose.axis();
        let origin = self.pose.to_lab(&Point3::origin());
        let mut corners = [Point3::origin(); 2];
        for e in 0..3 {
            // A parallel of radius r extends r sin(angle between axis and e) to both sides of its centre.
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

    /// Returns the ranges of x and of r of all layers: `[x_min, x_max, 0, r_max]`.
    pub(crate) fn bounds(&self) -> [f64; 4] {
        let none = [f64::INFINITY, f64::NEG_INFINITY, 0.0, 0.0];
        self.layers
            .iter()
            .fold(none, |[low, high, least, most], layer| {
                let [from, to] = layer.x_range();
                [low.min(from), high.max(to), least, most.max(layer.r_max())]
            })
    }

    /// Returns centre and radius of a ball in the lab that contains all layers, larger than any rounding error.
    pub(crate) fn ball(&self) -> (Point3<f64>, f64) {
        let [low, high, _, radius] = self.bounds();
        let centre = self.pose.to_lab(&Point3::new(0.5 * (low + high), 0.0, 0.0));
        let reach = (0.5 * (high - low)).hypot(radius);
        let size = self.pose.farthest(low.abs().max(high.abs()));
        (centre, reach + 1e-12 * (reach + size))
    }

    /// Returns the signed distance of a lab point from the surface of a layer: negative inside.
    ///
    /// # Errors
    /// [`RevolveError::NoSuchLayer`].
    pub fn signed_distance(&self, layer: usize, p: &Point3<f64>) -> Result<f64, RevolveError> {
        Ok(self.layer(layer)?.signed_distance(&self.pose.to_body(p)))
    }

    /// Checks that each layer is inside the next, to within `tolerance`.
    fn check_nested(&self, tolerance: f64) -> Result<(), RevolveError> {
        within("tolerance", tolerance, [0.0, self.layers[0].r_max()])?;
        for (layer, pair) in self.layers.windows(2).enumerate() {
            let (inner, outer) = (&pair[0], &pair[1]);
            // If they cross, a vertex of the inner one is outside or a corner of the outer one is inside.
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

//! The wall as material: where each of its points is at each phase of the beat.
//!
//! The membranes' points are known by their coordinate s; what lies between them is placed so that **each layer keeps its
//! volume**: the layer u holds the fraction u of the wall between itself and the inner membrane, at every phase (to the
//! rounding with which the wall's own volume is kept). Along the wall there are two ways:
//!
//! - [`Wall::new`], tied to the membranes: material s always lies between the two membrane points s. The membranes stretch
//!   unevenly, so a strip between s and s + ds does not keep its volume: the product of the three stretches is the ratio of
//!   the strip's volumes, the same in all layers.
//! - [`Wall::sliding`]: the wall slides along both membranes, as water does, so that every element keeps its volume and the
//!   product of the stretches is 1 everywhere. A material s is then where it was between the membrane points s at rest.
//!
//! Either may turn about the axis as it goes ([`Twist`]), which changes no volume.

use super::shape::HeartShape;
use super::twist::Twist;
use crate::error::{PhantomError, check};
use membrane_newton::{Equilibrium, PairEquilibrium};
use nalgebra::{Point3, Vector3};
use revolve_voxel::{Curve, Meridian, Piece, Pose, Sector, Shell, Thickness, VoxelGrid};
use std::f64::consts::{PI, TAU};
use std::ops::Range;
use std::sync::Arc;

/// The material coordinate of the apex.
pub(super) const APEX: f64 = 0.5;

/// A point of the wall that is told from all others at every phase.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MaterialPoint {
    /// Share of the wall's volume between it and the inner membrane: 0 on the inner, 1 on the outer membrane.
    pub layer: f64,
    /// Coordinate along the membranes, 0 at the base, 1/2 at the apex.
    pub s: f64,
    /// Angle about the body's axis in radians, from body y to body z.
    pub azimuth: f64,
}

/// The wall of the heart at one phase.
///
/// ```
/// use heart_phantom::{Heart, MaterialPoint, Wall};
/// let heart = Heart::study(201)?;
/// let shapes = heart.shapes(&[0.0, 0.6])?;
/// let rest = Wall::new(&shapes[0])?;
/// let dilated = Wall::sliding(&shapes[1], &rest)?;
/// let point = MaterialPoint { layer: 0.5, s: 0.2, azimuth: 1.0 };
/// let [from, to] = [rest.position(&point)?, dilated.position(&point)?];
/// assert!((to - from).norm() > 0.1); // cm
/// let stretch = rest.stretch(&dilated, &point)?;
/// assert!(stretch.hoop > 1.0 && stretch.radial < 1.0);
/// assert!((stretch.volume() - 1.0).abs() < 1e-10); // water does not compress
/// # Ok::<(), heart_phantom::PhantomError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Wall {
    shell: Arc<Shell>,
    pose: Pose,
    /// The wall at rest, if this one slides.
    rest: Option<Arc<Shell>>,
    twist: Option<Arc<Twist>>,
}

/// A piece of the wall that moves with it: all material points within three ranges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WallRegion {
    /// Layers, within 0 (inner membrane) to 1 (outer membrane).
    pub layers: [f64; 2],
    /// Coordinate along the membranes, within 0 (base) to 1/2 (apex).
    pub s: [f64; 2],
    /// Azimuths in radians, the second larger by at most a turn.
    pub azimuths: [f64; 2],
}

/// How a material element's sides change from one phase to another: lengths there over lengths here.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Stretch {
    /// Along the wall from base to apex, within the layer.
    pub meridional: f64,
    /// Round the axis.
    pub hoop: f64,
    /// Of the distance between neighbouring layers, across both.
    pub radial: f64,
}

impl Stretch {
    /// The ratio of the element's volumes: the product of the three.
    pub fn volume(&self) -> f64 {
        self.meridional * self.hoop * self.radial
    }
}

impl Wall {
    /// The wall of a shape, tied to its membranes.
    ///
    /// # Errors
    /// [`PhantomError::Solid`] where the lines between membrane points of equal s cross in the wall.
    pub fn new(shape: &HeartShape) -> Result<Self, PhantomError> {
        Self::of(shape.solution(), *shape.body().pose())
    }

    /// The wall between two solved membranes that are their own mirror images, standing in `pose`; their polynomials
    /// themselves, or under finite differences the polylines.
    ///
    /// # Errors
    /// As [`Wall::new`].
    pub fn of(pair: &PairEquilibrium, pose: Pose) -> Result<Self, PhantomError> {
        Self::between(curve(&pair.inner)?, curve(&pair.outer)?, pose)
    }

    fn between(inner: Curve, outer: Curve, pose: Pose) -> Result<Self, PhantomError> {
        Ok(Self {
            shell: Arc::new(Shell::new(inner, outer, [0.0, APEX])?),
            pose,
            rest: None,
            twist: None,
        })
    }

    /// The wall of a shape between the polygons that bound its body, which follow the membranes to `tolerance` cm: what fills it
    /// ends where the body does.
    pub(crate) fn drawn(shape: &HeartShape, tolerance: f64) -> Result<Self, PhantomError> {
        let pair = shape.solution();
        let [inner, outer] = [&pair.inner, &pair.outer]
            .map(|membrane| -> Result<_, PhantomError> { Ok(curve(membrane)?.drawn(tolerance)?) });
        Self::between(inner?, outer?, *shape.body().pose())
    }

    /// The wall of a shape, sliding along its membranes so that each element keeps the volume it has in `rest`.
    ///
    /// # Errors
    /// As [`Wall::new`].
    pub fn sliding(shape: &HeartShape, rest: &Wall) -> Result<Self, PhantomError> {
        Ok(Self::new(shape)?.sliding_from(rest))
    }

    /// The same wall, its material coordinate counted from another phase's membranes.
    pub fn sliding_from(mut self, rest: &Wall) -> Self {
        self.rest = Some(rest.shell.clone());
        self
    }

    /// The same wall, turned about its axis layer by layer; angles are counted from the wall without a twist.
    pub fn twisted(mut self, twist: Twist) -> Self {
        self.twist = Some(Arc::new(twist));
        self
    }

    /// The same wall standing elsewhere.
    pub fn standing(mut self, pose: Pose) -> Self {
        self.pose = pose;
        self
    }

    /// Volume of the wall in cm^3.
    pub fn volume(&self) -> f64 {
        self.shell.volume()
    }

    /// Where a material point is in the lab.
    ///
    /// # Errors
    /// [`PhantomError::OutOfRange`] for a layer outside 0 to 1, an s outside 0 to 1/2, an angle that is not finite.
    pub fn position(&self, point: &MaterialPoint) -> Result<Point3<f64>, PhantomError> {
        Ok(self.place(&point.checked()?))
    }

    /// The material point at a place in the lab, its angle in (-pi, pi], or nothing outside the wall (whose surfaces belong
    /// to it).
    pub fn locate(&self, p: &Point3<f64>) -> Option<MaterialPoint> {
        let body = self.pose.to_body(p);
        let found = self.shell.locate([body.x, body.y.hypot(body.z)])?;
        Some(self.material(found, &body))
    }

    /// The material point at the layer and the membranes' own s where a body point was found.
    pub(super) fn material(&self, [layer, at]: [f64; 2], body: &Point3<f64>) -> MaterialPoint {
        let s = self.shell.carried(at, self.reference());
        let place = body.z.atan2(body.y);
        MaterialPoint {
            layer,
            s,
            azimuth: match &self.twist {
                None => place,
                Some(twist) => PI - (PI - place + twist.angle(layer, s)).rem_euclid(TAU),
            },
        }
    }

    /// How far the material at a place moves from this phase to another: a lab vector in cm, or nothing outside the wall.
    pub fn displacement(&self, to: &Wall, p: &Point3<f64>) -> Option<[f64; 3]> {
        let point = self.locate(p)?;
        Some((to.place(&point) - p).into())
    }

    /// The displacements of the material at the centres of the voxels of some slices: those in the wall with their numbers
    /// among these slices (`[z][y][x]`), rising.
    ///
    /// Work grows with the voxels of the wall; the same bits for any number of threads.
    ///
    /// ```
    /// use heart_phantom::{Heart, Wall};
    /// use revolve_voxel::VoxelGrid;
    /// let shapes = Heart::study(201)?.shapes(&[0.0, 0.6])?;
    /// let rest = Wall::new(&shapes[0])?;
    /// let dilated = Wall::sliding(&shapes[1], &rest)?;
    /// let grid = VoxelGrid::cube(32, 0.5)?;
    /// let moved = rest.displacements(&dilated, &grid, 0..32)?;
    /// // As an array of all voxels, three components each, NaN outside the wall:
    /// let mut field = vec![[f32::NAN; 3]; grid.len()];
    /// for (voxel, displacement) in moved {
    ///     field[voxel] = displacement;
    /// }
    /// # Ok::<(), heart_phantom::PhantomError>(())
    /// ```
    ///
    /// # Errors
    /// [`PhantomError::Solid`] for slices that the grid does not have.
    pub fn displacements(
        &self,
        to: &Wall,
        grid: &VoxelGrid,
        slices: Range<usize>,
    ) -> Result<Vec<(usize, [f32; 3])>, PhantomError> {
        let moved = |p: &Point3<f64>, material: [f64; 2]| {
            let way = self.way(to, p, material, [0.0; 2]);
            [way.x as f32, way.y as f32, way.z as f32]
        };
        Ok(self.shell.map_voxels(&self.pose, grid, slices, moved)?)
    }

    /// How far what is at a body point goes, in the lab: with the material at a layer and the membranes' own s, from which it is off by so
    /// much along the axis and away from it.
    pub(super) fn way(
        &self,
        to: &Wall,
        p: &Point3<f64>,
        [layer, at]: [f64; 2],
        off: [f64; 2],
    ) -> Vector3<f64> {
        let [x, r] = to.shell.point(layer, self.same(at, to));
        let [x, r] = [x + off[0], (r + off[1]).max(0.0)];
        let from = (p.y * p.y + p.z * p.z).sqrt();
        // On the axis any azimuth will do.
        let [mut cos, mut sin] = if from > 0.0 {
            [p.y / from, p.z / from]
        } else {
            [1.0, 0.0]
        };
        if self.twist.is_some() || to.twist.is_some() {
            let s = self.shell.carried(at, self.reference());
            let (b, a) = (to.turn(layer, s) - self.turn(layer, s)).sin_cos();
            [cos, sin] = [a * cos - b * sin, b * cos + a * sin];
        }
        let there = to.pose.to_lab(&Point3::new(x, r * cos, r * sin));
        there - self.pose.to_lab(p)
    }

    /// The stretches of the material at a point from this phase to another. At the apex they are those 5e-7 before it.
    ///
    /// # Errors
    /// As [`Wall::position`].
    pub fn stretch(&self, to: &Wall, point: &MaterialPoint) -> Result<Stretch, PhantomError> {
        let point = point.checked()?;
        let [here, there] = [self, to].map(|wall| wall.element(&point));
        let [meridional, hoop, radial] = [0, 1, 2].map(|k| there[k] / here[k]);
        Ok(Stretch {
            meridional,
            hoop,
            radial,
        })
    }

    /// The solid between two layers and two s, as the profile of its solid of revolution with layers drawn to `tolerance` in
    /// cm.
    ///
    /// # Errors
    /// [`PhantomError::OutOfRange`] for what [`Wall::position`] refuses; [`PhantomError::Solid`] for ranges of no width, a
    /// tolerance that is not positive.
    pub fn region(
        &self,
        layers: [f64; 2],
        s: [f64; 2],
        tolerance: f64,
    ) -> Result<Meridian, PhantomError> {
        let mut ends = [0.0; 2];
        for k in 0..2 {
            let [layer, s] = [layers[k], s[k]];
            let azimuth = 0.0;
            let point = MaterialPoint { layer, s, azimuth };
            ends[k] = self.coordinate(point.checked()?.s);
        }
        Ok(self.shell.region(layers, ends, tolerance)?)
    }

    /// A piece of the wall at this phase as a solid in the lab, its layers drawn to `tolerance` in cm: exact line integrals
    /// and coverage of, say, a defect.
    ///
    /// Of a wall that twists it is the piece without its twist, which has sides that no half plane is; the defects of a
    /// [`Phantom`](crate::Phantom) twist, as fine cells.
    ///
    /// Add to what the wall gives the difference of the activities, that of the piece less that of the wall. Where
    /// pieces overlap, their differences add up.
    ///
    /// ```
    /// use heart_phantom::{Heart, Wall, WallRegion};
    /// let shapes = Heart::study(201)?.shapes(&[0.0, 0.6])?;
    /// let rest = Wall::new(&shapes[0])?;
    /// let infarct = WallRegion { layers: [0.0, 0.6], s: [0.3, 0.45], azimuths: [0.0, 1.0] };
    /// let volumes = [
    ///     Wall::sliding(&shapes[0], &rest)?.sector(&infarct, 1e-5)?.volume(),
    ///     Wall::sliding(&shapes[1], &rest)?.sector(&infarct, 1e-5)?.volume(),
    /// ];
    /// assert!((volumes[1] / volumes[0] - 1.0).abs() < 1e-4); // its activity is kept
    /// # Ok::<(), heart_phantom::PhantomError>(())
    /// ```
    ///
    /// # Errors
    /// As [`Wall::region`]; [`PhantomError::Solid`] for azimuths that open no wedge.
    pub fn sector(&self, region: &WallRegion, tolerance: f64) -> Result<Sector, PhantomError> {
        let ring = self.region(region.layers, region.s, tolerance)?;
        Ok(Sector::new(ring, region.azimuths, self.pose)?)
    }

    /// Thickness of the wall in cm where the inner membrane is at its own coordinate `s`, clamped to 0 to 1/2: the distance
    /// to the outer membrane.
    pub fn thickness(&self, s: f64) -> f64 {
        self.shell.thickness(s)
    }

    /// Least and mean thickness, the mean over the inner membrane's surface.
    pub fn thicknesses(&self) -> Thickness {
        self.shell.thicknesses()
    }

    /// Where the wall stands.
    pub fn pose(&self) -> &Pose {
        &self.pose
    }

    pub(super) fn place(&self, point: &MaterialPoint) -> Point3<f64> {
        let [x, r] = self.shell.point(point.layer, self.coordinate(point.s));
        let (sin, cos) = (point.azimuth + self.turn(point.layer, point.s)).sin_cos();
        self.pose.to_lab(&Point3::new(x, r * cos, r * sin))
    }

    /// How far a material point is turned about the axis.
    fn turn(&self, layer: f64, s: f64) -> f64 {
        (self.twist.as_ref()).map_or(0.0, |twist| twist.angle(layer, s))
    }

    /// The shell and where it stands.
    pub(super) fn standing_shell(&self) -> (&Shell, &Pose) {
        (&self.shell, &self.pose)
    }

    /// The membranes' own s between which material s lies at this phase.
    fn coordinate(&self, s: f64) -> f64 {
        self.reference().carried(s, &self.shell)
    }

    /// The membranes' own s in another wall of the material that is at the membranes' own s in this one.
    fn same(&self, at: f64, to: &Wall) -> f64 {
        if std::ptr::eq(self.reference(), to.reference()) {
            // Equal shares of the one wall are equal shares of the other.
            self.shell.carried(at, &to.shell)
        } else {
            to.coordinate(self.shell.carried(at, self.reference()))
        }
    }

    /// The wall whose membranes the material coordinate is counted on.
    fn reference(&self) -> &Shell {
        self.rest.as_deref().unwrap_or(&self.shell)
    }

    /// Sides of a material element: along the layer for each unit of s, round the axis, across layers for each unit of u.
    fn element(&self, point: &MaterialPoint) -> [f64; 3] {
        let [across, along, [_, _, r]] = self.tangents(point);
        let length = along[0].hypot(along[1]);
        let area = along[0] * across[1] - along[1] * across[0];
        [length, r, area / length]
    }

    /// Derivatives of the place of a material point by layer, s and azimuth, in its cylindrical frame: along the axis, away from it,
    /// round it.
    pub(super) fn tangents(&self, point: &MaterialPoint) -> [[f64; 3]; 3] {
        // The apex is a limit: sides and volumes vanish there together.
        let s = point.s.min(APEX * (1.0 - 1e-6));
        let at = self.coordinate(s);
        let [across, along] = self.shell.tangents(point.layer, at);
        let rate = match &self.rest {
            None => 1.0,
            Some(rest) => {
                let share = |shell: &Shell, s| shell.volume_rate(s) / shell.volume();
                share(rest, s) / share(&self.shell, at)
            }
        };
        let r = self.shell.point(point.layer, at)[1];
        let [by_layer, by_s] = match &self.twist {
            None => [0.0; 2],
            Some(twist) => twist.rates(point.layer, s).map(|rate| r * rate),
        };
        [
            [across[0], across[1], by_layer],
            [along[0] * rate, along[1] * rate, by_s],
            [0.0, 0.0, r],
        ]
    }
}

impl MaterialPoint {
    /// Itself, if it is in the wall.
    pub(super) fn checked(&self) -> Result<Self, PhantomError> {
        check("layer", self.layer, [0.0, 1.0])?;
        check("material coordinate s", self.s, [0.0, APEX])?;
        check("azimuth", self.azimuth, [f64::MIN, f64::MAX])?;
        Ok(*self)
    }
}

/// A solved membrane as a curve with its material coordinate.
fn curve(membrane: &Equilibrium) -> Result<Curve, PhantomError> {
    let pieces = membrane.pieces();
    let Some(first) = pieces.first() else {
        return Ok(Curve::polyline(&membrane.positions(), &membrane.points())?);
    };
    let mut knots = vec![first.from];
    knots.extend(pieces.iter().map(|piece| piece.to));
    let pieces = pieces
        .into_iter()
        .map(|piece| Piece::Chebyshev {
            x: piece.x,
            r: piece.y,
        })
        .collect();
    Ok(Curve::new(knots, pieces)?)
}

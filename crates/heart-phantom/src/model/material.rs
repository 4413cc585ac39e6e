//! Material coordinates of the wall: the position of each material point at each phase.
//!
//! Points of the membranes have the coordinate s. Between the membranes **each layer preserves its volume**: at every phase the
//! layer u contains the fraction u of the wall volume between itself and the inner membrane (to rounding). Two conventions exist
//! along the wall:
//!
//! - [`Wall::new`], tied to the membranes: material s lies between the two membrane points s. The membranes
//!   stretch unevenly, so a strip between s and s + ds does not preserve its volume: the product of the three
//!   stretches is the ratio of the volumes of the strip, the same in all layers.
//! - [`Wall::sliding_from`]: the wall slides along both membranes without friction, so every element preserves its volume and
//!   the product of the stretches is 1. Material s lies between the membrane points s in the reference configuration.
//!
//! A [`Twist`] rotates either about the axis and preserves volumes.

use super::twist::{APEX, Twist};
use crate::error::{PhantomError, check};
use membrane_newton::{Equilibrium, PairEquilibrium};
use nalgebra::{Point3, Vector3};
use revolve_voxel::{Curve, Meridian, Piece, Pose, Sector, Shell, VoxelGrid, WallTwist};
use std::f64::consts::{PI, TAU};
use std::ops::Range;
use std::sync::Arc;

/// A material point of the wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MaterialPoint {
    /// Fraction of the wall volume between it and the inner membrane: 0 on the inner, 1 on the outer membrane.
    pub layer: f64,
    /// Material coordinate along the membranes, 0 at the base, 1/2 at the apex.
    pub s: f64,
    /// Azimuth about the axis of the body in radians, from body y to body z.
    pub azimuth: f64,
}

/// The wall of the heart at one phase.
///
/// ```
/// use heart_phantom::{Heart, MaterialPoint, Wall};
/// let heart = Heart::study(201)?;
/// let shapes = heart.shapes(&[0.0, 0.6])?;
/// let wall = |k: usize| Wall::new(shapes[k].solution(), *heart.pose());
/// let (rest, dilated) = (wall(0)?, wall(1)?.sliding_from(&wall(0)?));
/// let point = MaterialPoint { layer: 0.5, s: 0.2, azimuth: 1.0 };
/// let [from, to] = [rest.position(&point)?, dilated.position(&point)?];
/// assert!((to - from).norm() > 0.1); // cm
/// let deformation = rest.deformation(&dilated, &point)?;
/// assert!(deformation.strain().circumferential > 0.0 && deformation.strain().radial < 0.0);
/// assert!((deformation.gradient.determinant() - 1.0).abs() < 1e-10); // the wall is incompressible
/// # Ok::<(), heart_phantom::PhantomError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Wall {
    shell: Arc<Shell>,
    pose: Pose,
    /// The reference wall of a sliding wall.
    rest: Option<Arc<Shell>>,
    twist: Option<Arc<Twist>>,
}

/// A region of the wall that moves with it: all material points within three ranges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct WallRegion {
    /// Layers, within 0 (inner membrane) to 1 (outer membrane).
    pub(crate) layers: [f64; 2],
    /// Coordinate along the membranes, within 0 (base) to 1/2 (apex).
    pub(crate) s: [f64; 2],
    /// Azimuths in radians, the second larger by at most a full turn.
    pub(crate) azimuths: [f64; 2],
}

impl Wall {
    /// The wall between two solved membranes with mirror symmetry ([`HeartShape::solution`](crate::HeartShape::solution)) in a pose, tied to the
    /// membranes: exact for polynomials, polylines for finite differences.
    ///
    /// # Errors
    /// [`PhantomError::Solid`] where the lines between membrane points of equal s cross in the wall.
    pub fn new(pair: &PairEquilibrium, pose: Pose) -> Result<Self, PhantomError> {
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

    /// The wall between polygons that follow the membranes to `tolerance` cm, as those that bound the body of a shape.
    pub(crate) fn polygonal(
        pair: &PairEquilibrium,
        pose: Pose,
        tolerance: f64,
    ) -> Result<Self, PhantomError> {
        let [inner, outer] =
            [&pair.inner, &pair.outer].map(|membrane| -> Result<_, PhantomError> {
                Ok(curve(membrane)?.to_polyline(tolerance)?)
            });
        Self::between(inner?, outer?, pose)
    }

    /// Returns the wall that slides along its membranes so that each element has the volume that it has in `rest`.
    #[must_use]
    pub fn sliding_from(mut self, rest: &Wall) -> Self {
        self.rest = Some(rest.shell.clone());
        self
    }

    /// Returns the wall with a twist; azimuths refer to the wall without twist.
    #[must_use]
    pub fn twisted(mut self, twist: Twist) -> Self {
        self.twist = Some(Arc::new(twist));
        self
    }

    /// Returns the wall in another pose.
    pub(crate) fn with_pose(mut self, pose: Pose) -> Self {
        self.pose = pose;
        self
    }

    /// Returns the volume of the wall in cm^3.
    #[must_use]
    pub fn volume(&self) -> f64 {
        self.shell.volume()
    }

    /// Returns the position of a material point in the lab, cm.
    ///
    /// # Errors
    /// [`PhantomError::OutOfRange`] for a layer outside 0 to 1, an s outside 0 to 1/2, an angle that is not finite.
    pub fn position(&self, point: &MaterialPoint) -> Result<Point3<f64>, PhantomError> {
        Ok(self.place(&point.checked()?))
    }

    /// Returns the material point at a position in the lab, with its azimuth in (-pi, pi]; `None` outside the closed wall.
    #[must_use]
    pub fn locate(&self, p: &Point3<f64>) -> Option<MaterialPoint> {
        let body = self.pose.to_body(p);
        let found = self.shell.locate([body.x, body.y.hypot(body.z)])?;
        Some(self.material(found, &body))
    }

    /// Returns the material point for a layer and the membrane coordinate s of a body point.
    pub(super) fn material(&self, [layer, at]: [f64; 2], body: &Point3<f64>) -> MaterialPoint {
        let s = self.shell.corresponding(at, self.reference());
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

    /// Returns the displacements of the material at the centres of the voxels of some slices. Only voxels in the wall are returned,
    /// with their indices among these slices (`[z][y][x]`), ascending.
    ///
    /// Cost: proportional to the number of voxels in the wall. Bitwise independent of the number of threads.
    ///
    /// ```
    /// use heart_phantom::{Heart, Wall};
    /// use revolve_voxel::VoxelGrid;
    /// let heart = Heart::study(201)?;
    /// let shapes = heart.shapes(&[0.0, 0.6])?;
    /// let wall = |k: usize| Wall::new(shapes[k].solution(), *heart.pose());
    /// let (rest, dilated) = (wall(0)?, wall(1)?.sliding_from(&wall(0)?));
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
        let moved = |p: &Point3<f64>, material: [f64; 2], _| {
            let way = self.way(to, p, material, [0.0; 2]);
            [way.x as f32, way.y as f32, way.z as f32]
        };
        Ok(self
            .shell
            .map_voxels(&self.pose, grid, slices, 0.0, moved)?)
    }

    /// Returns the displacement of a body point in the lab: that of the material at a layer and membrane coordinate s, plus an
    /// offset along the axis and away from it.
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
        // On the axis the azimuth is arbitrary.
        let [mut cos, mut sin] = if from > 0.0 {
            [p.y / from, p.z / from]
        } else {
            [1.0, 0.0]
        };
        if self.twist.is_some() || to.twist.is_some() {
            let s = self.shell.corresponding(at, self.reference());
            let (b, a) = (to.turn(layer, s) - self.turn(layer, s)).sin_cos();
            [cos, sin] = [a * cos - b * sin, b * cos + a * sin];
        }
        let there = to.pose.to_lab(&Point3::new(x, r * cos, r * sin));
        there - self.pose.to_lab(p)
    }

    /// Returns the profile of the solid of revolution between two layers and two s, with layers accurate to `tolerance` in cm.
    ///
    /// # Errors
    /// [`PhantomError::OutOfRange`] as [`Wall::position`]; [`PhantomError::Solid`] for ranges of zero width or a tolerance that is
    /// not positive.
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

    /// As [`sector`](Self::sector), with the twist of [`wall_twist`](Self::wall_twist), which regions share.
    pub(super) fn sector_in(
        &self,
        region: &WallRegion,
        twist: Option<Arc<WallTwist>>,
        tolerance: f64,
    ) -> Result<Sector, PhantomError> {
        let ring = self.region(region.layers, region.s, tolerance)?;
        let sector = Sector::new(ring, region.azimuths, self.pose)?;
        Ok(match twist {
            None => sector,
            Some(twist) => sector.with_twist(twist),
        })
    }

    /// Returns the twist as a function of the layer and s of this phase; `None` without one.
    pub(crate) fn wall_twist(&self) -> Result<Option<Arc<WallTwist>>, PhantomError> {
        let Some(twist) = self.twist.as_deref() else {
            return Ok(None);
        };
        let angles = |at: f64| {
            let s = self.shell.corresponding(at, self.reference());
            [0.0, 1.0].map(|layer| twist.angle(layer, s))
        };
        Ok(Some(Arc::new(WallTwist::new(self.shell.clone(), angles)?)))
    }

    /// Returns the thickness of the wall in cm at the inner membrane point `s`, clamped to 0 to 1/2: the distance to the outer
    /// membrane; NaN for NaN.
    #[must_use]
    pub fn thickness(&self, s: f64) -> f64 {
        self.shell.thickness(s)
    }

    /// Returns the pose of the wall.
    #[must_use]
    pub fn pose(&self) -> &Pose {
        &self.pose
    }

    pub(super) fn place(&self, point: &MaterialPoint) -> Point3<f64> {
        self.placed(
            point,
            self.shell.point(point.layer, self.coordinate(point.s)),
        )
    }

    /// Returns the vector from the place of a material point in one wall to that in another shortly after it, with `self` between both.
    ///
    /// Material slides along the layers. They have small jumps at the nodes of polygons, which a difference over a short time would amplify:
    /// it is the movement at one membrane coordinate, and the tangent of the layer in this wall times the change of this coordinate.
    pub(super) fn moved(&self, between: [&Wall; 2], point: &MaterialPoint) -> Vector3<f64> {
        let at = self.coordinate(point.s);
        let [_, along] = self.shell.tangents(point.layer, at);
        let [from, to] = between.map(|wall| {
            let [x, r] = wall.shell.point(point.layer, at);
            let slid = wall.coordinate(point.s) - at;
            wall.placed(point, [x + along[0] * slid, r + along[1] * slid])
        });
        to - from
    }

    /// Returns the place of a material point at (x, r) in its meridian plane.
    fn placed(&self, point: &MaterialPoint, [x, r]: [f64; 2]) -> Point3<f64> {
        let (sin, cos) = (point.azimuth + self.turn(point.layer, point.s)).sin_cos();
        self.pose.to_lab(&Point3::new(x, r * cos, r * sin))
    }

    /// Returns the rotation of a material point about the axis.
    fn turn(&self, layer: f64, s: f64) -> f64 {
        (self.twist.as_ref()).map_or(0.0, |twist| twist.angle(layer, s))
    }

    /// The shell and its pose.
    pub(super) fn placed_shell(&self) -> (&Shell, &Pose) {
        (&self.shell, &self.pose)
    }

    /// Returns the membrane coordinate s of material s at this phase.
    fn coordinate(&self, s: f64) -> f64 {
        self.reference().corresponding(s, &self.shell)
    }

    /// Returns the membrane coordinate s in another wall of the material at membrane coordinate s in this one.
    fn same(&self, at: f64, to: &Wall) -> f64 {
        if std::ptr::eq(self.reference(), to.reference()) {
            // Equal volume fractions correspond to each other.
            self.shell.corresponding(at, &to.shell)
        } else {
            to.coordinate(self.shell.corresponding(at, self.reference()))
        }
    }

    /// The wall that defines the material coordinate.
    fn reference(&self) -> &Shell {
        self.rest.as_deref().unwrap_or(&self.shell)
    }

    /// Derivatives of the position of a material point with respect to layer, s and azimuth in its cylindrical frame: axial,
    /// radial, circumferential.
    pub(super) fn tangents(&self, point: &MaterialPoint) -> [[f64; 3]; 3] {
        // The apex is a limit: sides and volumes vanish together.
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
    /// Returns the point if it is in the wall.
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

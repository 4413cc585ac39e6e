//! Sectors: solids of revolution between two azimuths, such as a defect of a wall.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};

use crate::error::{finite, length};
use crate::rays::single::Search;
use crate::rays::slabs::for_slabs;
use crate::solid::wedge::Wedge;
use crate::wall::body_line::BodyLine;
use crate::{
    Body, Hit, Lines, Meridian, Pose, Ray, RayCounters, RevolveError, Sample, Span, WallTwist,
};

/// Margin of azimuths of a twisted sector, radians: more than rounding of sines and cosines.
const MARGIN: f64 = 1e-9;

/// The part of a solid of revolution between two half-planes that start at its axis, in the lab. The sides may be twisted
/// ([`with_twist`](Self::with_twist)).
///
/// Azimuth is the angle from body y to body z. The plane between two adjacent sectors belongs to the one that it begins, for points
/// and for rays in that plane; the axis belongs to the sector with azimuth 0.
///
/// ```
/// use revolve_voxel::{Meridian, Pose, Sector};
/// // A quarter of a tube.
/// let ring = Meridian::ring(&[[0.0, 1.0], [0.0, 2.0], [3.0, 2.0], [3.0, 1.0]])?;
/// let quarter = Sector::new(ring, [0.0, std::f64::consts::FRAC_PI_2], Pose::axis_along_z(1.5)?)?;
/// assert!((quarter.volume() - 0.25 * std::f64::consts::PI * 3.0 * 3.0).abs() < 1e-12);
/// # Ok::<(), revolve_voxel::RevolveError>(())
/// ```
#[doc(alias("wedge", "infarct"))]
#[derive(Debug, Clone, PartialEq)]
pub struct Sector {
    /// The complete ring, as the only layer.
    pub(super) ring: Body,
    pub(super) wedge: Wedge,
    azimuths: [f64; 2],
    pub(super) twisted: Option<Twisted>,
}

/// The sides of a sector in a twisted wall.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Twisted {
    twist: Arc<WallTwist>,
    /// Contains the sector at all angles of the twist.
    pub(super) reach: Wedge,
    /// Inside the sector at all angles of the twist.
    pub(super) core: Option<Wedge>,
}

impl Sector {
    /// Creates the part of `ring` from the first azimuth to the last, in radians.
    ///
    /// # Errors
    /// [`RevolveError::NotFinite`], [`RevolveError::NotPositive`] unless the last azimuth is larger, [`RevolveError::OutOfRange`] for
    /// more than a full turn.
    pub fn new(ring: Meridian, azimuths: [f64; 2], pose: Pose) -> Result<Self, RevolveError> {
        Ok(Self {
            wedge: Wedge::new(azimuths)?,
            ring: Body::new(vec![ring], pose)?,
            azimuths,
            twisted: None,
        })
    }

    /// Returns the sector with its material rotated by the twist of a wall that contains the ring, in the same body frame. Its volume does not
    /// change.
    ///
    /// Intervals of lines end where the sides are, to about 1e-6 of the size of the wall; those of a line that nearly touches a side, to the
    /// square root of that. Cost: two calls of [`Shell::locate`](crate::Shell::locate) for each step near a side, and one for each end.
    ///
    /// ```
    /// use revolve_voxel::{Curve, Meridian, Pose, Ray, Sector, Shell, WallTwist};
    /// use revolve_voxel::nalgebra::{Point3, Vector3};
    /// // A quarter of a tube, rotated by 0 to 1.2 radians from one end to the other.
    /// let line = |r: f64| Curve::polyline(&[0.0, 1.0], &[[0.0, r], [3.0, r]]);
    /// let wall = Shell::new(line(1.0)?, line(2.0)?, [0.0, 1.0])?;
    /// let twist = WallTwist::new(wall.into(), |s| [1.2 * s; 2])?;
    /// let ring = Meridian::ring(&[[0.0, 1.0], [0.0, 2.0], [3.0, 2.0], [3.0, 1.0]])?;
    /// let quarter = Sector::new(ring, [0.0, std::f64::consts::FRAC_PI_2], Pose::identity())?;
    /// let twisted = quarter.with_twist(twist.into());
    /// // Along the axis at azimuth 0.6: inside until the wall is rotated by more than that.
    /// let ray = Ray::new(Point3::new(0.0, 1.5 * 0.6_f64.cos(), 1.5 * 0.6_f64.sin()), Vector3::x())?;
    /// assert!((twisted.chord(&ray) - 1.5).abs() < 1e-9);
    /// # Ok::<(), revolve_voxel::RevolveError>(())
    /// ```
    #[must_use]
    pub fn with_twist(mut self, twist: Arc<WallTwist>) -> Self {
        let ([from, to], [least, most]) = (self.azimuths, twist.range());
        // A twist maps a ring onto itself; without rotation the sides are flat.
        if self.wedge != Wedge::Whole && [least, most] != [0.0; 2] {
            // More than a full turn is not a wedge.
            let reach = [from + least - MARGIN, to + most + MARGIN];
            self.twisted = Some(Twisted {
                twist,
                reach: Wedge::new(reach).unwrap_or(Wedge::Whole),
                core: Wedge::new([from + most + MARGIN, to + least - MARGIN]).ok(),
            });
        }
        self
    }

    /// Returns the sector in another pose; the ring is shared.
    #[must_use]
    pub fn with_pose(&self, pose: Pose) -> Self {
        Self {
            ring: self.ring.with_pose(pose),
            ..self.clone()
        }
    }

    /// Returns the pose.
    pub(crate) fn pose(&self) -> &Pose {
        self.ring.pose()
    }

    /// Returns the complete ring, as the only layer, and a wedge that contains the sector.
    pub(crate) fn ring(&self) -> (&Body, &Wedge) {
        (&self.ring, self.reach())
    }

    /// Returns the edges of each side in the lab, a closed line through vertices of the ring that are `apart`; nothing for a full turn.
    pub(crate) fn side_edges(&self, apart: f64) -> impl Iterator<Item = Vec<Point3<f64>>> {
        let (ring, pose) = (&self.ring.layers()[0], self.ring.pose());
        // Along the axis there are no segments.
        let ends = ring.segments().iter().flat_map(|s| [s.start(), s.end()]);
        let mut points: Vec<[f64; 2]> = ends.collect();
        points.rotate_left(1);
        points.dedup_by(|[x, r], [from_x, from_r]| (*x - *from_x).hypot(*r - *from_r) < apart);
        // On the surface of the wall the angle is that of a point nearer to the opposite end of the list, across the wall.
        let opposite = points.iter().rev();
        let turns: Vec<f64> = (points.iter().zip(opposite))
            .map(|(own, across)| match &self.twisted {
                None => 0.0,
                Some(Twisted { twist, .. }) => twist.angle_near(*own, *across),
            })
            .collect();
        let sides = match self.wedge {
            Wedge::Whole => &[][..],
            Wedge::Within(_) | Wedge::Without(_) => &self.azimuths,
        };
        sides.iter().map(move |azimuth| {
            let place = |([x, r], turn): (&[f64; 2], &f64)| {
                let (sin, cos) = (azimuth + turn).sin_cos();
                pose.to_lab(&Point3::new(*x, r * cos, r * sin))
            };
            points.iter().zip(&turns).map(place).collect()
        })
    }

    /// Returns the volume in cm^3.
    #[must_use]
    pub fn volume(&self) -> f64 {
        let [from, to] = self.azimuths;
        self.ring.layers()[0].mass_properties().volume * (to - from) / std::f64::consts::TAU
    }

    /// Returns whether the sector contains a lab point.
    #[must_use]
    pub fn contains(&self, p: &Point3<f64>) -> bool {
        let pose = self.ring.pose();
        let place = pose.to_body(p);
        let before = match &self.twisted {
            None => Some(place),
            Some(twisted) => twisted.twist.before(&place),
        };
        let near = pose.rounding(p);
        self.ring.layers()[0].contains(&place)
            && before.is_some_and(|before| self.wedge.contains(&before, near))
    }

    /// Returns the length of a line inside the sector.
    #[must_use]
    pub fn chord(&self, ray: &Ray) -> f64 {
        let (mut sum, mut search) = (0.0, Search::default());
        let line = BodyLine::new(self.ring.pose(), ray);
        self.for_spans(ray, &line, &mut search, |span| sum += span.length());
        sum
    }

    /// Calls `each` with the disjoint intervals of a line inside the sector; `None` if the line misses its bounds. `line` is the ray in its pose.
    /// Neighbouring lines share `search`.
    pub(crate) fn for_spans(
        &self,
        ray: &Ray,
        line: &BodyLine,
        search: &mut Search,
        mut each: impl FnMut(Span),
    ) -> Option<()> {
        let ring = &self.ring.layers()[0];
        let held = line.inside(ring.boxes().whole(), self.reach())?;
        self.ring.for_spans(ring, ray, search, |span| {
            self.for_parts(line, held, [span.enter, span.exit], |[enter, exit]| {
                each(Span { enter, exit });
            });
        });
        Some(())
    }

    /// Calls `each` with the disjoint intervals of a line between the sides. The line is in the ring from `enter` to `exit`, and in the wedge
    /// that contains the sector in the intervals `held`.
    fn for_parts(
        &self,
        line: &BodyLine,
        held: [Option<[f64; 2]>; 2],
        [enter, exit]: [f64; 2],
        mut each: impl FnMut([f64; 2]),
    ) {
        let within = |[from, to]: [f64; 2]| {
            let part = [from.max(enter), to.min(exit)];
            (part[0] < part[1]).then_some(part)
        };
        let parts = held.into_iter().flatten().filter_map(within);
        let Some(Twisted { twist, core, .. }) = &self.twisted else {
            parts.for_each(each);
            return;
        };
        let (origin, along, near) = &line.parts;
        let core = (core.as_ref()).map_or([None; 2], |core| core.stretches(origin, along, *near));
        let mut last: Option<[f64; 2]> = None;
        // Parts that meet are one.
        let mut add = |part: [f64; 2]| match &mut last {
            Some(last) if part[0] <= last[1] => last[1] = part[1],
            _ => last.replace(part).into_iter().for_each(&mut each),
        };
        for [from, to] in parts {
            let mut at = from;
            for [start, end] in core.into_iter().flatten() {
                let [start, end] = [start.max(from), end.min(to)];
                if start < end {
                    if at < start {
                        twist.trace(&self.wedge, line, [at, start], &mut add);
                    }
                    add([start, end]);
                    at = end;
                }
            }
            if at < to {
                twist.trace(&self.wedge, line, [at, to], &mut add);
            }
        }
        last.into_iter().for_each(each);
    }

    /// Returns the first point with `t >= 0` where the ray enters the sector, with the outward normal; `None` if there is none.
    ///
    /// ```
    /// use revolve_voxel::nalgebra::{Point3, Vector3};
    /// use revolve_voxel::{Meridian, Pose, Ray, Sector};
    /// let rod = Meridian::new(&[[0.0, 1.0], [3.0, 1.0]])?;
    /// let half = Sector::new(rod, [0.0, std::f64::consts::PI], Pose::identity())?; // z >= 0
    /// let ray = Ray::new(Point3::new(1.0, 0.5, -4.0), Vector3::z())?;
    /// let hit = half.first_hit(&ray).unwrap();
    /// assert_eq!((hit.t, hit.normal), (4.0, -Vector3::z())); // on the face of the cut
    /// # Ok::<(), revolve_voxel::RevolveError>(())
    /// ```
    #[must_use]
    pub fn first_hit(&self, ray: &Ray) -> Option<Hit> {
        let line = BodyLine::new(self.ring.pose(), ray);
        let ring = &self.ring.layers()[0];
        let held = line.inside(ring.boxes().whole(), self.reach())?;
        // Entry into both ring and wedge, and whether it is on the surface of the ring.
        let mut found = None;
        let mut search = Search::default();
        self.ring.for_spans(ring, ray, &mut search, |span| {
            self.for_parts(&line, held, [span.enter, span.exit], |[t, _]| {
                if t >= 0.0 && found.is_none() {
                    found = Some((t, t == span.enter));
                }
            });
        });
        let (t, is_on_ring) = found?;
        let (point, pose) = (ray.at(t), self.ring.pose());
        let body = pose.to_body(&point);
        let normal = match is_on_ring {
            false => self.side_normal(&body)?,
            true => {
                let r = body.y.hypot(body.z);
                let [nx, nr] = ring.normal_at(body.x, r);
                match r > 0.0 {
                    true => Vector3::new(nx, nr * body.y / r, nr * body.z / r),
                    false => Vector3::x() * nx.signum(),
                }
            }
        };
        Some(Hit {
            t,
            point,
            normal: pose.isometry().rotation * normal,
        })
    }

    /// Adds `activity` times the line integrals to an image `[row][bin]`. [`Assembly`](crate::Assembly) supports attenuation.
    ///
    /// # Errors
    /// [`RevolveError::WrongLength`] for a wrong image, [`RevolveError::NotFinite`] for the activity.
    pub fn project_add<T: Sample>(
        &self,
        rays: &Lines,
        activity: f64,
        out: &mut [T],
    ) -> Result<RayCounters, RevolveError> {
        finite("activity", activity)?;
        length("image", rays.image_len(), out.len())?;
        let cast = |search: &mut Search, ray: &Ray, slabs: &mut [f64]| {
            let (line, mut hit) = (BodyLine::new(self.ring.pose(), ray), false);
            self.for_spans(ray, &line, search, |Span { enter, exit }| {
                hit = true;
                for_slabs(rays.planes(), 0.0, [enter, exit], |slab, [from, to]| {
                    slabs[slab] += to - from;
                });
            })?;
            Some(hit)
        };
        Ok(rays.add_each(Some(self.ring.ball()), activity, out, cast))
    }

    /// A wedge that contains the sector.
    fn reach(&self) -> &Wedge {
        (self.twisted.as_ref()).map_or(&self.wedge, |twisted| &twisted.reach)
    }

    /// Returns the outward normal (body) of the side at a body point in it.
    fn side_normal(&self, p: &Point3<f64>) -> Option<Vector3<f64>> {
        let Some(twisted) = &self.twisted else {
            return self.wedge.normal_at(p);
        };
        let before = twisted.twist.before(p)?;
        let [y, z] = [before.y, before.z];
        let flat = self.wedge.normal_at(&before)?;
        let outward = (flat.z * y - flat.y * z).signum();
        // The side is where azimuth minus angle is constant.
        let r = p.y.hypot(p.z);
        let [by_x, by_r] = twisted.twist.slopes([p.x, r]);
        let [cos, sin] = [p.y / r, p.z / r];
        let gradient = Vector3::new(-by_x, -by_r * cos - sin / r, -by_r * sin + cos / r);
        Some(gradient.normalize() * outward)
    }
}

//! Sectors: solids of revolution between two azimuths, such as a defect of a wall.

use std::ops::Range;

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::error::{finite, positive, zeros};
use crate::rays::cylinder::check_slices;
use crate::rays::single::SurfacePoint;
use crate::solid::wedge::{Place, Wedge};
use crate::voxels::patch::Cuboid;
use crate::voxels::runs::Runs;
use crate::voxels::sections::Sections;
use crate::wall::body_line::BodyLine;
use crate::{
    Body, Hit, Meridian, Pose, Ray, RayCounters, Rays, RevolveError, Sample, Sampling, Span,
    VoxelCounters, VoxelGrid,
};

/// The part of a solid of revolution between two half-planes that start at its axis, in the lab.
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
    ring: Body,
    wedge: Wedge,
    azimuths: [f64; 2],
}

impl Sector {
    /// Creates the part of `ring` from the first azimuth to the last, in radians.
    ///
    /// # Errors
    /// [`RevolveError::NotFinite`], [`RevolveError::NotPositive`] unless the last azimuth is larger, [`RevolveError::TooWide`] for
    /// more than a full turn.
    pub fn new(ring: Meridian, azimuths: [f64; 2], pose: Pose) -> Result<Self, RevolveError> {
        Ok(Self {
            wedge: Wedge::new(azimuths)?,
            ring: Body::new(vec![ring], pose)?,
            azimuths,
        })
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
    #[must_use]
    pub fn pose(&self) -> &Pose {
        self.ring.pose()
    }

    /// Returns the ring, as the only layer, if the sector is a full turn.
    pub(crate) fn ring(&self) -> Option<&Body> {
        (self.wedge == Wedge::Whole).then_some(&self.ring)
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
        self.ring.layers()[0].contains(&place) && self.wedge.contains(&place, pose.rounding(p))
    }

    /// Returns the length of a line inside the sector.
    #[must_use]
    pub fn chord(&self, ray: &Ray) -> f64 {
        let spans = self.ring.spans_in(&self.ring.layers()[0], ray);
        let clip = self.clip(ray);
        spans
            .iter()
            .map(|span| clip(span.enter, span.exit, &|low, high| high - low))
            .sum()
    }

    /// Returns the range of x and r of the ring, and the azimuths.
    pub(crate) fn bounds(&self) -> ([f64; 4], [f64; 2]) {
        (self.ring.layers()[0].boxes().whole(), self.azimuths)
    }

    /// Calls `each` with the disjoint intervals of a line inside the sector. `line` is the ray in its pose.
    pub(crate) fn for_spans(&self, ray: &Ray, line: &BodyLine, mut each: impl FnMut(Span)) {
        let ring = &self.ring.layers()[0];
        let Some(held) = line.inside(ring.boxes().whole(), &self.wedge) else {
            return;
        };
        for span in &self.ring.spans_in(ring, ray) {
            for &[from, to] in held.iter().flatten() {
                let (enter, exit) = (from.max(span.enter), to.min(span.exit));
                if enter < exit {
                    each(Span { enter, exit });
                }
            }
        }
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
        let (origin, along, near) = self.in_body(ray);
        let held = self.wedge.stretches(&origin, &along, near);
        let spans = self.ring.surface_spans(&self.ring.layers()[0], ray);
        // Entry into both ring and wedge, and whether it is on the surface of the ring.
        let entries = spans.iter().flat_map(|[enter, exit]| {
            held.iter().flatten().filter_map(move |&[from, to]| {
                let t = from.max(enter.t);
                (t >= 0.0 && t < to.min(exit.t)).then_some((t, (t == enter.t).then_some(enter)))
            })
        });
        let (t, surface) = entries.into_iter().next()?;
        let (point, pose) = (ray.at(t), self.ring.pose());
        let body = pose.to_body(&point);
        let normal = match surface {
            None => self.wedge.normal_at(&body)?,
            // A disc that the ray enters from outside faces the ray.
            Some(SurfacePoint { normal: None, .. }) => Vector3::x() * -along.x.signum(),
            Some(SurfacePoint {
                normal: Some([nx, nr]),
                ..
            }) => {
                // Scaled, because near the axis a root of squares loses its digits.
                let most = body.y.abs().max(body.z.abs());
                if most > 0.0 {
                    let [y, z] = [body.y / most, body.z / most];
                    let r = y.hypot(z);
                    Vector3::new(*nx, nr * y / r, nr * z / r)
                } else {
                    Vector3::x() * nx.signum()
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
        rays: &impl Rays,
        activity: f64,
        out: &mut [T],
    ) -> Result<RayCounters, RevolveError> {
        self.ring
            .project_measured(rays, &[activity], 1.0, out, |[bin, row]| {
                let clip = self.clip(&rays.line(bin, row));
                move |low: f64, high: f64, origin: f64| {
                    clip(low - origin, high - origin, &|low, high| high - low)
                }
            })
    }

    /// Adds `activity` times the covered fraction of every voxel in some slices to `out` (`[z][y][x]`, those slices only).
    ///
    /// A voxel cut by a side of the wedge is always computed by coverage, to the tolerance of the sampling or 1e-2. Other voxels
    /// have the value of the ring.
    ///
    /// # Errors
    /// As [`Body::voxelize_add`].
    pub fn voxelize_add<T: Sample>(
        &self,
        grid: &VoxelGrid,
        slices: Range<usize>,
        sampling: Sampling,
        activity: f64,
        out: &mut [T],
    ) -> Result<VoxelCounters, RevolveError> {
        finite("activity", activity)?;
        check_slices(grid, &slices, out.len())?;
        let tolerance = match sampling {
            Sampling::Coverage { tolerance } => positive("tolerance", tolerance)?,
            _ => 1e-2,
        };
        // The ring alone, on the part of the grid that contains it, independent of the requested slices.
        let [low, high] = self.ring.bounding_box(0)?;
        let (origin, h) = (grid.origin(), grid.spacing());
        let part: [Range<usize>; 3] = [0, 1, 2].map(|a| {
            let n = grid.shape()[a] as f64;
            let index = |x: f64| ((x - origin[a]) / h[a]).clamp(-1.0, n);
            let first = (index(low[a]) - 1.0).max(0.0) as usize;
            first..((index(high[a]) + 2.0).min(n) as usize).max(first)
        });
        let z = part[2].start.max(slices.start)..part[2].end.min(slices.end);
        let [nx, ny] = [part[0].len(), part[1].len()];
        if nx * ny == 0 || z.is_empty() {
            return Ok(VoxelCounters::default());
        }
        let corner = grid.centre(part[0].start, part[1].start, part[2].start);
        let small = VoxelGrid::new(part.clone().map(|p| p.len()), h, corner.coords.into())?;
        let own = z.start - part[2].start..z.end - part[2].start;
        let mut ring = zeros("voxels", nx * ny * z.len())?;
        let mut counters =
            self.ring
                .voxelize_add(&small, own.clone(), sampling, &[1.0], 1.0, &mut ring)?;
        counters = counters + self.cut(&small, own.start, sampling, tolerance, &mut ring);
        for (slice, own) in z.zip(ring.chunks(nx * ny)) {
            for (y, row) in own.chunks(nx).enumerate() {
                let start = (slice - slices.start) * grid.slice_len()
                    + (part[1].start + y) * grid.shape()[0]
                    + part[0].start;
                for (v, share) in out[start..start + nx].iter_mut().zip(row) {
                    if *share != 0.0 {
                        *v += T::from_f64(activity * share);
                    }
                }
            }
        }
        Ok(counters)
    }

    /// Converts the coverage of the ring, from `first_slice`, to that of the sector.
    fn cut(
        &self,
        grid: &VoxelGrid,
        first_slice: usize,
        sampling: Sampling,
        tolerance: f64,
        ring: &mut [f64],
    ) -> VoxelCounters {
        if self.wedge == Wedge::Whole {
            return VoxelCounters::default();
        }
        let pose = self.ring.pose();
        let steps = [Vector3::x(), Vector3::y(), Vector3::z()].map(|e| pose.vector_to_body(&e));
        let half = grid.spacing().map(|h| 0.5 * h);
        let radius = Vector3::from(half).norm();
        let meridian = &self.ring.layers()[0];
        let runs = Runs::each(meridian);
        let by_coverage = matches!(sampling, Sampling::Coverage { .. });
        let [nx, ny, _] = grid.shape();
        ring.par_iter_mut()
            .enumerate()
            .map(|(k, share)| {
                let mut counters = VoxelCounters::default();
                if *share == 0.0 && by_coverage {
                    return counters;
                }
                let (x, y, z) = (k % nx, k / nx % ny, first_slice + k / (nx * ny));
                let centre = pose.to_body(&grid.centre(x, y, z));
                match self.wedge.place(&centre, half, &steps) {
                    Place::Inside => {}
                    Place::Outside => *share = 0.0,
                    Place::Cut => {
                        let cuboid = Cuboid {
                            centre: &centre,
                            axes: &steps,
                            half,
                            radius,
                        };
                        let mut sections =
                            Sections::new(meridian, &runs, &cuboid, tolerance).within(&self.wedge);
                        *share = sections.fraction();
                        counters.cut = 1;
                        counters.evaluations = sections.evaluations;
                    }
                }
                counters
            })
            .reduce(VoxelCounters::default, |a, b| a + b)
    }

    fn clip(&self, ray: &Ray) -> impl Fn(f64, f64, &dyn Fn(f64, f64) -> f64) -> f64 + use<> {
        let (origin, along, near) = self.in_body(ray);
        self.wedge.clip(&origin, &along, near)
    }

    /// Returns origin and direction of a ray in the body frame, with the rounding error of the origin.
    fn in_body(&self, ray: &Ray) -> (Point3<f64>, Vector3<f64>, f64) {
        BodyLine::new(self.ring.pose(), ray).parts
    }
}

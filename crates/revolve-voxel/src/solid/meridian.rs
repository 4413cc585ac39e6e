//! Meridians: curves whose rotation about the axis bounds a solid.

use crate::RevolveError;
use crate::error::{SIZES, at_least, within};
use crate::solid::box_tree::BoxTree;
use crate::solid::chains::{Chain, Node, chains, tree};
use crate::solid::mass_properties::MassProperties;
use crate::solid::segment::{ROUNDING, Segment};

/// A validated meridian (x along the axis, distance r >= 0), closed by discs where it ends off the axis.
///
/// Its rotation about the axis bounds a solid. Several radii at one x, bulges behind the base, and interior points on the axis are
/// allowed; self-intersections are rejected.
///
/// ```
/// use revolve_voxel::Meridian;
/// let cone = Meridian::new(&[[0.0, 1.0], [3.0, 0.0]])?; // open at the base: a disc closes it
/// assert!((cone.mass_properties().volume - std::f64::consts::PI).abs() < 1e-14);
/// # Ok::<(), revolve_voxel::RevolveError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
#[doc(alias = "polycone")]
pub struct Meridian {
    segments: Vec<Segment>,
    chains: Vec<Chain>,
    tree: Vec<Node>,
    boxes: BoxTree,
    x_min: f64,
    x_max: f64,
    r_max: f64,
}

impl Meridian {
    /// Creates a meridian from points (x, r), base to apex (the reverse order is inverted). The position on the axis precedes the radius; points
    /// (r, x) are usually a valid meridian of another solid.
    ///
    /// Repeated points are merged. An end with r > 0 is closed by a disc.
    ///
    /// # Errors
    /// [`RevolveError::TooFew`], [`RevolveError::NotFinitePoint`], [`RevolveError::NegativeRadius`], [`RevolveError::SelfCrossing`],
    /// [`RevolveError::NoVolume`], [`RevolveError::OutOfRange`] for a size below 1e-100 or above 1e100.
    pub fn new(points: &[[f64; 2]]) -> Result<Self, RevolveError> {
        let mut path = checked(points, 2)?;
        if path[0][1] > 0.0 {
            path.insert(0, [path[0][0], 0.0]);
        }
        let last = path[path.len() - 1];
        if last[1] > 0.0 {
            path.push([last[0], 0.0]);
        }
        Self::from_path(path, false)
    }

    /// Creates a closed meridian that need not touch the axis, such as that of a torus.
    ///
    /// The last point is connected to the first.
    ///
    /// # Errors
    /// As [`Meridian::new`]; at least three distinct points are needed.
    pub fn ring(points: &[[f64; 2]]) -> Result<Self, RevolveError> {
        let mut path = checked(points, 3)?;
        if path[0] != path[path.len() - 1] {
            path.push(path[0]);
        }
        Self::from_path(path, true)
    }

    /// Creates a meridian from the upper half of a mirror-symmetric curve (x, y): the points from its first (y > 0, the base) to
    /// the apex, where y changes sign; between two nodes the apex is interpolated.
    ///
    /// # Errors
    /// As [`Meridian::new`], and [`RevolveError::NegativeRadius`] if the curve starts below the axis.
    pub fn from_full_curve(points: &[[f64; 2]]) -> Result<Self, RevolveError> {
        let mut half = Vec::with_capacity(points.len() / 2 + 2);
        for (i, &p) in points.iter().enumerate() {
            if !(p[0].is_finite() && p[1].is_finite()) {
                return Err(RevolveError::NotFinitePoint {
                    index: i,
                    x: p[0],
                    r: p[1],
                });
            }
            if p[1] > 0.0 || i == 0 {
                half.push(p);
                continue;
            }
            let q = points[i - 1];
            let f = q[1] / (q[1] - p[1]);
            half.push([q[0] + f * (p[0] - q[0]), 0.0]);
            break;
        }
        Self::new(&half)
    }

    pub(crate) fn from_path(mut path: Vec<[f64; 2]>, ring: bool) -> Result<Self, RevolveError> {
        let volume = MassProperties::signed_volume(&path);
        if volume < 0.0 {
            path.reverse();
        }
        let fold =
            |f: fn(f64, f64) -> f64, init: f64, i: usize| path.iter().map(|p| p[i]).fold(init, f);
        let x_min = fold(f64::min, f64::INFINITY, 0);
        let x_max = fold(f64::max, f64::NEG_INFINITY, 0);
        let r_max = fold(f64::max, 0.0, 1);
        // Negligible for the size of the solid, or below the rounding error of its position.
        let size = within("size of the meridian", (x_max - x_min).max(r_max), SIZES)?;
        let rounding = x_min.abs().max(x_max.abs()) * r_max * r_max;
        if volume.is_nan() || volume.abs() <= 1e-14 * size.powi(3).max(rounding) {
            return Err(RevolveError::NoVolume { volume });
        }
        let mut segments: Vec<Segment> = Vec::with_capacity(path.len());
        for pair in path.windows(2) {
            // On the axis there is no surface.
            if pair[0][1] > 0.0 || pair[1][1] > 0.0 {
                segments.push(Segment::new(pair[0], pair[1]));
            }
        }
        let n = segments.len();
        for k in 0..n {
            let next = (k + 1) % n;
            let (a, b) = (segments[k], segments[next]);
            let sum = if a.r1 == 0.0 {
                // The neighbour across the axis is the mirror image.
                [-a.tr, 0.0]
            } else {
                [-a.tr - b.tr, a.tx + b.tx]
            };
            segments[k].end_normal = sum;
            if a.r1 > 0.0 && (ring || next > 0) {
                segments[next].start_normal = sum;
            }
        }
        for s in &mut segments {
            if s.r0 == 0.0 {
                s.start_normal = [-s.tr, 0.0];
            }
        }
        share_axis_points(&mut segments);
        let boxes = BoxTree::new(&segments);
        crate::solid::self_crossing::check(&segments, &boxes)?;
        let mid = 0.5 * (x_min + x_max);
        let chains = chains(&segments, mid, 0.5 * (x_max - x_min) + r_max);
        Ok(Self {
            tree: tree(&chains),
            boxes,
            chains,
            r_max,
            x_min,
            x_max,
            segments,
        })
    }

    /// Returns the number of cones, cylinders and discs of the surface.
    #[must_use]
    pub fn n_segments(&self) -> usize {
        self.segments.len()
    }

    /// Returns the smallest and the largest axial coordinate.
    #[must_use]
    pub fn x_range(&self) -> [f64; 2] {
        [self.x_min, self.x_max]
    }

    /// Returns the largest radius.
    #[must_use]
    pub fn r_max(&self) -> f64 {
        self.r_max
    }

    /// Returns an upper bound on the distance of the solid from the middle of its axis.
    pub(crate) fn size(&self) -> f64 {
        0.5 * (self.x_max - self.x_min) + self.r_max
    }

    /// Returns exact volume, surface, centroid and inertia of the solid.
    #[must_use]
    pub fn mass_properties(&self) -> MassProperties {
        MassProperties::of(&self.segments)
    }

    /// Middle of the x range: the origin of the coordinates of the chains.
    pub(crate) fn mid(&self) -> f64 {
        0.5 * (self.x_min + self.x_max)
    }

    pub(crate) fn boxes(&self) -> &BoxTree {
        &self.boxes
    }

    pub(crate) fn tree(&self) -> &[Node] {
        &self.tree
    }

    pub(crate) fn chains(&self) -> &[Chain] {
        &self.chains
    }

    pub(crate) fn segments(&self) -> &[Segment] {
        &self.segments
    }
}

/// Where segments meet at one point of the axis, all from one side, the one nearest to that side covers the others: its normal
/// applies to all.
fn share_axis_points(segments: &mut [Segment]) {
    // Position, axial extent of the segment, its normal there, the segment and its end.
    let mut feet: Vec<(f64, f64, [f64; 2], usize, bool)> = Vec::new();
    for (k, s) in segments.iter().enumerate() {
        if s.r0 == 0.0 {
            feet.push((s.x0, s.tx, s.start_normal, k, true));
        }
        if s.r1 == 0.0 {
            feet.push((s.x1, -s.tx, s.end_normal, k, false));
        }
    }
    feet.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    for at_one in feet.chunk_by(|a, b| a.0 == b.0) {
        let (first, last) = (at_one[0], at_one[at_one.len() - 1]);
        let normal = match (first.1 >= 0.0, last.1 <= 0.0) {
            (_, true) => last.2,
            (true, false) => first.2,
            (false, false) => continue,
        };
        for &(.., k, is_start) in at_one {
            match is_start {
                true => segments[k].start_normal = normal,
                false => segments[k].end_normal = normal,
            }
        }
    }
}

/// Finite, non-negative, without repeats.
fn checked(points: &[[f64; 2]], least: usize) -> Result<Vec<[f64; 2]>, RevolveError> {
    let mut path: Vec<[f64; 2]> = Vec::with_capacity(points.len() + 2);
    for (index, &[x, r]) in points.iter().enumerate() {
        if !(x.is_finite() && r.is_finite()) {
            return Err(RevolveError::NotFinitePoint { index, x, r });
        }
        if r < 0.0 {
            return Err(RevolveError::NegativeRadius { index, r });
        }
        // `+ 0.0` turns a negative zero into zero.
        let mut p = [x + 0.0, r + 0.0];
        if let Some(last) = path.last()
            && (p[0] - last[0]).abs() <= ROUNDING * (p[1] - last[1]).abs()
        {
            // A face perpendicular to the axis up to rounding is perpendicular.
            p[0] = last[0];
        }
        if path.last() != Some(&p) {
            path.push(p);
        }
    }
    at_least("distinct points of a meridian", path.len(), least)?;
    Ok(path)
}

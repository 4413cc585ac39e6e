//! Wedges: the space between two half-planes that start at the axis of a body.

use nalgebra::{Point3, Vector3};
use std::f64::consts::{PI, TAU};

use crate::RevolveError;
use crate::error::{finite, positive};
use crate::solid::segment::ROUNDING;
use crate::voxels::patch::Cuboid;

/// A wedge of azimuth in the body frame: from y to z, between two angles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Wedge {
    /// The full circle.
    Whole,
    /// At most half a turn: convex.
    Within(Sides),
    /// More than half a turn: the complement of a convex wedge.
    Without(Sides),
}

/// Normals (y, z) of the two planes, both pointing into a wedge of at most half a turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sides {
    normals: [[f64; 2]; 2],
}

/// Position of a box relative to a wedge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Place {
    Inside,
    Outside,
    /// A side may intersect it.
    Cut,
}

impl Wedge {
    /// From one azimuth to a larger one, in radians.
    pub(crate) fn new([from, to]: [f64; 2]) -> Result<Self, RevolveError> {
        finite("first azimuth", from)?;
        finite("last azimuth", to)?;
        let opening = positive("opening of the wedge", to - from)?;
        // A full turn given as a sum of angles may differ by rounding.
        if opening > TAU * (1.0 + 1e-12) {
            return Err(RevolveError::OutOfRange {
                what: "opening of a wedge (radians)",
                given: opening,
                least: 0.0,
                most: TAU,
            });
        }
        if opening >= TAU * (1.0 - 1e-12) {
            return Ok(Self::Whole);
        }
        let left = |a: f64| [-a.sin(), a.cos()];
        let right = |a: f64| [a.sin(), -a.cos()];
        Ok(if opening <= PI {
            Self::Within(Sides {
                normals: [left(from), right(to)],
            })
        } else {
            Self::Without(Sides {
                normals: [left(to), right(from)],
            })
        })
    }

    /// Returns whether it contains a body point, known to within `near`. The first plane belongs to the wedge, the last does not.
    pub(crate) fn contains(&self, p: &Point3<f64>, near: f64) -> bool {
        let (sides, inverted) = self.sides();
        sides.is_none_or(|sides| {
            let held = (0..2).all(|k| sides.course(k, p, &Vector3::zeros(), near)[0] > 0.0);
            held != inverted
        })
    }

    /// Returns the parts of the path from p to q (y, z) inside it, as fractions.
    pub(crate) fn parts(&self, p: [f64; 2], q: [f64; 2]) -> [Option<[f64; 2]>; 2] {
        self.of([0.0, 1.0], |sides| sides.held(p, q))
    }

    /// Returns the parameter intervals of a line inside it, in order (in the body frame, origin known to within `near`).
    pub(crate) fn stretches(
        &self,
        origin: &Point3<f64>,
        direction: &Vector3<f64>,
        near: f64,
    ) -> [Option<[f64; 2]>; 2] {
        let line = [f64::NEG_INFINITY, f64::INFINITY];
        self.of(line, |sides| sides.interval(origin, direction, near))
    }

    /// Returns its part of a whole, from the part of the convex wedge.
    fn of(
        &self,
        [start, end]: [f64; 2],
        held: impl Fn(&Sides) -> Option<[f64; 2]>,
    ) -> [Option<[f64; 2]>; 2] {
        let (sides, inverted) = self.sides();
        match (sides.map(held), inverted) {
            (None, _) | (Some(None), true) => [Some([start, end]), None],
            (Some(held), false) => [held, None],
            (Some(Some([a, b])), true) => [
                (a > start).then_some([start, a]),
                (b < end).then_some([b, end]),
            ],
        }
    }

    /// Returns the outward normal of the side of a point; `None` without sides.
    pub(crate) fn normal_at(&self, p: &Point3<f64>) -> Option<Vector3<f64>> {
        let (sides, inverted) = self.sides();
        let (sides, inward) = (sides?, if inverted { -1.0 } else { 1.0 });
        let depth = sides.depth(p).map(f64::abs);
        let [y, z] = sides.normals[usize::from(depth[1] < depth[0])];
        Some(Vector3::new(0.0, y, z) * -inward)
    }

    /// Returns the position of a box.
    pub(crate) fn place(&self, cuboid: &Cuboid<'_>) -> Place {
        let (sides, inverted) = self.sides();
        let place = sides.map_or(Place::Inside, |sides| sides.place(cuboid));
        match place {
            Place::Inside if inverted => Place::Outside,
            Place::Outside if inverted => Place::Inside,
            place => place,
        }
    }

    /// Normals (y, z) of the planes of its sides.
    pub(crate) fn normals(&self) -> impl Iterator<Item = [f64; 2]> + use<> {
        self.sides()
            .0
            .map(|sides| sides.normals)
            .into_iter()
            .flatten()
    }

    /// Unit vectors (y, z) along its sides, from the axis outward.
    pub(crate) fn directions(&self) -> impl Iterator<Item = [f64; 2]> + use<> {
        self.sides().0.map(Sides::directions).into_iter().flatten()
    }

    /// Returns the depths of a point below both sides of the convex wedge.
    pub(crate) fn depths(&self, p: &Point3<f64>) -> [f64; 2] {
        self.sides().0.map_or([1.0; 2], |sides| sides.depth(p))
    }

    /// Returns whether a point with these depths is inside.
    pub(crate) fn holds(&self, depths: [f64; 2]) -> bool {
        depths.iter().all(|depth| *depth > 0.0) != self.sides().1
    }

    /// The convex wedge, and whether this one is its complement.
    fn sides(&self) -> (Option<&Sides>, bool) {
        match self {
            Self::Whole => (None, false),
            Self::Within(sides) => (Some(sides), false),
            Self::Without(sides) => (Some(sides), true),
        }
    }
}

impl Sides {
    fn depth(&self, p: &Point3<f64>) -> [f64; 2] {
        self.normals.map(|[y, z]| y * p.y + z * p.z)
    }

    /// Unit vectors (y, z) along the sides, from the axis outward.
    fn directions(&self) -> [[f64; 2]; 2] {
        let [[a, b], [c, d]] = self.normals;
        [[b, -a], [-d, c]]
    }

    /// Depth of the start of a line below side `k`, and its rate.
    ///
    /// A line in the plane of a side is the limit from larger azimuths, so the plane belongs only to the wedge that it begins; the
    /// axis has azimuth 0.
    fn course(
        &self,
        k: usize,
        origin: &Point3<f64>,
        direction: &Vector3<f64>,
        near: f64,
    ) -> [f64; 2] {
        let [normal, along] = [self.normals[k], self.directions()[k]];
        let forward = if k == 0 { 1.0 } else { -1.0 };
        let dot = |[y, z]: [f64; 2]| {
            [
                y * origin.y + z * origin.z,
                y * direction.y + z * direction.z,
            ]
        };
        let [depth, rate] = dot(normal);
        if rate.abs() > ROUNDING {
            return [depth, rate];
        } else if depth.abs() > near {
            return [depth, 0.0];
        }
        let [depth, rate] = dot(along).map(|v| v * forward);
        if rate.abs() > ROUNDING {
            [depth, rate]
        } else if depth.abs() > near {
            [depth, 0.0]
        } else if normal[0].abs() > ROUNDING {
            [normal[0], 0.0]
        } else {
            [along[0] * forward, 0.0]
        }
    }

    /// Returns the parameters of a line inside the wedge.
    fn interval(
        &self,
        origin: &Point3<f64>,
        direction: &Vector3<f64>,
        near: f64,
    ) -> Option<[f64; 2]> {
        let mut ends = [f64::NEG_INFINITY, f64::INFINITY];
        for k in 0..2 {
            let [depth, rate] = self.course(k, origin, direction, near);
            if rate > 0.0 {
                ends[0] = ends[0].max(-depth / rate);
            } else if rate < 0.0 {
                ends[1] = ends[1].min(-depth / rate);
            } else if depth < 0.0 {
                return None;
            }
        }
        (ends[0] < ends[1]).then_some(ends)
    }

    /// Returns the fractions of the path from p to q (y, z) inside it.
    fn held(&self, p: [f64; 2], q: [f64; 2]) -> Option<[f64; 2]> {
        let [mut low, mut high] = [0.0f64, 1.0];
        for [y, z] in self.normals {
            let (from, to) = (y * p[0] + z * p[1], y * q[0] + z * q[1]);
            if from < 0.0 && to < 0.0 {
                return None;
            } else if from < 0.0 {
                low = low.max(from / (from - to));
            } else if to < 0.0 {
                high = high.min(from / (from - to));
            }
        }
        (low < high).then_some([low, high])
    }

    fn place(&self, cuboid: &Cuboid<'_>) -> Place {
        let (depth, half, steps) = (self.depth(cuboid.centre), cuboid.half, cuboid.axes);
        let mut place = Place::Inside;
        for k in 0..2 {
            let [y, z] = self.normals[k];
            let reach: f64 = (0..3)
                .map(|a| half[a] * (y * steps[a].y + z * steps[a].z).abs())
                .sum();
            if depth[k] <= -reach {
                return Place::Outside;
            }
            if depth[k] < reach {
                place = Place::Cut;
            }
        }
        place
    }
}

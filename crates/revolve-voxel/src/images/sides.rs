//! Outlines of a body and its sectors on the detector.

use nalgebra::Point3;

use crate::Sector;
use crate::images::outline::{Path, turn};
use crate::images::plane::{RayPlane, RayRow};
use crate::rays::assembly::Assembly;
use crate::solid::wedge::Wedge;

/// The outlines of a body with its sectors.
#[derive(Debug, Default)]
pub(super) struct Outlines<'a> {
    paths: Vec<Path<'a>>,
    sides: Vec<Side>,
}

impl<'a> Outlines<'a> {
    /// `least` is the sine of the smallest turn of a corner of a meridian that divides panels.
    pub(super) fn new(assembly: &'a Assembly<'_>, least: f64, with_sectors: bool) -> Self {
        let mut outlines = Self::default();
        if let Some(body) = assembly.body() {
            let new = |layer| Path::new(body, layer, &Wedge::Whole, least);
            outlines.paths.extend(body.layers().iter().map(new));
        }
        for sector in assembly.sectors().filter(|_| with_sectors) {
            let (ring, wedge) = sector.ring();
            let path = Path::new(ring, &ring.layers()[0], wedge, least);
            outlines.paths.push(path);
            outlines.sides.extend(Side::all(sector, least));
        }
        outlines
    }

    /// Appends the positions at which the line integrals along a row are not smooth.
    pub(super) fn add_positions(&self, row: &RayRow, breaks: &mut Vec<f64>) {
        (self.paths.iter()).for_each(|path| path.add_positions(row, breaks));
        (self.sides.iter()).for_each(|side| side.add_positions(row, breaks));
    }

    /// Appends the heights at which the integrals of the rows are not smooth.
    pub(super) fn add_heights(&self, plane: &RayPlane, breaks: &mut Vec<f64>) {
        (self.paths.iter()).for_each(|path| path.add_heights(plane, breaks));
        (self.sides.iter()).for_each(|side| side.add_heights(plane, breaks));
    }
}

/// The edges of a side of a sector: a closed line in the lab. Line integrals have kinks where they cross the rows, and steps where rays are parallel to
/// the side.
#[derive(Debug)]
struct Side {
    /// The last point is the first. Whether a point is a corner.
    points: Vec<(Point3<f64>, bool)>,
}

impl Side {
    /// The sides of a sector; `least` is the sine of the smallest turn of a corner that divides panels.
    fn all(sector: &Sector, least: f64) -> impl Iterator<Item = Self> {
        let ring = &sector.ring().0.layers()[0];
        sector.side_edges().map(move |edges| {
            let corner = |(k, point)| (point, turn(ring, k) > least);
            let mut points: Vec<_> = edges.into_iter().enumerate().map(corner).collect();
            points.extend(points.first().copied());
            Self { points }
        })
    }

    /// Appends the positions at which a row crosses the edges.
    fn add_positions(&self, row: &RayRow, breaks: &mut Vec<f64>) {
        let (position, (normal, distance)) = (row.position(), row.plane());
        let depth = |p: &Point3<f64>| normal.dot(&p.coords) - distance;
        let Some(&(mut from, _)) = self.points.first() else {
            return;
        };
        let mut before = depth(&from);
        for (to, _) in &self.points[1..] {
            let after = depth(to);
            if (before > 0.0) != (after > 0.0) {
                let crossed = from + (to - from) * (before / (before - after));
                breaks.push(position.at(&crossed));
            }
            (from, before) = (*to, after);
        }
    }

    /// Appends the local extrema of the heights of the edges, and the heights of corners.
    fn add_heights(&self, plane: &RayPlane, breaks: &mut Vec<f64>) {
        let height = plane.height();
        let n = self.points.len() - 1;
        let heights: Vec<f64> = self.points.iter().map(|(p, _)| height.at(p)).collect();
        for (k, (_, corner)) in self.points[..n].iter().enumerate() {
            let [before, own, after] = [heights[(k + n - 1) % n], heights[k], heights[k + 1]];
            breaks.extend((*corner || (own > before) != (after > own)).then_some(own));
        }
    }
}

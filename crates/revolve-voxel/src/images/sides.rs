//! Outlines of a body and its sectors on the detector.

use nalgebra::Point3;

use crate::images::outline::Path;
use crate::images::plane::{RayPlane, RayRow};
use crate::rays::assembly::Assembly;

/// Vertices of a sector count as one if they are nearer to each other than the first number times its size, or than the second times the finest scale:
/// regions between meridians of few vertices have jags, and panels between them cost more nodes than they save.
const JAG: [f64; 2] = [1e-3, 0.03];

/// The outlines of a body with its sectors.
#[derive(Debug, Default)]
pub(super) struct Outlines<'a> {
    paths: Vec<Path<'a>>,
    sides: Vec<Side>,
}

impl<'a> Outlines<'a> {
    /// `least` is the sine of the smallest turn of a corner of a meridian that divides panels. Sectors divide them only if `finest`, the scale of
    /// their details that matter, is given.
    pub(super) fn new(assembly: &'a Assembly<'_>, least: f64, finest: Option<f64>) -> Self {
        let mut outlines = Self::default();
        if let Some(body) = assembly.body() {
            let new = |layer| Path::of_layer(body, layer, least);
            outlines.paths.extend(body.layers().iter().map(new));
        }
        let Some(finest) = finest else {
            return outlines;
        };
        for sector in assembly.sectors() {
            let apart = (JAG[0] * sector.ring().0.layers()[0].size()).max(JAG[1] * finest);
            outlines.paths.push(Path::of_sector(sector, least, apart));
            let new = |points| Side { points, least };
            outlines.sides.extend(sector.side_edges(apart).map(new));
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
    points: Vec<Point3<f64>>,
    /// The sine of the smallest turn of a corner.
    least: f64,
}

impl Side {
    /// Appends the positions at which a row crosses the edges.
    fn add_positions(&self, row: &RayRow, breaks: &mut Vec<f64>) {
        let (position, (normal, distance)) = (row.position(), row.plane());
        let depths: Vec<f64> = (self.points.iter())
            .map(|p| normal.dot(&p.coords) - distance)
            .collect();
        let n = depths.len();
        for k in 0..n {
            let (before, after) = (depths[k], depths[(k + 1) % n]);
            if (before > 0.0) != (after > 0.0) {
                let [from, to] = [self.points[k], self.points[(k + 1) % n]];
                let crossed = from + (to - from) * (before / (before - after));
                breaks.push(position.at(&crossed));
            }
        }
    }

    /// Appends the local extrema of the heights of the edges, and the heights of corners.
    fn add_heights(&self, plane: &RayPlane, breaks: &mut Vec<f64>) {
        let height = plane.height();
        let n = self.points.len();
        for k in 0..n {
            let around = [(k + n - 1) % n, k, (k + 1) % n].map(|k| self.points[k]);
            let [a, b, c] = around.map(|p| height.at(&p));
            let [before, after] = [around[1] - around[0], around[2] - around[1]];
            let turn = before.cross(&after).norm() / (before.norm() * after.norm());
            breaks.extend((turn > self.least || (b > a) != (c > b)).then_some(b));
        }
    }
}

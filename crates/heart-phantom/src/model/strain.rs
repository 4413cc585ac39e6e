//! How the material of the wall is deformed from one phase to another.
//!
//! A material point is (u, s, phi): layer, coordinate along the membranes, azimuth. In the cylindrical frame of where it is, (x, r) in the
//! meridian's plane and phi across it, its coordinate lines have the tangents
//!
//! ```text
//! G = [ x_u        x_s        0 ]
//!     [ r_u        r_s        0 ]     tau the twist, subscripts derivatives
//!     [ r tau_u    r tau_s    r ]
//! ```
//!
//! and the deformation gradient from here to there is `F = G_there G_here^-1`, in closed form. All of it is exact: the curves are
//! polynomials, layers follow from cubics ([`revolve_voxel::Shell`]), the twist is piecewise linear.

use super::material::{MaterialPoint, Wall};
use crate::error::PhantomError;
use nalgebra::{Matrix3, Point3, Vector3};
use revolve_voxel::VoxelGrid;
use std::ops::Range;

/// The deformation gradient `F = dx'/dx` of the material about a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deformation {
    /// F from the cylindrical frame here to that there: along the body's axis to the apex, away from it, round it.
    pub gradient: Matrix3<f64>,
    /// The wall's own directions in the frame here, as columns: radial (across the layer, outward), circumferential (with rising
    /// azimuth: counter-clockwise seen from beyond the apex), longitudinal (along the layer, base to apex).
    pub wall: Matrix3<f64>,
}

/// Green's strain `E = (F^T F - 1) / 2` in the wall's own directions at the place that it is counted from.
///
/// Normal components are `(stretch^2 - 1) / 2`, shears half the scalar product of the two deformed directions; with a twist,
/// `circumferential_longitudinal` is the shear of torsion.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct GreenStrain {
    /// Across the layers: thickening is positive.
    pub radial: f64,
    /// Round the axis.
    pub circumferential: f64,
    /// From base to apex.
    pub longitudinal: f64,
    /// Shear between radial and circumferential.
    pub radial_circumferential: f64,
    /// Shear between radial and longitudinal.
    pub radial_longitudinal: f64,
    /// Shear between circumferential and longitudinal.
    pub circumferential_longitudinal: f64,
}

impl Deformation {
    /// Volume there over volume here, det F: 1 for a wall that slides ([`Wall::sliding`]), to rounding and the accuracy with which the
    /// wall's volume is kept.
    pub fn volume(&self) -> f64 {
        // Nothing turns out of the meridian's plane but along the azimuth: expanded by the last column.
        let f = &self.gradient;
        (f[(0, 0)] * f[(1, 1)] - f[(0, 1)] * f[(1, 0)]) * f[(2, 2)]
    }

    /// Green's strain.
    pub fn strain(&self) -> GreenStrain {
        let f = self.gradient * self.wall;
        let e = (f.tr_mul(&f) - Matrix3::identity()) * 0.5;
        GreenStrain {
            radial: e[(0, 0)],
            circumferential: e[(1, 1)],
            longitudinal: e[(2, 2)],
            radial_circumferential: e[(0, 1)],
            radial_longitudinal: e[(0, 2)],
            circumferential_longitudinal: e[(1, 2)],
        }
    }
}

impl GreenStrain {
    /// The names of the components, in the order of [`GreenStrain::components`].
    pub const NAMES: [&'static str; 6] = ["rr", "cc", "ll", "rc", "rl", "cl"];

    /// Radial, circumferential, longitudinal, then the shears rc, rl, cl.
    pub fn components(&self) -> [f64; 6] {
        [
            self.radial,
            self.circumferential,
            self.longitudinal,
            self.radial_circumferential,
            self.radial_longitudinal,
            self.circumferential_longitudinal,
        ]
    }
}

impl Wall {
    /// How the material about a point is deformed from this phase to another. At the apex it is that 5e-7 before it.
    ///
    /// ```
    /// use heart_phantom::{Heart, MaterialPoint, Twist, Wall};
    /// let shapes = Heart::study(201)?.shapes(&[0.0, 0.6])?;
    /// let systole = Wall::new(&shapes[0])?;
    /// let diastole = Wall::sliding(&shapes[1], &systole)?;
    /// let twisted = systole.clone().twisted(Twist::linear([-3.0, 10.0], [-3.0, 10.0])?);
    /// let point = MaterialPoint { layer: 0.5, s: 0.2, azimuth: 1.0 };
    /// let beat = diastole.deformation(&twisted, &point)?;
    /// assert!((beat.volume() - 1.0).abs() < 1e-10); // water does not compress
    /// let strain = beat.strain();
    /// assert!(strain.radial > 0.0 && strain.circumferential < 0.0 && strain.circumferential_longitudinal > 0.0);
    /// # Ok::<(), heart_phantom::PhantomError>(())
    /// ```
    ///
    /// # Errors
    /// As [`Wall::position`].
    pub fn deformation(
        &self,
        to: &Wall,
        point: &MaterialPoint,
    ) -> Result<Deformation, PhantomError> {
        let point = point.checked()?;
        Ok(self.deformed(to, &point))
    }

    /// Green's strain of the material at the centres of the voxels of some slices, from this phase to another: those in the wall with
    /// their numbers among these slices (`[z][y][x]`), rising, and the [components](GreenStrain::components).
    ///
    /// Work grows with the voxels of the wall; the same bits for any number of threads.
    ///
    /// # Errors
    /// As [`Wall::displacements`].
    pub fn strains(
        &self,
        to: &Wall,
        grid: &VoxelGrid,
        slices: Range<usize>,
    ) -> Result<Vec<(usize, [f32; 6])>, PhantomError> {
        let strain = |p: &Point3<f64>, [layer, at]: [f64; 2]| {
            let point = self.material([layer, at], p);
            let strain = self.deformed(to, &point).strain();
            strain.components().map(|e| e as f32)
        };
        let (shell, pose) = self.standing_shell();
        Ok(shell.map_voxels(pose, grid, slices, strain)?)
    }

    fn deformed(&self, to: &Wall, point: &MaterialPoint) -> Deformation {
        let [here, there] = [self, to].map(|wall| wall.tangents(point));
        let [[x_u, r_u, phi_u], [x_s, r_s, phi_s], [_, _, r]] = here;
        // The inverse of the block in the meridian's plane, whose determinant is the element's area.
        let area = x_u * r_s - x_s * r_u;
        let inverse = [[r_s / area, -x_s / area], [-r_u / area, x_u / area]];
        let [u, s, [_, _, r_there]] = there;
        let hoop = r_there / r;
        let mut gradient = Matrix3::zeros();
        for k in 0..2 {
            let by = |row: usize| u[row] * inverse[0][k] + s[row] * inverse[1][k];
            let turned = phi_u * inverse[0][k] + phi_s * inverse[1][k];
            gradient[(0, k)] = by(0);
            gradient[(1, k)] = by(1);
            gradient[(2, k)] = by(2) - hoop * turned;
        }
        gradient[(2, 2)] = hoop;
        let length = x_s.hypot(r_s);
        let (x, r) = (x_s / length, r_s / length);
        Deformation {
            gradient,
            wall: Matrix3::from_columns(&[
                Vector3::new(-r, x, 0.0),
                Vector3::z(),
                Vector3::new(x, r, 0.0),
            ]),
        }
    }
}

//! Deformation and strain of the wall.
//!
//! A material point is (u, s, phi): layer, coordinate along the membranes, azimuth. In its cylindrical frame, (x, r) in the
//! meridian plane and phi perpendicular to it, the tangents of the coordinate lines are
//!
//! ```text
//! G = [ x_u        x_s        0 ]
//!     [ r_u        r_s        0 ]     tau the twist, subscripts derivatives
//!     [ r tau_u    r tau_s    r ]
//! ```
//!
//! and the deformation gradient from this phase to another is `F = G_other G_this^-1`, in closed form: the curves are polynomials,
//! layers are roots of cubics ([`revolve_voxel::Shell`]), and the twist is piecewise linear.

use super::material::{MaterialPoint, Wall};
use crate::error::PhantomError;
use nalgebra::{Matrix3, Point3, Vector3};
use revolve_voxel::VoxelGrid;
use std::ops::Range;

/// The deformation gradient at a material point, in cylindrical frames about the axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deformation {
    /// `F = dx'/dx`, from the cylindrical frame of the point at the first phase to that of its place at the second: axial (towards the apex), radial,
    /// circumferential. The Cartesian gradient is `Q' F Q^T` with these directions as columns of Q and Q'. The determinant, the ratio of volumes,
    /// is 1 for a sliding wall ([`Wall::sliding_from`]), to the accuracy of the wall volume.
    pub gradient: Matrix3<f64>,
    /// The directions of the wall in the initial frame, as columns: radial (across the layer, outward), circumferential
    /// (counter-clockwise seen from beyond the apex), longitudinal (along the layer, base to apex).
    pub wall: Matrix3<f64>,
}

/// Green's strain `E = (F^T F - 1) / 2` in the directions of the wall at the initial phase.
///
/// Normal components are `(stretch^2 - 1) / 2`, shears half the scalar product of the two deformed directions. With a twist
/// `circumferential_longitudinal` is the shear of torsion.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct GreenStrain {
    /// Radial: thickening is positive.
    pub radial: f64,
    /// Circumferential.
    pub circumferential: f64,
    /// Longitudinal.
    pub longitudinal: f64,
    /// Shear between radial and circumferential.
    pub radial_circumferential: f64,
    /// Shear between radial and longitudinal.
    pub radial_longitudinal: f64,
    /// Shear between circumferential and longitudinal.
    pub circumferential_longitudinal: f64,
}

impl Deformation {
    /// Returns Green's strain.
    #[must_use]
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
    /// Names of the components, in the order of [`GreenStrain::components`].
    pub const NAMES: [&'static str; 6] = ["rr", "cc", "ll", "rc", "rl", "cl"];

    /// Returns the components: radial, circumferential, longitudinal, then the shears rc, rl, cl.
    #[must_use]
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
    /// Returns the deformation of the material at a point from this phase to another. At the apex it is that at a distance of 5e-7
    /// in s.
    ///
    /// ```
    /// use heart_phantom::{Heart, MaterialPoint, Twist, Wall};
    /// let heart = Heart::study(201)?;
    /// let shapes = heart.shapes(&[0.0, 0.6])?;
    /// let wall = |k: usize| Wall::new(shapes[k].solution(), *heart.pose());
    /// let (systole, diastole) = (wall(0)?, wall(1)?.sliding_from(&wall(0)?));
    /// let twisted = systole.clone().twisted(Twist { inner_degrees: vec![-3.0, 10.0], outer_degrees: vec![-3.0, 10.0] });
    /// let point = MaterialPoint { layer: 0.5, s: 0.2, azimuth: 1.0 };
    /// let beat = diastole.deformation(&twisted, &point)?;
    /// assert!((beat.gradient.determinant() - 1.0).abs() < 1e-10); // the wall is incompressible
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

    /// Returns Green's strain from this phase to another at the centres of the voxels of some slices. Only voxels in the wall are
    /// returned, with their indices among these slices (`[z][y][x]`), ascending, and the [components](GreenStrain::components).
    ///
    /// Cost: proportional to the number of voxels in the wall. Bitwise independent of the number of threads.
    ///
    /// # Errors
    /// As [`Wall::displacements`].
    pub fn strains(
        &self,
        to: &Wall,
        grid: &VoxelGrid,
        slices: Range<usize>,
    ) -> Result<Vec<(usize, [f32; 6])>, PhantomError> {
        let strain = |p: &Point3<f64>, [layer, at]: [f64; 2], _| {
            let point = self.material([layer, at], p);
            let strain = self.deformed(to, &point).strain();
            strain.components().map(|e| e as f32)
        };
        let (shell, pose) = self.placed_shell();
        Ok(shell.map_voxels(pose, grid, slices, 0.0, strain)?)
    }

    fn deformed(&self, to: &Wall, point: &MaterialPoint) -> Deformation {
        let [here, there] = [self, to].map(|wall| wall.tangents(point));
        let [[x_u, r_u, phi_u], [x_s, r_s, phi_s], [_, _, r]] = here;
        // The inverse of the block in the meridian plane; its determinant is the area of the element.
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

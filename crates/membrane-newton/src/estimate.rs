//! The estimated error of the discretisation.

use std::f64::consts::PI;

use membrane_forces::{CurvePiece, Material, Measures};

use crate::constraint::Control;
use crate::equilibrium::Equilibrium;
use crate::options::NewtonOptions;
use crate::solver::{Discretisation, Solver};

/// Factor on the estimated error of finite differences, which is known at the nodes of the polynomials only.
const SAFETY: f64 = 2.0;
/// Polynomials that estimate it.
const ESTIMATE: Discretisation = Discretisation::Spectral {
    degree: 20,
    per_piece: 2,
};
/// Sine of the angle between tangents above which they have a corner.
const CORNER: f64 = 1e-6;

impl Equilibrium {
    /// Estimated relative error of the discretisation, of shape and intensity at this volume.
    ///
    /// For polynomials the error of the shape is the spectral tail, which is twice the degree p times the last two Chebyshev coefficients of the
    /// curve over its length (the largest of any element), or, if larger, the mean relative error of the polynomials through the stiffness or
    /// thickness (at four points per node; narrower features remain unseen), or the rounding of the derivative matrices, the sum of
    /// epsilon p^2 (p + 1 / (4 l)) over the elements of the whole curve, whose material coordinates have the lengths l.
    /// [`Discretisation::SpectralAdaptive`](crate::Discretisation) refines until the tail is within the tolerance. The rounding grows with the degree
    /// and with the square of the number of elements: a finer discretisation than necessary is less accurate. A small intensity f has a larger
    /// relative error, about that of the shape divided by the displacement: the tail times S L |df / dV| / (2 pi |f|), with volume V, surface S
    /// and length L ([`Equilibrium::sensitivity`]). The result is the larger of the two errors, without load that of the shape; for springs it is
    /// multiplied by the square of the ratio of the largest to the smallest stiffness. With the default tolerances, the stated error of the
    /// equilibrium is the sum of this number and of [`NewtonReport::iteration_error`](crate::NewtonReport::iteration_error), whose norm differs. This
    /// is an estimate: of 3000 stiffnesses with two Gaussian bumps of widths 0.03 to 0.5 the intensity of 38 had a larger error, by up to a factor of
    /// 2.3, the shape of none.
    ///
    /// For finite differences it is twice the difference from the equilibrium of polynomials at the same volume (degree 20, two elements on each
    /// smooth piece) and the error of these, at the cost of [`Solver::solve_from`]: twice the error, and more where that of the curve is larger
    /// between the nodes. Where the stiffness jumps, that position must be a breakpoint. The curve has a kink there. Beside it the error between
    /// the nodes is of first order, and may exceed the estimate of many nodes: by up to 41 times at 4001 nodes in a disc whose stiffness jumps by a
    /// factor of 2.5.
    ///
    /// `None` where that solve fails or the volume is at a limit, and for finite differences of a negative volume or of rubber whose reference
    /// configuration has corners, which the polynomials do not resolve.
    #[must_use]
    pub fn discretisation_error(&self) -> Option<f64> {
        let Some(tail) = self.resolution.tail(self.nodes()) else {
            return self.error_of_differences();
        };
        let rounding = self.pieces().into_iter().map(|piece| {
            let p = piece.x.len() as f64 - 1.0;
            p * p * (p + 0.25 / (piece.to - piece.from))
        });
        let shape = tail.max(f64::EPSILON * rounding.sum::<f64>());
        if self.intensity == 0.0 {
            return Some(shape);
        }
        let slope = self.sensitivity(Control::Volume(self.measures.volume));
        let relative = slope.ok()?.intensity / self.intensity;
        let Measures {
            surface, length, ..
        } = self.measures;
        let displaced = (relative.abs() * surface * length / (2.0 * PI)).max(1.0);
        Some(shape * displaced * self.resolution.profile.contrast.powi(2))
    }

    fn error_of_differences(&self) -> Option<f64> {
        let exact = Solver::new(self.membrane(), ESTIMATE).ok()?;
        let corner = |pieces: &[CurvePiece]| {
            let ends = [pieces[0].at(pieces[0].to), pieces[1].at(pieces[1].from)];
            let [a, b] = ends.map(|end| end.first[1].atan2(end.first[0]));
            (a - b).sin().abs() > CORNER
        };
        let is_rubber = matches!(self.membrane().material(), Material::Rubber(_));
        if is_rubber && exact.start().pieces().windows(2).any(corner) {
            return None;
        }
        let control = match self.intensity {
            0.0 => Control::Load(0.0),
            _ => Control::Volume(self.measures.volume),
        };
        let exact = exact
            .solve_from(self, control, &NewtonOptions::default())
            .ok()?;
        let (resolution, state) = (&exact.resolution, &exact.state);
        let own = resolution.carry(&self.resolution, &self.state);
        let change: Vec<f64> = own.iter().zip(state).map(|(a, b)| a - b).collect();
        // not a number without load
        let intensity = (change.last()? / state.last()?).abs();
        let system = resolution.system(resolution.constraint(control).ok()?);
        let error = SAFETY * system.shape_norm(&change).max(intensity);
        // without load the polynomials are exact at their nodes
        let unknown = match self.intensity {
            0.0 => 0.0,
            _ => exact.discretisation_error()?,
        };
        let error = error + unknown;
        error.is_finite().then_some(error)
    }
}

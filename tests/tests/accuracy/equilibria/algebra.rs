//! Equations whose root is known: a random matrix times products of the distance from the root.

use membrane_newton::{
    LineSearch, NewtonError, NewtonOptions, NewtonReport, Refactor, ResidualSystem, StopReason,
    newton,
};
use nalgebra::{DMatrix, DVector, Dyn, LU};
use tests::Random;

/// A (d + bend d d) = 0 with d = (x - root) / scale.
struct Equations {
    matrix: DMatrix<f64>,
    root: DVector<f64>,
    bend: f64,
    scale: f64,
    lu: Option<LU<f64, Dyn, Dyn>>,
}

impl Equations {
    fn random(random: &mut Random) -> (Self, Vec<f64>) {
        let n = random.integer(1, 12);
        let scale = random.decades(-3.0, 3.0);
        let mut entry = || random.uniform(-1.0, 1.0);
        let mut matrix = DMatrix::from_fn(n, n, |_, _| entry());
        for k in 0..n {
            matrix[(k, k)] += n as f64;
        }
        let root = DVector::from_fn(n, |_, _| scale * random.uniform(-1.0, 1.0));
        let away = random.uniform(0.05, 0.8);
        let start = root
            .iter()
            .map(|x| x + scale * away * random.uniform(-1.0, 1.0));
        let start = start.collect();
        let bend = random.uniform(-1.0, 1.0);
        let lu = None;
        (
            Self {
                matrix,
                root,
                bend,
                scale,
                lu,
            },
            start,
        )
    }

    /// Distance from the root, over the scale.
    fn off(&self, x: &[f64]) -> DVector<f64> {
        (DVector::from_column_slice(x) - &self.root) / self.scale
    }
}

impl ResidualSystem for Equations {
    fn len(&self) -> usize {
        self.root.len()
    }

    fn residual_into(&mut self, x: &[f64], out: &mut [f64]) -> Result<(), NewtonError> {
        let d = self.off(x);
        let r = &self.matrix * d.map(|d| d + self.bend * d * d);
        out.copy_from_slice(r.as_slice());
        Ok(())
    }

    fn factor(&mut self, x: &[f64]) -> Result<(), NewtonError> {
        let slope = self
            .off(x)
            .map(|d| (1.0 + 2.0 * self.bend * d) / self.scale);
        self.lu = Some((&self.matrix * DMatrix::from_diagonal(&slope)).lu());
        Ok(())
    }

    fn solve_in_place(&mut self, rhs: &mut [f64]) -> Result<(), NewtonError> {
        let lu = self.lu.as_ref().ok_or(NewtonError::NotFactored)?;
        let pivot = 0.0;
        let x = lu.solve(&DVector::from_column_slice(rhs));
        rhs.copy_from_slice(x.ok_or(NewtonError::Singular { row: 0, pivot })?.as_slice());
        Ok(())
    }

    fn residual_norm(&self, residual: &[f64]) -> f64 {
        residual.iter().fold(0.0, |m: f64, r| m.max(r.abs()))
    }

    fn step_norm(&self, step: &[f64]) -> f64 {
        step.iter().fold(0.0, |m: f64, s| m.max(s.abs())) / self.scale
    }
}

fn options(random: &mut Random) -> NewtonOptions {
    let options = match random.integer(0, 2) {
        0 => NewtonOptions::default(),
        1 => NewtonOptions::default().with_line_search(LineSearch::FullStep),
        _ => NewtonOptions::default().with_refactor(Refactor::WhenContractionAbove(0.05)),
    };
    options.with_max_iterations(60)
}

/// Rounding of a root of order one.
const ROUNDING: f64 = 1e-14;

/// The equations, the report, and the error over the scale.
fn solved(
    random: &mut Random,
    tolerances: [f64; 2],
) -> Option<(Equations, Vec<f64>, NewtonReport)> {
    let (mut equations, mut x) = Equations::random(random);
    let options = options(random).with_tolerances(tolerances[0], tolerances[1]);
    let report = newton(&mut equations, &mut x, &options).ok()?;
    // d = -1 / bend is a root, too
    let other = equations.off(&x).amax() > 0.5;
    (!other).then_some((equations, x, report))
}

pub(super) fn estimate(random: &mut Random) -> Option<f64> {
    let tolerances = [random.decades(-14.0, -1.0), random.decades(-14.0, -1.0)];
    let (equations, x, report) = solved(random, tolerances)?;
    Some(equations.off(&x).amax() / (report.iteration_error + ROUNDING))
}

pub(super) fn step(random: &mut Random) -> Option<f64> {
    let tolerance = random.decades(-12.0, -1.0);
    let (equations, x, report) = solved(random, [0.0, tolerance])?;
    (report.stopped_by == Some(StopReason::Step))
        .then(|| equations.off(&x).amax() / (tolerance + ROUNDING))
}

pub(super) fn residual(random: &mut Random) -> Option<f64> {
    let tolerance = random.decades(-12.0, -1.0);
    let (equations, x, _) = solved(random, [tolerance, 0.0])?;
    // d (1 + bend d) instead of d + bend d d
    let d = equations.off(&x);
    let size = (&equations.matrix * d.map(|d| d * (1.0 + equations.bend * d))).amax();
    Some(size / (tolerance + ROUNDING))
}

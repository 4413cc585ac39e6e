//! Equilibrium and control as one system: the shape and its force intensity.

use membrane_forces::{DiscreteMembrane, Measure, Measures, MembraneError};

use crate::border::Border;
use crate::constraint::Constraint;
use crate::error::{NewtonError, Result, own};
use crate::factors::Factors;
use crate::route::Route;
use crate::turning::{Reach, turned, turning};

/// F(c, f) = 0 and g(c, f) = 0 for the unknowns (c, f), f last.
pub(crate) struct Block<'a> {
    discrete: &'a dyn DiscreteMembrane,
    route: Route,
    pub(crate) constraint: Constraint,
    factors: Factors,
    border: Border,
    elastic: Vec<f64>,
    blow_up: f64,
    start: Measures,
    /// Scales that make numbers dimensionless: length of the start, largest lambda.
    length_scale: f64,
    stiffness_scale: f64,
    /// Scales of shape and intensity for the size of steps.
    size: (f64, f64),
    /// Smallest tension in tangents of rubber, over its shear modulus; minus infinity for exact tangents.
    least: f64,
    /// Signs of the determinant at the first and at the last factorisation, 0 before.
    signs: (f64, f64),
}

impl<'a> Block<'a> {
    pub(crate) fn new(
        discrete: &'a dyn DiscreteMembrane,
        start: Measures,
        constraint: Constraint,
    ) -> Self {
        let length_scale = start.length;
        let n = discrete.start().len();
        let stiffness_scale = discrete.stiffness_scale();
        Self {
            discrete,
            route: Route::of(discrete),
            constraint,
            factors: Factors::new(discrete),
            border: Border::new(n),
            elastic: vec![0.0; n],
            blow_up: discrete.blow_up(),
            start,
            length_scale,
            stiffness_scale,
            size: (length_scale, stiffness_scale),
            least: f64::NEG_INFINITY,
            signs: (0.0, 0.0),
        }
    }

    /// Limits the tension in later tangents of rubber from below.
    pub(crate) fn set_least_tension(&mut self, least: f64) {
        self.least = least;
    }

    /// Defines the branch of rubber by its start: stable at a constant value of the prescribed quantity.
    ///
    /// The energy is then a minimum, K negative definite among moving nodes, and the border of a volume, -g.K^-1 g, or of an
    /// intensity, 1, positive.
    pub(crate) fn expect_stable(&mut self) {
        match self.route {
            Route::Raise => (),
            Route::Inflate => {
                let free = self.elastic.len() - self.discrete.fixed().len();
                let sign = if free.is_multiple_of(2) { 1.0 } else { -1.0 };
                self.signs = (sign, sign);
            }
        }
    }

    /// Returns the least tension of rubber in this state, over its shear modulus; infinite where it is not defined.
    pub(crate) fn least_tension(&self, nodes: &[f64]) -> f64 {
        self.discrete.least_tension(nodes).unwrap_or(f64::INFINITY)
    }

    /// Returns the route from the start.
    pub(crate) fn route(&self) -> Route {
        self.route
    }

    /// Measures of the start.
    pub(crate) fn start(&self) -> &Measures {
        &self.start
    }

    fn measure(&self, measure: Measure, nodes: &[f64]) -> f64 {
        own(self.discrete.measure(measure, nodes))
    }

    pub(crate) fn volume(&self, nodes: &[f64]) -> f64 {
        self.measure(Measure::Volume, nodes)
    }

    pub(crate) fn volume_gradient_into(&self, nodes: &[f64], out: &mut [f64]) {
        self.discrete
            .measure_gradient_into(Measure::Volume, nodes, out);
    }

    /// Returns the prescribed quantity in state `x`.
    pub(crate) fn constrained_value(&self, x: &[f64]) -> f64 {
        let (f, nodes) = (x[x.len() - 1], &x[..x.len() - 1]);
        match self.constraint {
            Constraint::Intensity(_) => f,
            Constraint::TotalForce(_) => f * self.measure(Measure::Surface, nodes),
            Constraint::Measure(measure, _) => self.measure(measure, nodes),
        }
    }

    fn force_scale(&self) -> f64 {
        self.stiffness_scale * self.length_scale
    }

    /// Intensity that moves the membrane by about its length.
    fn intensity_scale(&self) -> f64 {
        self.discrete.intensity_scale(self.length_scale)
    }

    /// Returns the scale of changes of the intensity: the prescribed intensity, however small, or that which moves the membrane by its
    /// length.
    fn intensity_size(&self, x: &[f64]) -> f64 {
        let (f, nodes) = (x[x.len() - 1], &x[..x.len() - 1]);
        match self.constraint {
            Constraint::Intensity(wanted) if wanted != 0.0 => wanted.abs(),
            Constraint::TotalForce(wanted) if wanted != 0.0 => {
                (wanted / self.measure(Measure::Surface, nodes)).abs()
            }
            _ => self.intensity_scale().max(f.abs()),
        }
    }

    /// Returns the scale of the prescribed value: its magnitude, at most that which moves the membrane by its length, so that small loads
    /// and slender bodies have the same relative accuracy.
    fn constraint_size(&self) -> f64 {
        let (wanted, scale) = (self.constraint.value().abs(), self.constraint_scale());
        if wanted > 0.0 {
            wanted.min(scale)
        } else {
            scale
        }
    }

    /// Returns the scale of the border equation, so that all equations have equal weight.
    fn constraint_scale(&self) -> f64 {
        let l = self.length_scale;
        match self.constraint {
            Constraint::Intensity(_) => self.intensity_scale(),
            Constraint::TotalForce(_) => self.intensity_scale() * l * l,
            Constraint::Measure(Measure::Length, _) => l,
            Constraint::Measure(Measure::Area | Measure::Surface, _) => l * l,
            Constraint::Measure(Measure::Volume, _) => l * l * l,
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.elastic.len() + 1
    }

    pub(crate) fn residual_into(&mut self, x: &[f64], out: &mut [f64]) -> Result<()> {
        let n = self.elastic.len();
        let (nodes, f) = (&x[..n], x[n]);
        if f.abs() >= self.blow_up {
            // beyond it there are solutions on a branch that no inflation reaches
            return Err(MembraneError::PastBlowUp {
                pressure: f,
                limit: self.blow_up,
            }
            .into());
        }
        let forces = &mut out[..n];
        let volume = (self.discrete).forces_into(nodes, f, &mut self.elastic, forces)?;
        let value = match (self.constraint, volume) {
            (Constraint::Measure(Measure::Volume, _), Some(volume)) => volume,
            _ => self.constrained_value(x),
        };
        out[n] = value - self.constraint.value();
        Ok(())
    }

    pub(crate) fn factor(&mut self, x: &[f64]) -> Result<()> {
        let n = self.elastic.len();
        let (nodes, f) = (&x[..n], x[n]);
        self.size = (
            self.length_scale.max(max_abs(nodes)),
            self.intensity_size(x),
        );
        let Self {
            discrete,
            route,
            factors,
            border,
            ..
        } = self;
        let sign = factors.factor(*discrete, nodes, (f, self.least))?;
        discrete.pressure_force_into(nodes, 1.0, border.column_mut())?;
        let (column, row) = border.column_and_row_mut();
        let corner = match self.constraint {
            Constraint::Intensity(_) => {
                row.fill(0.0);
                1.0
            }
            Constraint::TotalForce(_) => {
                discrete.measure_gradient_into(Measure::Surface, nodes, row);
                row.iter_mut().for_each(|g| *g *= f);
                discrete.measure(Measure::Surface, nodes)?
            }
            Constraint::Measure(measure, _) => {
                match (*route, measure) {
                    // the pressure is conjugate to the volume
                    (Route::Inflate, Measure::Volume) => row.copy_from_slice(column),
                    (Route::Inflate, Measure::Length | Measure::Area | Measure::Surface)
                    | (Route::Raise, _) => discrete.measure_gradient_into(measure, nodes, row),
                }
                0.0
            }
        };
        let border = border.eliminate(corner, |column| factors.solve_in_place(column))?;
        self.signs.1 = sign * border.sign();
        if self.signs.0 == 0.0 {
            self.signs.0 = self.signs.1;
        }
        Ok(())
    }

    pub(crate) fn solve_in_place(&mut self, rhs: &mut [f64]) -> Result<()> {
        let border = self.border.elimination().ok_or(NewtonError::NotFactored)?;
        let (head, tail) = rhs.split_at_mut(self.elastic.len());
        self.factors.solve_in_place(head)?;
        tail[0] = border.correct(head, tail[0])?;
        Ok(())
    }

    pub(crate) fn residual_norm(&self, residual: &[f64]) -> f64 {
        let n = self.elastic.len();
        let forces = residual[..n]
            .as_chunks::<2>()
            .0
            .iter()
            .map(|r| r[0].hypot(r[1]))
            .fold(0.0, nan_max);
        nan_max(
            forces / self.force_scale(),
            residual[n].abs() / self.constraint_size(),
        )
    }

    pub(crate) fn step_norm(&self, step: &[f64]) -> f64 {
        let n = self.elastic.len();
        nan_max(
            max_abs(&step[..n]) / self.size.0,
            step[n].abs() / self.size.1,
        )
    }

    pub(crate) fn set_control(&mut self, value: f64) {
        self.constraint = self.constraint.with_value(value);
        self.signs.1 = self.signs.0;
    }

    pub(crate) fn misses(&self, x: &[f64]) -> f64 {
        let wanted = self.constraint.value();
        (self.constrained_value(x) - wanted).abs()
            / wanted.abs().max(0.01 * self.constraint_scale())
    }

    pub(crate) fn keeps_sign(&self) -> bool {
        self.signs.0 == self.signs.1
    }

    pub(crate) fn within(&self, reach: Reach, from: &[f64], to: &[f64]) -> bool {
        let n = self.elastic.len();
        // Total turning angle of the curve in both states.
        let copies = if self.discrete.is_half() { 2.0 } else { 1.0 };
        let before = copies * turning(&from[..n]);
        reach.allows([before, before + copies * turned(&from[..n], &to[..n])])
    }

    pub(crate) fn shape_norm(&self, change: &[f64]) -> f64 {
        max_abs(&change[..self.elastic.len()]) / self.size.0
    }
}

fn max_abs(v: &[f64]) -> f64 {
    v.iter().fold(0.0, |m, v| nan_max(m, v.abs()))
}

/// The larger of the two, NaN if either is.
pub(crate) fn nan_max(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() {
        f64::NAN
    } else {
        a.max(b)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use membrane_forces::{
        FiniteDifferences, Membrane, ReferenceShape, SpectralElements, Stiffness,
    };
    use nalgebra::{DMatrix, DVector};

    use crate::resolution::Resolution;

    /// The matrix of the whole system by central differences of its residual, then a dense LU: shares no code with tangents, elimination or
    /// border.
    #[test]
    fn solves_equal_a_dense_lu_of_differences() {
        let membrane = |skew: f64| {
            Membrane::new(ReferenceShape::balloon(8.5, 1.75).unwrap())
                .with_stiffness(Stiffness::function(move |s| 1.0 + skew * s, &[]).unwrap())
                .with_second_neighbours(Stiffness::constant(0.1).unwrap())
        };
        for skew in [0.5, 0.0] {
            for resolution in [
                Resolution::new(FiniteDifferences::half(&membrane(skew), 20).unwrap(), None),
                Resolution::new(FiniteDifferences::half(&membrane(skew), 21).unwrap(), None),
                Resolution::new(SpectralElements::new(&membrane(skew), 6, 1).unwrap(), None),
            ] {
                let resolution = resolution.unwrap();
                for constraint in [
                    Constraint::Intensity(5.0),
                    Constraint::TotalForce(300.0),
                    Constraint::Measure(Measure::Volume, 120.0),
                    Constraint::Measure(Measure::Area, 40.0),
                ] {
                    let mut system = resolution.system(constraint);
                    let n = system.len();
                    let mut x = resolution.start_state();
                    let moved = |(i, x): (usize, &mut f64)| *x += 0.1 * (i as f64 * 0.4).sin();
                    x.iter_mut().enumerate().for_each(moved);
                    let held = resolution.discrete.fixed();
                    held.iter()
                        .for_each(|&k| x[k] = resolution.discrete.start()[k]);
                    x[n - 1] = 6.0;
                    let mut residual = |x: &[f64]| {
                        let mut out = vec![0.0; n];
                        system.residual_into(x, &mut out).unwrap();
                        DVector::from_vec(out)
                    };
                    let mut matrix = DMatrix::zeros(n, n);
                    for j in 0..n {
                        let step = 1e-5;
                        let mut moved = |sign: f64| {
                            let mut x = x.clone();
                            x[j] += sign * step;
                            residual(&x)
                        };
                        let column = (moved(1.0) - moved(-1.0)) / (2.0 * step);
                        matrix.set_column(j, &column);
                    }
                    // a fixed coordinate does not move: its force and its part of the column are zero
                    let mut b = DVector::from_fn(n, |i, _| (i as f64 * 0.9).cos());
                    for &row in held {
                        matrix.row_mut(row).fill(0.0);
                        matrix[(row, row)] = 1.0;
                        b[row] = 0.0;
                    }
                    let dense = matrix.lu().solve(&b).unwrap();
                    let mut solved = b.as_slice().to_vec();
                    let unfactored = system.solve_in_place(&mut solved.clone());
                    assert_eq!(unfactored, Err(NewtonError::NotFactored));
                    system.factor(&x).unwrap();
                    system.solve_in_place(&mut solved).unwrap();
                    let off = (&dense - DVector::from_vec(solved)).amax() / dense.amax();
                    // differences at 1e-5 are accurate to about 1e-9, times the condition number
                    assert!(
                        off < 1e-6,
                        "skew {skew}, {n} unknowns, {constraint:?}: {off:e}"
                    );
                }
            }
        }
    }
}

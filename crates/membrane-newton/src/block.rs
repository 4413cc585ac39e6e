//! Equilibrium and control as one system: the shape and its force intensity.

use membrane_forces::{DiscreteMembrane, Measure, Measures, MembraneError};

use crate::border::Border;
use crate::constraint::{Constraint, Quantity};
use crate::error::{Result, own};
use crate::factors::Factors;
use crate::route::Route;
use crate::turning::{Reach, turned, turning};

/// F(c, f) = 0 and g(c, f) = 0 for the unknowns (c, f), f last.
pub(crate) struct Block<'a> {
    discrete: &'a dyn DiscreteMembrane,
    pub(crate) route: Route,
    pub(crate) constraint: Constraint,
    factors: Factors,
    border: Border,
    elastic: Vec<f64>,
    /// Measures of the start, whose length is the scale of lengths.
    pub(crate) start: Measures,
    /// Scales of shape and intensity for the size of steps.
    size: (f64, f64),
    /// Smallest tension in tangents of rubber, over its shear modulus; minus infinity for exact tangents.
    pub(crate) least_tension: f64,
    /// Signs of the determinant at the first and at the last factorisation, 0 before.
    signs: (f64, f64),
}

impl<'a> Block<'a> {
    pub(crate) fn new(
        discrete: &'a dyn DiscreteMembrane,
        start: Measures,
        constraint: Constraint,
    ) -> Self {
        let n = discrete.start().len();
        Self {
            discrete,
            route: Route::of(discrete),
            constraint,
            factors: Factors::new(discrete),
            border: Border::new(n),
            elastic: vec![0.0; n],
            start,
            size: (start.length, discrete.stiffness_scale()),
            least_tension: f64::NEG_INFINITY,
            signs: (0.0, 0.0),
        }
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

    /// Returns the least tension of rubber in state `x`, over its shear modulus; infinite where it is not defined.
    pub(crate) fn tension(&self, x: &[f64]) -> f64 {
        let tension = self.discrete.least_tension(&x[..self.elastic.len()]);
        tension.unwrap_or(f64::INFINITY)
    }

    pub(crate) fn volume(&self, x: &[f64]) -> f64 {
        Quantity::VOLUME.of(self.discrete, x)
    }

    pub(crate) fn volume_gradient_into(&self, x: &[f64], out: &mut [f64]) {
        let nodes = &x[..self.elastic.len()];
        (self.discrete).measure_gradient_into(Measure::Volume, nodes, out);
    }

    /// Returns the prescribed quantity in state `x`.
    pub(crate) fn constrained_value(&self, x: &[f64]) -> f64 {
        self.constraint.quantity.of(self.discrete, x)
    }

    /// Intensity that moves the membrane by about its length.
    fn intensity_scale(&self) -> f64 {
        self.discrete.intensity_scale(self.start.length)
    }

    /// Returns the scale of changes of the intensity: the prescribed intensity, however small, or that which moves the membrane by its
    /// length.
    fn intensity_size(&self, x: &[f64]) -> f64 {
        let Constraint { quantity, value } = self.constraint;
        let (f, nodes) = (x[x.len() - 1], &x[..x.len() - 1]);
        match quantity {
            Quantity::Intensity if value != 0.0 => value.abs(),
            Quantity::TotalForce if value != 0.0 => {
                (value / own(self.discrete.measure(Measure::Surface, nodes))).abs()
            }
            _ => self.intensity_scale().max(f.abs()),
        }
    }

    /// Returns the scale of the prescribed value: its magnitude, at most that which moves the membrane by its length, so that small loads
    /// and slender bodies have the same relative accuracy.
    fn constraint_size(&self) -> f64 {
        let (wanted, scale) = (self.constraint.value.abs(), self.constraint_scale());
        if wanted > 0.0 {
            wanted.min(scale)
        } else {
            scale
        }
    }

    /// Returns the scale of the border equation, so that all equations have equal weight.
    fn constraint_scale(&self) -> f64 {
        let l = self.start.length;
        match self.constraint.quantity {
            Quantity::Intensity => self.intensity_scale(),
            Quantity::TotalForce => self.intensity_scale() * l * l,
            Quantity::Measure(Measure::Length) => l,
            Quantity::Measure(Measure::Area | Measure::Surface) => l * l,
            Quantity::Measure(Measure::Volume) => l * l * l,
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.elastic.len() + 1
    }

    pub(crate) fn residual_into(&mut self, x: &[f64], out: &mut [f64]) -> Result<()> {
        let n = self.elastic.len();
        let (nodes, pressure, limit) = (&x[..n], x[n], self.discrete.blow_up());
        if pressure.abs() >= limit {
            // beyond it there are solutions on a branch that no inflation reaches
            return Err(MembraneError::PastBlowUp { pressure, limit }.into());
        }
        let forces = &mut out[..n];
        let volume = (self.discrete).forces_into(nodes, pressure, &mut self.elastic, forces)?;
        let value = match (self.constraint.quantity, volume) {
            (Quantity::VOLUME, Some(volume)) => volume,
            _ => self.constrained_value(x),
        };
        out[n] = value - self.constraint.value;
        Ok(())
    }

    pub(crate) fn factor(&mut self, x: &[f64]) -> Result<()> {
        let n = self.elastic.len();
        let (nodes, f) = (&x[..n], x[n]);
        self.size = (
            self.start.length.max(max_abs(nodes)),
            self.intensity_size(x),
        );
        let (discrete, factors, border) = (self.discrete, &mut self.factors, &mut self.border);
        let sign = factors.factor(discrete, nodes, (f, self.least_tension))?;
        let (column, row) = border.column_and_row_mut();
        discrete.pressure_force_into(nodes, 1.0, column)?;
        let corner = match (self.constraint.quantity, self.route) {
            (Quantity::Intensity, _) => {
                row.fill(0.0);
                1.0
            }
            (Quantity::TotalForce, _) => {
                discrete.measure_gradient_into(Measure::Surface, nodes, row);
                row.iter_mut().for_each(|g| *g *= f);
                discrete.measure(Measure::Surface, nodes)?
            }
            (Quantity::VOLUME, Route::Inflate) => {
                // the pressure is conjugate to the volume
                row.copy_from_slice(column);
                0.0
            }
            (Quantity::Measure(measure), _) => {
                discrete.measure_gradient_into(measure, nodes, row);
                0.0
            }
        };
        border.eliminate(corner, |column| factors.solve_in_place(column))?;
        self.signs.1 = sign * border.sign();
        if self.signs.0 == 0.0 {
            self.signs.0 = self.signs.1;
        }
        Ok(())
    }

    pub(crate) fn solve_in_place(&mut self, rhs: &mut [f64]) -> Result<()> {
        let (head, tail) = rhs.split_at_mut(self.elastic.len());
        self.factors.solve_in_place(head)?;
        tail[0] = self.border.correct(head, tail[0])?;
        Ok(())
    }

    pub(crate) fn residual_norm(&self, residual: &[f64]) -> f64 {
        let n = self.elastic.len();
        let forces = residual[..n].as_chunks::<2>().0.iter();
        let force = forces.map(|r| r[0].hypot(r[1])).fold(0.0, nan_max);
        nan_max(
            force / (self.discrete.stiffness_scale() * self.start.length),
            residual[n].abs() / self.constraint_size(),
        )
    }

    pub(crate) fn step_norm(&self, step: &[f64]) -> f64 {
        let intensity = step[self.elastic.len()].abs() / self.size.1;
        nan_max(self.shape_norm(step), intensity)
    }

    pub(crate) fn shape_norm(&self, change: &[f64]) -> f64 {
        max_abs(&change[..self.elastic.len()]) / self.size.0
    }

    pub(crate) fn set_control(&mut self, value: f64) {
        self.constraint.value = value;
        self.signs.1 = self.signs.0;
    }

    pub(crate) fn misses(&self, x: &[f64]) -> f64 {
        let wanted = self.constraint.value;
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

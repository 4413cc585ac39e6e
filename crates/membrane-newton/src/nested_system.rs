//! One system of equations for nested membranes, with walls of constant volume between them.

use std::ops::Range;

use crate::block::{Block, nan_max};
use crate::border::dot;
use crate::constraint::Constraint;
use crate::error::Result;
use crate::newton::ResidualSystem;
use crate::route::Route;
use crate::turning::Reach;

/// Unknowns (c, f) of each membrane from the inside out, with one prescribed number, the control of the innermost.
///
/// The border equation of every other membrane, V - V of the next inner one = wall volume, couples it to that one in one direction.
pub(crate) struct NestedSystem<'a> {
    membranes: Vec<Block<'a>>,
    /// Ranges of the unknowns of each membrane.
    places: Vec<Range<usize>>,
    wall_volumes: Vec<f64>,
    /// dV/dc of the membranes inside another one.
    volume_rows: Vec<Vec<f64>>,
}

impl<'a> NestedSystem<'a> {
    /// `wall_volumes`: between each membrane and the next.
    pub(crate) fn new(membranes: Vec<Block<'a>>, wall_volumes: Vec<f64>) -> Self {
        let mut end = 0;
        let places = membranes.iter().map(|membrane| {
            let start = end;
            end += membrane.len();
            start..end
        });
        let places: Vec<Range<usize>> = places.collect();
        let inside = places.iter().take(wall_volumes.len());
        Self {
            volume_rows: inside.map(|place| vec![0.0; place.len() - 1]).collect(),
            places,
            wall_volumes,
            membranes,
        }
    }

    pub(crate) fn innermost(&mut self) -> &mut Block<'a> {
        &mut self.membranes[0]
    }

    /// Volume of the innermost membrane.
    pub(crate) fn volume(&self, x: &[f64]) -> f64 {
        self.membranes[0].volume(&x[self.places[0].clone()])
    }

    /// All membranes, from the inside out.
    pub(crate) fn each(&mut self) -> impl Iterator<Item = &mut Block<'a>> {
        self.membranes.iter_mut()
    }

    /// Returns the prescribed quantity in state `x`.
    pub(crate) fn control_value(&self, x: &[f64]) -> f64 {
        self.membranes[0].constrained_value(&x[self.places[0].clone()])
    }

    /// Returns the route of the innermost membrane from its start.
    pub(crate) fn route(&self) -> Route {
        self.membranes[0].route
    }

    pub(crate) fn set_control(&mut self, value: f64) {
        self.membranes[0].set_control(value);
    }

    /// Prescribes the volumes of the outer membranes that belong to that of the innermost membrane in state `x`.
    fn couple(&mut self, x: &[f64]) {
        for (k, wall_volume) in self.wall_volumes.iter().enumerate() {
            let volume = self.membranes[k].volume(&x[self.places[k].clone()]);
            self.membranes[k + 1].constraint = Constraint::volume(volume + wall_volume);
        }
    }

    /// Returns the largest `size` over all membranes and their parts of `x`.
    fn largest(&self, x: &[f64], size: impl Fn(&Block<'a>, &[f64]) -> f64) -> f64 {
        let parts = self.membranes.iter().zip(&self.places);
        parts
            .map(|(membrane, place)| size(membrane, &x[place.clone()]))
            .fold(0.0, nan_max)
    }

    /// Returns the error of the prescribed quantity in state `x`, relative to its value, or to a hundredth of the value that moves a
    /// membrane by its length.
    pub(crate) fn misses(&mut self, x: &[f64]) -> f64 {
        self.couple(x);
        self.largest(x, Block::misses)
    }

    /// Whether the determinant of the tangent, if factored since the value was set, has the sign of the first factorisation of this system.
    pub(crate) fn keeps_sign(&self) -> bool {
        self.membranes.iter().all(Block::keeps_sign)
    }

    /// Whether no curve turns more from state `from` to state `to` than `reach` allows.
    pub(crate) fn within(&self, reach: Reach, from: &[f64], to: &[f64]) -> bool {
        let mut parts = self.membranes.iter().zip(&self.places);
        parts.all(|(membrane, place)| {
            membrane.within(reach, &from[place.clone()], &to[place.clone()])
        })
    }

    /// Least tension of rubber along the meridian, over its shear modulus; infinite where it is not defined.
    pub(crate) fn tension(&self, x: &[f64]) -> f64 {
        let parts = self.membranes.iter().zip(&self.places);
        let tensions = parts.map(|(membrane, place)| membrane.tension(&x[place.clone()]));
        tensions.fold(f64::INFINITY, f64::min)
    }

    /// Limits the tensions in later tangents of rubber from below.
    pub(crate) fn set_least_tension(&mut self, least: f64) {
        self.each().for_each(|m| m.least_tension = least);
    }

    /// `out` = rate of change of the state with the control, by the last factorisation.
    ///
    /// # Errors
    /// No tangent was factored.
    pub(crate) fn rate_into(&mut self, out: &mut [f64]) -> Result<()> {
        out.fill(0.0);
        out[self.places[0].end - 1] = 1.0;
        self.solve_in_place(out)
    }

    /// Dimensionless size of a change of the curves.
    pub(crate) fn shape_norm(&self, change: &[f64]) -> f64 {
        self.largest(change, Block::shape_norm)
    }
}

impl ResidualSystem for NestedSystem<'_> {
    fn len(&self) -> usize {
        self.places.iter().map(Range::len).sum()
    }

    fn residual_into(&mut self, x: &[f64], out: &mut [f64]) -> Result<()> {
        self.couple(x);
        let mut parts = self.membranes.iter_mut().zip(&self.places);
        parts.try_for_each(|(membrane, place)| {
            membrane.residual_into(&x[place.clone()], &mut out[place.clone()])
        })
    }

    fn factor(&mut self, x: &[f64]) -> Result<()> {
        for (k, place) in self.places.iter().enumerate() {
            self.membranes[k].factor(&x[place.clone()])?;
            if let Some(row) = self.volume_rows.get_mut(k) {
                self.membranes[k].volume_gradient_into(&x[place.clone()], row);
            }
        }
        Ok(())
    }

    fn solve_in_place(&mut self, rhs: &mut [f64]) -> Result<()> {
        for (k, place) in self.places.iter().enumerate() {
            self.membranes[k].solve_in_place(&mut rhs[place.clone()])?;
            if let Some(row) = self.volume_rows.get(k) {
                let volume = dot(row, &rhs[place.start..place.end - 1]);
                rhs[self.places[k + 1].end - 1] += volume;
            }
        }
        Ok(())
    }

    fn residual_norm(&self, residual: &[f64]) -> f64 {
        self.largest(residual, Block::residual_norm)
    }

    fn step_norm(&self, step: &[f64]) -> f64 {
        self.largest(step, Block::step_norm)
    }
}

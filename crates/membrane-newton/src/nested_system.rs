//! One membrane, or membranes around each other with walls of constant volume between them, as one system of equations.

use std::ops::Range;

use membrane_forces::Measure;

use crate::block::{Block, nan_max};
use crate::border::dot;
use crate::constraint::Constraint;
use crate::error::NewtonError;
use crate::newton::ResidualSystem;
use crate::route::Route;
use crate::turning::Reach;

/// Unknowns (c, f) of each membrane from the inside out, with one number that is prescribed, the control of the innermost.
///
/// The border equation of every other one, V - V of the one inside = wall volume, couples it to that one in one direction.
pub(crate) struct NestedSystem<'a> {
    membranes: Vec<Block<'a>>,
    /// Where the unknowns of each are.
    places: Vec<Range<usize>>,
    wall_volumes: Vec<f64>,
    /// dV/dc of those with another one around them.
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

    /// The membrane inside all others.
    pub(crate) fn innermost(&mut self) -> &mut Block<'a> {
        &mut self.membranes[0]
    }

    /// Volume of the membrane inside all others.
    pub(crate) fn volume(&self, x: &[f64]) -> f64 {
        let Range { start, end } = self.places[0];
        self.membranes[0].volume(&x[start..end - 1])
    }

    /// All of them, from the inside out.
    pub(crate) fn each(&mut self) -> impl Iterator<Item = &mut Block<'a>> {
        self.membranes.iter_mut()
    }

    /// What the control prescribes, as it is in state `x`.
    pub(crate) fn control_value(&self, x: &[f64]) -> f64 {
        self.membranes[0].constrained_value(&x[self.places[0].clone()])
    }

    /// The way of the membrane inside all others from its start.
    pub(crate) fn route(&self) -> Route {
        self.membranes[0].route()
    }

    /// Prescribes `value`.
    pub(crate) fn set_control(&mut self, value: f64) {
        self.membranes[0].set_control(value);
    }

    /// The volume that goes with that of the membrane inside in state `x`.
    fn couple(&mut self, x: &[f64]) {
        for (k, wall_volume) in self.wall_volumes.iter().enumerate() {
            let Range { start, end } = self.places[k];
            let volume = self.membranes[k].volume(&x[start..end - 1]);
            self.membranes[k + 1].constraint =
                Constraint::Measure(Measure::Volume, volume + wall_volume);
        }
    }

    /// The largest `size` of a membrane and its part of `x`.
    fn largest(&self, x: &[f64], size: impl Fn(&Block<'a>, &[f64]) -> f64) -> f64 {
        let parts = self.membranes.iter().zip(&self.places);
        parts
            .map(|(membrane, place)| size(membrane, &x[place.clone()]))
            .fold(0.0, nan_max)
    }

    /// By how much state `x` misses what is prescribed, relative to that, or to a hundredth of what moves a
    /// membrane by its length.
    pub(crate) fn misses(&mut self, x: &[f64]) -> f64 {
        self.couple(x);
        self.largest(x, Block::misses)
    }

    /// Whether the determinant of the tangent, if factored since the value was set, has the sign
    /// that it had when this system was factored first.
    pub(crate) fn keeps_sign(&self) -> bool {
        self.membranes.iter().all(Block::keeps_sign)
    }

    /// Whether no curve turns further from state `from` to state `to` than `reach` allows.
    pub(crate) fn within(&self, reach: Reach, from: &[f64], to: &[f64]) -> bool {
        let mut parts = self.membranes.iter().zip(&self.places);
        parts.all(|(membrane, place)| {
            membrane.within(reach, &from[place.clone()], &to[place.clone()])
        })
    }

    /// Least tension of rubber along the meridian, over its shear modulus; infinite where it is not defined.
    pub(crate) fn least_tension(&self, x: &[f64]) -> f64 {
        let parts = self.membranes.iter().zip(&self.places);
        parts
            .map(|(membrane, place)| membrane.least_tension(&x[place.start..place.end - 1]))
            .fold(f64::INFINITY, f64::min)
    }

    /// `out` = how fast the state changes with the control, by the tangent factored last.
    ///
    /// # Errors
    /// No tangent has been factored.
    pub(crate) fn rate_into(&mut self, out: &mut [f64]) -> Result<(), NewtonError> {
        out.fill(0.0);
        out[self.places[0].end - 1] = 1.0;
        self.solve_in_place(out)
    }

    /// Size of what a change of the state does to the curves, free of units.
    pub(crate) fn shape_norm(&self, change: &[f64]) -> f64 {
        self.largest(change, Block::shape_norm)
    }
}

impl ResidualSystem for NestedSystem<'_> {
    fn len(&self) -> usize {
        self.places.iter().map(Range::len).sum()
    }

    fn residual_into(&mut self, x: &[f64], out: &mut [f64]) -> Result<(), NewtonError> {
        self.couple(x);
        let mut parts = self.membranes.iter_mut().zip(&self.places);
        parts.try_for_each(|(membrane, place)| {
            membrane.residual_into(&x[place.clone()], &mut out[place.clone()])
        })
    }

    fn factor(&mut self, x: &[f64]) -> Result<(), NewtonError> {
        for (k, place) in self.places.iter().enumerate() {
            self.membranes[k].factor(&x[place.clone()])?;
            if let Some(row) = self.volume_rows.get_mut(k) {
                self.membranes[k].volume_gradient_into(&x[place.start..place.end - 1], row);
            }
        }
        Ok(())
    }

    fn solve_in_place(&mut self, rhs: &mut [f64]) -> Result<(), NewtonError> {
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

//! Atrioventricular-plane displacement with a fixed apex.

use super::twist::APEX;
use crate::error::{PhantomError, check};
use crate::ranges::GAIN;
use membrane_newton::membrane_forces::Material;
use membrane_newton::{
    Control, Discretisation, Equilibrium, Membrane, NewtonOptions, Pair, PairEquilibrium,
    ReferenceShape, Solver,
};
use std::f64::consts::{PI, TAU};

/// Tolerance of the apex position, as a fraction of the length of the heart.
const AT_REST: f64 = 1e-11;
/// Largest number of solves of the outer membrane; typically four.
const MOST_TRIES: usize = 30;

/// Displacement of the base from end-diastole to end-systole.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Descent {
    /// Total displacement, cm.
    whole: f64,
    /// Volume gains at end-systole and end-diastole.
    gains: [f64; 2],
}

impl Descent {
    /// A displacement of `whole` cm, at most `length`, from the gain at end-diastole to that at end-systole; `None` for zero or a constant
    /// volume.
    pub(super) fn new(
        whole: f64,
        [low, high]: [f64; 2],
        length: f64,
    ) -> Result<Option<Self>, PhantomError> {
        check("av_plane_displacement", whole, [0.0, length])?;
        check("largest gain", high, GAIN)?;
        check("smallest gain", low, [0.0, high])?;
        let gains = [low, high];
        Ok((whole > 0.0 && high > low).then_some(Self { whole, gains }))
    }

    /// Returns the displacement of the ring at a gain, cm.
    pub(super) fn at(&self, gain: f64) -> f64 {
        let [low, high] = self.gains;
        self.whole * ((high - gain) / (high - low)).clamp(0.0, 1.0)
    }

    /// Solves the two membranes at a gain with the displaced ring and the outer apex at its position at end-diastole.
    ///
    /// The reference configurations are shortened along the axis by `a (1 - w(s))`, `w = cos(pi s)^2`, and fixed at the ring, `c_a
    /// = c_0 + (d - a (1 - w)) e_x`. The secant method finds the `a` that keeps the outer apex fixed. The volumes of cavity and
    /// wall are separate equations.
    pub(super) fn solve(
        &self,
        [inner, outer]: [&Membrane; 2],
        discretisation: Discretisation,
        pair: &Pair,
        gain: f64,
    ) -> Result<PairEquilibrium, PhantomError> {
        let ring = self.at(gain);
        let cavity = pair.inner().start_measures().volume;
        let wall = pair.wall_volume();
        let solved = |membrane: &Membrane, volume: f64, [ring, short]: [f64; 2]| {
            let solver = Solver::new(&shortened(membrane, ring, short)?, discretisation)?;
            let options = NewtonOptions::default();
            Ok::<_, PhantomError>(solver.solve(Control::Volume(volume), &options)?)
        };
        let volume = |gain: f64| cavity * (1.0 + gain);
        let apex = |shape: &Equilibrium| shape.at(APEX).position[0];
        let rests = apex(&solved(outer, volume(self.gains[1]) + wall, [0.0; 2])?);
        let length = outer.reference().at(APEX).position[0];
        let at = |short: f64| -> Result<(Equilibrium, f64), PhantomError> {
            let shape = solved(outer, volume(gain) + wall, [ring, short])?;
            let off = apex(&shape) - rests;
            Ok((shape, off))
        };
        // Initial guess: the whole displacement is shortening.
        let mut last = ring;
        let (mut outside, mut off) = at(last)?;
        let mut next = last + off;
        for _ in 0..MOST_TRIES {
            if off.abs() <= AT_REST * length {
                break;
            }
            let (shape, new) = at(next)?;
            let slope = (new - off) / (next - last);
            (last, outside, off) = (next, shape, new);
            let step = if slope.is_finite() && slope != 0.0 {
                off / slope
            } else {
                -off
            };
            next = last - step;
        }
        let inside = solved(inner, volume(gain), [ring, last])?;
        Ok(PairEquilibrium::of(inside, outside, wall)?)
    }
}

/// A membrane with its reference configuration shortened along the axis and its ring displaced.
fn shortened(membrane: &Membrane, ring: f64, short: f64) -> Result<Membrane, PhantomError> {
    let rest = membrane.reference().clone();
    let breaks = rest.breakpoints();
    let inside = breaks[1..breaks.len() - 1].to_vec();
    let curve = move |s: f64| {
        let mut point = rest.at(s);
        // 1 - w = sin(pi s)^2, and its derivatives.
        let (sine, double) = ((PI * s).sin().powi(2), TAU * s);
        point.position[0] += ring - short * sine;
        point.first[0] -= short * PI * double.sin();
        point.second[0] -= short * PI * TAU * double.cos();
        point
    };
    let rest = ReferenceShape::from_function(curve, &inside)?;
    let ends = membrane.ends().map(|[x, y]| [x + ring, y]);
    let made = Membrane::new(rest).with_ends(ends)?;
    let made = match membrane.material() {
        Material::Rubber(rubber) => made.with_rubber(rubber.clone()),
        Material::Springs { stiffness, second } => {
            let made = made.with_stiffness(stiffness.clone());
            match second {
                Some(second) => made.with_second_neighbours(second.clone()),
                None => made,
            }
        }
    };
    Ok(made.with_law(membrane.law()))
}

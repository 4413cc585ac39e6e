//! The base goes down while the heart empties, and the apex rests.

use super::material::APEX;
use crate::error::{PhantomError, check};
use crate::ranges::{DESCENT, GAIN};
use membrane_newton::membrane_forces::Material;
use membrane_newton::{
    Control, Discretisation, Equilibrium, Membrane, NewtonOptions, Pair, PairEquilibrium,
    RestShape, Solver,
};
use std::f64::consts::{PI, TAU};

/// How far from rest the apex may be left, as a share of the heart's length.
const AT_REST: f64 = 1e-11;
/// Shapes of the outer membrane until it is there; four as a rule.
const MOST_TRIES: usize = 30;

/// How far the plane of the base goes down, from end-diastole to end-systole.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Descent {
    /// From end-diastole to end-systole, cm.
    whole: f64,
    /// Volume gains at end-systole and end-diastole.
    gains: [f64; 2],
}

impl Descent {
    /// The ring goes down by `whole` cm from the gain at end-diastole to that at end-systole.
    ///
    /// Nothing of no descent, or where the volume stays.
    pub(super) fn new(whole: f64, [low, high]: [f64; 2]) -> Result<Option<Self>, PhantomError> {
        check("descent of the base", whole, DESCENT)?;
        check("largest gain", high, GAIN)?;
        check("smallest gain", low, [0.0, high])?;
        let gains = [low, high];
        Ok((whole > 0.0 && high > low).then_some(Self { whole, gains }))
    }

    /// How far the ring has come at a gain, cm.
    pub(super) fn at(&self, gain: f64) -> f64 {
        let [low, high] = self.gains;
        self.whole * ((high - gain) / (high - low)).clamp(0.0, 1.0)
    }

    /// At a gain the two membranes with the ring where it is and the outer apex where it is at end-diastole.
    ///
    /// Their muscle shortens: each rest shape is drawn together along the axis by `a (1 - w(s))`, `w = cos(pi s)^2`, and held where the
    /// ring is, `c_a = c_0 + (d - a (1 - w)) e_x`; a is that with which the outer apex rests (secants). Cavity and wall have their volumes
    /// as equations of their own.
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
        let length = outer.rest().at(APEX).position[0];
        let at = |short: f64| -> Result<(Equilibrium, f64), PhantomError> {
            let shape = solved(outer, volume(gain) + wall, [ring, short])?;
            let off = apex(&shape) - rests;
            Ok((shape, off))
        };
        // Without a change of volume all of the descent is shortening.
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

/// A membrane whose rest shape is drawn together along the axis, and held with its ring so far from where it was.
fn shortened(membrane: &Membrane, ring: f64, short: f64) -> Result<Membrane, PhantomError> {
    let rest = membrane.rest().clone();
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
    let rest = RestShape::from_function(curve, &inside)?;
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

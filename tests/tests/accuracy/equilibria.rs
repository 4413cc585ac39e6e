//! Equilibria of membranes, and Newton's iteration.

mod algebra;
mod shooting;

use std::f64::consts::PI;

use crate::Row;
use membrane_forces::{
    CurvePiece, LinearEquilibrium, Membrane, PressureLaw, ReferenceShape, Rubber, Stiffness,
    StrainEnergy, Thickness,
};
use membrane_newton::{Control, Discretisation, NewtonError, NewtonOptions, Pair, Solver};
use shooting::{Sheet, Springs};
use tests::Random;

pub(crate) const ROWS: &[Row] = &[
    Row {
        name: "membrane_newton::NewtonReport::iteration_error",
        what: "error of the unknowns at the end of Newton's method",
        reference: "root known by construction",
        norm: "maximum over the unknowns, relative to their scale",
        quick: 50,
        problem: algebra::estimate,
    },
    Row {
        name: "membrane_newton::NewtonOptions::step_tolerance",
        what: "error of the unknowns",
        reference: "root known by construction",
        norm: "maximum over the unknowns, relative to their scale",
        quick: 50,
        problem: algebra::step,
    },
    Row {
        name: "membrane_newton::NewtonOptions::residual_tolerance",
        what: "residual at the solution",
        reference: "equations evaluated in product form",
        norm: "maximum over the equations, relative to their scale",
        quick: 50,
        problem: algebra::residual,
    },
    Row {
        name: "membrane_newton::Discretisation::SpectralAdaptive::tolerance",
        what: "position of points on a membrane of springs",
        reference: "shooting with a Runge-Kutta scheme; closed form in complex numbers",
        norm: "maximum distance, relative to the length",
        quick: 4,
        problem: springs,
    },
    Row {
        name: "membrane_newton::Discretisation::SpectralAdaptive::tolerance",
        what: "pressure of a rubber disc at a given volume",
        reference: "shooting, Runge-Kutta",
        norm: "relative",
        quick: 4,
        problem: rubber,
    },
    Row {
        name: "membrane_newton::NewtonError::LimitPoint::reached",
        what: "maximum pressure of a rubber disc; stated error 1e-7",
        reference: "maximum over shooting solutions (Runge-Kutta)",
        norm: "relative",
        quick: 2,
        problem: limit,
    },
    Row {
        name: "membrane_newton::PairEquilibrium::wall_volume_error",
        what: "volume of the wall; 1e-12 of the volumes is added to the stated error",
        reference: "Gauss quadrature along the curves",
        norm: "relative to the wall",
        quick: 4,
        problem: wall,
    },
];

fn adaptive(membrane: &Membrane, tolerance: f64) -> Option<Solver> {
    Solver::new(membrane, Discretisation::SpectralAdaptive { tolerance }).ok()
}

/// Rounding of positions and pressures, relative to their size: the remaining steps of Newton on fine elements.
const ROUNDING: f64 = 1e-11;

fn springs(random: &mut Random) -> Option<f64> {
    let tolerance = random.decades(-9.0, -3.0);
    let options = NewtonOptions::default();
    let points = (0..=40).map(|k| 0.5 * f64::from(k) / 40.0);
    let distance = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
    let (off, length) = if random.one_in(2) {
        let (h, radius) = (random.decades(-0.5, 1.0), random.decades(-0.3, 0.3));
        let kappa = random.uniform(-0.3, 4.0);
        let membrane = Membrane::new(ReferenceShape::balloon(h, radius).ok()?)
            .with_law(PressureLaw::PerCurrentLength);
        let solved = adaptive(&membrane, tolerance)?
            .solve(Control::Load(kappa), &options)
            .ok()?;
        let exact = LinearEquilibrium::balloon(h, radius, kappa, 1.0).ok()?;
        let off = points.map(|s| distance(solved.at(s).position, exact.at(s).position));
        (off.fold(0.0, f64::max), exact.measures().length)
    } else {
        let springs = Springs {
            radius: random.decades(-0.3, 0.3),
            amplitude: random.uniform(-0.5, 0.5),
            waves: random.integer(1, 3) as f64,
        };
        let stiffness = Stiffness::function(move |s| springs.stiffness(s), &[]).ok()?;
        let membrane =
            Membrane::new(ReferenceShape::disc(springs.radius).ok()?).with_stiffness(stiffness);
        let load = random.uniform(0.3, 3.0) * springs.radius;
        let solved = adaptive(&membrane, tolerance)?
            .solve(Control::Load(load), &options)
            .ok()?;
        let tension = -solved.at(0.5).first[1] * springs.stiffness(0.5);
        let exact = springs.solve(load, tension)?;
        let off = exact
            .iter()
            .map(|(s, place)| distance(solved.at(*s).position, *place));
        (off.fold(0.0, f64::max), solved.measures.length)
    };
    Some(off / length / (tolerance + ROUNDING))
}

fn sheet(random: &mut Random) -> Sheet {
    let energy = match random.integer(0, 3) {
        0 => StrainEnergy::NeoHookean { mu: 1.0 },
        1 => StrainEnergy::MooneyRivlin {
            c1: 0.5,
            c2: random.uniform(0.0, 0.03),
        },
        2 => StrainEnergy::Ogden {
            terms: vec![
                [random.uniform(1.0, 2.0), random.uniform(1.2, 2.0)],
                [-0.02, -2.0],
            ],
        },
        _ => StrainEnergy::Gent {
            mu: 1.0,
            jm: random.uniform(60.0, 100.0),
        },
    };
    Sheet { energy }
}

impl Sheet {
    fn disc(&self) -> Option<Membrane> {
        let rubber = Rubber::new(self.energy.clone(), Thickness::UNIT).ok()?;
        Some(Membrane::new(ReferenceShape::disc(1.0).ok()?).with_rubber(rubber))
    }
}

fn rubber(random: &mut Random) -> Option<f64> {
    let (sheet, tolerance) = (sheet(random), random.decades(-8.0, -4.0));
    let shot = sheet.shoot(random.uniform(1.05, 1.6))?;
    let solver = adaptive(&sheet.disc()?, tolerance)?;
    let solved = solver
        .solve(Control::Volume(shot.volume), &NewtonOptions::default())
        .ok()?;
    let off = (solved.intensity / shot.pressure - 1.0).abs();
    Some(off / (tolerance + 1e-9))
}

fn limit(random: &mut Random) -> Option<f64> {
    let sheet = sheet(random);
    let solver = adaptive(&sheet.disc()?, 1e-8)?;
    let Err(NewtonError::LimitPoint { reached, .. }) =
        solver.solve(Control::Load(20.0), &NewtonOptions::default())
    else {
        return None;
    };
    let most = sheet.first_maximum()?;
    Some((reached / most - 1.0).abs() / 1e-7)
}

/// Nodes and weights of Gauss and Legendre's rule of five points on [-1, 1].
const GAUSS: [[f64; 2]; 5] = [
    [-0.906179845938664, 0.23692688505618908],
    [-0.538469310105683, 0.47862867049936647],
    [0.0, 0.5688888888888889],
    [0.538469310105683, 0.47862867049936647],
    [0.906179845938664, 0.23692688505618908],
];

/// pi times the integral of y^2 x' over the upper half, by Gauss's rule on 40 panels per piece.
pub(crate) fn volume(pieces: &[CurvePiece]) -> f64 {
    let upper = pieces.iter().filter(|piece| piece.to <= 0.5 + 1e-12);
    let sums = upper.map(|piece| {
        let width = (piece.to - piece.from) / 40.0;
        let panel = |k: u32| -> f64 {
            let sum = GAUSS.map(|[node, weight]| {
                let s = piece.from + width * (f64::from(k) + 0.5 + 0.5 * node);
                let point = piece.at(s);
                weight * point.position[1].powi(2) * point.first[0]
            });
            0.5 * width * sum.iter().sum::<f64>()
        };
        (0..40).map(panel).sum::<f64>()
    });
    PI * sums.sum::<f64>()
}

fn wall(random: &mut Random) -> Option<f64> {
    let (h, radius) = (random.decades(-0.3, 1.0), random.decades(-0.3, 0.3));
    let outer = radius * random.uniform(1.1, 2.0);
    let spectral = Discretisation::Spectral {
        degree: random.integer(10, 24),
        per_piece: 1,
    };
    let [inner, outer] = [radius, outer].map(|radius| {
        let balloon = ReferenceShape::balloon(h, radius).ok()?;
        Solver::new(&Membrane::new(balloon), spectral).ok()
    });
    let (inner, outer) = (inner?, outer?);
    let starts = [&inner, &outer].map(|solver| volume(&solver.start().pieces()));
    let options = NewtonOptions::default().with_tolerances(1e-15, random.decades(-14.0, -4.0));
    let pair = Pair::new(inner, outer).ok()?;
    let solved = pair.solve_gain(random.uniform(-0.2, 1.0), &options).ok()?;
    let [inside, outside] = [&solved.inner, &solved.outer].map(|of| volume(&of.pieces()));
    let rest = starts[1] - starts[0];
    let error = (outside - inside) / rest - 1.0;
    let rounding = 1e-12 * outside / rest;
    Some(error.abs() / (solved.wall_volume_error.abs() + rounding))
}

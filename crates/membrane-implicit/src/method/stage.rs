//! An implicit stage: the velocity w that balances momentum, and the intensity.

use membrane_newton::membrane_forces::Tangent;
use membrane_newton::{
    BandMatrix, BandedLu, Border, DiscreteMembrane, Measure, NewtonError, dot_in_eight,
};

use crate::body::Body;
use crate::constraint::{Answer, Constraint};
use crate::error::{ImplicitError, Result};
use crate::kinematics::{Kinematics, slope};
use crate::scheme::Jacobian;
use crate::work::Work;

const MAX_ITERATIONS: usize = 40;
/// Tolerance on the estimated change of positions in the next iteration, as a fraction of the membrane's length. It is below the rounding
/// of a position because forces amplify it by 1 / ds^2: only then does the energy report balance.
const SOLVE_TOLERANCE: f64 = 1e-17;
/// Below this fraction, an iteration without progress has reached rounding.
const STALL: f64 = 1e-8;
/// Product of the last change and the step, over the squared length, below which an iteration with discrete derivatives has reached the
/// rounding of energies if it makes no progress. Larger changes may also converge slowly, because the matrix has no secants.
const SECANT_STALL: f64 = 1e-14;

/// Solves, for the velocity w and the intensity f,
///
/// ```text
/// (m + h mu) w = m v* + h [ F_e(c) + f n(c) ]        c = c* + h w
/// g(c, w, f) = 0                       f = f_t,   f S(c) = F_t,   V(c* + r w) = V_t   or   f = P(t, V(c), V'(c) w)
/// ```
///
/// with the matrix (m + h mu) I - h^2 (K + f dn/dc), bordered by g. All implicit schemes consist of such stages. The unknowns are 2 N
/// velocities, not 4 N positions and velocities.
#[derive(Debug, Clone)]
pub(crate) struct Stage {
    pub(crate) jacobian: Jacobian,
    matrix: Tangent,
    lu: BandedLu,
    /// Column -h n(c), row h dg/dc + dg/dw.
    pub(crate) border: Border,
    /// h of `lu` and `border`, NaN if there is none.
    factored: f64,
    /// F_e and F_p.
    forces: [Vec<f64>; 2],
    /// Residual of the balance of momentum, then the correction of w.
    correction: Vec<f64>,
    /// c* + r w, and r w.
    end: Vec<f64>,
    moved: Vec<f64>,
}

/// Position and time of a stage.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Equation<'a> {
    pub(crate) body: &'a Body,
    /// The prescribed quantity at the end of the stage.
    pub(crate) constraint: Constraint<'a>,
    /// Time at the start of the step, and at the end of the stage.
    pub(crate) time: f64,
    pub(crate) end: f64,
    pub(crate) dt: f64,
    /// h = gamma dt.
    pub(crate) h: f64,
    /// r: h, or the whole step for a stage in the middle of a step.
    pub(crate) reach: f64,
    /// Elastic energy and volume at c*, if the forces are discrete derivatives over the step to c* + r w.
    pub(crate) secant: Option<[f64; 2]>,
}

impl Equation<'_> {
    fn linear(&self, error: NewtonError) -> ImplicitError {
        let Self { time, dt, .. } = *self;
        ImplicitError::Linear { time, dt, error }
    }

    fn membrane(&self, error: membrane_newton::MembraneError) -> ImplicitError {
        let time = self.time;
        ImplicitError::Membrane { time, error }
    }
}

impl Stage {
    pub(crate) fn new(body: &Body) -> Self {
        let matrix = body.discrete.tangent();
        let zero = vec![0.0; matrix.band.len()];
        Self {
            jacobian: Jacobian::Exact,
            lu: BandedLu::for_matrix(&matrix.band),
            border: Border::new(zero.len()),
            factored: f64::NAN,
            forces: [zero.clone(), zero.clone()],
            correction: zero.clone(),
            end: zero.clone(),
            moved: zero,
            matrix,
        }
    }

    /// The current factorisation.
    pub(crate) fn matrix(&self) -> &BandMatrix {
        &self.matrix.band
    }

    /// Requires a new factorisation for the next solve.
    pub(crate) fn forget(&mut self) {
        self.factored = f64::NAN;
    }

    /// Builds and factors the matrix at `nodes`, their velocities and the intensity; c* is `positions`.
    pub(crate) fn linearise(
        &mut self,
        eq: &Equation<'_>,
        positions: &[f64],
        (nodes, velocities): (&[f64], &[f64]),
        intensity: f64,
        work: &mut Work,
    ) -> Result<()> {
        let Equation { body, h, time, .. } = *eq;
        self.forget();
        body.stage_matrix_into(time, (nodes, intensity), h, &mut self.matrix)?;
        self.extrapolate(eq, positions, velocities);
        let lu = self.lu.factor(&self.matrix.band);
        let lu = lu.map_err(|e| eq.linear(e))?;
        work.factorisations += 1;

        let points = nodes.as_chunks().0;
        let answering = |answer: Answer| {
            let slope = -(h * answer.by_volume + answer.by_rate);
            Some((Some((Measure::Volume, nodes, slope)), 1.0))
        };
        // gradient of g, that of a measure times a factor, and its slope by f
        let border = match eq.constraint {
            Constraint::Intensity(_) => None,
            // Without the rank-one part the intensity does not depend on the change of shape.
            Constraint::TotalForce(_) if self.jacobian == Jacobian::Band => {
                Some((None, Measure::Surface.of(points)))
            }
            Constraint::TotalForce(_) => Some((
                Some((Measure::Surface, nodes, h * intensity)),
                Measure::Surface.of(points),
            )),
            Constraint::Volume(_) => Some((Some((Measure::Volume, &*self.end, eq.reach)), 0.0)),
            Constraint::Feedback(load) => {
                let at = body.load_state(eq.end, nodes, velocities);
                answering(Answer::about(load, at, body.length, h)?)
            }
            Constraint::Answer(answer) => answering(answer),
        };
        let row = self.border.row_mut();
        row.fill(0.0);
        if let Some((Some((measure, nodes, factor)), _)) = border {
            body.discrete.measure_gradient_into(measure, nodes, row);
            body.hold(row);
            row.iter_mut().for_each(|g| *g *= factor);
        }
        let column = self.border.column_mut();
        let eliminated = if let Some((_, corner)) = border {
            body.pressure_into(time, nodes, -h, column)?;
            work.force_calls += 1;
            self.border.eliminate(corner, |column| {
                lu.solve_into(column);
                body.hold(column);
                Ok(())
            })
        } else {
            column.fill(0.0);
            self.border.eliminate(1.0, |_| Ok(()))
        };
        eliminated.map_err(|e| eq.linear(e))?;
        self.factored = h;
        Ok(())
    }

    /// `end` = c* + r w and `moved` = r w.
    fn extrapolate(&mut self, eq: &Equation<'_>, positions: &[f64], w: &[f64]) {
        let nodes = self.end.iter_mut().zip(&mut self.moved);
        for ((end, moved), (start, w)) in nodes.zip(positions.iter().zip(w)) {
            *moved = eq.reach * w;
            *end = start + *moved;
        }
    }

    /// F_e and F_p = `intensity` n at `nodes`, or their discrete derivatives over the step to `end`.
    fn evaluate(&mut self, eq: &Equation<'_>, nodes: &[f64], intensity: f64) -> Result<()> {
        let body = eq.body;
        let [elastic, pressure] = &mut self.forces;
        body.discrete.elastic_force_into(nodes, elastic);
        let Some([energy, volume]) = eq.secant else {
            return body.pressure_into(eq.time, nodes, intensity, pressure);
        };
        let energy_at = |nodes: &[f64]| {
            let energy = body.discrete.elastic_energy(nodes);
            energy.map_err(|error| eq.membrane(error))
        };
        if elastic.iter().any(|force| force.is_nan()) {
            energy_at(nodes)?;
        }
        body.pressure_into(eq.time, nodes, 1.0, pressure)?;
        let reached = energy_at(&self.end)?;
        add_secant(elastic, &self.moved, [reached, energy]);
        add_secant(pressure, &self.moved, [volume, body.volume(&self.end)]);
        pressure.iter_mut().for_each(|force| *force *= intensity);
        Ok(())
    }

    /// Makes one Newton iteration with the current factorisation and updates `w`, `intensity` and `nodes` = c* + h w. Returns the largest
    /// change of a coordinate of the position.
    pub(crate) fn iterate(
        &mut self,
        eq: &Equation<'_>,
        (positions, velocities): (&[f64], &[f64]),
        (nodes, w, intensity): (&mut [f64], &mut [f64], &mut f64),
        work: &mut Work,
    ) -> Result<f64> {
        let Equation { body, h, .. } = *eq;
        work.iterations += 1;
        work.force_calls += 1;
        let by_volume = matches!(eq.constraint, Constraint::Volume(_));
        if by_volume || eq.secant.is_some() {
            self.extrapolate(eq, positions, w);
        }
        self.evaluate(eq, nodes, *intensity)?;
        let (m, m_h) = (body.mass, body.inertia(h));
        let forces = self.forces[0].iter().zip(&self.forces[1]);
        let momentum = velocities.iter().zip(w.iter()).zip(&body.volumes);
        for (missing, ((e, p), ((v, w), volume))) in
            self.correction.iter_mut().zip(forces.zip(momentum))
        {
            *missing = volume * (m * v - m_h * w) + h * (e + p);
        }
        body.hold(&mut self.correction);
        let lu = self.lu.factorisation();
        let (lu, border) = lu
            .zip(self.border.elimination())
            .ok_or_else(|| eq.linear(NewtonError::NotFactored))?;
        // Pivoting mixes fixed rows with their neighbours; rounding must not move an end.
        lu.solve_into(&mut self.correction);
        body.hold(&mut self.correction);
        let now = || body.load_state(eq.end, nodes, w);
        let defect = match eq.constraint {
            Constraint::TotalForce(wanted) => {
                *intensity * Measure::Surface.of(nodes.as_chunks().0) - wanted
            }
            Constraint::Volume(wanted) => body.volume(&self.end) - wanted,
            Constraint::Intensity(wanted) => *intensity - wanted,
            Constraint::Feedback(load) => *intensity - load.at(&now())?,
            Constraint::Answer(answer) => *intensity - answer.intensity(&now()),
        };
        let correct = border.correct(&mut self.correction, -defect);
        *intensity += correct.map_err(|e| eq.linear(e))?;
        // An error of the border counts as a displacement of the whole membrane by the same fraction; for an intensity, the step below
        // determines the displacement.
        let scale = match eq.constraint {
            Constraint::TotalForce(wanted) => body.length / wanted.abs(),
            // a flat membrane encloses nothing
            Constraint::Volume(wanted) => {
                body.length / wanted.abs().max(1e-9 * body.length.powi(3))
            }
            Constraint::Intensity(_) | Constraint::Feedback(_) | Constraint::Answer(_) => 0.0,
        };
        let mut change = if defect == 0.0 {
            0.0
        } else {
            defect.abs() * scale
        };
        let moving = w.iter_mut().zip(nodes).zip(positions);
        for (((w, node), start), dw) in moving.zip(&self.correction) {
            *w += dw;
            *node = start + h * *w;
            // max() would ignore NaN
            let moved = (h * dw).abs();
            change = if moved <= change { change } else { moved };
        }
        Ok(change)
    }

    /// Solves the stage by Newton from the velocity, the nodes and the intensity in `new`, with the current factorisation while it
    /// contracts. c* and v* are `positions` and `velocities`, c and f at the start of the step those of `now`.
    pub(crate) fn solve(
        &mut self,
        eq: &Equation<'_>,
        (positions, velocities): (&[f64], &[f64]),
        (now, new): (&Kinematics, &mut Kinematics),
        work: &mut Work,
    ) -> Result<()> {
        let Equation {
            body, time, dt, h, ..
        } = *eq;
        let tolerance = SOLVE_TOLERANCE * body.length;
        let not_solved = |iterations, change| ImplicitError::StepNotSolved {
            time,
            dt,
            iterations,
            change,
        };
        // A feedback acts in its own direction, in which the matrix of another state contracts less than in that of the first change.
        let least = match eq.constraint {
            Constraint::Feedback(_) => 3,
            Constraint::Intensity(_)
            | Constraint::TotalForce(_)
            | Constraint::Volume(_)
            | Constraint::Answer(_) => 2,
        };
        let mut fresh = self.factored != h;
        let mut last = f64::INFINITY;
        for iteration in 1..=MAX_ITERATIONS {
            if fresh {
                let state = (&*new.nodes, &*new.velocity);
                self.linearise(eq, positions, state, new.intensity, work)?;
            }
            let change = self.iterate(
                eq,
                (positions, velocities),
                (&mut new.nodes, &mut new.velocity, &mut new.intensity),
                work,
            );
            let change = match change {
                Ok(change) if change.is_finite() => change,
                _ if fresh => {
                    self.forget();
                    return Err(change.err().unwrap_or(not_solved(iteration, f64::INFINITY)));
                }
                _ => f64::INFINITY,
            };
            let ratio = change / last;
            if change <= tolerance
                || (iteration >= least
                    && ratio < 1.0
                    && change * ratio / (1.0 - ratio) <= tolerance)
                || (iteration > 2 && ratio > 0.3 && self.is_rounding(eq, change))
            {
                return Ok(());
            }
            if iteration == MAX_ITERATIONS {
                self.forget();
                return Err(not_solved(iteration, change));
            }
            fresh = ratio > 0.05 && iteration > 1;
            if fresh && !change.is_finite() {
                slope(&now.nodes, positions, h, &mut new.velocity);
                new.nodes.copy_from_slice(&now.nodes);
                new.intensity = now.intensity;
            }
            last = change;
        }
        Ok(())
    }

    /// Whether a `change` of positions that no longer shrinks is within rounding.
    fn is_rounding(&self, eq: &Equation<'_>, change: f64) -> bool {
        let length = eq.body.length;
        match eq.secant {
            None => change <= STALL * length,
            Some(_) => {
                let step = dot_in_eight(&self.moved, &self.moved).sqrt();
                change * step <= SECANT_STALL * length * length
            }
        }
    }

    /// Filters an error estimate through the current matrix, if there is one.
    pub(crate) fn filter(&self, body: &Body, error: &mut LocalError) {
        if let Some(lu) = self.lu.factorisation() {
            error.filter(body, self.factored, |v| lu.solve_into(v));
        }
    }
}

/// Adds a multiple of `moved` to `derivative` so that their product equals the difference of the two values, unless it already does to
/// rounding.
fn add_secant(derivative: &mut [f64], moved: &[f64], [from, to]: [f64; 2]) {
    let square = dot_in_eight(moved, moved);
    let missing = to - from - dot_in_eight(derivative, moved);
    if square == 0.0 || missing.abs() <= 4.0 * f64::EPSILON * from.abs().max(to.abs()) {
        return;
    }
    let factor = missing / square;
    for (value, moved) in derivative.iter_mut().zip(moved) {
        *value += factor * moved;
    }
}

/// Sets velocities and nodes for the first iteration: by Taylor's series if the result is close; for a stiff step unchanged.
pub(crate) fn predict(
    new: &mut Kinematics,
    now: &Kinematics,
    positions: &[f64],
    (ahead, h): (f64, f64),
    length: f64,
) {
    let accelerations = now.acceleration.iter();
    let reach = accelerations.fold(0.0, |m: f64, a| m.max(a.abs()));
    if ahead * ahead * reach <= 0.01 * length {
        let slopes = now.velocity.iter().zip(&now.acceleration);
        for (w, (v, a)) in new.velocity.iter_mut().zip(slopes) {
            *w = v + ahead * a;
        }
    } else {
        slope(&now.nodes, positions, h, &mut new.velocity);
    }
    let moved = positions.iter().zip(&new.velocity);
    for (node, (start, w)) in new.nodes.iter_mut().zip(moved) {
        *node = start + h * w;
    }
}

/// Estimated error of a step, and buffers of its filter.
#[derive(Debug, Clone)]
pub(crate) struct LocalError {
    pub(crate) position: Vec<f64>,
    pub(crate) velocity: Vec<f64>,
    /// K times the error of the position.
    force: Vec<f64>,
}

impl LocalError {
    pub(crate) fn new(n: usize) -> Self {
        Self {
            position: vec![0.0; n],
            velocity: vec![0.0; n],
            force: vec![0.0; n],
        }
    }

    /// Filters the error through the matrix of an implicit stage, by which `solve` divides, so that stiff components have the weight that
    /// they have in the scheme (Hosea and Shampine 1996).
    pub(crate) fn filter(&mut self, body: &Body, h: f64, solve: impl FnOnce(&mut [f64])) {
        body.stiffness.mul_into(&self.position, &mut self.force);
        for (v, force) in self.velocity.iter_mut().zip(&self.force) {
            *v = body.mass * *v + h * force;
        }
        solve(&mut self.velocity);
        for (p, v) in self.position.iter_mut().zip(&self.velocity) {
            *p += h * v;
        }
    }
}

//! An implicit stage: the velocity w that balances momentum, and the intensity.

use std::error::Error;

use membrane_newton::membrane_forces::Tangent;
use membrane_newton::{
    BandedLu, Border, DiscreteMembrane, LineSearch, Measure, NewtonError, NewtonOptions,
    NewtonScratch, Refactor, ResidualSystem, dot_in_eight, newton_with,
};

use crate::body::Body;
use crate::constraint::{Answer, Constraint};
use crate::error::{ImplicitError, Result};
use crate::kinematics::{Kinematics, slope};
use crate::report::Work;
use crate::scheme::Jacobian;

const MAX_ITERATIONS: usize = 40;
/// Tolerance on the estimated error of positions, as a fraction of the membrane's length. It is below the rounding of a position because
/// forces amplify it by 1 / ds^2: only then does the energy report balance.
const SOLVE_TOLERANCE: f64 = 2e-17;
/// Changes below this fraction of the length that no longer shrink are rounding, over Newton's own limit of 1e-7.
const STALL: f64 = 0.1;
/// The same for discrete derivatives, for the product of the change and the step over the squared length: rounding of energies. Larger
/// changes may also converge slowly, because the matrix has no secants.
const SECANT_STALL: f64 = 1e-7;

/// Solves, for the velocity w and the intensity f,
///
/// ```text
/// (m + h mu) w = m v* + h [ F_e(c) + f n(c) ]        c = c* + h w
/// g(c, w, f) = 0                       f = f_t,   f S(c) = F_t,   V(c* + r w) = V_t   or   f = P(t, V(c), V'(c) w)
/// ```
///
/// by Newton with the matrix (m + h mu) I - h^2 (K + f dn/dc), bordered by g. All implicit schemes consist of such stages. The unknowns are
/// 2 N velocities, not 4 N positions and velocities.
#[derive(Debug, Clone)]
pub(crate) struct Stage {
    pub(crate) jacobian: Jacobian,
    pub(crate) matrix: Tangent,
    lu: BandedLu,
    /// Column -h n(c), row h dg/dc + dg/dw.
    pub(crate) border: Border,
    /// h of `lu` and `border`, NaN if there is none.
    factored: f64,
    /// F_e, and F_p (without the intensity for discrete derivatives), at the nodes c.
    forces: [Vec<f64>; 2],
    /// w, then f.
    unknowns: Vec<f64>,
    /// Change of the unknowns.
    step: Vec<f64>,
    /// c.
    nodes: Vec<f64>,
    /// c* + r w, and r w.
    end: Vec<f64>,
    moved: Vec<f64>,
    scratch: NewtonScratch,
}

/// Workspace of a scheme with implicit stages.
#[derive(Debug, Clone)]
pub(crate) struct Implicit {
    pub(crate) stage: Stage,
    pub(crate) buffers: [Vec<f64>; 3],
}

impl Implicit {
    pub(crate) fn new(body: &Body) -> Self {
        let stage = Stage::new(body);
        let buffers = [(); 3].map(|()| stage.nodes.clone());
        Self { stage, buffers }
    }
}

/// Position and time of a stage.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Equation<'a> {
    pub(crate) body: &'a Body,
    /// c* and v*.
    pub(crate) from: (&'a [f64], &'a [f64]),
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
    /// Converts the error of a solve.
    fn error(&self, error: NewtonError) -> ImplicitError {
        let Self { time, dt, .. } = *self;
        match error {
            NewtonError::Membrane(error) => ImplicitError::Forces { time, error },
            error => {
                // that of the load, as it was
                let of_load = error.source().and_then(|error| error.downcast_ref());
                let of_load = of_load.cloned();
                of_load.unwrap_or(ImplicitError::Step { time, dt, error })
            }
        }
    }

    /// Returns the unit of changes of a position in a step by `moved` in all.
    fn unit(&self, moved: f64) -> f64 {
        let length = self.body.length;
        match self.secant {
            None => STALL * length,
            Some(_) => length * (SECANT_STALL * length / moved).min(1.0),
        }
    }
}

struct System<'a> {
    stage: &'a mut Stage,
    eq: &'a Equation<'a>,
    /// Unit of changes of a position.
    unit: f64,
    /// Change of a position that counts as much as a unit of the intensity.
    per_intensity: f64,
    work: &'a mut Work,
}

impl System<'_> {
    /// Sets c; c* + r w and r w if they are used.
    fn place(&mut self, w: &[f64]) {
        let (positions, _) = self.eq.from;
        add_into(&mut self.stage.nodes, positions, self.eq.h, w);
        if self.eq.secant.is_some() || matches!(self.eq.constraint, Constraint::Volume(_)) {
            add_into(&mut self.stage.end, positions, self.eq.reach, w);
            let moved = self.stage.moved.iter_mut().zip(w);
            moved.for_each(|(moved, w)| *moved = self.eq.reach * w);
        }
    }

    /// F_e and F_p = `intensity` n at c, or their discrete derivatives over the step to its end.
    fn evaluate(&mut self, intensity: f64) -> Result<(), NewtonError> {
        let body = self.eq.body;
        let Stage {
            forces: [elastic, pressure],
            nodes,
            end,
            moved,
            ..
        } = &mut *self.stage;
        body.discrete.elastic_force_into(nodes, elastic);
        let Some([energy, volume]) = self.eq.secant else {
            body.discrete
                .pressure_force_into(nodes, intensity, pressure)?;
            return Ok(());
        };
        if elastic.iter().any(|force| force.is_nan()) {
            body.discrete.elastic_energy(nodes)?;
        }
        body.discrete.pressure_force_into(nodes, 1.0, pressure)?;
        let reached = body.discrete.elastic_energy(end)?;
        add_secant(elastic, moved, [reached, energy]);
        add_secant(pressure, moved, [volume, body.volume(end)]);
        pressure.iter_mut().for_each(|force| *force *= intensity);
        Ok(())
    }
}

impl ResidualSystem for System<'_> {
    fn len(&self) -> usize {
        self.stage.nodes.len() + 1
    }

    fn residual_into(&mut self, x: &[f64], out: &mut [f64]) -> Result<(), NewtonError> {
        let Equation {
            body, h, from, end, ..
        } = *self.eq;
        let (w, f) = (&x[..x.len() - 1], x[x.len() - 1]);
        self.work.force_calls += 1;
        self.place(w);
        self.evaluate(f)?;
        let (m, m_h) = (body.mass, body.inertia(h));
        let stage = &*self.stage;
        let forces = stage.forces[0].iter().zip(&stage.forces[1]);
        let momentum = from.1.iter().zip(w).zip(&body.volumes);
        for (out, ((e, p), ((v, w), volume))) in out.iter_mut().zip(forces.zip(momentum)) {
            *out = volume * (m_h * w - m * v) - h * (e + p);
        }
        body.hold(&mut out[..w.len()]);
        let now = || body.load_state(end, &stage.nodes, w);
        out[w.len()] = match self.eq.constraint {
            Constraint::Intensity(wanted) => f - wanted,
            Constraint::TotalForce(wanted) => {
                f * Measure::Surface.of(stage.nodes.as_chunks().0) - wanted
            }
            Constraint::Volume(wanted) => body.volume(&stage.end) - wanted,
            Constraint::Feedback(load) => f - load.at(&now()).map_err(NewtonError::user)?,
            Constraint::Answer(answer) => f - answer.intensity(&now()),
        };
        Ok(())
    }

    fn factor(&mut self, x: &[f64]) -> Result<(), NewtonError> {
        let Equation { body, h, end, .. } = *self.eq;
        let (w, f) = (&x[..x.len() - 1], x[x.len() - 1]);
        self.place(w);
        let stage = &mut *self.stage;
        stage.forget();
        body.stage_matrix_into(&stage.nodes, f, h, &mut stage.matrix)?;
        stage.lu.factor(&stage.matrix.band)?;
        self.work.factorisations += 1;
        let nodes = &*stage.nodes;
        let surface = || Measure::Surface.of(nodes.as_chunks().0);
        let answering = |answer: Answer| {
            let slope = -(h * answer.by_volume + answer.by_rate);
            (Some((Measure::Volume, nodes, slope)), 1.0)
        };
        // gradient of g, that of a measure times a factor, and its slope by f
        let (gradient, corner) = match self.eq.constraint {
            Constraint::Intensity(_) => (None, 1.0),
            // Without the rank-one part the intensity does not depend on the change of shape.
            Constraint::TotalForce(_) if stage.jacobian == Jacobian::Band => (None, surface()),
            Constraint::TotalForce(_) => (Some((Measure::Surface, nodes, h * f)), surface()),
            Constraint::Volume(_) => (Some((Measure::Volume, &*stage.end, self.eq.reach)), 0.0),
            Constraint::Feedback(load) => {
                let at = body.load_state(end, nodes, w);
                let answer = Answer::about(load, at, body.length, h);
                answering(answer.map_err(NewtonError::user)?)
            }
            Constraint::Answer(answer) => answering(answer),
        };
        let (column, row) = stage.border.column_and_row_mut();
        row.fill(0.0);
        column.fill(0.0);
        if let Some((measure, nodes, factor)) = gradient {
            body.discrete.measure_gradient_into(measure, nodes, row);
            body.hold(row);
            row.iter_mut().for_each(|g| *g *= factor);
        }
        let is_known = matches!(self.eq.constraint, Constraint::Intensity(_));
        if !is_known {
            body.discrete.pressure_force_into(nodes, -h, column)?;
            self.work.force_calls += 1;
        }
        let lu = &stage.lu;
        stage.border.eliminate(corner, |column| {
            if !is_known {
                lu.solve_into(column)?;
                body.hold(column);
            }
            Ok(())
        })?;
        stage.factored = h;
        Ok(())
    }

    fn solve_in_place(&mut self, rhs: &mut [f64]) -> Result<(), NewtonError> {
        self.work.iterations += 1;
        let (head, tail) = rhs.split_at_mut(self.stage.nodes.len());
        // Pivoting mixes fixed rows with their neighbours; rounding must not move an end.
        self.stage.lu.solve_into(head)?;
        self.eq.body.hold(head);
        tail[0] = self.stage.border.correct(head, tail[0])?;
        Ok(())
    }

    /// Only steps end the solve of a stage.
    fn residual_norm(&self, _residual: &[f64]) -> f64 {
        1.0
    }

    /// Largest change of a coordinate of the position, plus that of the intensity.
    fn step_norm(&self, step: &[f64]) -> f64 {
        let changes = step[..self.stage.nodes.len()].iter().map(|dw| dw.abs());
        // max() would ignore NaN
        let largest = changes.fold(0.0, |most, dw| if dw <= most { most } else { dw });
        let by_intensity = self.per_intensity * step[self.stage.nodes.len()].abs();
        (largest * self.eq.h + by_intensity) / self.unit
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
            unknowns: vec![0.0; zero.len() + 1],
            step: vec![0.0; zero.len() + 1],
            nodes: zero.clone(),
            end: zero.clone(),
            moved: zero,
            matrix,
            scratch: NewtonScratch::default(),
        }
    }

    /// Requires a new factorisation for the next solve.
    pub(crate) fn forget(&mut self) {
        self.factored = f64::NAN;
    }

    /// Solves the stage by Newton from the velocity and the intensity in `new`, with the current factorisation while it contracts, and sets
    /// its velocity, nodes and intensity. `now` is the start of the step.
    pub(crate) fn solve(
        &mut self,
        eq: &Equation<'_>,
        now: &Kinematics,
        new: &mut Kinematics,
        work: &mut Work,
    ) -> Result<()> {
        let intensity = new.intensity.abs().max(f64::MIN_POSITIVE);
        let (tolerance, per_intensity) = match eq.constraint {
            // acts in its own direction, in which the matrix of another state contracts less than in that of the first changes
            Constraint::Feedback(_) => (0.1 * SOLVE_TOLERANCE, 0.0),
            // a relative change of an intensity that follows from the shape counts as the same displacement of the whole membrane
            Constraint::TotalForce(_) => (SOLVE_TOLERANCE, eq.body.length / intensity),
            Constraint::Intensity(_) | Constraint::Volume(_) | Constraint::Answer(_) => {
                (SOLVE_TOLERANCE, 0.0)
            }
        };
        let moved = eq.reach * dot_in_eight(&new.velocity, &new.velocity).sqrt();
        let unit = eq.unit(moved);
        let options = NewtonOptions::default()
            .with_tolerances(0.0, tolerance * eq.body.length / unit)
            .with_max_iterations(MAX_ITERATIONS)
            .with_line_search(LineSearch::FullStep)
            .with_refactor(Refactor::WhenContractionAbove(0.05));
        let mut x = std::mem::take(&mut self.unknowns);
        let mut scratch = std::mem::take(&mut self.scratch);
        let n = self.nodes.len();
        let outcome = loop {
            // a panic of the user's feedback has taken the vector
            x.resize(n + 1, 0.0);
            x[..n].copy_from_slice(&new.velocity);
            x[n] = new.intensity;
            let stale = self.factored == eq.h;
            if !stale {
                scratch.forget_factorisation();
            }
            let stage = &mut *self;
            let mut system = System {
                stage,
                eq,
                unit,
                per_intensity,
                work,
            };
            let outcome = newton_with(&mut system, &mut x, &options, &mut scratch);
            if outcome.is_ok() || !stale {
                break outcome;
            }
            // again with a matrix of its own, from the start of the step
            self.forget();
            slope(&now.nodes, eq.from.0, eq.h, &mut new.velocity);
            new.intensity = now.intensity;
        };
        new.velocity.copy_from_slice(&x[..n]);
        new.intensity = x[n];
        add_into(&mut new.nodes, eq.from.0, eq.h, &new.velocity);
        (self.unknowns, self.scratch) = (x, scratch);
        outcome.map_err(|error| {
            self.forget();
            eq.error(error)
        })
    }

    /// Makes one Newton iteration from the velocity and the intensity in `new`, with a new factorisation.
    pub(crate) fn iterate(
        &mut self,
        eq: &Equation<'_>,
        new: &mut Kinematics,
        work: &mut Work,
    ) -> Result<()> {
        let mut x = std::mem::take(&mut self.unknowns);
        let mut step = std::mem::take(&mut self.step);
        let n = self.nodes.len();
        x.resize(n + 1, 0.0);
        step.resize(n + 1, 0.0);
        x[..n].copy_from_slice(&new.velocity);
        x[n] = new.intensity;
        let stage = &mut *self;
        let mut system = System {
            stage,
            eq,
            unit: 1.0,
            per_intensity: 0.0,
            work,
        };
        let solved = (system.factor(&x))
            .and_then(|()| system.residual_into(&x, &mut step))
            .and_then(|()| system.solve_in_place(&mut step));
        for (w, dw) in new.velocity.iter_mut().zip(&step) {
            *w -= dw;
        }
        new.intensity -= step[n];
        add_into(&mut new.nodes, eq.from.0, eq.h, &new.velocity);
        (self.unknowns, self.step) = (x, step);
        solved.map_err(|error| eq.error(error))
    }

    /// Filters an error estimate through the current matrix.
    pub(crate) fn filter(&self, body: &Body, error: &mut LocalError) {
        // A step was made, so there is a factorisation.
        error.filter(body, self.factored, |v| self.lu.solve_into(v).unwrap_or(()));
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

/// Sets the velocity for the first iteration of a stage from `positions` over h that ends `ahead` in time: by Taylor's series if the result
/// is close; for a stiff step unchanged positions.
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
    add_into(&mut new.nodes, positions, h, &new.velocity);
}

/// `out` = `start` + h w.
fn add_into(out: &mut [f64], start: &[f64], h: f64, w: &[f64]) {
    for (out, (start, w)) in out.iter_mut().zip(start.iter().zip(w)) {
        *out = start + h * w;
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

//! One step of a scheme for one membrane: stages, energy, error estimate. Nothing is allocated here.

mod runge_kutta;

use membrane_newton::DiscreteMembrane;
use membrane_newton::Measure;

use crate::body::{FARTHEST, MovingMembrane};
use crate::drive::DriveKind;
use crate::energy::{Energy, Ledger};
use crate::error::ImplicitError;
use crate::scheme::{Family, Jacobian, Scheme, Tableau};
use crate::springs::Springs;
use crate::stage::{Stage, dot, hold_ends};
use crate::target::Target;
use crate::work::Work;

/// Position, velocity and acceleration at one instant, flat.
#[derive(Debug, Clone)]
pub(crate) struct Instant {
    pub(crate) time: f64,
    pub(crate) nodes: Vec<f64>,
    pub(crate) velocity: Vec<f64>,
    pub(crate) acceleration: Vec<f64>,
    /// Pressure force.
    pressure: Vec<f64>,
    pub(crate) intensity: f64,
    /// Power of the pressure force, and |v|^2, both integrated over s.
    pressure_power: f64,
    speed_squared: f64,
}

#[derive(Debug, Clone)]
pub(crate) struct Stepper {
    pub(crate) body: MovingMembrane,
    pub(crate) scheme: Scheme,
    tableau: Tableau,
    jacobian: Jacobian,
    kind: DriveKind,
    length: f64,
    stage: Stage,
    springs: Springs,
    /// Stage 0 is the present.
    instants: Vec<Instant>,
    pub(crate) old: Instant,
    /// c* and v* of the stage being solved.
    start: (Vec<f64>, Vec<f64>),
    scratch: Vec<f64>,
    error: (Vec<f64>, Vec<f64>),
    /// Difference quotient of the derivative over the previous step, for the trapezoidal rule.
    has_history: bool,
    ledger: Ledger,
    /// Account of the attempted step, for the scheme that has no tableau.
    pending: Ledger,
    stage_times: Vec<f64>,
    pub(crate) work: Work,
}

impl Stepper {
    pub(crate) fn new(body: MovingMembrane, scheme: Scheme, kind: DriveKind) -> Self {
        let nodes = body.differences.start().to_vec();
        let n = nodes.len();
        let zero = || vec![0.0; n];
        let instant = Instant {
            time: 0.0,
            nodes,
            velocity: zero(),
            acceleration: zero(),
            pressure: zero(),
            intensity: 0.0,
            pressure_power: 0.0,
            speed_squared: 0.0,
        };
        let tableau = scheme.tableau();
        let stage_times = match scheme.family() {
            Family::Splitting | Family::ImplicitSplitting => {
                let drifts = scheme.splitting().1;
                (1..=drifts.len())
                    .map(|k| drifts[..k].iter().sum())
                    .collect()
            }
            Family::ExplicitStages | Family::ImplicitStages | Family::Linearised => {
                tableau.c[1..tableau.stages].to_vec()
            }
        };
        Self {
            length: body.length_scale(),
            stage: Stage::new(&body),
            springs: Springs::new(body.n_nodes()),
            scheme,
            tableau,
            jacobian: Jacobian::Exact,
            kind,
            instants: vec![instant.clone(); tableau.stages],
            old: instant,
            start: (zero(), zero()),
            scratch: zero(),
            error: (zero(), zero()),
            has_history: false,
            ledger: Ledger::default(),
            pending: Ledger::default(),
            stage_times,
            work: Work::default(),
            body,
        }
    }

    pub(crate) fn set_jacobian(&mut self, jacobian: Jacobian) {
        self.jacobian = jacobian;
        self.stage.forget();
    }

    pub(crate) fn set_time(&mut self, time: f64) {
        self.instants[0].time = time;
    }

    pub(crate) fn now(&self) -> &Instant {
        &self.instants[0]
    }

    /// Sets position and velocity; the intensity and acceleration follow in [`Stepper::begin`].
    pub(crate) fn set(&mut self, time: f64, nodes: &[f64], velocity: &[f64]) {
        let now = &mut self.instants[0];
        now.time = time;
        now.nodes.copy_from_slice(nodes);
        now.velocity.copy_from_slice(velocity);
        hold_ends(&mut now.velocity);
        self.ledger = Ledger::default();
        self.has_history = false;
    }

    /// Intensity and acceleration at the present state. `target` is what the drive prescribes now, but for a volume its
    /// second time derivative.
    pub(crate) fn begin(&mut self, target: Target<'_>) -> Result<(), ImplicitError> {
        self.evaluate(0, target)
    }

    fn evaluate(&mut self, index: usize, target: Target<'_>) -> Result<(), ImplicitError> {
        let Self {
            body,
            stage,
            instants,
            start: (force, row),
            error: (moved, _),
            ..
        } = self;
        let at = &mut instants[index];
        let d = &body.differences;
        let time = at.time;
        let membrane = |error| ImplicitError::Membrane { time, error };
        d.elastic_force_into(&at.nodes, force);
        stage.force_calls += 1;
        let intensity = if let Target::Volume(acceleration) = target {
            // m V'' = grad V . (F_e + f n - mu v) + m v . H v
            d.pressure_force_into(&at.nodes, 1.0, &mut at.pressure)
                .map_err(membrane)?;
            Measure::Volume.gradient_into(at.nodes.as_chunks().0, row.as_chunks_mut().0);
            hold_ends(row);
            let per_intensity = dot(row, &at.pressure);
            let rate = dot(row, &at.velocity);
            let pull = dot(row, force);
            let bend = curvature_of_volume(&at.nodes, &at.velocity, moved, row);
            (body.mass * (acceleration - bend) - pull + body.damping * rate) / per_intensity
        } else {
            target.intensity(time, &at.nodes, &at.velocity, f64::NAN)?
        };
        if !intensity.is_finite() {
            let value = intensity;
            return Err(ImplicitError::BadDrive { time, value });
        }
        at.intensity = intensity;
        d.pressure_force_into(&at.nodes, intensity, &mut at.pressure)
            .map_err(membrane)?;
        let (inverse_mass, mu) = (1.0 / body.mass, body.damping);
        let forces = force.iter().zip(&at.pressure).zip(&at.velocity);
        for (a, ((e, p), v)) in at.acceleration.iter_mut().zip(forces) {
            *a = (e + p - mu * v) * inverse_mass;
        }
        hold_ends(&mut at.acceleration);
        at.measure(d.ds());
        Ok(())
    }

    /// Second time derivative of the enclosed volume at the present state.
    pub(crate) fn volume_acceleration(&mut self) -> f64 {
        let Self {
            instants,
            start: (_, row),
            error,
            ..
        } = self;
        let now = &instants[0];
        Measure::Volume.gradient_into(now.nodes.as_chunks().0, row.as_chunks_mut().0);
        dot(row, &now.acceleration)
            + curvature_of_volume(&now.nodes, &now.velocity, &mut error.0, row)
    }

    /// Times, in units of the step, at which [`Stepper::attempt`] wants the drive's value.
    pub(crate) fn stage_times(&self) -> &[f64] {
        &self.stage_times
    }

    /// Volume at the end of stage `index` (from 1) of the step just attempted.
    pub(crate) fn stage_volume(&self, index: usize) -> f64 {
        Measure::Volume.of(self.instants[index].nodes.as_chunks().0)
    }

    /// Time at the end of the step just attempted.
    pub(crate) fn end_time(&self) -> f64 {
        self.instants[self.tableau.stages - 1].time
    }

    /// Volume at the end of the step just attempted.
    pub(crate) fn end_volume(&self) -> f64 {
        self.stage_volume(self.tableau.stages - 1)
    }

    /// Makes the stages of a step without accepting it. `targets` are the drive's values at
    /// [`Stepper::stage_times`].
    pub(crate) fn attempt(&mut self, dt: f64, targets: &[Target<'_>]) -> Result<(), ImplicitError> {
        let last = self.tableau.stages - 1;
        for (index, &target) in (1..=last).zip(targets) {
            let made = match self.scheme.family() {
                Family::ExplicitStages => self.explicit_stage(index, dt, target),
                Family::ImplicitStages => self.solve_stage(index, dt, target),
                Family::Linearised => self.linearised_step(dt, target),
                Family::Splitting => self.split_step(dt, targets),
                Family::ImplicitSplitting => self.kick_and_relax(dt, target),
            };
            made.map_err(|error| self.runaway(index, dt).unwrap_or(error))?;
        }
        match self.runaway(last, dt) {
            Some(error) => {
                self.stage.forget();
                Err(error)
            }
            None => Ok(()),
        }
    }

    /// What stage `index` of a step of length `dt` says if it went too far to be a membrane, be it by NaN.
    fn runaway(&self, index: usize, dt: f64) -> Option<ImplicitError> {
        let at = &self.instants[index];
        // any number too large makes the sum of squares so
        if dot(&at.nodes, &at.nodes) + dot(&at.velocity, &at.velocity) <= FARTHEST * FARTHEST {
            return None;
        }
        let positions = at.nodes.iter().map(|value| ("position", value));
        let velocities = at.velocity.iter().map(|value| ("velocity", value));
        let size = |value: f64| {
            if value.is_nan() {
                f64::INFINITY
            } else {
                value.abs()
            }
        };
        let (k, (quantity, &value)) = (positions.enumerate())
            .chain(velocities.enumerate())
            .max_by(|(_, (_, a)), (_, (_, b))| size(**a).total_cmp(&size(**b)))?;
        Some(ImplicitError::Unstable {
            step: self.work.steps + 1,
            time: self.now().time,
            dt,
            quantity,
            node: k / 2,
            value,
        })
    }

    /// Scaled local error of the attempted step (1 is just acceptable); `None` where the scheme
    /// needs a previous step that there has not been yet.
    pub(crate) fn error(&mut self, tolerance: (f64, f64)) -> Option<f64> {
        let last = self.tableau.stages - 1;
        let dt = self.instants[last].time - self.instants[0].time;
        let (position, velocity) = (&mut self.error.0, &mut self.error.1);
        position.fill(0.0);
        velocity.fill(0.0);
        let mut add = |instant: &Instant, weight: f64| {
            add_slopes(
                std::slice::from_ref(instant),
                &[1.0],
                weight,
                position,
                velocity,
            );
        };
        match self.tableau.e {
            Some(e) => add_slopes(&self.instants, &e, dt, position, velocity),
            None if self.has_history => {
                // dt^3 / 12 of the third derivative: second divided difference of the first one
                let before = self.instants[0].time - self.old.time;
                let weight = dt.powi(3) / (6.0 * (dt + before));
                add(&self.instants[last], weight / dt);
                add(&self.instants[0], -weight / dt - weight / before);
                add(&self.old, weight / before);
            }
            None => return None,
        }
        match self.scheme.family() {
            Family::ImplicitSplitting => {
                let h = 0.5 * dt;
                self.stage.elastic.mul_into(position, &mut self.scratch);
                for (out, v) in self.scratch.iter_mut().zip(velocity.iter()) {
                    *out = self.body.mass * v + h * *out;
                }
                self.springs.solve_in_place(&mut self.scratch);
                velocity.copy_from_slice(&self.scratch);
                for (p, v) in position.iter_mut().zip(velocity.iter()) {
                    *p += h * v;
                }
            }
            Family::ImplicitStages | Family::Linearised => {
                self.stage.filter(&self.body, position, velocity);
            }
            Family::ExplicitStages | Family::Splitting => {}
        }
        let rms = |v: &[f64]| (v.iter().map(|e| e * e).sum::<f64>() / (v.len() / 2) as f64).sqrt();
        let by_position = rms(position) / tolerance.0;
        Some(match self.kind {
            // A prescribed volume makes the velocity follow V' at once, so its error does not
            // shrink with dt where that jumps: what counts is how far it moves the membrane
            // (index 3; Hairer and Wanner 1996, VII.3 scale the same way).
            DriveKind::Volume => by_position.max(dt * rms(velocity) / tolerance.0),
            _ => by_position.max(rms(velocity) / tolerance.1),
        })
    }

    pub(crate) fn error_exponent(&self) -> f64 {
        1.0 / f64::from(self.tableau.estimate)
    }

    /// Makes the attempted step the present.
    pub(crate) fn accept(&mut self) {
        let last = self.tableau.stages - 1;
        let dt = self.instants[last].time - self.instants[0].time;
        self.settle_energy(dt);
        self.instants.swap(0, last);
        std::mem::swap(&mut self.old, &mut self.instants[last]);
        self.has_history = true;
        self.work.steps += 1;
        self.work.factorisations = self.stage.factorisations;
        self.work.force_calls = self.stage.force_calls;
    }

    /// Work, damping and numerical loss of the attempted step; see [`crate::Energy`].
    fn settle_energy(&mut self, dt: f64) {
        let Tableau { stages, a, b, .. } = self.tableau;
        let ds = self.body.differences.ds();
        let pending = std::mem::take(&mut self.pending);
        self.ledger.work += pending.work;
        self.ledger.damping += pending.damping;
        self.ledger.numerical += pending.numerical;
        for i in 0..stages {
            self.ledger.work += dt * b[i] * self.instants[i].pressure_power;
            self.ledger.damping += dt * b[i] * self.body.damping * self.instants[i].speed_squared;
        }
        let mut loss = 0.0;
        for j in 0..stages {
            if (0..stages).all(|i| b[i] * a[i][j] + b[j] * a[j][i] - b[i] * b[j] == 0.0) {
                continue;
            }
            self.stage
                .elastic
                .mul_into(&self.instants[j].velocity, &mut self.scratch);
            for i in 0..stages {
                let m = b[i] * a[i][j] + b[j] * a[j][i] - b[i] * b[j];
                if m != 0.0 {
                    let (k, other) = (&self.instants[i], &self.instants[j]);
                    loss += m
                        * (self.body.mass * dot(&k.acceleration, &other.acceleration)
                            - dot(&k.velocity, &self.scratch));
                }
            }
        }
        self.ledger.numerical += 0.5 * dt * dt * ds * loss;
    }

    /// Energy now and what the ledger holds; `initial` is left to the caller.
    pub(crate) fn energy(&self) -> Energy {
        let now = self.now();
        let d = &self.body.differences;
        Energy {
            kinetic: 0.5 * self.body.mass * d.ds() * dot(&now.velocity, &now.velocity),
            elastic: d.elastic_energy(&now.nodes),
            initial: 0.0,
            pressure_work: self.ledger.work,
            damping_loss: self.ledger.damping,
            numerical_loss: self.ledger.numerical,
        }
    }

    /// A first step over which the acceleration moves a node by about the tolerance.
    pub(crate) fn first_step(&self, tolerance: f64) -> f64 {
        let now = self.now();
        let n = (now.nodes.len() / 2) as f64;
        let rms = |v: &[f64]| (dot(v, v) / n).sqrt();
        let by_acceleration = (tolerance / rms(&now.acceleration)).sqrt();
        let by_velocity = 0.1 * self.length / rms(&now.velocity);
        let step = by_acceleration.min(by_velocity);
        if step.is_finite() && step > 0.0 {
            step
        } else {
            self.body.largest_explicit_step()
        }
    }

    /// Norms over s, (integral of |.|^2 ds)^(1/2), of F_p + F_e and of the velocity, at the present.
    pub(crate) fn norms(&mut self) -> Result<(f64, f64), ImplicitError> {
        let now = &self.instants[0];
        let d = &self.body.differences;
        d.elastic_force_into(&now.nodes, &mut self.start.0);
        d.pressure_force_into(&now.nodes, now.intensity, &mut self.scratch)
            .map_err(|error| ImplicitError::Membrane {
                time: now.time,
                error,
            })?;
        let sum: f64 = self
            .start
            .0
            .iter()
            .zip(&self.scratch)
            .map(|(e, p)| (e + p) * (e + p))
            .sum();
        Ok((
            (d.ds() * sum).sqrt(),
            (d.ds() * dot(&now.velocity, &now.velocity)).sqrt(),
        ))
    }
}

impl Instant {
    fn measure(&mut self, ds: f64) {
        self.pressure_power = ds * dot(&self.pressure, &self.velocity);
        self.speed_squared = ds * dot(&self.velocity, &self.velocity);
    }
}

/// `positions`, `velocities` += dt sum a_j (v_j, a_j).
fn add_slopes(
    before: &[Instant],
    a: &[f64],
    dt: f64,
    positions: &mut [f64],
    velocities: &mut [f64],
) {
    for (instant, a) in before.iter().zip(a) {
        if *a != 0.0 {
            let a = dt * a;
            let axpy = |out: &mut [f64], slope: &[f64]| {
                out.iter_mut()
                    .zip(slope)
                    .for_each(|(out, slope)| *out += a * slope);
            };
            axpy(positions, &instant.velocity);
            axpy(velocities, &instant.acceleration);
        }
    }
}

/// v . H v of the volume, by a difference of its gradient along v; `row` holds the gradient at
/// `nodes` and keeps it.
fn curvature_of_volume(nodes: &[f64], velocity: &[f64], moved: &mut [f64], row: &mut [f64]) -> f64 {
    let speed = velocity.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    if speed == 0.0 {
        return 0.0;
    }
    let size = nodes.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    let step = 1e-5 * size / speed;
    let mut slope = |sign: f64| {
        for i in 0..nodes.len() {
            moved[i] = nodes[i] + sign * step * velocity[i];
        }
        Measure::Volume.gradient_into(moved.as_chunks().0, row.as_chunks_mut().0);
        dot(row, velocity)
    };
    let bend = (slope(1.0) - slope(-1.0)) / (2.0 * step);
    Measure::Volume.gradient_into(nodes.as_chunks().0, row.as_chunks_mut().0);
    hold_ends(row);
    bend
}

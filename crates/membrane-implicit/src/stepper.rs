//! One membrane carried through time by the steps of a scheme. Nothing is allocated in a step.

mod linearised;
mod runge_kutta;
mod splitting;

use membrane_newton::{DiscreteMembrane, dot_in_eight as dot};

use crate::body::{FARTHEST, MovingMembrane, hold_ends};
use crate::drive::DriveKind;
use crate::energy::{Energy, Ledger};
use crate::error::{ImplicitError, length, within};
use crate::instant::{Instant, Step, add_slopes, slope, volume_gradient};
use crate::scheme::{Family, Jacobian, Scheme, Tableau};
use crate::stage::{LocalError, Stage};
use crate::target::Target;
use crate::work::Work;
use linearised::Linearised;
use runge_kutta::{ImplicitStages, explicit_stage};
use splitting::{ImplicitSplitting, kick_and_drift};

/// How a step is made, with the workspace for it.
#[derive(Debug, Clone)]
enum Method {
    ExplicitStages,
    ImplicitStages(ImplicitStages),
    Linearised(Linearised),
    Splitting,
    ImplicitSplitting(ImplicitSplitting),
}

#[derive(Debug, Clone)]
pub(crate) struct Stepper {
    pub(crate) body: MovingMembrane,
    pub(crate) scheme: Scheme,
    tableau: Tableau,
    kind: DriveKind,
    method: Method,
    /// Stage 0 is the present.
    instants: Vec<Instant>,
    /// Start of the step that led here; the present, if none did.
    old: Instant,
    error: LocalError,
    /// F_e and F_p of the present for [`Stepper::norms`]; K times a velocity for the account.
    forces: [Vec<f64>; 2],
    ledger: Ledger,
    /// Account of the attempted step, of a scheme that has no tableau.
    pending: Ledger,
    drive_times: Vec<f64>,
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
        Self {
            method: match scheme.family() {
                Family::ExplicitStages => Method::ExplicitStages,
                Family::ImplicitStages => Method::ImplicitStages(ImplicitStages::new(&body)),
                Family::Linearised => Method::Linearised(Linearised::new(&body)),
                Family::Splitting => Method::Splitting,
                Family::ImplicitSplitting => {
                    Method::ImplicitSplitting(ImplicitSplitting::new(&body))
                }
            },
            drive_times: scheme.drive_times(),
            scheme,
            tableau,
            kind,
            instants: vec![instant.clone(); tableau.stages],
            old: instant,
            error: LocalError::new(n),
            forces: [zero(), zero()],
            ledger: Ledger::default(),
            pending: Ledger::default(),
            work: Work::default(),
            body,
        }
    }

    pub(crate) fn set_jacobian(&mut self, jacobian: Jacobian) {
        if let Some(stage) = self.stage() {
            stage.jacobian = jacobian;
            stage.forget();
        }
    }

    /// The stages that are solved for, if the scheme has any.
    fn stage(&mut self) -> Option<&mut Stage> {
        match &mut self.method {
            Method::ImplicitStages(stages) => Some(&mut stages.stage),
            Method::Linearised(linearised) => Some(&mut linearised.stage),
            Method::ExplicitStages | Method::Splitting | Method::ImplicitSplitting(_) => None,
        }
    }

    pub(crate) fn set_time(&mut self, time: f64) {
        self.instants[0].time = time;
    }

    pub(crate) fn now(&self) -> &Instant {
        &self.instants[0]
    }

    /// The end of the step just attempted.
    pub(crate) fn end(&self) -> &Instant {
        &self.instants[self.instants.len() - 1]
    }

    /// Sets position and velocity; the intensity and acceleration follow in [`Stepper::begin`].
    pub(crate) fn set(&mut self, time: f64, nodes: &[f64], velocity: &[f64]) {
        let now = &mut self.instants[0];
        now.time = time;
        now.nodes.copy_from_slice(nodes);
        now.velocity.copy_from_slice(velocity);
        hold_ends(&mut now.velocity);
        self.old.clone_from(now);
        self.ledger = Ledger::default();
    }

    /// Intensity and acceleration at the present state. `target` is what the drive prescribes now, but for a volume its
    /// second time derivative.
    pub(crate) fn begin(&mut self, target: Target<'_>) -> Result<(), ImplicitError> {
        let Self { body, work, .. } = self;
        let now = &mut self.instants[0];
        let intensity = if let Target::Volume(acceleration) = target {
            // m V'' = grad V . (F_e + f n - mu v) + m v . H v
            body.differences
                .elastic_force_into(&now.nodes, &mut now.acceleration);
            body.pressure_into(now.time, &now.nodes, 1.0, &mut now.pressure)?;
            let gradient = now.volume_gradient();
            let (pull, rate) = (
                dot(&gradient, &now.acceleration),
                dot(&gradient, &now.velocity),
            );
            (body.mass * (acceleration - now.volume_curvature()) - pull + body.damping * rate)
                / dot(&gradient, &now.pressure)
        } else {
            target.intensity(now.time, &now.nodes, &now.velocity, f64::NAN)?
        };
        work.force_calls += 1;
        now.respond(body, intensity)
    }

    /// Second time derivative of the enclosed volume at the present state.
    pub(crate) fn volume_acceleration(&self) -> f64 {
        let now = self.now();
        dot(&volume_gradient(&now.nodes), &now.acceleration) + now.volume_curvature()
    }

    /// Times, in units of the step, at which [`Stepper::attempt`] wants the drive's value.
    pub(crate) fn drive_times(&self) -> &[f64] {
        &self.drive_times
    }

    /// Volume at the end of stage `index` (from 1) of the step just attempted.
    pub(crate) fn stage_volume(&self, index: usize) -> f64 {
        self.instants[index].volume()
    }

    /// Makes the stages of a step without accepting it. `targets` are the drive's values at
    /// [`Stepper::drive_times`].
    pub(crate) fn attempt(&mut self, dt: f64, targets: &[Target<'_>]) -> Result<(), ImplicitError> {
        let last = self.tableau.stages - 1;
        for (index, &target) in (1..=last).zip(targets) {
            let step = Step {
                body: &self.body,
                instants: &mut self.instants,
                dt,
                work: &mut self.work,
            };
            let (tableau, none) = (&self.tableau, Ledger::default());
            let account = match &mut self.method {
                Method::ExplicitStages => {
                    explicit_stage(step, tableau, index, target).map(|()| none)
                }
                Method::ImplicitStages(stages) => {
                    stages.solve(step, tableau, index, target).map(|()| none)
                }
                Method::Linearised(linearised) => linearised.step(step, target).map(|()| none),
                Method::Splitting => kick_and_drift(step, self.scheme.splitting(), targets),
                Method::ImplicitSplitting(splitting) => splitting.kick_and_relax(step, target),
            };
            self.pending = account.map_err(|error| self.runaway(index, dt).unwrap_or(error))?;
        }
        match self.runaway(last, dt) {
            Some(error) => {
                self.stage().into_iter().for_each(Stage::forget);
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
        let (k, (what, &value)) = (positions.enumerate())
            .chain(velocities.enumerate())
            .max_by(|(_, (_, a)), (_, (_, b))| size(**a).total_cmp(&size(**b)))?;
        Some(ImplicitError::Unstable {
            step: self.work.steps + 1,
            time: self.now().time,
            dt,
            what,
            node: k / 2,
            value,
        })
    }

    /// Scaled local error of the attempted step (1 is just acceptable); `None` where the estimate needs a previous step and
    /// there is none.
    pub(crate) fn error(&mut self, tolerance: (f64, f64)) -> Option<f64> {
        let last = self.tableau.stages - 1;
        let (now, new) = (&self.instants[0], &self.instants[last]);
        let (dt, before) = (new.time - now.time, now.time - self.old.time);
        let LocalError {
            position, velocity, ..
        } = &mut self.error;
        position.fill(0.0);
        velocity.fill(0.0);
        let mut add = |instants: &[Instant], weights: &[f64], dt: f64| {
            add_slopes(instants, weights, dt, position, velocity);
        };
        match self.tableau.e {
            Some(e) => add(&self.instants, &e, dt),
            None if before > 0.0 => {
                // dt^3 / 12 of the third derivative: second divided difference of the first one
                let weight = dt.powi(3) / (6.0 * (dt + before));
                let mut add_one =
                    |at: &Instant, weight| add(std::slice::from_ref(at), &[1.0], weight);
                add_one(new, weight / dt);
                add_one(now, -weight / dt - weight / before);
                add_one(&self.old, weight / before);
            }
            None => return None,
        }
        let (body, error) = (&self.body, &mut self.error);
        match &self.method {
            Method::ImplicitStages(stages) => stages.stage.filter(body, error),
            Method::Linearised(linearised) => linearised.stage.filter(body, error),
            Method::ImplicitSplitting(splitting) => splitting.filter(body, 0.5 * dt, error),
            Method::ExplicitStages | Method::Splitting => (),
        }
        Some(self.scaled_error(tolerance, dt))
    }

    /// Scaled local error of the attempted step by step doubling: `halves` has attempted the second of two steps of half the
    /// length from the same state. With order p, these have the fraction 2^-p of the error of the whole step.
    pub(crate) fn error_by_doubling(&mut self, halves: &Self, tolerance: (f64, f64)) -> f64 {
        let (whole, halves) = (&self.instants[self.tableau.stages - 1], halves.end());
        let error = &mut self.error;
        let dt = whole.time - self.instants[0].time;
        // difference = (1 - 2^-p) error of the whole step
        let fraction = 1.0 - 0.5f64.powi(self.tableau.order);
        slope(&whole.nodes, &halves.nodes, fraction, &mut error.position);
        slope(
            &whole.velocity,
            &halves.velocity,
            fraction,
            &mut error.velocity,
        );
        self.scaled_error(tolerance, dt)
    }

    /// Size of `error` over the tolerances, of a step of length `dt`.
    fn scaled_error(&self, tolerance: (f64, f64), dt: f64) -> f64 {
        let LocalError {
            position, velocity, ..
        } = &self.error;
        let rms = |v: &[f64]| (v.iter().map(|e| e * e).sum::<f64>() / (v.len() / 2) as f64).sqrt();
        let by_position = rms(position) / tolerance.0;
        match self.kind {
            // A prescribed volume makes the velocity follow V' at once, so its error does not
            // shrink with dt where that jumps: what counts is how far it moves the membrane
            // (index 3; Hairer and Wanner 1996, VII.3 scale the same way).
            DriveKind::Volume => by_position.max(dt * rms(velocity) / tolerance.0),
            _ => by_position.max(rms(velocity) / tolerance.1),
        }
    }

    pub(crate) fn error_exponent(&self) -> f64 {
        1.0 / f64::from(self.tableau.estimate)
    }

    /// Makes the attempted step the present.
    pub(crate) fn accept(&mut self) {
        let last = self.tableau.stages - 1;
        self.settle_energy(self.end().time - self.now().time);
        self.instants.swap(0, last);
        std::mem::swap(&mut self.old, &mut self.instants[last]);
        self.work.steps += 1;
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
            let [force, _] = &mut self.forces;
            self.body
                .springs
                .mul_into(&self.instants[j].velocity, force);
            for i in 0..stages {
                let m = b[i] * a[i][j] + b[j] * a[j][i] - b[i] * b[j];
                if m != 0.0 {
                    let (k, other) = (&self.instants[i], &self.instants[j]);
                    loss += m
                        * (self.body.mass * dot(&k.acceleration, &other.acceleration)
                            - dot(&k.velocity, force));
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
        let by_velocity = 0.1 * self.body.length / rms(&now.velocity);
        let step = by_acceleration.min(by_velocity);
        if step.is_finite() && step > 0.0 {
            step
        } else {
            self.body.largest_explicit_step()
        }
    }

    /// Norms over s, (integral of |.|^2 ds)^(1/2), of F_p + F_e and of the velocity, at the present.
    pub(crate) fn norms(&mut self) -> Result<(f64, f64), ImplicitError> {
        let (now, d) = (&self.instants[0], &self.body.differences);
        let [elastic, pressure] = &mut self.forces;
        d.elastic_force_into(&now.nodes, elastic);
        (self.body).pressure_into(now.time, &now.nodes, now.intensity, pressure)?;
        let pairs = elastic.iter().zip(&*pressure);
        let sum: f64 = pairs.map(|(e, p)| (e + p) * (e + p)).sum();
        Ok((
            (d.ds() * sum).sqrt(),
            (d.ds() * dot(&now.velocity, &now.velocity)).sqrt(),
        ))
    }

    /// Shape and velocity at a time within the last step: cubic Hermite interpolation of positions (from velocities) and
    /// velocities (from accelerations).
    pub(crate) fn at_into(
        &self,
        time: f64,
        points: &mut [[f64; 2]],
        velocities: &mut [[f64; 2]],
    ) -> Result<(), ImplicitError> {
        let (old, now) = (&self.old, self.now());
        within("time", time, old.time, now.time)?;
        let n = now.nodes.len() / 2;
        length("points", points.len(), n)?;
        length("velocities", velocities.len(), n)?;
        let dt = now.time - old.time;
        let t = if dt > 0.0 {
            (time - old.time) / dt
        } else {
            1.0
        };
        let s = 1.0 - t;
        // 1 - 3 t^2 + 2 t^3 and its fellows
        let (h00, h10) = (s * s * (1.0 + 2.0 * t), dt * t * s * s);
        let (h01, h11) = (t * t * (1.0 + 2.0 * s), -dt * t * t * s);
        let mix = |out: &mut [[f64; 2]], a: &[f64], da: &[f64], b: &[f64], db: &[f64]| {
            for (i, out) in out.as_flattened_mut().iter_mut().enumerate() {
                *out = h00 * a[i] + h10 * da[i] + h01 * b[i] + h11 * db[i];
            }
        };
        let (v0, v1) = (&old.velocity, &now.velocity);
        mix(points, &old.nodes, v0, &now.nodes, v1);
        mix(velocities, v0, &old.acceleration, v1, &now.acceleration);
        Ok(())
    }
}

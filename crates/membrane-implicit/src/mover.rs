//! The motion of one membrane by the steps of a scheme. A step allocates nothing.

use membrane_newton::membrane_forces::Material;
use membrane_newton::{DiscreteMembrane, MembraneError, dot_in_eight as dot};

use crate::body::{Body, FARTHEST};
use crate::constraint::Constraint;
use crate::energy::Ledger;
use crate::error::{ImplicitError, Result};
use crate::kinematics::{Kinematics, Step, add_slopes, slope, volume_gradient};
use crate::method::splitting::{ImplicitSplitting, kick_and_drift};
use crate::method::stage::{Implicit, LocalError, Stage};
use crate::report::{Energy, Work};
use crate::scheme::{Jacobian, LoadKind, Scheme};

/// The method of a step, with its workspace.
#[derive(Debug, Clone)]
enum Method {
    SemiImplicitEuler(Implicit),
    TrBdf2(Implicit),
    Midpoint(Implicit),
    Splitting,
    ImplicitSplitting(ImplicitSplitting),
}

/// Factor on an error estimated from accelerations: with it the true error is within the tolerance in 99 of 100 steps, and almost always
/// within 1.5 times the tolerance.
const SAFETY: f64 = 2.0;

#[derive(Debug, Clone)]
pub(crate) struct Mover {
    pub(crate) body: Body,
    pub(crate) scheme: Scheme,
    load: LoadKind,
    method: Method,
    /// The current state first, the end of the attempted step last.
    stages: Vec<Kinematics>,
    /// Start of the last step; the current state before the first step.
    old: Kinematics,
    error: LocalError,
    /// F_e and F_p of the current state for [`Mover::norms`].
    forces: [Vec<f64>; 2],
    ledger: Ledger,
    /// Account of the attempted step.
    pending: Ledger,
    /// Times, in units of the step, at which [`Mover::attempt`] needs the value of the load.
    pub(crate) load_times: Vec<f64>,
    pub(crate) work: Work,
    /// Work array of [`Body::check_walls`].
    order: Vec<usize>,
}

impl Mover {
    pub(crate) fn new(body: Body, scheme: Scheme, load: LoadKind) -> Self {
        let present = Kinematics::at_rest(&body);
        let n = present.nodes.len();
        Self {
            method: match scheme {
                Scheme::SemiImplicitEuler => Method::SemiImplicitEuler(Implicit::new(&body)),
                Scheme::TrBdf2 => Method::TrBdf2(Implicit::new(&body)),
                Scheme::Midpoint => Method::Midpoint(Implicit::new(&body)),
                Scheme::Splitting2 | Scheme::Splitting6 => Method::Splitting,
                Scheme::ImplicitSplitting2 => {
                    Method::ImplicitSplitting(ImplicitSplitting::new(&body))
                }
            },
            load_times: scheme.load_times(load),
            scheme,
            load,
            stages: vec![present.clone(); if scheme == Scheme::TrBdf2 { 3 } else { 2 }],
            old: present,
            error: LocalError::new(n),
            forces: [vec![0.0; n], vec![0.0; n]],
            ledger: Ledger::default(),
            pending: Ledger::default(),
            work: Work::default(),
            order: Vec::new(),
            body,
        }
    }

    /// Replaces the load from the current time; there is no last step under it.
    pub(crate) fn set_load(&mut self, load: LoadKind) {
        self.load = load;
        self.load_times = self.scheme.load_times(load);
        self.old.clone_from(&self.stages[0]);
        self.forget();
    }

    /// Replaces the body from the current time.
    pub(crate) fn set_body(&mut self, body: Body) {
        let jacobian = self.stage().map(|stage| stage.jacobian);
        let mut next = Self::new(body, self.scheme, self.load);
        next.stages.clone_from(&self.stages);
        next.old.clone_from(&self.stages[0]);
        (next.ledger, next.work) = (self.ledger, self.work);
        *self = next;
        jacobian.into_iter().for_each(|j| self.set_jacobian(j));
    }

    pub(crate) fn set_jacobian(&mut self, jacobian: Jacobian) {
        if let Some(stage) = self.stage() {
            stage.jacobian = jacobian;
        }
        self.forget();
    }

    /// Returns the stages that are solved for, if the scheme has any.
    fn stage(&mut self) -> Option<&mut Stage> {
        match &mut self.method {
            Method::SemiImplicitEuler(method)
            | Method::TrBdf2(method)
            | Method::Midpoint(method) => Some(&mut method.stage),
            Method::Splitting | Method::ImplicitSplitting(_) => None,
        }
    }

    fn forget(&mut self) {
        self.stage().into_iter().for_each(Stage::forget);
    }

    pub(crate) fn set_time(&mut self, time: f64) {
        self.stages[0].time = time;
    }

    pub(crate) fn now(&self) -> &Kinematics {
        &self.stages[0]
    }

    /// Returns the end of the attempted step.
    pub(crate) fn end(&self) -> &Kinematics {
        &self.stages[self.stages.len() - 1]
    }

    /// Sets position and velocity; the intensity and acceleration follow in [`Mover::begin`].
    pub(crate) fn set(&mut self, time: f64, nodes: &[f64], velocity: &[f64]) -> Result<()> {
        let (now, start) = (&mut self.stages[0], self.body.discrete.start());
        now.time = time;
        now.nodes.copy_from_slice(nodes);
        now.velocity.copy_from_slice(velocity);
        self.body.hold(&mut now.velocity);
        for &held in self.body.discrete.fixed() {
            if (nodes[held] - start[held]).abs() > 1e-9 * self.body.length {
                let node = held / 2;
                let [given, fixed] = [nodes, start].map(|of| [of[2 * node], of[2 * node + 1]]);
                return Err(ImplicitError::FixedNode { node, given, fixed });
            }
            now.nodes[held] = start[held];
        }
        self.old.clone_from(now);
        self.ledger = Ledger::default();
        Ok(())
    }

    /// Computes intensity and acceleration at the current state. `constraint` is the current value of the load, for a volume its second
    /// time derivative.
    pub(crate) fn begin(&mut self, constraint: Constraint<'_>) -> Result<()> {
        let Self { body, work, .. } = self;
        let now = &mut self.stages[0];
        let intensity = if let Constraint::Volume(acceleration) = constraint {
            // V'' = grad V . a + v . H v, and a is linear in the intensity
            let gradient = volume_gradient(body, &now.nodes);
            let curvature = now.volume_curvature(body);
            let mut response = [0.0; 2];
            for (response, intensity) in response.iter_mut().zip([0.0, 1.0]) {
                now.respond(body, intensity)?;
                *response = dot(&gradient, &now.acceleration);
            }
            (acceleration - curvature - response[0]) / (response[1] - response[0])
        } else {
            constraint.intensity(body, now, f64::NAN)?
        };
        work.force_calls += 1;
        now.respond(body, intensity)
    }

    /// Returns the second time derivative of the enclosed volume at the current state.
    pub(crate) fn volume_acceleration(&self) -> f64 {
        let (now, body) = (self.now(), &self.body);
        let gradient = volume_gradient(body, &now.nodes);
        dot(&gradient, &now.acceleration) + now.volume_curvature(body)
    }

    /// Returns the volume at the end of stage `index` (from 1) of the attempted step.
    pub(crate) fn stage_volume(&self, index: usize) -> f64 {
        self.body.volume(&self.stages[index].nodes)
    }

    /// Returns the volume at the end of the attempted step.
    pub(crate) fn end_volume(&self) -> f64 {
        self.body.volume(&self.end().nodes)
    }

    /// Makes a step without accepting it. `constraints` are those of the load at the load times.
    pub(crate) fn attempt(&mut self, dt: f64, constraints: &[Constraint<'_>]) -> Result<()> {
        let Some(&first) = constraints.first() else {
            return Ok(());
        };
        let step = Step {
            body: &self.body,
            stages: &mut self.stages,
            dt,
            work: &mut self.work,
        };
        let account = match &mut self.method {
            Method::SemiImplicitEuler(method) => method.linearised(step, first),
            Method::TrBdf2(method) => method.tr_bdf2(step, constraints),
            Method::Midpoint(method) => method.midpoint(step, first, constraints),
            Method::Splitting => kick_and_drift(step, self.scheme.splitting(), constraints),
            Method::ImplicitSplitting(method) => method.kick_and_relax(step, first),
        };
        // a diverging stage is the cause of a later error
        let runaway = (1..self.stages.len()).find_map(|index| self.runaway(index, dt));
        if runaway.is_some() {
            // removes its effect on the next attempt
            let (now, others) = self.stages.split_at_mut(1);
            let others = others.iter_mut();
            others.for_each(|stage| stage.clone_from(&now[0]));
        }
        match runaway.map_or(account, Err) {
            Ok(account) => self.pending = account,
            Err(error) => {
                self.forget();
                return Err(error);
            }
        }
        Ok(())
    }

    /// Returns the error of stage `index` of a step of length `dt` if positions or velocities diverge or are NaN.
    fn runaway(&self, index: usize, dt: f64) -> Option<ImplicitError> {
        let at = &self.stages[index];
        // any number beyond the limit makes the sum of squares exceed it
        if dot(&at.nodes, &at.nodes) + dot(&at.velocity, &at.velocity) <= FARTHEST * FARTHEST {
            return None;
        }
        let positions = at.nodes.iter().map(|value| ("position", value));
        let velocities = at.velocity.iter().map(|value| ("velocity", value));
        // NaN counts as the largest number
        let (k, (what, &value)) = (positions.enumerate())
            .chain(velocities.enumerate())
            .max_by(|(_, (_, a)), (_, (_, b))| a.abs().total_cmp(&b.abs()))?;
        Some(ImplicitError::Unstable {
            step: self.work.steps + 1,
            time: self.now().time,
            dt,
            what,
            node: k / 2,
            value,
        })
    }

    /// Rejects the attempted step if walls intersect at its end under a prescribed volume, which then is not that of a body.
    pub(crate) fn check_walls(&mut self) -> Result<()> {
        let end = &self.stages[self.stages.len() - 1];
        match self.load {
            LoadKind::Volume => (self.body).check_walls(&end.nodes, end.time, &mut self.order),
            LoadKind::Intensity | LoadKind::TotalForce | LoadKind::Feedback => Ok(()),
        }
    }

    /// Whether there is a last step.
    pub(crate) fn has_previous(&self) -> bool {
        self.now().time > self.old.time
    }

    /// Scaled local error of the attempted step by the scheme's own estimate (1 is acceptable); `None` if the estimate needs a previous
    /// step and there is none.
    pub(crate) fn error(&mut self, tolerance: (f64, f64)) -> Option<f64> {
        let (now, new) = (&self.stages[0], &self.stages[self.stages.len() - 1]);
        let (dt, before) = (new.time - now.time, now.time - self.old.time);
        let LocalError {
            position, velocity, ..
        } = &mut self.error;
        position.fill(0.0);
        velocity.fill(0.0);
        let mut add = |stages: &[Kinematics], weights: &[f64], dt: f64| {
            add_slopes(stages, weights, dt, position, velocity);
        };
        match self.scheme.error_weights() {
            Some(weights) => add(&self.stages, weights, dt),
            None if before > 0.0 => {
                // dt^3 / 12 of the third derivative: second divided difference of the first derivative
                let weight = dt.powi(3) / (6.0 * (dt + before));
                let mut add_one =
                    |at: &Kinematics, weight| add(std::slice::from_ref(at), &[1.0], weight);
                add_one(new, weight / dt);
                add_one(now, -weight / dt - weight / before);
                add_one(&self.old, weight / before);
                // kicks at the ends of the step have an error of dt^3 / 6 in the position
                let factor = self.scheme.position_factor();
                position.iter_mut().for_each(|p| *p *= factor);
            }
            None => return None,
        }
        let (body, error) = (&self.body, &mut self.error);
        match (body.material(), &self.method) {
            (
                Material::Springs { .. },
                Method::SemiImplicitEuler(method)
                | Method::TrBdf2(method)
                | Method::Midpoint(method),
            ) => method.stage.filter(body, error),
            (Material::Springs { .. }, Method::ImplicitSplitting(method)) => {
                method.filter(body, 0.5 * dt, error);
            }
            (Material::Springs { .. }, Method::Splitting) | (Material::Rubber(_), _) => (),
        }
        let error = self.scaled_error(tolerance, dt);
        Some(match self.body.material() {
            Material::Springs { .. } => error,
            // the force is nonlinear: either estimate may vanish, but not both
            Material::Rubber(_) => error.max(self.error_by_simpson(tolerance)),
        })
    }

    /// Scaled local error of the attempted step by step doubling: `halves` has attempted the second of two half steps from the same state.
    /// With order p, they have the fraction 2^-p of the error of the whole step.
    pub(crate) fn error_by_doubling(&mut self, halves: &Self, tolerance: (f64, f64)) -> f64 {
        let (whole, halves) = (&self.stages[self.stages.len() - 1], halves.end());
        let error = &mut self.error;
        let dt = whole.time - self.stages[0].time;
        // difference = (1 - 2^-p) error of the whole step
        let fraction = 1.0 - 0.5f64.powi(self.scheme.order() as i32);
        slope(&whole.nodes, &halves.nodes, fraction, &mut error.position);
        slope(
            &whole.velocity,
            &halves.velocity,
            fraction,
            &mut error.velocity,
        );
        let by_doubling = self.scaled_error(tolerance, dt);
        // the midpoint rule has no stage at the start, where a load may begin to rise
        by_doubling.max(self.error_by_simpson(tolerance))
    }

    /// Scaled error of the attempted step against Simpson's rule for the accelerations a0 and a1 at both ends and a = (v1 - v0) / dt in the
    /// middle: dt (a0 - 2 a + a1) / 6 of the velocity, dt^2 (a0 - a) / 6 of the position. The estimate is doubled for the velocity.
    fn error_by_simpson(&mut self, tolerance: (f64, f64)) -> f64 {
        let (now, new) = (&self.stages[0], &self.stages[self.stages.len() - 1]);
        let dt = new.time - now.time;
        let change = new
            .velocity
            .iter()
            .zip(&now.velocity)
            .map(|(new, now)| new - now);
        for (i, change) in change.enumerate() {
            let [before, after] = [now, new].map(|at| dt * at.acceleration[i]);
            self.error.velocity[i] = (before - 2.0 * change + after) / 3.0;
            self.error.position[i] = dt / 6.0 * (before - change);
        }
        self.scaled_error(tolerance, dt)
    }

    /// Size of `error` of a step of length `dt`, relative to the tolerances.
    fn scaled_error(&self, tolerance: (f64, f64), dt: f64) -> f64 {
        let LocalError {
            position, velocity, ..
        } = &self.error;
        let safety = match self.scheme.error_weights() {
            Some(_) => 1.0,
            None => SAFETY,
        };
        let rms = |v: &[f64]| (v.iter().map(|e| e * e).sum::<f64>() / (v.len() / 2) as f64).sqrt();
        let by_position = safety * rms(position) / tolerance.0;
        match self.load {
            // With a prescribed volume the velocity follows V' immediately, so that its error does not shrink with dt where V' jumps: its
            // effect on the position counts (index 3; Hairer and Wanner 1996, VII.3 scale in the same way).
            LoadKind::Volume => by_position.max(safety * dt * rms(velocity) / tolerance.0),
            LoadKind::Intensity | LoadKind::TotalForce | LoadKind::Feedback => {
                by_position.max(safety * rms(velocity) / tolerance.1)
            }
        }
    }

    /// Returns the stability limit of explicit steps, infinite for other schemes.
    pub(crate) fn longest_step(&self) -> f64 {
        self.scheme.stability_limit() * self.body.largest_explicit_step()
    }

    /// Makes the end of the attempted step the current state.
    pub(crate) fn accept(&mut self) {
        let last = self.stages.len() - 1;
        self.ledger.add(std::mem::take(&mut self.pending));
        self.stages.swap(0, last);
        std::mem::swap(&mut self.old, &mut self.stages[last]);
        self.work.steps += 1;
    }

    /// Adds the current energy and the account.
    pub(crate) fn add_energy(&self, energy: &mut Energy) {
        let (now, body) = (self.now(), &self.body);
        let elastic = body.discrete.elastic_energy(&now.nodes);
        energy.kinetic += 0.5 * body.mass * body.square(&now.velocity);
        energy.elastic += elastic.unwrap_or(f64::NAN);
        energy.pressure_work += self.ledger.work;
        energy.damping_loss += self.ledger.damping;
        energy.numerical_loss += self.ledger.numerical;
    }

    /// Returns a first step over which the acceleration moves a node by about the tolerance.
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

    /// Norms of F_p + F_e and of the velocity at the current time: (integral of |.|^2 ds)^(1/2); for rubber that of the forces at the
    /// nodes, and (integral of |v|^2 over the volume)^(1/2).
    pub(crate) fn norms(&mut self) -> Result<(f64, f64)> {
        let (now, body) = (&self.stages[0], &self.body);
        let [elastic, pressure] = &mut self.forces;
        body.discrete.elastic_force_into(&now.nodes, elastic);
        body.pressure_into(now.time, &now.nodes, now.intensity, pressure)?;
        let pairs = elastic.iter().zip(&*pressure);
        let sum: f64 = pairs.map(|(e, p)| (e + p) * (e + p)).sum();
        let force = (body.weight * sum).sqrt();
        Ok((force, body.square(&now.velocity).sqrt()))
    }

    /// Shape and velocity at a time within the last step: cubic Hermite interpolation of positions (from velocities) and
    /// velocities (from accelerations).
    pub(crate) fn at_into(
        &self,
        time: f64,
        points: &mut [[f64; 2]],
        velocities: &mut [[f64; 2]],
    ) -> Result<()> {
        let (old, now) = (&self.old, self.now());
        MembraneError::within("time", time, old.time, now.time)?;
        let n = now.nodes.len() / 2;
        MembraneError::length("points", points.len(), n)?;
        MembraneError::length("velocities", velocities.len(), n)?;
        let dt = now.time - old.time;
        let t = if dt > 0.0 {
            (time - old.time) / dt
        } else {
            1.0
        };
        let s = 1.0 - t;
        // the cubic Hermite basis
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

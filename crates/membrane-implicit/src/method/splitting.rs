//! Splittings: kicks by forces, drifts between them.

use membrane_newton::{DiscreteMembrane, dot_in_eight as dot};

use crate::body::Body;
use crate::constraint::Constraint;
use crate::energy::Ledger;
use crate::error::{ImplicitError, Result};
use crate::kinematics::Step;
use crate::method::pentadiagonal::PentadiagonalLdl;
use crate::method::stage::LocalError;

/// Kicks v += b dt F / m, with the force at c, between drifts that solve c' = v, m v' = -mu v. Returns the account of the step.
///
/// A kick changes the kinetic energy by b dt F.(v- + v+)/2. A drift changes the elastic energy by the mean of the elastic forces at its
/// ends, and loses m/2 (|v-|^2 - |v+|^2) to damping.
pub(crate) fn kick_and_drift(
    step: Step<'_>,
    (kicks, drifts): (&[f64], &[f64]),
    constraints: &[Constraint<'_>],
) -> Result<Ledger> {
    let (body, (now, new), dt, work) = step.ends();
    let d = &body.discrete;
    let (m, mu, ds) = (body.mass, body.friction(), d.ds());
    let mut account = Ledger::default();
    new.time = now.time + dt;
    new.nodes.copy_from_slice(&now.nodes);
    new.velocity.copy_from_slice(&now.velocity);
    new.intensity = now.intensity;
    // `acceleration` is the elastic force before the last kick
    let mut reach = 0.0;
    for k in 0..kicks.len() {
        if k > 0 {
            let tau = drifts[k - 1] * dt;
            let decay = (-mu * tau / m).exp();
            let drift = if mu > 0.0 {
                -m / mu * (-mu * tau / m).exp_m1()
            } else {
                tau
            };
            let speed = dot(&new.velocity, &new.velocity);
            account.damping += 0.5 * m * ds * speed * (1.0 - decay * decay);
            account.numerical += 0.5 * ds * drift * dot(&new.acceleration, &new.velocity);
            for (node, v) in new.nodes.iter_mut().zip(new.velocity.iter_mut()) {
                *node += drift * *v;
                *v *= decay;
            }
            reach = drift / decay;
            let held = new.intensity;
            new.intensity = constraints[k - 1].intensity(body, new, held)?;
        }
        d.elastic_force_into(&new.nodes, &mut new.acceleration);
        if k == 0 {
            new.pressure.copy_from_slice(&now.pressure);
        } else {
            body.pressure_into(now.time, &new.nodes, new.intensity, &mut new.pressure)?;
            work.force_calls += 1;
        }
        let (push, pull) = (
            dot(&new.pressure, &new.velocity),
            dot(&new.acceleration, &new.velocity),
        );
        account.numerical += 0.5 * ds * reach * pull;
        let kick = kicks[k] * dt;
        let forces = new.acceleration.iter().zip(&new.pressure);
        for (v, (e, p)) in new.velocity.iter_mut().zip(forces) {
            *v += kick / m * (e + p);
        }
        let (push, pull) = (
            push + dot(&new.pressure, &new.velocity),
            pull + dot(&new.acceleration, &new.velocity),
        );
        account.work += 0.5 * kick * ds * push;
        account.numerical -= 0.5 * kick * ds * pull;
    }
    let pressures = new.pressure.iter().zip(&new.velocity);
    for (a, (p, v)) in new.acceleration.iter_mut().zip(pressures) {
        *a = (*a + p - mu * v) / m;
    }
    Ok(account)
}

/// Workspace of the splitting with implicit drifts for springs, mass and damping.
#[derive(Debug, Clone)]
pub(crate) struct ImplicitSplitting {
    /// (m + h mu) I - h^2 K, factored.
    matrix: PentadiagonalLdl,
    /// h of the factorisation, NaN before the first one.
    factored: f64,
}

impl ImplicitSplitting {
    pub(crate) fn new(body: &Body) -> Self {
        Self {
            matrix: PentadiagonalLdl::new(body.discrete.n_nodes() - 2),
            factored: f64::NAN,
        }
    }

    /// Overwrites `values` of moving nodes with the inverse matrix times them; the ends become zero.
    fn solve(&self, values: &mut [f64]) {
        let points = values.as_chunks_mut::<2>().0;
        let last = points.len() - 1;
        (points[0], points[last]) = ([0.0; 2], [0.0; 2]);
        self.matrix.solve_into(&mut points[1..last]);
    }

    /// A half kick of the pressure, the implicit midpoint rule for springs and damping, a half kick of the pressure at the new position.
    /// With w the velocity at the midpoint and h = dt / 2,
    ///
    /// ```text
    /// [(m + h mu) - h^2 K] w = m v1 + h F_e(c) = (m + h mu) v + h m a      v1 = v + h p / m
    /// c2 = c + dt w      v2 = 2 w - v1      v3 = v2 + h p2 / m
    /// ```
    ///
    /// The midpoint rule changes kinetic plus elastic energy by exactly -dt mu |w|^2. Returns the account of the step.
    pub(crate) fn kick_and_relax(
        &mut self,
        step: Step<'_>,
        constraint: Constraint<'_>,
    ) -> Result<Ledger> {
        let (body, (now, new), dt, work) = step.ends();
        let d = &body.discrete;
        let (m, mu, ds, h) = (body.mass, body.friction(), d.ds(), 0.5 * dt);
        let (time, diagonal, kick) = (now.time, body.inertia(h), h / m);
        if self.factored != h {
            self.factored = f64::NAN;
            let entry = |i: usize, j: usize| {
                // x and y have equal springs
                let k = body.stiffness.get(2 * i + 2, 2 * j + 2).unwrap_or(0.0);
                if i == j {
                    diagonal - h * h * k
                } else {
                    -h * h * k
                }
            };
            let factored = self.matrix.factor(entry);
            factored.map_err(|error| ImplicitError::Step { time, dt, error })?;
            self.factored = h;
            work.factorisations += 1;
        }
        let before = now.velocity.iter().zip(&now.acceleration);
        for (w, (v, a)) in new.velocity.iter_mut().zip(before) {
            *w = diagonal * v + h * m * a;
        }
        self.solve(&mut new.velocity);
        let push = dot(&now.pressure, &now.velocity);
        let mut account = Ledger {
            work: h * ds * (push + 0.5 * kick * dot(&now.pressure, &now.pressure)),
            damping: dt * mu * ds * dot(&new.velocity, &new.velocity),
            numerical: 0.0,
        };
        for ((c, w), c0) in new.nodes.iter_mut().zip(&new.velocity).zip(&now.nodes) {
            *c = c0 + dt * w;
        }
        let before = now.velocity.iter().zip(&now.pressure);
        for (v, (v0, p)) in new.velocity.iter_mut().zip(before) {
            *v = 2.0 * *v - (v0 + kick * p);
        }
        new.time = time + dt;
        new.intensity = constraint.intensity(body, new, now.intensity)?;
        d.elastic_force_into(&new.nodes, &mut new.acceleration);
        body.pressure_into(time, &new.nodes, new.intensity, &mut new.pressure)?;
        work.force_calls += 1;
        let inverse_mass = 1.0 / m;
        let moved = new.velocity.iter_mut().zip(&mut new.acceleration);
        for ((v, a), p) in moved.zip(&new.pressure) {
            *v += kick * p;
            *a = (*a + p - mu * *v) * inverse_mass;
        }
        let after = dot(&new.pressure, &new.pressure);
        account.work += h * (ds * dot(&new.pressure, &new.velocity) - 0.5 * kick * ds * after);
        Ok(account)
    }

    /// Filters the error estimate of a step of length 2 `h` through the matrix.
    pub(crate) fn filter(&self, body: &Body, h: f64, error: &mut LocalError) {
        error.filter(body, h, |v| self.solve(v));
    }
}

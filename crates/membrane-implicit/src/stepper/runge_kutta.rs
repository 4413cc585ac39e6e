//! How one stage of each kind of scheme is made.

use super::{Stepper, add_slopes};
use crate::drive::Moment;
use crate::error::ImplicitError;
use crate::scheme::Jacobian;
use crate::stage::{Equation, dot};
use crate::target::{Answer, Target};
use membrane_newton::DiscreteMembrane;

const MAX_ITERATIONS: usize = 40;
/// The next iteration must promise to move positions by less than this fraction of the membrane's
/// length. It lies below the rounding of a position because forces see it through 1 / ds^2: only
/// then does the energy report close.
const SOLVE_TOLERANCE: f64 = 1e-17;
/// Below this fraction, an iteration that no longer gains has reached its rounding.
const STALL: f64 = 1e-8;

impl Stepper {
    pub(super) fn explicit_stage(
        &mut self,
        index: usize,
        dt: f64,
        target: Target<'_>,
    ) -> Result<(), ImplicitError> {
        let (before, rest) = self.instants.split_at_mut(index);
        let (now, new) = (&before[0], &mut rest[0]);
        new.time = now.time + dt * self.tableau.c[index];
        new.nodes.copy_from_slice(&now.nodes);
        new.velocity.copy_from_slice(&now.velocity);
        add_slopes(
            before,
            &self.tableau.a[index],
            dt,
            &mut new.nodes,
            &mut new.velocity,
        );
        self.evaluate(index, target)
    }

    /// Kicks v += b dt F / m, with the force at c, between drifts that solve c' = v, m v' = -mu v.
    ///
    /// A kick changes the kinetic energy by b dt F.(v- + v+)/2; a drift changes the elastic energy
    /// by the mean of the elastic forces at its ends, and takes m/2 (|v-|^2 - |v+|^2) for damping.
    pub(super) fn split_step(
        &mut self,
        dt: f64,
        targets: &[Target<'_>],
    ) -> Result<(), ImplicitError> {
        let (kicks, drifts) = self.scheme.splitting();
        let Self {
            body,
            stage,
            instants,
            start: (force, _),
            pending,
            ..
        } = self;
        let (now, rest) = instants.split_at_mut(1);
        let (now, new) = (&now[0], &mut rest[0]);
        let d = &body.differences;
        let (m, mu, ds) = (body.mass, body.damping, d.ds());
        *pending = Default::default();
        new.time = now.time + dt;
        new.nodes.copy_from_slice(&now.nodes);
        new.velocity.copy_from_slice(&now.velocity);
        new.intensity = now.intensity;
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
                pending.damping += 0.5 * m * ds * speed * (1.0 - decay * decay);
                pending.numerical += 0.5 * ds * drift * dot(force, &new.velocity);
                for (node, v) in new.nodes.iter_mut().zip(new.velocity.iter_mut()) {
                    *node += drift * *v;
                    *v *= decay;
                }
                reach = drift / decay;
                let held = new.intensity;
                new.intensity =
                    targets[k - 1].intensity(new.time, &new.nodes, &new.velocity, held)?;
            }
            d.elastic_force_into(&new.nodes, force);
            if k == 0 {
                new.pressure.copy_from_slice(&now.pressure);
            } else {
                d.pressure_force_into(&new.nodes, new.intensity, &mut new.pressure)
                    .map_err(|error| ImplicitError::Membrane {
                        time: now.time,
                        error,
                    })?;
                stage.force_calls += 1;
            }
            let (push, pull) = (dot(&new.pressure, &new.velocity), dot(force, &new.velocity));
            pending.numerical += 0.5 * ds * reach * pull;
            let kick = kicks[k] * dt;
            let forces = force.iter().zip(&new.pressure);
            for (v, (e, p)) in new.velocity.iter_mut().zip(forces) {
                *v += kick / m * (e + p);
            }
            let (push, pull) = (
                push + dot(&new.pressure, &new.velocity),
                pull + dot(force, &new.velocity),
            );
            pending.work += 0.5 * kick * ds * push;
            pending.numerical -= 0.5 * kick * ds * pull;
        }
        let forces = force.iter().zip(&new.pressure).zip(&new.velocity);
        for (a, ((e, p), v)) in new.acceleration.iter_mut().zip(forces) {
            *a = (e + p - mu * v) / m;
        }
        new.measure(ds);
        Ok(())
    }

    /// A half kick of the pressure, the implicit midpoint rule for springs and damping, a half kick
    /// of the pressure where that ends. With w the velocity at the midpoint and h = dt / 2,
    ///
    /// ```text
    /// [(m + h mu) - h^2 K] w = m v1 + h F_e(c) = (m + h mu) v + h m a      v1 = v + h p / m
    /// c2 = c + dt w      v2 = 2 w - v1      v3 = v2 + h p2 / m
    /// ```
    ///
    /// The midpoint rule changes kinetic and elastic energy by -dt mu |w|^2 and no more.
    pub(super) fn kick_and_relax(
        &mut self,
        dt: f64,
        target: Target<'_>,
    ) -> Result<(), ImplicitError> {
        let Self {
            body,
            stage,
            springs,
            instants,
            start: (force, middle),
            pending,
            ..
        } = self;
        let (now, rest) = instants.split_at_mut(1);
        let (now, new) = (&now[0], &mut rest[0]);
        let d = &body.differences;
        let (m, mu, ds, h) = (body.mass, body.damping, d.ds(), 0.5 * dt);
        let diagonal = m + h * mu;
        if springs.factor(&stage.elastic, diagonal, h) {
            stage.factorisations += 1;
        }
        for ((w, v), a) in middle.iter_mut().zip(&now.velocity).zip(&now.acceleration) {
            *w = diagonal * v + h * m * a;
        }
        springs.solve_in_place(middle);
        let kick = h / m;
        *pending = Default::default();
        pending.damping = dt * mu * ds * dot(middle, middle);
        pending.work = h
            * ds
            * (dot(&now.pressure, &now.velocity) + 0.5 * kick * dot(&now.pressure, &now.pressure));
        let before = now.velocity.iter().zip(&now.pressure);
        for ((v, w), (v0, p)) in new.velocity.iter_mut().zip(middle.iter()).zip(before) {
            *v = 2.0 * w - (v0 + kick * p);
        }
        for ((c, w), c0) in new.nodes.iter_mut().zip(middle.iter()).zip(&now.nodes) {
            *c = c0 + dt * w;
        }
        new.time = now.time + dt;
        new.intensity = target.intensity(new.time, &new.nodes, &new.velocity, now.intensity)?;
        d.elastic_force_into(&new.nodes, force);
        d.pressure_force_into(&new.nodes, new.intensity, &mut new.pressure)
            .map_err(|error| ImplicitError::Membrane {
                time: now.time,
                error,
            })?;
        stage.force_calls += 1;
        let inverse_mass = 1.0 / m;
        let forces = force.iter().zip(&new.pressure);
        let moved = new.velocity.iter_mut().zip(new.acceleration.iter_mut());
        for ((v, a), (e, p)) in moved.zip(forces) {
            *v += kick * p;
            *a = (e + p - mu * *v) * inverse_mass;
        }
        new.measure(ds);
        let after = dot(&new.pressure, &new.pressure);
        pending.work += h * (new.pressure_power - 0.5 * kick * ds * after);
        Ok(())
    }

    pub(super) fn linearised_step(
        &mut self,
        dt: f64,
        prescribed: Target<'_>,
    ) -> Result<(), ImplicitError> {
        let refresh = match self.jacobian {
            Jacobian::Differences { refresh_every } => {
                self.work.steps.is_multiple_of(refresh_every)
            }
            _ => true,
        };
        let Self {
            body,
            stage,
            instants,
            length,
            ..
        } = self;
        let (now, rest) = instants.split_at_mut(1);
        let (now, new) = (&mut now[0], &mut rest[0]);
        let end = now.time + dt;
        // A feedback is linearised about the start of the step too.
        let target = match prescribed {
            Target::Feedback(drive) => {
                let at = Moment::of(end, &now.nodes, &now.velocity);
                Target::Answer(Answer::about(drive, at, *length, dt)?)
            }
            known => known,
        };
        let eq = Equation {
            body,
            target,
            time: now.time,
            end,
            dt,
            h: dt,
            length: *length,
        };
        new.time = end;
        new.nodes.copy_from_slice(&now.nodes);
        new.velocity.fill(0.0);
        let intensity = target.intensity(end, &now.nodes, &now.velocity, now.intensity)?;
        new.intensity = intensity;
        if refresh || !stage.is_factored_for(dt) {
            let start = (&now.nodes[..], &now.velocity[..]);
            stage.linearise(&eq, self.jacobian, start, intensity)?;
        }
        stage.iterate(
            &eq,
            (&now.nodes, &now.velocity),
            &mut new.velocity,
            &mut new.nodes,
            &mut new.intensity,
        )?;
        self.work.iterations += 1;
        // The force that acted: at the start's normals, plus what linearising added.
        body.differences
            .pressure_force_into(&now.nodes, intensity, &mut new.pressure)
            .map_err(|error| ImplicitError::Membrane {
                time: now.time,
                error,
            })?;
        stage.force_calls += 1;
        stage.add_linearised(
            &eq,
            &new.velocity,
            new.intensity - intensity,
            &mut new.pressure,
        );
        slope(&new.velocity, &now.velocity, dt, &mut new.acceleration);
        new.measure(body.differences.ds());
        // that of the shape reached
        new.intensity = prescribed.intensity(end, &new.nodes, &new.velocity, new.intensity)?;
        Ok(())
    }

    pub(super) fn solve_stage(
        &mut self,
        index: usize,
        dt: f64,
        target: Target<'_>,
    ) -> Result<(), ImplicitError> {
        let Self {
            body,
            stage,
            instants,
            length,
            tableau,
            start,
            jacobian,
            work,
            ..
        } = self;
        let (before, rest) = instants.split_at_mut(index);
        let (now, new) = (&before[0], &mut rest[0]);
        let (positions, velocities) = start;
        positions.copy_from_slice(&now.nodes);
        velocities.copy_from_slice(&now.velocity);
        add_slopes(before, &tableau.a[index], dt, positions, velocities);
        let h = dt * tableau.a[index][index];
        new.time = now.time + dt * tableau.c[index];
        let eq = Equation {
            body,
            target,
            time: now.time,
            end: new.time,
            dt,
            h,
            length: *length,
        };

        // Predict by Taylor's series where that stays close; a stiff step starts from where it is.
        let ahead = dt * tableau.c[index];
        let reach = now
            .acceleration
            .iter()
            .fold(0.0, |m: f64, a| m.max(a.abs()));
        let close = ahead * ahead * reach <= 0.01 * *length;
        if close {
            let slopes = now.velocity.iter().zip(&now.acceleration);
            for (w, (v, a)) in new.velocity.iter_mut().zip(slopes) {
                *w = v + ahead * a;
            }
        } else {
            slope(&now.nodes, positions, h, &mut new.velocity);
        }
        for (node, (start, w)) in new
            .nodes
            .iter_mut()
            .zip(positions.iter().zip(&new.velocity))
        {
            *node = start + h * w;
        }
        let held = before[index - 1].intensity;
        new.intensity = target.intensity(new.time, &new.nodes, &new.velocity, held)?;

        let refresh = match jacobian {
            Jacobian::Differences { refresh_every } => {
                index == 1 && work.steps.is_multiple_of(*refresh_every)
            }
            _ => false,
        };
        let mut fresh = false;
        if refresh || !stage.is_factored_for(h) {
            stage.linearise(&eq, *jacobian, (&new.nodes, &new.velocity), new.intensity)?;
            fresh = true;
        }
        let tolerance = SOLVE_TOLERANCE * *length;
        let time = now.time;
        let not_solved = |iterations, change| ImplicitError::StepNotSolved {
            time,
            dt,
            iterations,
            change,
        };
        let mut last = f64::INFINITY;
        for iteration in 1..=MAX_ITERATIONS {
            let change = stage.iterate(
                &eq,
                (positions, velocities),
                &mut new.velocity,
                &mut new.nodes,
                &mut new.intensity,
            );
            work.iterations += 1;
            let change = match change {
                Ok(change) if change.is_finite() => change,
                _ if fresh => {
                    stage.forget();
                    return Err(change.err().unwrap_or(not_solved(iteration, f64::INFINITY)));
                }
                _ => f64::INFINITY,
            };
            let ratio = change / last;
            let settled = change <= tolerance
                || (iteration > 1 && ratio < 1.0 && change * ratio / (1.0 - ratio) <= tolerance)
                || (iteration > 2 && ratio > 0.3 && change <= STALL * *length);
            if settled {
                break;
            }
            if iteration == MAX_ITERATIONS {
                stage.forget();
                return Err(not_solved(iteration, change));
            }
            fresh = false;
            if ratio > 0.05 && iteration > 1 {
                if !change.is_finite() {
                    slope(&now.nodes, positions, h, &mut new.velocity);
                    new.nodes.copy_from_slice(&now.nodes);
                    new.intensity = now.intensity;
                }
                stage.linearise(&eq, *jacobian, (&new.nodes, &new.velocity), new.intensity)?;
                fresh = true;
            }
            last = change;
        }
        body.differences
            .pressure_force_into(&new.nodes, new.intensity, &mut new.pressure)
            .map_err(|error| ImplicitError::Membrane {
                time: now.time,
                error,
            })?;
        stage.force_calls += 1;
        slope(&new.velocity, velocities, h, &mut new.acceleration);
        new.measure(body.differences.ds());
        Ok(())
    }
}

/// `out` = (`to` - `from`) / h.
fn slope(to: &[f64], from: &[f64], h: f64, out: &mut [f64]) {
    let inverse = 1.0 / h;
    for (out, (to, from)) in out.iter_mut().zip(to.iter().zip(from)) {
        *out = (to - from) * inverse;
    }
}

//! A step by one linear solve about its start.

use crate::constraint::{Answer, Constraint};
use crate::energy::Ledger;
use crate::error::Result;
use crate::kinematics::{Step, slope};
use crate::method::stage::{Equation, Implicit};

impl Implicit {
    /// Solves linearly about the start; returns the account of the step.
    pub(crate) fn linearised(
        &mut self,
        step: Step<'_>,
        prescribed: Constraint<'_>,
    ) -> Result<Ledger> {
        let (body, (now, new), dt, work) = step.ends();
        let Self { stage, buffers } = self;
        let (time, end) = (now.time, now.time + dt);
        // A feedback is linearised about the start of the step, too.
        let constraint = match prescribed {
            Constraint::Feedback(load) => {
                let at = body.load_state(end, &now.nodes, &now.velocity);
                Constraint::Answer(Answer::about(load, at, body.length, dt)?)
            }
            Constraint::Intensity(_)
            | Constraint::TotalForce(_)
            | Constraint::Volume(_)
            | Constraint::Answer(_) => prescribed,
        };
        let eq = Equation {
            body,
            from: (&now.nodes, &now.velocity),
            constraint,
            time,
            end,
            dt,
            h: dt,
            reach: dt,
            secant: None,
        };
        new.nodes.copy_from_slice(&now.nodes);
        new.velocity.copy_from_slice(&now.velocity);
        new.time = end;
        let intensity = constraint.intensity(body, new, now.intensity)?;
        new.intensity = intensity;
        new.velocity.fill(0.0);
        stage.iterate(&eq, new, work)?;
        // The force at the normals of the start, plus the linearised change h f (dn/dc) w + growth n by the matrix and its border: not by the
        // balance of momentum, so that an error of the linear solver appears in the energy balance.
        body.pressure_into(time, &now.nodes, intensity, &mut new.pressure)?;
        work.force_calls += 1;
        let (growth, w) = (new.intensity - intensity, &new.velocity);
        let [growing, momentum, pull] = buffers;
        // the matrix times this is -h n
        let changes = growing.iter_mut().zip(w).zip(stage.border.solved());
        changes.for_each(|((growing, w), column)| *growing = w + growth * column);
        stage.matrix.band.mul_into(growing, momentum);
        body.stiffness.mul_into(w, pull);
        let m_h = body.inertia(dt);
        for (i, p) in new.pressure.iter_mut().enumerate() {
            *p += (m_h * w[i] - momentum[i]) / dt - dt * pull[i];
        }
        slope(&new.velocity, &now.velocity, dt, &mut new.acceleration);
        // of the resulting shape
        new.intensity = prescribed.intensity(body, new, new.intensity)?;
        let stages = std::slice::from_ref(&*new);
        Ok(Ledger::of_stages(body, stages, dt, &[[1.0]], pull))
    }
}

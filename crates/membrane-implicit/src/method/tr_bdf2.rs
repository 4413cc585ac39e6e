//! TR-BDF2: two stages with the same matrix.

use crate::constraint::Constraint;
use crate::energy::Ledger;
use crate::error::Result;
use crate::kinematics::{Step, add_slopes, slope};
use crate::method::stage::{Equation, Implicit, predict};
use crate::scheme::TR_BDF2;

impl Implicit {
    /// Solves both stages; returns the account of the step.
    pub(crate) fn tr_bdf2(
        &mut self,
        step: Step<'_>,
        constraints: &[Constraint<'_>],
    ) -> Result<Ledger> {
        let Step {
            body,
            stages,
            dt,
            work,
        } = step;
        // c* and v* of the current stage, from the previous stages
        let Self { stage, buffers } = self;
        let [positions, velocities, force] = buffers;
        for (index, &constraint) in (1..stages.len()).zip(constraints) {
            let (before, rest) = stages.split_at_mut(index);
            let (now, new) = (&before[0], &mut rest[0]);
            let row = &TR_BDF2[index];
            positions.copy_from_slice(&now.nodes);
            velocities.copy_from_slice(&now.velocity);
            add_slopes(before, row, dt, positions, velocities);
            let (time, ahead) = (now.time, dt * row.iter().sum::<f64>());
            let h = dt * row[index];
            new.time = time + ahead;
            predict(new, now, positions, (ahead, h), body.length);
            let held = before[index - 1].intensity;
            new.intensity = constraint.intensity(body, new, held)?;
            let eq = Equation {
                body,
                from: (positions, velocities),
                constraint,
                time,
                end: new.time,
                dt,
                h,
                reach: h,
                secant: None,
            };
            stage.solve(&eq, now, new, work)?;
            body.pressure_into(time, &new.nodes, new.intensity, &mut new.pressure)?;
            work.force_calls += 1;
            slope(&new.velocity, velocities, h, &mut new.acceleration);
        }
        Ok(Ledger::of_stages(body, stages, dt, &TR_BDF2, force))
    }
}

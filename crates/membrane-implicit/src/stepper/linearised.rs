//! One linear solve about the start of the step.

use crate::body::MovingMembrane;
use crate::drive::Moment;
use crate::error::ImplicitError;
use crate::instant::{Step, slope};
use crate::scheme::Jacobian;
use crate::stage::{Equation, Stage};
use crate::target::{Answer, Target};

/// Workspace of a step that is linearised about its start.
#[derive(Debug, Clone)]
pub(super) struct Linearised {
    pub(super) stage: Stage,
    /// The velocity, in which the pressure grows beside it.
    growing: Vec<f64>,
    /// The stage's matrix times that.
    momentum: Vec<f64>,
    /// K times the velocity.
    pull: Vec<f64>,
}

impl Linearised {
    pub(super) fn new(body: &MovingMembrane) -> Self {
        let zero = vec![0.0; 2 * body.n_nodes()];
        Self {
            stage: Stage::new(body),
            growing: zero.clone(),
            momentum: zero.clone(),
            pull: zero,
        }
    }

    pub(super) fn step(
        &mut self,
        step: Step<'_>,
        prescribed: Target<'_>,
    ) -> Result<(), ImplicitError> {
        let Step { body, dt, work, .. } = step;
        let (now, new) = step.instants.split_at_mut(1);
        let (now, new) = (&now[0], &mut new[0]);
        let stage = &mut self.stage;
        let refresh = match stage.jacobian {
            Jacobian::Differences { refresh_every } => work.steps.is_multiple_of(refresh_every),
            Jacobian::Exact | Jacobian::Band => true,
        };
        let (time, end) = (now.time, now.time + dt);
        // A feedback is linearised about the start of the step too.
        let target = match prescribed {
            Target::Feedback(drive) => {
                let at = Moment::of(end, &now.nodes, &now.velocity);
                Target::Answer(Answer::about(drive, at, body.length, dt)?)
            }
            known => known,
        };
        let eq = Equation {
            body,
            target,
            time,
            end,
            dt,
            h: dt,
        };
        new.time = end;
        new.nodes.copy_from_slice(&now.nodes);
        new.velocity.fill(0.0);
        let intensity = target.intensity(end, &now.nodes, &now.velocity, now.intensity)?;
        new.intensity = intensity;
        if refresh || !stage.is_factored_for(dt) {
            stage.linearise(&eq, (&now.nodes, &now.velocity), intensity, work)?;
        }
        stage.iterate(
            &eq,
            (&now.nodes, &now.velocity),
            (&mut new.nodes, &mut new.velocity, &mut new.intensity),
            work,
        )?;
        // The force that acted: at the start's normals, plus what linearising added.
        body.pressure_into(time, &now.nodes, intensity, &mut new.pressure)?;
        work.force_calls += 1;
        let growth = new.intensity - intensity;
        self.add_linearised(body, dt, &new.velocity, growth, &mut new.pressure);
        slope(&new.velocity, &now.velocity, dt, &mut new.acceleration);
        new.measure(body.differences.ds());
        // that of the shape reached
        new.intensity = prescribed.intensity(end, &new.nodes, &new.velocity, new.intensity)?;
        Ok(())
    }

    /// `pressure` += h f (dn/dc) w + `growth` n, both as the matrix and its border at hand have
    /// them: what linearising added to the force of the start.
    ///
    /// Taken from the matrix, not from the momentum balance, so that the energy report sees an
    /// error of the linear solver.
    fn add_linearised(
        &mut self,
        body: &MovingMembrane,
        h: f64,
        w: &[f64],
        growth: f64,
        pressure: &mut [f64],
    ) {
        if let Some(border) = self.stage.border.eliminated() {
            // matrix times this is -h n
            let growing = self.growing.iter_mut().zip(w).zip(border.solved());
            growing.for_each(|((growing, w), column)| *growing = w + growth * column);
        }
        self.stage
            .matrix
            .mul_into(&self.growing, &mut self.momentum);
        body.springs.mul_into(w, &mut self.pull);
        let m_h = body.inertia(h);
        for i in 0..w.len() {
            pressure[i] += (m_h * w[i] - self.momentum[i]) / h - h * self.pull[i];
        }
    }
}

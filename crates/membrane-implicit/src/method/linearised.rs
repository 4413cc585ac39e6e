//! A step by one linear solve about its start.

use crate::body::Body;
use crate::constraint::{Answer, Constraint};
use crate::energy::Ledger;
use crate::error::Result;
use crate::kinematics::{Step, slope};
use crate::method::stage::{Equation, Stage};

/// Workspace of a step that is linearised about its start.
#[derive(Debug, Clone)]
pub(crate) struct Linearised {
    pub(crate) stage: Stage,
    /// The velocity by which the pressure grows.
    growing: Vec<f64>,
    /// The stage's matrix times that velocity.
    momentum: Vec<f64>,
    /// K times the velocity.
    pull: Vec<f64>,
}

impl Linearised {
    pub(crate) fn new(body: &Body) -> Self {
        let zero = vec![0.0; body.volumes.len()];
        Self {
            stage: Stage::new(body),
            growing: zero.clone(),
            momentum: zero.clone(),
            pull: zero,
        }
    }

    /// Solves linearly about the start; returns the account of the step.
    pub(crate) fn step(&mut self, step: Step<'_>, prescribed: Constraint<'_>) -> Result<Ledger> {
        let (body, (now, new), dt, work) = step.ends();
        let stage = &mut self.stage;
        let (time, end) = (now.time, now.time + dt);
        let start = (&*now.nodes, &*now.velocity);
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
            from: start,
            constraint,
            time,
            end,
            dt,
            h: dt,
            reach: dt,
            secant: None,
        };
        new.time = end;
        new.velocity.fill(0.0);
        let intensity = constraint.intensity(body, end, start, now.intensity)?;
        new.intensity = intensity;
        stage.iterate(&eq, new, work)?;
        // The force at the start's normals, plus the linearised change.
        body.pressure_into(time, &now.nodes, intensity, &mut new.pressure)?;
        work.force_calls += 1;
        let growth = new.intensity - intensity;
        self.add_linearised(body, dt, &new.velocity, growth, &mut new.pressure);
        slope(&new.velocity, &now.velocity, dt, &mut new.acceleration);
        // of the resulting shape
        let state = (&*new.nodes, &*new.velocity);
        new.intensity = prescribed.intensity(body, end, state, new.intensity)?;
        let stages = std::slice::from_ref(&*new);
        let weights = [[1.0]];
        Ok(Ledger::of_stages(
            body,
            stages,
            dt,
            &weights,
            &mut self.pull,
        ))
    }

    /// `pressure` += h f (dn/dc) w + `growth` n by the current matrix and its border: the linearised change of the force of the start.
    ///
    /// Computed from the matrix, not from the momentum balance, so that an error of the linear solver appears in the energy balance.
    fn add_linearised(
        &mut self,
        body: &Body,
        h: f64,
        w: &[f64],
        growth: f64,
        pressure: &mut [f64],
    ) {
        if let Some(border) = self.stage.border.elimination() {
            // the matrix times this is -h n
            let growing = self.growing.iter_mut().zip(w).zip(border.solved());
            growing.for_each(|((growing, w), column)| *growing = w + growth * column);
        }
        let matrix = self.stage.matrix();
        matrix.mul_into(&self.growing, &mut self.momentum);
        body.stiffness.mul_into(w, &mut self.pull);
        let m_h = body.inertia(h);
        for i in 0..w.len() {
            pressure[i] += (m_h * w[i] - self.momentum[i]) / h - h * self.pull[i];
        }
    }
}

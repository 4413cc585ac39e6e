//! The implicit midpoint rule, for rubber with discrete derivatives.

use membrane_newton::membrane_forces::Material;
use membrane_newton::{DiscreteMembrane, dot_in_eight as dot};

use crate::constraint::Constraint;
use crate::energy::Ledger;
use crate::error::{ImplicitError, Result};
use crate::kinematics::Step;
use crate::method::stage::{Equation, Implicit, predict};

impl Implicit {
    /// One stage in the middle of the step, at velocity w = (v0 + v1) / 2:
    ///
    /// ```text
    /// m (w - v0) = (dt / 2) [F_e + f n - mu w]      c1 = c0 + dt w      v1 = 2 w - v0
    /// ```
    ///
    /// Returns the account of the step: dt F_p.w, for rubber f (V1 - V0), and dt mu |w|^2.
    pub(crate) fn midpoint(
        &mut self,
        step: Step<'_>,
        constraint: Constraint<'_>,
        constraints: &[Constraint<'_>],
    ) -> Result<Ledger> {
        let (body, (now, new), dt, work) = step.ends();
        let last = constraints.last().unwrap_or(&constraint);
        let (time, h) = (now.time, 0.5 * dt);
        let at = |error| ImplicitError::Forces { time, error };
        let secant = match body.material() {
            Material::Springs { .. } => None,
            Material::Rubber(_) => {
                let energy = body.discrete.elastic_energy(&now.nodes).map_err(at)?;
                Some([energy, body.volume(&now.nodes)])
            }
        };
        let eq = Equation {
            body,
            from: (&now.nodes, &now.velocity),
            constraint,
            time,
            end: time + h,
            dt,
            h,
            reach: dt,
            secant,
        };
        predict(new, now, &now.nodes, (h, h), body.length);
        new.time = eq.end;
        new.intensity = constraint.intensity(body, new, now.intensity)?;
        self.stage.solve(&eq, now, new, work)?;
        let (intensity, speed) = (new.intensity, body.square(&new.velocity));
        let push = match secant {
            Some(_) => 0.0,
            None => {
                body.pressure_into(time, &new.nodes, intensity, &mut new.pressure)?;
                work.force_calls += 1;
                dt * body.weight * dot(&new.pressure, &new.velocity)
            }
        };
        new.time = time + dt;
        let start = now.nodes.iter().zip(&now.velocity);
        let end = new.nodes.iter_mut().zip(&mut new.velocity);
        for ((c, w), (c0, v0)) in end.zip(start) {
            *c = c0 + dt * *w;
            *w = 2.0 * *w - v0;
        }
        let reached = last.intensity(body, new, intensity)?;
        new.respond(body, reached)?;
        work.force_calls += 1;
        Ok(Ledger {
            work: match secant {
                Some([_, volume]) => intensity * (body.volume(&new.nodes) - volume),
                None => push,
            },
            damping: dt * body.friction() * speed,
            numerical: 0.0,
        })
    }
}

//! Stages of Runge-Kutta schemes, at known shapes or solved for.

use crate::body::MovingMembrane;
use crate::error::ImplicitError;
use crate::instant::{Instant, Step, add_slopes, slope};
use crate::scheme::{Jacobian, Tableau};
use crate::stage::{Equation, Stage};
use crate::target::Target;
use crate::work::Work;

const MAX_ITERATIONS: usize = 40;
/// The next iteration must promise to move positions by less than this fraction of the membrane's
/// length. It lies below the rounding of a position because forces see it through 1 / ds^2: only
/// then does the energy report close.
const SOLVE_TOLERANCE: f64 = 1e-17;
/// Below this fraction, an iteration that no longer gains has reached its rounding.
const STALL: f64 = 1e-8;

/// Stage `index` at the shape that the stages before it lead to.
pub(super) fn explicit_stage(
    step: Step<'_>,
    tableau: &Tableau,
    index: usize,
    target: Target<'_>,
) -> Result<(), ImplicitError> {
    let (before, rest) = step.instants.split_at_mut(index);
    let (now, new) = (&before[0], &mut rest[0]);
    new.time = now.time + step.dt * tableau.c[index];
    new.nodes.copy_from_slice(&now.nodes);
    new.velocity.copy_from_slice(&now.velocity);
    add_slopes(
        before,
        &tableau.a[index],
        step.dt,
        &mut new.nodes,
        &mut new.velocity,
    );
    let intensity = target.intensity(new.time, &new.nodes, &new.velocity, f64::NAN)?;
    step.work.force_calls += 1;
    new.respond(step.body, intensity)
}

/// Workspace of stages that are solved for.
#[derive(Debug, Clone)]
pub(super) struct ImplicitStages {
    pub(super) stage: Stage,
    /// c* and v* of the stage being solved: what the stages before it lead to.
    positions: Vec<f64>,
    velocities: Vec<f64>,
}

impl ImplicitStages {
    pub(super) fn new(body: &MovingMembrane) -> Self {
        let zero = vec![0.0; 2 * body.n_nodes()];
        Self {
            stage: Stage::new(body),
            positions: zero.clone(),
            velocities: zero,
        }
    }

    /// Solves stage `index` by Newton with the matrix at hand as long as that contracts.
    pub(super) fn solve(
        &mut self,
        step: Step<'_>,
        tableau: &Tableau,
        index: usize,
        target: Target<'_>,
    ) -> Result<(), ImplicitError> {
        let Step {
            body,
            instants,
            dt,
            work,
        } = step;
        let (before, rest) = instants.split_at_mut(index);
        let (now, new) = (&before[0], &mut rest[0]);
        let Self {
            stage,
            positions,
            velocities,
        } = self;
        positions.copy_from_slice(&now.nodes);
        velocities.copy_from_slice(&now.velocity);
        add_slopes(before, &tableau.a[index], dt, positions, velocities);
        let (time, ahead) = (now.time, dt * tableau.c[index]);
        let h = dt * tableau.a[index][index];
        new.time = time + ahead;
        predict(new, now, positions, ahead, h, body.length);
        let held = before[index - 1].intensity;
        new.intensity = target.intensity(new.time, &new.nodes, &new.velocity, held)?;
        let eq = Equation {
            body,
            target,
            time,
            end: new.time,
            dt,
            h,
        };

        let refresh = match stage.jacobian {
            Jacobian::Differences { refresh_every } => {
                index == 1 && work.steps.is_multiple_of(refresh_every)
            }
            Jacobian::Exact | Jacobian::Band => false,
        };
        let fresh = refresh || !stage.is_factored_for(h);
        if fresh {
            stage.linearise(&eq, (&new.nodes, &new.velocity), new.intensity, work)?;
        }
        self.contract(&eq, now, new, fresh, work)?;
        body.pressure_into(time, &new.nodes, new.intensity, &mut new.pressure)?;
        work.force_calls += 1;
        slope(&new.velocity, &self.velocities, h, &mut new.acceleration);
        new.measure(body.differences.ds());
        Ok(())
    }

    /// Iterates until a stage is solved, linearising again where that no longer contracts; `fresh` if it was just linearised.
    fn contract(
        &mut self,
        eq: &Equation<'_>,
        now: &Instant,
        new: &mut Instant,
        mut fresh: bool,
        work: &mut Work,
    ) -> Result<(), ImplicitError> {
        let Self {
            stage,
            positions,
            velocities,
        } = self;
        let (body, time, dt, h) = (eq.body, eq.time, eq.dt, eq.h);
        let tolerance = SOLVE_TOLERANCE * body.length;
        let not_solved = |iterations, change| ImplicitError::StepNotSolved {
            time,
            dt,
            iterations,
            change,
        };
        let mut last = f64::INFINITY;
        for iteration in 1..=MAX_ITERATIONS {
            let change = stage.iterate(
                eq,
                (positions, velocities),
                (&mut new.nodes, &mut new.velocity, &mut new.intensity),
                work,
            );
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
                || (iteration > 2 && ratio > 0.3 && change <= STALL * body.length);
            if settled {
                break;
            }
            if iteration == MAX_ITERATIONS {
                stage.forget();
                return Err(not_solved(iteration, change));
            }
            fresh = ratio > 0.05 && iteration > 1;
            if fresh {
                if !change.is_finite() {
                    slope(&now.nodes, positions, h, &mut new.velocity);
                    new.nodes.copy_from_slice(&now.nodes);
                    new.intensity = now.intensity;
                }
                stage.linearise(eq, (&new.nodes, &new.velocity), new.intensity, work)?;
            }
            last = change;
        }
        Ok(())
    }
}

/// Velocities and nodes to begin with: by Taylor's series where that stays close; a stiff step starts from where it is.
fn predict(new: &mut Instant, now: &Instant, positions: &[f64], ahead: f64, h: f64, length: f64) {
    let accelerations = now.acceleration.iter();
    let reach = accelerations.fold(0.0, |m: f64, a| m.max(a.abs()));
    if ahead * ahead * reach <= 0.01 * length {
        let slopes = now.velocity.iter().zip(&now.acceleration);
        for (w, (v, a)) in new.velocity.iter_mut().zip(slopes) {
            *w = v + ahead * a;
        }
    } else {
        slope(&now.nodes, positions, h, &mut new.velocity);
    }
    let moved = positions.iter().zip(&new.velocity);
    for (node, (start, w)) in new.nodes.iter_mut().zip(moved) {
        *node = start + h * w;
    }
}

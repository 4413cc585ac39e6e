//! The account of the work and the losses of a step.

use membrane_newton::dot_in_eight as dot;

use crate::body::Body;
use crate::kinematics::Kinematics;

/// Work and losses of a step or since the start.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Ledger {
    pub(crate) work: f64,
    pub(crate) damping: f64,
    pub(crate) numerical: f64,
}

impl Ledger {
    pub(crate) fn add(&mut self, step: Self) {
        self.work += step.work;
        self.damping += step.damping;
        self.numerical += step.numerical;
    }

    /// Returns the account of a Runge-Kutta step of a body of springs with these stages; `a` is the matrix of the scheme, with b as its
    /// last row. `force` is a buffer for K times a velocity.
    pub(crate) fn of_stages<const S: usize>(
        body: &Body,
        stages: &[Kinematics],
        dt: f64,
        a: &[[f64; S]; S],
        force: &mut [f64],
    ) -> Self {
        let b = &a[S - 1];
        let mut out = Self::default();
        for (stage, b) in stages.iter().zip(b) {
            out.work += dt * b * body.weight * dot(&stage.pressure, &stage.velocity);
            let speed = body.weight * dot(&stage.velocity, &stage.velocity);
            out.damping += dt * b * body.friction() * speed;
        }
        let mut loss = 0.0;
        for (j, other) in stages.iter().enumerate() {
            let m = |i: usize| b[i] * a[i][j] + b[j] * a[j][i] - b[i] * b[j];
            if (0..S).all(|i| m(i) == 0.0) {
                continue;
            }
            body.stiffness.mul_into(&other.velocity, force);
            for (i, stage) in stages.iter().enumerate() {
                if m(i) != 0.0 {
                    let momentum = body.mass * dot(&stage.acceleration, &other.acceleration);
                    loss += m(i) * (momentum - dot(&stage.velocity, force));
                }
            }
        }
        out.numerical = 0.5 * dt * dt * body.weight * loss;
        out
    }
}

//! The time schemes, as Runge-Kutta tableaus of one family.

/// How a step is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Scheme {
    /// Explicit, order 1, stable only for tiny steps and with damping (Eq. 21): here to show its
    /// limit, which [`MovingMembrane::forward_euler_step`](crate::MovingMembrane::forward_euler_step) gives.
    ForwardEuler,
    /// The paper's scheme (Eq. 24-29, corrected): backward Euler with the elastic force exact and
    /// the pressure linearised about the start of the step; one linear solve a step, order 1.
    SemiImplicitEuler,
    /// Order 1, L-stable, the equations of each step solved to rounding.
    BackwardEuler,
    /// Order 2, A-stable, keeps the energy of the linear membrane; does not damp what it cannot
    /// resolve.
    Trapezoidal,
    /// Order 2, L-stable: a trapezoidal stage to t + (2 - sqrt 2) dt, then BDF2 (Bank et al. 1985;
    /// error estimate of Hosea and Shampine 1996).
    TrBdf2,
}

/// Where the derivative of the pressure force comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Jacobian {
    /// The exact derivative, with the rank-one part of a prescribed total force.
    #[default]
    Exact,
    /// The band alone: within a linearised step the intensity F / S(c) stays that of its start.
    Band,
    /// The band by differences, kept for this many steps, as in the paper ("typically every ten
    /// iterations"); border as in [`Jacobian::Exact`].
    Differences {
        /// Steps between refreshes, at least 1.
        refresh_every: usize,
    },
}

/// a, b, c of a Runge-Kutta scheme whose stage 0 is the start of the step and whose last stage is
/// its end, with the difference of b to an embedded rule.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tableau {
    pub(crate) stages: usize,
    pub(crate) a: [[f64; 3]; 3],
    pub(crate) b: [f64; 3],
    pub(crate) c: [f64; 3],
    /// Error estimate dt sum(e_i k_i); `None` where it needs the previous step as well.
    pub(crate) e: Option<[f64; 3]>,
    pub(crate) order: i32,
}

const D: f64 = 1.0 - std::f64::consts::FRAC_1_SQRT_2;
const W: f64 = 0.5 * std::f64::consts::FRAC_1_SQRT_2;

impl Scheme {
    /// Order of convergence in dt.
    pub fn order(self) -> usize {
        self.tableau().order as usize
    }

    pub(crate) fn tableau(self) -> Tableau {
        let euler = Tableau {
            stages: 2,
            a: [[0.0; 3]; 3],
            b: [0.0; 3],
            c: [0.0, 1.0, 0.0],
            e: Some([-0.5, 0.5, 0.0]),
            order: 1,
        };
        let none = [0.0; 3];
        match self {
            Self::ForwardEuler => Tableau {
                a: [none, [1.0, 0.0, 0.0], none],
                b: [1.0, 0.0, 0.0],
                ..euler
            },
            Self::SemiImplicitEuler | Self::BackwardEuler => Tableau {
                a: [none, [0.0, 1.0, 0.0], none],
                b: [0.0, 1.0, 0.0],
                ..euler
            },
            Self::Trapezoidal => Tableau {
                a: [none, [0.5, 0.5, 0.0], none],
                b: [0.5, 0.5, 0.0],
                e: None,
                order: 2,
                ..euler
            },
            Self::TrBdf2 => Tableau {
                stages: 3,
                a: [none, [D, D, 0.0], [W, W, D]],
                b: [W, W, D],
                c: [0.0, 2.0 * D, 1.0],
                e: Some([(4.0 * W - 1.0) / 3.0, -1.0 / 3.0, 2.0 * D / 3.0]),
                order: 2,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tableaus_meet_their_order_conditions() {
        for scheme in [
            Scheme::ForwardEuler,
            Scheme::SemiImplicitEuler,
            Scheme::BackwardEuler,
            Scheme::Trapezoidal,
            Scheme::TrBdf2,
        ] {
            let t = scheme.tableau();
            let close = |x: f64, y: f64| assert!((x - y).abs() < 1e-15, "{scheme:?}: {x} and {y}");
            close(t.b.iter().sum(), 1.0);
            for i in 0..t.stages {
                close(t.a[i].iter().sum(), t.c[i]);
            }
            let bc = |p: i32, b: [f64; 3]| (0..3).map(|i| b[i] * t.c[i].powi(p)).sum::<f64>();
            if t.order == 2 {
                close(bc(1, t.b), 0.5);
            }
            // The estimate sees no error of the order the scheme already has.
            for p in 0..t.order {
                close(bc(p, t.e.unwrap_or_default()), 0.0);
            }
            if let Some(e) = t.e {
                // b - e integrates one degree more
                let higher = [t.b[0] - e[0], t.b[1] - e[1], t.b[2] - e[2]];
                if scheme == Scheme::TrBdf2 {
                    close(bc(2, higher), 1.0 / 3.0);
                }
            }
        }
    }
}

//! The time schemes, as Runge-Kutta tableaus of one family.

/// How a step is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Scheme {
    /// Explicit, order 1, stable only for tiny steps and with damping (Eq. 21): here to show its
    /// limit, which [`MovingMembrane::forward_euler_step`](crate::MovingMembrane::forward_euler_step) gives.
    ForwardEuler,
    /// Explicit, order 4, the classical scheme: the cheapest way to follow the waves where they are
    /// to be resolved. Stable up to sqrt 2 times
    /// [`MovingMembrane::largest_explicit_step`](crate::MovingMembrane::largest_explicit_step)
    /// without damping, and up to dt = 2.78 m / mu.
    RungeKutta4,
    /// Explicit, order 2, by splitting into kicks of the force and drifts that carry the damping
    /// exactly (Stormer, Verlet): one force a step. Stable up to
    /// [`MovingMembrane::largest_explicit_step`](crate::MovingMembrane::largest_explicit_step).
    Splitting2,
    /// Order 2, by splitting into kicks of the pressure force and the implicit midpoint rule for
    /// springs, mass and damping: these are linear with a matrix that does not change, so a step
    /// takes one pressure force and one solve with two diagonals, and nothing is iterated. The
    /// least time for a coarse error. Springs of any stiffness are stable; the pressure is
    /// explicit and asks for dt < 2 / omega of what it alone would make swing. Keeps equilibria.
    ImplicitSplitting2,
    /// Explicit, order 6, by splitting into kicks of the force and drifts that carry the damping
    /// exactly (SRKN_11^b of Blanes and Moan, J. Comput. Appl. Math. 142 (2002) 313-330): eleven
    /// forces a step, the least time for a given small error where the waves are to be resolved.
    /// Stable up to 1.57 times
    /// [`MovingMembrane::largest_explicit_step`](crate::MovingMembrane::largest_explicit_step),
    /// fixed steps only.
    Splitting6,
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
#[non_exhaustive]
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

/// Schemes whose steps are made alike.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Family {
    /// Stages at known shapes.
    ExplicitStages,
    /// Stages that are solved for.
    ImplicitStages,
    /// One linear solve about the start of the step.
    Linearised,
    /// Kicks by all forces between drifts.
    Splitting,
    /// Kicks by the pressure, springs by the implicit midpoint rule.
    ImplicitSplitting,
}

/// a, b, c of a Runge-Kutta scheme whose stage 0 is the start of the step and whose last stage is
/// its end, with the difference of b to an embedded rule.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tableau {
    pub(crate) stages: usize,
    pub(crate) a: [[f64; MAX_STAGES]; MAX_STAGES],
    pub(crate) b: [f64; MAX_STAGES],
    pub(crate) c: [f64; MAX_STAGES],
    /// Error estimate dt sum(e_i k_i); `None` where it needs the previous step as well.
    pub(crate) e: Option<[f64; MAX_STAGES]>,
    /// The estimate shrinks with this power of dt.
    pub(crate) estimate: i32,
    pub(crate) order: i32,
}

pub(crate) const MAX_STAGES: usize = 5;

const D: f64 = 1.0 - std::f64::consts::FRAC_1_SQRT_2;
const W: f64 = 0.5 * std::f64::consts::FRAC_1_SQRT_2;

impl Scheme {
    /// Order of convergence in dt.
    pub fn order(self) -> usize {
        self.tableau().order as usize
    }

    /// Times, in units of the step, at which the drive acts on it.
    pub(crate) fn drive_times(self) -> Vec<f64> {
        let drifts = self.splitting().1;
        let tableau = self.tableau();
        match self.family() {
            Family::Splitting | Family::ImplicitSplitting => (1..=drifts.len())
                .map(|k| drifts[..k].iter().sum())
                .collect(),
            Family::ExplicitStages | Family::ImplicitStages | Family::Linearised => {
                tableau.c[1..tableau.stages].to_vec()
            }
        }
    }

    /// Whether the pressure force is that of a known shape, so that no volume can be prescribed.
    pub(crate) fn has_explicit_pressure(self) -> bool {
        match self.family() {
            Family::ExplicitStages | Family::Splitting | Family::ImplicitSplitting => true,
            Family::ImplicitStages | Family::Linearised => false,
        }
    }

    /// Whether a step is made of states with an intensity each, which can answer to them.
    pub(crate) fn has_stages(self) -> bool {
        match self.family() {
            Family::ExplicitStages | Family::ImplicitStages | Family::Linearised => true,
            Family::Splitting | Family::ImplicitSplitting => false,
        }
    }

    pub(crate) fn family(self) -> Family {
        match self {
            Self::ForwardEuler | Self::RungeKutta4 => Family::ExplicitStages,
            Self::BackwardEuler | Self::Trapezoidal | Self::TrBdf2 => Family::ImplicitStages,
            Self::SemiImplicitEuler => Family::Linearised,
            Self::Splitting2 | Self::Splitting6 => Family::Splitting,
            Self::ImplicitSplitting2 => Family::ImplicitSplitting,
        }
    }

    pub(crate) fn tableau(self) -> Tableau {
        let row = |values: &[f64]| {
            let mut row = [0.0; MAX_STAGES];
            row[..values.len()].copy_from_slice(values);
            row
        };
        let none = row(&[]);
        let euler = Tableau {
            stages: 2,
            a: [none; MAX_STAGES],
            b: none,
            c: row(&[0.0, 1.0]),
            e: Some(row(&[-0.5, 0.5])),
            estimate: 2,
            order: 1,
        };
        match self {
            Self::ForwardEuler => Tableau {
                a: [none, row(&[1.0]), none, none, none],
                b: row(&[1.0]),
                ..euler
            },
            Self::RungeKutta4 => {
                let b = row(&[1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0]);
                Tableau {
                    stages: 5,
                    a: [
                        none,
                        row(&[0.5]),
                        row(&[0.0, 0.5]),
                        row(&[0.0, 0.0, 1.0]),
                        b,
                    ],
                    b,
                    c: row(&[0.0, 0.5, 0.5, 1.0, 1.0]),
                    // against the rule of order 3 that ends with the slope at the step's end
                    e: Some(row(&[0.0, 0.0, 0.0, 1.0 / 6.0, -1.0 / 6.0])),
                    estimate: 4,
                    order: 4,
                }
            }
            // not tableaus' schemes: their steps keep their own account
            Self::Splitting2 | Self::ImplicitSplitting2 => Tableau {
                e: None,
                estimate: 3,
                order: 2,
                ..euler
            },
            Self::Splitting6 => Tableau {
                e: None,
                order: 6,
                ..euler
            },
            Self::SemiImplicitEuler | Self::BackwardEuler => Tableau {
                a: [none, row(&[0.0, 1.0]), none, none, none],
                b: row(&[0.0, 1.0]),
                ..euler
            },
            Self::Trapezoidal => Tableau {
                a: [none, row(&[0.5, 0.5]), none, none, none],
                b: row(&[0.5, 0.5]),
                e: None,
                estimate: 3,
                order: 2,
                ..euler
            },
            Self::TrBdf2 => Tableau {
                stages: 3,
                a: [none, row(&[D, D]), row(&[W, W, D]), none, none],
                b: row(&[W, W, D]),
                c: row(&[0.0, 2.0 * D, 1.0]),
                e: Some(row(&[(4.0 * W - 1.0) / 3.0, -1.0 / 3.0, 2.0 * D / 3.0])),
                estimate: 3,
                order: 2,
            },
        }
    }
}

/// Kicks b, and drifts a between them, in units of the step: of Stormer and Verlet, and of
/// SRKN_11^b. Both lists read the same backwards.
const VERLET: (&[f64], &[f64]) = (&[0.5, 0.5], &[1.0]);
const SRKN_11: (&[f64], &[f64]) = (
    &[
        B[0], B[1], B[2], B[3], B[4], B5, B5, B[4], B[3], B[2], B[1], B[0],
    ],
    &[
        A[0], A[1], A[2], A[3], A[4], A5, A[4], A[3], A[2], A[1], A[0],
    ],
);
const B: [f64; 5] = [
    0.0414649985182624,
    0.198128671918067,
    -0.0400061921041533,
    0.0752539843015807,
    -0.0115113874206879,
];
const A: [f64; 5] = [
    0.123229775946271,
    0.290553797799558,
    -0.127049212625417,
    -0.246331761062075,
    0.357208872795928,
];
const B5: f64 = 0.5 - (B[0] + B[1] + B[2] + B[3] + B[4]);
const A5: f64 = 1.0 - 2.0 * (A[0] + A[1] + A[2] + A[3] + A[4]);

impl Scheme {
    /// Kicks and drifts of a splitting; none for the other schemes.
    pub(crate) fn splitting(self) -> (&'static [f64], &'static [f64]) {
        match self {
            Self::Splitting2 | Self::ImplicitSplitting2 => VERLET,
            Self::Splitting6 => SRKN_11,
            Self::ForwardEuler
            | Self::RungeKutta4
            | Self::SemiImplicitEuler
            | Self::BackwardEuler
            | Self::Trapezoidal
            | Self::TrBdf2 => (&[], &[]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One step for c'' = -c as a matrix: |trace| <= 2 is stability.
    #[test]
    fn splitting_is_stable_as_far_as_it_says() {
        let (kicks, drifts) = SRKN_11;
        let trace = |z: f64| {
            let mut columns = [[1.0, 0.0], [0.0, 1.0]];
            for [c, v] in &mut columns {
                for k in 0..12 {
                    *v -= kicks[k] * z * *c;
                    if k < 11 {
                        *c += drifts[k] * z * *v;
                    }
                }
            }
            columns[0][0] + columns[1][1]
        };
        let mut z = 1e-3;
        while trace(z).abs() <= 2.0 + 1e-12 {
            z += 1e-3;
        }
        println!("stable to omega dt = {z}, {} leapfrog steps", z / 2.0);
        assert!((1.56..1.58).contains(&(0.5 * z)), "{z}");
        // order 6: the trace is 2 cos z to z^8
        let error = |z: f64| (trace(z) - 2.0 * z.cos()).abs();
        let slope = (error(0.5) / error(0.25)).log2();
        println!("{slope}");
        assert!((slope - 8.0).abs() < 0.4, "{slope}");
    }

    #[test]
    fn tableaus_meet_their_order_conditions() {
        for scheme in [
            Scheme::ForwardEuler,
            Scheme::RungeKutta4,
            Scheme::SemiImplicitEuler,
            Scheme::BackwardEuler,
            Scheme::Trapezoidal,
            Scheme::TrBdf2,
        ] {
            let t = scheme.tableau();
            let close = |x: f64, y: f64| assert!((x - y).abs() < 1e-15, "{scheme:?}: {x} and {y}");
            let moment = |p: i32, b: [f64; MAX_STAGES]| -> f64 {
                (0..t.stages).map(|i| b[i] * t.c[i].powi(p)).sum()
            };
            for i in 0..t.stages {
                close(t.a[i].iter().sum(), t.c[i]);
            }
            for p in 0..t.order {
                close(moment(p, t.b), 1.0 / f64::from(p + 1));
            }
            if t.order == 4 {
                let nested: f64 = (0..t.stages).map(|i| t.b[i] * moment(1, t.a[i])).sum();
                close(nested, 1.0 / 6.0);
            }
            // The estimate vanishes with the power of dt it is said to have.
            for p in 0..t.estimate - 1 {
                close(moment(p, t.e.unwrap_or_default()), 0.0);
            }
            if let Some(e) = t.e
                && scheme == Scheme::TrBdf2
            {
                // b - e integrates one degree more
                close(moment(2, t.b) - moment(2, e), 1.0 / 3.0);
            }
        }
    }
}

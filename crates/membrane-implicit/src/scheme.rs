//! Time schemes, with the loads and materials that each supports.

use membrane_newton::Membrane;
use membrane_newton::membrane_forces::Material;

/// The time integration scheme.
///
/// | scheme | order | springs | rubber | loads |
/// | --- | --- | --- | --- | --- |
/// | `SemiImplicitEuler`, `TrBdf2` | 1, 2 | yes | no | all |
/// | `Midpoint` | 2 | yes | yes | all; rubber no total force |
/// | `ImplicitSplitting2`, `Splitting2`, `Splitting6` | 2, 2, 6 | yes | no | pressure and total force as functions of time |
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Scheme {
    /// The paper's scheme (Eq. 24-29, corrected): backward Euler with the elastic force exact and
    /// the pressure linearised about the start of the step; one linear solve a step, order 1.
    SemiImplicitEuler,
    /// Order 2, L-stable: a trapezoidal stage to t + (2 - sqrt 2) dt, then BDF2 (Bank et al. 1985;
    /// error estimate of Hosea and Shampine 1996).
    TrBdf2,
    /// Order 2, A-stable: the implicit midpoint rule, for rubber with discrete derivatives (Gonzalez 1996,
    /// doi:10.1007/BF02440162) of a function U,
    ///
    /// ```text
    /// D U = U'(c_m) + [U(c1) - U(c0) - U'(c_m).d] d / |d|^2,     d = c1 - c0,  c_m the middle
    /// ```
    ///
    /// so that D U . d = U(c1) - U(c0): the change of kinetic plus elastic energy equals the work of the pressure less the damping for any
    /// length of the step, to the accuracy of its solution. The elastic energy of springs is quadratic and needs no correction. Unresolved
    /// oscillations are not damped. The pressure of a prescribed volume is the average over the step; it may alternate from step to step
    /// where V'' jumps.
    Midpoint,
    /// Order 2, by splitting into kicks of the pressure force and the implicit midpoint rule for springs, mass and damping: these are
    /// linear with a constant matrix, so a step needs one pressure force and one solve with two diagonals, without iterations. The fastest
    /// scheme for large errors. Stable for springs of any stiffness; the pressure is explicit and requires dt < 2 / omega of its own
    /// oscillations. Preserves equilibria.
    ImplicitSplitting2,
    /// Explicit, order 2, by splitting into kicks of the force and drifts with exact damping (Stormer, Verlet): one force per step. Stable
    /// up to [`Body::largest_explicit_step`](crate::Body::largest_explicit_step); a longer fixed step is an error.
    Splitting2,
    /// Explicit, order 6, by splitting into kicks of the force and drifts with exact damping (SRKN_11^b of Blanes and Moan, J. Comput.
    /// Appl. Math. 142 (2002) 313-330): eleven forces per step, the fastest scheme for small errors of resolved waves. Stable up to 1.57
    /// times [`Body::largest_explicit_step`](crate::Body::largest_explicit_step), fixed steps only;
    /// a longer one is an error.
    Splitting6,
}

/// The derivative of the pressure force in a linearised step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Jacobian {
    /// The exact derivative, with the rank-one part of a prescribed total force.
    #[default]
    Exact,
    /// Only the band: within a linearised step the intensity F / S(c) is that of its start.
    Band,
}

/// The quantity that a [`Load`](crate::Load) prescribes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LoadKind {
    /// Force intensity: f per unit of material length, or the pressure p per unit of current length ([`PressureLaw`](crate::PressureLaw)).
    Intensity,
    /// Total force: intensity times the lateral surface of revolution (Eq. 4).
    TotalForce,
    /// Enclosed volume of revolution, cm^3.
    Volume,
    /// Force intensity as a function of volume and flow ([`Feedback`](crate::Feedback)).
    Feedback,
}

impl Scheme {
    /// Returns the order of convergence in dt.
    #[must_use]
    pub fn order(self) -> usize {
        match self {
            Self::SemiImplicitEuler => 1,
            Self::TrBdf2 | Self::Midpoint | Self::ImplicitSplitting2 | Self::Splitting2 => 2,
            Self::Splitting6 => 6,
        }
    }

    /// Whether the scheme consists of kicks and drifts, without an unknown pressure.
    fn is_splitting(self) -> bool {
        match self {
            Self::SemiImplicitEuler | Self::TrBdf2 | Self::Midpoint => false,
            Self::ImplicitSplitting2 | Self::Splitting2 | Self::Splitting6 => true,
        }
    }

    /// Returns the largest stable step without damping, in units of [`Body::largest_explicit_step`](crate::Body::largest_explicit_step).
    pub(crate) fn stability_limit(self) -> f64 {
        match self {
            Self::Splitting2 => 1.0,
            Self::Splitting6 => 1.57,
            Self::SemiImplicitEuler | Self::TrBdf2 | Self::Midpoint | Self::ImplicitSplitting2 => {
                f64::INFINITY
            }
        }
    }

    /// Returns the part of a problem with this load and membrane that the scheme does not support.
    pub(crate) fn unsupported(self, load: LoadKind, of: &Membrane) -> Option<&'static str> {
        match (of.material(), load) {
            (Material::Rubber(_), _) if self != Self::Midpoint => Some("rubber"),
            (Material::Rubber(_), LoadKind::TotalForce) => Some("a total force on rubber"),
            (Material::Springs { .. }, LoadKind::Volume) if self.is_splitting() => {
                Some("a prescribed volume")
            }
            (Material::Springs { .. }, LoadKind::Feedback) if self.is_splitting() => {
                Some("a load that depends on the state")
            }
            (Material::Springs { .. }, LoadKind::Intensity | LoadKind::Feedback)
                if of.law().is_total_force() =>
            {
                Some("an intensity under PressureLaw::TotalForce, whose load is Load::total_force")
            }
            (Material::Springs { .. } | Material::Rubber(_), _) => None,
        }
    }

    /// Times, in units of the step, at which the load acts on it.
    pub(crate) fn load_times(self, load: LoadKind) -> Vec<f64> {
        match self {
            Self::SemiImplicitEuler => vec![1.0],
            Self::TrBdf2 => vec![2.0 * TR_BDF2_D, 1.0],
            // a volume applies at the end; other loads apply in the middle and then define the intensity at the end
            Self::Midpoint => match load {
                LoadKind::Volume => vec![1.0],
                LoadKind::Intensity | LoadKind::TotalForce | LoadKind::Feedback => vec![0.5, 1.0],
            },
            Self::ImplicitSplitting2 | Self::Splitting2 | Self::Splitting6 => {
                let drifts = self.splitting().1;
                let sum = |k: usize| drifts[..k].iter().sum();
                (1..=drifts.len()).map(sum).collect()
            }
        }
    }

    /// Weights e of the error estimate dt sum(e_i k_i) over the slopes of the stages; `None` if accelerations at the ends of steps define
    /// the estimate.
    pub(crate) fn error_weights(self) -> Option<&'static [f64]> {
        match self {
            Self::SemiImplicitEuler => Some(&[-0.5, 0.5]),
            Self::TrBdf2 => Some(&[
                (4.0 * TR_BDF2_W - 1.0) / 3.0,
                -1.0 / 3.0,
                2.0 * TR_BDF2_D / 3.0,
            ]),
            Self::Midpoint | Self::ImplicitSplitting2 | Self::Splitting2 | Self::Splitting6 => None,
        }
    }

    /// Ratio of the local error of a position to dt^3 / 12 of its third derivative, for schemes without such weights.
    pub(crate) fn position_factor(self) -> f64 {
        if self.is_splitting() { 2.0 } else { 1.0 }
    }

    /// Kicks and drifts of a splitting; empty for other schemes.
    pub(crate) fn splitting(self) -> (&'static [f64], &'static [f64]) {
        match self {
            Self::Splitting2 | Self::ImplicitSplitting2 => VERLET,
            Self::Splitting6 => SRKN_11,
            Self::SemiImplicitEuler | Self::TrBdf2 | Self::Midpoint => (&[], &[]),
        }
    }
}

/// d and w of TR-BDF2.
const TR_BDF2_D: f64 = 1.0 - std::f64::consts::FRAC_1_SQRT_2;
const TR_BDF2_W: f64 = 0.5 * std::f64::consts::FRAC_1_SQRT_2;

/// The Runge-Kutta matrix of TR-BDF2; its last row is b.
pub(crate) const TR_BDF2: [[f64; 3]; 3] = [
    [0.0; 3],
    [TR_BDF2_D, TR_BDF2_D, 0.0],
    [TR_BDF2_W, TR_BDF2_W, TR_BDF2_D],
];

/// Kicks b, and drifts a between them, in units of the step: of Stormer and Verlet, and of SRKN_11^b. Both lists are symmetric.
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

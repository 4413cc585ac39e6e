//! How a membrane comes from its start to what is prescribed: the one place in this crate where the material decides how to solve.

use membrane_forces::{DiscreteMembrane, Material};

/// The way from the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Route {
    /// Springs: taut from the start, so that the control is raised from there.
    Raise,
    /// Rubber: slack at rest, so that it is inflated to a first volume; its pressure has limits, its equilibria have an energy.
    Inflate,
}

/// Least degree of polynomials whose answer finer ones start from.
const LEAST_COARSE: usize = 6;

impl Route {
    pub(crate) fn of(discrete: &dyn DiscreteMembrane) -> Self {
        match discrete.setting().membrane().material() {
            Material::Springs { .. } => Self::Raise,
            Material::Rubber(_) => Self::Inflate,
        }
    }

    /// Degree of the polynomials that are solved first: rubber takes several steps from rest, which cost an eighth with half the degree.
    pub(crate) fn coarse_degree(self, degree: usize) -> Option<usize> {
        match self {
            Self::Raise => None,
            Self::Inflate => Some(degree / 2).filter(|coarse| *coarse >= LEAST_COARSE),
        }
    }
}

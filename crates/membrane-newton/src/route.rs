//! Solution strategies from the start, the only dependence of this crate on the material.

use membrane_forces::{DiscreteMembrane, Material};

/// The strategy from the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Route {
    /// Springs: under tension from the start, so that the control is raised from there.
    Raise,
    /// Rubber: slack in the reference configuration, so that it is inflated first; its pressure has limits, its equilibria have an energy.
    Inflate,
}

/// Least degree of the coarse polynomials of an initial solve.
const LEAST_COARSE: usize = 6;

impl Route {
    pub(crate) fn of(discrete: &dyn DiscreteMembrane) -> Self {
        match discrete.setting().membrane().material() {
            Material::Springs { .. } => Self::Raise,
            Material::Rubber(_) => Self::Inflate,
        }
    }

    /// Returns the degree of the initial solve: rubber needs several steps, which cost an eighth with half the degree.
    pub(crate) fn coarse_degree(self, degree: usize) -> Option<usize> {
        match self {
            Self::Raise => None,
            Self::Inflate => Some(degree / 2).filter(|coarse| *coarse >= LEAST_COARSE),
        }
    }
}

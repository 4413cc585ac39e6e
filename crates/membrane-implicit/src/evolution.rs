//! The history of an evolution to equilibrium, and the shape at its end.

use crate::work::Work;

/// The membrane at one step, with the forces on each node (per unit s; zero at the fixed ends).
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Frame {
    /// Number of the step.
    pub step: usize,
    /// Time.
    pub time: f64,
    /// Nodes [x, y] from s = 0 to s = 1, cm.
    pub points: Vec<[f64; 2]>,
    /// Elastic force F_e at each node.
    pub elastic: Vec<[f64; 2]>,
    /// Pressure force F_p at each node.
    pub pressure: Vec<[f64; 2]>,
}

/// The result of [`evolve`](crate::evolve).
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Evolution {
    /// Steps made.
    pub steps: usize,
    /// Norm of F_p + F_e before the first step and after each.
    pub norms: Vec<f64>,
    /// Stored frames.
    pub frames: Vec<Frame>,
    /// Final nodes [x, y], cm.
    pub points: Vec<[f64; 2]>,
    /// Final force intensity f = F / S.
    pub intensity: f64,
    /// Counters.
    pub work: Work,
}

impl Evolution {
    /// Whether the norm decreases in every step.
    #[must_use]
    pub fn is_monotone(&self) -> bool {
        self.norms.windows(2).all(|pair| pair[1] < pair[0])
    }

    /// Last norm of F_p + F_e; NaN if there is none.
    #[must_use]
    pub fn residual(&self) -> f64 {
        self.norms.last().copied().unwrap_or(f64::NAN)
    }
}

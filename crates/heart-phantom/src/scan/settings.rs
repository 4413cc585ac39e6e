//! Acquisition settings: plain data of a scene.

/// Camera motion between views.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Rotation {
    /// Step and shoot: the camera is stationary during a view and moves instantaneously.
    StepAndShoot,
    /// Continuous rotation; the camera passes the angle of a view at the middle of its interval ([`ViewTime`](crate::ViewTime)).
    Continuous,
}

/// The acquisition time of a view.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
#[non_exhaustive]
pub enum Mode {
    /// One phase in all views.
    Static {
        /// The phase: 0 and 1 are the start of a cycle; whole numbers may be added. Scenes allow 0 to 1.
        phase: f64,
    },
    /// The start of each view.
    Instants,
    /// The start of each view, for some seconds.
    Exposure {
        /// Duration in seconds.
        seconds: f64,
    },
    /// Whole cycles; with continuous rotation the whole interval of the view.
    WholeCycle,
    /// One gated projection set per equal part of the cycle.
    Gated {
        /// Number of gates.
        gates: usize,
    },
}

impl Mode {
    /// Returns the phase of a static scene.
    pub(crate) fn static_phase(self) -> Option<f64> {
        match self {
            Self::Static { phase } => Some(phase),
            Self::Instants | Self::Exposure { .. } | Self::WholeCycle | Self::Gated { .. } => None,
        }
    }

    /// Returns the number of projection sets.
    pub(crate) fn n_gates(self) -> usize {
        match self {
            Self::Gated { gates } => gates,
            Self::Static { .. } | Self::Instants | Self::Exposure { .. } | Self::WholeCycle => 1,
        }
    }
}

/// Accuracy of the samples.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Accuracy {
    /// Even number of steps per cycle, rounded up to a multiple of four: half between levels of rising volume, half of falling volume. For whole
    /// cycles of a sinusoid they are equal time steps.
    Steps(usize),
    /// Largest error of every sample relative to the largest one; determines the time steps and the resolution of images. With `Steps`, images
    /// are those of 1e-3. Half of it is for averages over bins, the remainder for averages over time and omitted weights of the response. The
    /// errors of `[scatter]` are not included: [`ScatterSettings::tolerance`](crate::scene::ScatterSettings::tolerance) limits its standard
    /// error, and [`ViewError::total`](crate::ViewError::total) contains all.
    ///
    /// If the finest time steps (4096 per cycle) or the finest resolution do not meet it, the result is
    /// [`PhantomError::Tolerance`](crate::PhantomError::Tolerance) with the smallest error reached. Averages over bins without a response
    /// reached 5e-6 to 3e-5 for static hearts with walls of 0.3 to 1 cm, in bins of 1 and 2 cm.
    Tolerance(f64),
}

/// Poisson noise, `[noise]` of a scene. Projections are counts divided by counts per unit sample, so that their units remain.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Noise {
    /// Expected number of counts.
    pub counts: Counts,
    /// Seed; equal seeds give equal noise. 0 by default.
    #[serde(default)]
    pub seed: u64,
}

/// Expected number of counts.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Counts {
    /// Counts per unit sample (activity times cm).
    PerUnit(f64),
    /// Counts in all views of a gate, met to a relative error of 1.6e-5 because the scale has 16 significant bits
    /// (half of the last one is at most 2^-16 of it); any part of a gate needs all of its views once.
    Total(f64),
    /// Counts from the sensitivity of the camera ([`Counting`](crate::Counting)), which must be given.
    Expected,
}

/// The definition of a sample of a view.
///
/// A detector measures averages over its bins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
#[non_exhaustive]
pub enum BinSample {
    /// The value of the blurred image at the centre of the bin; without a response the line integral through it. It differs from the average by
    /// some per cent of the largest sample where the bins are wider than half the response.
    Centres,
    /// The average of the blurred image over the area of the bin.
    Averages,
}

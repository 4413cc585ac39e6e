//! Acquisition settings: plain data that scene files and Rust share.

/// The time that a view sees.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "scene",
    serde(rename_all = "kebab-case", deny_unknown_fields)
)]
#[non_exhaustive]
pub enum Mode {
    /// One phase, the same in all views.
    Static {
        /// The phase: 0 and 1 are the start of a beat, and whole beats more or less are the same. Scenes take 0 to 1.
        phase: f64,
    },
    /// The instant at which the view starts.
    Instants,
    /// The first seconds of the view.
    Exposure {
        /// How many.
        seconds: f64,
    },
    /// Whole beats; all of a view's time if the camera turns.
    WholeCycle,
    /// One set of views for each of some equal parts of the beat.
    Gated {
        /// How many parts.
        gates: usize,
    },
}

impl Mode {
    /// Sets of views.
    pub(crate) fn n_gates(self) -> usize {
        match self {
            Self::Gated { gates } => gates,
            Self::Static { .. } | Self::Instants | Self::Exposure { .. } | Self::WholeCycle => 1,
        }
    }
}

/// Accuracy of the samples.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "scene", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum Accuracy {
    /// Steps per cycle, even: half of them between levels of volume on the way up, half on the way down, rounded up to a multiple of four.
    /// Over whole beats of a sinusoid these are equal steps of time.
    Steps(usize),
    /// Whatever keeps the error of every sample, relative to the largest one, below this: steps of time, sub-bins and rays of bins, slabs of
    /// depth. With `Steps` the last three are as for 1e-3.
    Tolerance(f64),
}

/// Poisson counts, `[noise]` of a scene. Views are given as counts over counts per unit, so that their units stay.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "scene", serde(deny_unknown_fields))]
pub struct Noise {
    /// How many.
    pub counts: Counts,
    /// The same seed gives the same noise.
    pub seed: u64,
}

/// Mean numbers of counts.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "scene", serde(rename_all = "snake_case"))]
pub enum Counts {
    /// For a sample of 1 (activity times cm).
    PerUnit(f64),
    /// In all views of a gate together; any part of it then needs all of its views once.
    Total(f64),
    /// As the camera's sensitivity has them ([`Counting`](crate::Counting)), which has to be known then.
    Expected,
}

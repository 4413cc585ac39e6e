//! Projections to be written.

use crate::error::{PhantomError, check, check_count, check_length};
use crate::files::Samples;
use crate::files::samples::{SECONDS_PER_GATE, n_gates};
use revolve_voxel::ParallelDetector;

/// Whether the radii of an orbit are equal, up to rounding.
pub(crate) fn are_equal(radii: &[f64]) -> bool {
    let first = radii.first().copied().unwrap_or_default();
    radii
        .iter()
        .all(|radius| (radius - first).abs() <= 1e-12 * first)
}

/// How projections were acquired, for headers that record it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AcquisitionInfo {
    /// Detector heads: the views of head k are block k of as many blocks of equal length.
    pub heads: usize,
    /// Acquisition time of each view in seconds, of all gates together; 0 if unknown.
    pub seconds_per_view: f64,
    /// Whether samples are corrected for decay to the start of the acquisition.
    pub decay_corrected: bool,
    /// Whether samples are counts.
    pub counts: bool,
    /// The beats of a gated acquisition.
    pub beats: Option<BeatCounts>,
}

impl Default for AcquisitionInfo {
    fn default() -> Self {
        Self {
            heads: 1,
            seconds_per_view: 0.0,
            decay_corrected: false,
            counts: false,
            beats: None,
        }
    }
}

/// The R-R intervals of a gated acquisition.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeatCounts {
    /// Intervals accepted.
    pub accepted: usize,
    /// Intervals rejected.
    pub rejected: usize,
    /// Mean accepted interval in seconds.
    pub mean: f64,
    /// Shortest and longest interval in seconds that is accepted.
    pub limits: [f64; 2],
    /// Whether intervals outside the limits are rejected.
    pub rejects: bool,
}

/// Projections of a rotating camera, index order `[view][row][bin]`, with their geometry. Gates of a cycle are
/// `[gate][view][row][bin]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Projections<'a> {
    pub(super) detector: ParallelDetector,
    /// The angle of each view in radians.
    pub(super) angles: &'a [f64],
    /// Distance of the detector face from the axis of rotation in cm: one number, or one per view.
    pub(super) radii: &'a [f64],
    pub(super) samples: Samples<'a>,
    /// The expected counts of a sample of 1 in each view, if known.
    pub(super) counts: Option<&'a [f64]>,
    pub(super) seconds_per_gate: Option<f64>,
    pub(super) info: AcquisitionInfo,
    /// The name of the study, see [`Volume::study`](crate::files::Volume::study).
    pub study: Option<&'a str>,
}

impl<'a> Projections<'a> {
    /// Projections with their detector, the angle of each view in radians, and the distance in cm of the detector face from the
    /// axis of rotation: one number, or one per view.
    ///
    /// Line integrals of a parallel beam do not depend on the distance; Interfile requires it, because the resolution of a
    /// collimator does. Radii that are equal in all views describe a circular orbit.
    ///
    /// # Errors
    /// [`PhantomError::Count`] if there are no views; [`PhantomError::WrongLength`] unless there is one sample per view, row and
    /// bin, and one radius or one per view; [`PhantomError::OutOfRange`] if an angle or a sample is not finite, a radius is not
    /// positive, or a length in millimetres does not fit into 32 bits.
    pub fn new(
        detector: ParallelDetector,
        angles: &'a [f64],
        radii: &'a [f64],
        samples: impl Into<Samples<'a>>,
    ) -> Result<Self, PhantomError> {
        Self::with_gates(detector, angles, radii, samples.into(), None)
    }

    fn with_gates(
        detector: ParallelDetector,
        angles: &'a [f64],
        radii: &'a [f64],
        samples: Samples<'a>,
        seconds_per_gate: Option<f64>,
    ) -> Result<Self, PhantomError> {
        check_count("views", angles.len(), [1, usize::MAX])?;
        for &angle in angles {
            // Beyond this an f64 angle is not accurate to 1e-9 radians.
            check("view angle", angle, [-1e6, 1e6])?;
        }
        let (least, most) = (f64::from(f32::MIN_POSITIVE), f64::from(f32::MAX) / 10.0);
        if radii.len() != 1 {
            check_length("radii of the camera", radii.len(), angles.len())?;
        }
        for &radius in radii {
            check("camera radius", radius, [least, most])?;
        }
        for a in 0..2 {
            check("detector pitch", detector.pitch()[a], [least, most])?;
            check("detector offset", detector.offset()[a], [-most, most])?;
        }
        let projections = Self {
            detector,
            angles,
            radii: if are_equal(radii) { &radii[..1] } else { radii },
            samples,
            counts: None,
            seconds_per_gate,
            info: AcquisitionInfo::default(),
            study: None,
        };
        samples.check("samples of projections", &projections.axes())?;
        Ok(projections)
    }

    /// Projections of all gates of a cycle for one file, `[gate][view][row][bin]`, all at the same angles, `seconds` from one gate
    /// to the next.
    ///
    /// # Errors
    /// As [`Projections::new`], if the number of samples is not a multiple of that of a gate; [`PhantomError::OutOfRange`] if
    /// `seconds` is not positive.
    pub fn of_gates(
        detector: ParallelDetector,
        angles: &'a [f64],
        radii: &'a [f64],
        samples: impl Into<Samples<'a>>,
        seconds: f64,
    ) -> Result<Self, PhantomError> {
        check("seconds per gate", seconds, SECONDS_PER_GATE)?;
        Self::with_gates(detector, angles, radii, samples.into(), Some(seconds))
    }

    /// Sets the acquisition.
    ///
    /// # Errors
    /// [`PhantomError::Count`] without a head; [`PhantomError::WrongLength`] unless all heads have the same number of views;
    /// [`PhantomError::OutOfRange`] if the seconds are negative or not finite.
    pub fn with_acquisition(mut self, info: AcquisitionInfo) -> Result<Self, PhantomError> {
        check_count("heads", info.heads, [1, self.angles.len()])?;
        let whole = self.angles.len().next_multiple_of(info.heads);
        check_length("views of all heads", self.angles.len(), whole)?;
        check("seconds of a view", info.seconds_per_view, [0.0, 1e9])?;
        self.info = info;
        Ok(self)
    }

    /// Sets the expected counts of a sample of 1 in each view, `[view]` or `[gate][view]`, for headers.
    ///
    /// # Errors
    /// [`PhantomError::WrongLength`] unless there is one per view of each gate; [`PhantomError::OutOfRange`] if one is not finite
    /// and positive.
    pub fn with_counts_per_unit(mut self, counts: &'a [f64]) -> Result<Self, PhantomError> {
        let what = "counts of a sample of 1";
        check_length(what, counts.len(), self.n_gates() * self.angles.len())?;
        for &count in counts {
            check(what, count, [f64::MIN_POSITIVE, f64::MAX])?;
        }
        self.counts = Some(counts);
        Ok(self)
    }

    /// Returns the expected counts of a sample of 1, if they are known and equal in all views.
    pub(super) fn common_counts(&self) -> Option<f64> {
        let (first, others) = self.counts?.split_first()?;
        others.iter().all(|count| count == first).then_some(*first)
    }

    /// Returns the number of gates, or 1.
    pub(super) fn n_gates(&self) -> usize {
        match self.seconds_per_gate {
            None => 1,
            Some(_) => n_gates(
                self.samples,
                (self.shape().into_iter()).fold(1, usize::saturating_mul),
            ),
        }
    }

    /// Returns the lengths of the axes from slowest to fastest.
    pub(super) fn axes(&self) -> Vec<usize> {
        let gates = self.seconds_per_gate.map(|_| self.n_gates());
        gates.into_iter().chain(self.shape()).collect()
    }

    /// Returns `[views, rows, bins]` of a gate.
    pub(super) fn shape(&self) -> [usize; 3] {
        [
            self.angles.len(),
            self.detector.n_rows(),
            self.detector.n_bins(),
        ]
    }

    /// Returns the centres of the first bin and the first row in cm.
    pub(super) fn first(&self) -> [f64; 2] {
        let [_, rows, bins] = self.shape();
        let first = |n: usize, a: usize| {
            self.detector.offset()[a] - 0.5 * (n as f64 - 1.0) * self.detector.pitch()[a]
        };
        [first(bins, 0), first(rows, 1)]
    }
}

//! Projections to be written.

use crate::error::{PhantomError, check, check_count, check_length};
use crate::files::Samples;
use crate::files::samples::gates_of;
use revolve_voxel::ParallelDetector;

/// Distance of the detector face from the axis of rotation, in cm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Radius<'a> {
    /// The same in all views.
    Circular(f64),
    /// One per view.
    PerView(&'a [f64]),
}

impl From<f64> for Radius<'_> {
    fn from(radius: f64) -> Self {
        Self::Circular(radius)
    }
}

impl<'a> From<&'a [f64]> for Radius<'a> {
    fn from(radii: &'a [f64]) -> Self {
        Self::PerView(radii)
    }
}

impl Radius<'_> {
    /// Returns one number, or one per view.
    #[must_use]
    pub fn as_slice(&self) -> &[f64] {
        match self {
            Self::Circular(radius) => std::slice::from_ref(radius),
            Self::PerView(radii) => radii,
        }
    }
}

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
    detector: ParallelDetector,
    angles: &'a [f64],
    radius: Radius<'a>,
    samples: Samples<'a>,
    counts: Option<&'a [f64]>,
    seconds: f64,
    seconds_per_gate: Option<f64>,
    info: AcquisitionInfo,
    study: Option<&'a str>,
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
        radius: impl Into<Radius<'a>>,
        samples: impl Into<Samples<'a>>,
    ) -> Result<Self, PhantomError> {
        let (radius, samples) = (radius.into(), samples.into());
        check_count("views", angles.len(), [1, usize::MAX])?;
        let shape = [angles.len(), detector.n_rows(), detector.n_bins()];
        samples.check("samples of projections", &shape)?;
        for &angle in angles {
            // Beyond this an f64 angle is not accurate to 1e-9 radians.
            check("view angle", angle, [-1e6, 1e6])?;
        }
        let (least, most) = (f64::from(f32::MIN_POSITIVE), f64::from(f32::MAX) / 10.0);
        if let Radius::PerView(radii) = radius {
            check_length("radii of the camera", radii.len(), angles.len())?;
        }
        for &radius in radius.as_slice() {
            check("camera radius", radius, [least, most])?;
        }
        for a in 0..2 {
            check("detector pitch", detector.pitch()[a], [least, most])?;
            check("detector offset", detector.offset()[a], [-most, most])?;
        }
        let radius = match radius {
            Radius::PerView(radii) if are_equal(radii) => Radius::Circular(radii[0]),
            Radius::Circular(_) | Radius::PerView(_) => radius,
        };
        Ok(Self {
            detector,
            angles,
            radius,
            samples,
            counts: None,
            seconds: 0.0,
            seconds_per_gate: None,
            info: AcquisitionInfo::default(),
            study: None,
        })
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
        radius: impl Into<Radius<'a>>,
        samples: impl Into<Samples<'a>>,
        seconds: f64,
    ) -> Result<Self, PhantomError> {
        let samples = samples.into();
        let view_len = detector.n_rows().saturating_mul(detector.n_bins());
        let first = gates_of(samples, angles.len().saturating_mul(view_len), seconds)?;
        let projections = Self::new(detector, angles, radius, first)?;
        samples.check("samples of projections", &[samples.len()])?;
        Ok(Self {
            samples,
            seconds_per_gate: Some(seconds),
            ..projections
        })
    }

    /// Sets the acquisition time of each view in seconds, of all gates together; 0 if unknown. Only DICOM stores it.
    ///
    /// # Errors
    /// [`PhantomError::OutOfRange`] if they are negative or not finite.
    pub fn with_seconds(mut self, seconds: f64) -> Result<Self, PhantomError> {
        self.seconds = check("seconds of a view", seconds, [0.0, 1e9])?;
        Ok(self)
    }

    /// Sets the acquisition.
    ///
    /// # Errors
    /// [`PhantomError::Count`] without a head; [`PhantomError::WrongLength`] unless all heads have the same number of views.
    pub fn with_acquisition(mut self, info: AcquisitionInfo) -> Result<Self, PhantomError> {
        check_count("heads", info.heads, [1, self.angles.len()])?;
        let whole = self.angles.len().next_multiple_of(info.heads);
        check_length("views of all heads", self.angles.len(), whole)?;
        self.info = info;
        Ok(self)
    }

    /// Returns the acquisition.
    #[must_use]
    pub fn acquisition(&self) -> &AcquisitionInfo {
        &self.info
    }

    /// Sets the name of the study, see [`Volume::with_study`](crate::files::Volume::with_study).
    #[must_use]
    pub fn with_study(mut self, name: &'a str) -> Self {
        self.study = Some(name);
        self
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

    /// Returns the expected counts of a sample of 1 in each view, if known.
    #[must_use]
    pub fn counts_per_unit(&self) -> Option<&'a [f64]> {
        self.counts
    }

    /// Returns the detector.
    #[must_use]
    pub fn detector(&self) -> &ParallelDetector {
        &self.detector
    }

    /// Returns the angle of each view in radians.
    #[must_use]
    pub fn angles(&self) -> &'a [f64] {
        self.angles
    }

    /// Returns the distance of the detector face from the axis of rotation in cm.
    #[must_use]
    pub fn radius(&self) -> Radius<'a> {
        self.radius
    }

    /// Returns the acquisition time of each view in seconds; 0 if unknown.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.seconds
    }

    /// Returns the seconds from one gate to the next, for gated projections.
    #[must_use]
    pub fn seconds_per_gate(&self) -> Option<f64> {
        self.seconds_per_gate
    }

    /// Returns the number of gates, or 1.
    #[must_use]
    pub fn n_gates(&self) -> usize {
        self.samples.len() / self.shape().iter().product::<usize>().max(1)
    }

    /// Returns the name of the study.
    #[must_use]
    pub fn study(&self) -> Option<&'a str> {
        self.study
    }

    /// Returns the samples, `[view][row][bin]` or `[gate][view][row][bin]`.
    #[must_use]
    pub fn samples(&self) -> Samples<'a> {
        self.samples
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

//! The cavity volume over the cardiac cycle.

use crate::error::{PhantomError, check, check_count};
use crate::ranges::{EJECTION_FRACTION, GAIN};
use crate::scene::exactly;
use std::f64::consts::{PI, TAU};

/// Heart rates of [`VolumeCurve::Physiological`] that leave time for filling.
const PHYSIOLOGICAL_BPM: [f64; 2] = [35.0, 140.0];
/// Aortic closure to the opening of the mitral valve, seconds.
const ISOVOLUMIC_RELAXATION: f64 = 0.080;
/// Longest early filling and atrial contraction in seconds, and their largest fractions of the filling time.
const EARLY_FILLING: [f64; 2] = [0.200, 0.5];
const ATRIAL_FILLING: [f64; 2] = [0.110, 0.3];
/// Fractions of the stroke volume filled after early filling and after diastasis.
const FILLED: [f64; 2] = [0.75, 0.80];
/// Allowed numbers of samples of [`VolumeCurve::Sampled`].
const SAMPLES: [usize; 2] = [3, 100_000];

/// The normalised cavity volume over the cardiac cycle; [`VolumeRange`] sets EDV and ESV.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum VolumeCurve {
    /// `(1 - cos 2 pi p) / 2`, that of the study: **phase 0 is end-systole**, phase 1/2 end-diastole.
    Sinusoid,
    /// The left ventricle of a resting adult: **phase 0 is end-diastole**, the onset of the QRS complex.
    ///
    /// Pre-ejection `131 - 0.4 r` ms and ejection `413 - 1.7 r` ms at `r` beats/min, isovolumic relaxation 80 ms; then 75 % of the
    /// stroke volume in early filling (at most 200 ms), 5 % in diastasis, 20 % in atrial contraction (at most 110 ms), fractions
    /// from textbooks of physiology. Between these points the volume follows the monotone cubic of [`Sampled`](Self::Sampled); it
    /// is constant while all valves are closed.
    ///
    /// The regressions are those for men of Weissler, Harris and Schoenfeld 1968 (211 normal subjects,
    /// <https://doi.org/10.1161/01.CIR.37.2.149>), as quoted by later work; only the abstract was read. For 50 to 100 beats/min
    /// their sum `544 - 2.1 r` is within 13 ms of the electromechanical systole `541 - 2.2 r` ms measured in other men (Chest 80
    /// (1981) 613, <https://doi.org/10.1378/chest.80.5.613>).
    Physiological,
    /// Volumes at equally spaced phases; **phase 0 is the first sample**. Any unit: the smallest sample becomes the end-systolic
    /// volume, the largest the end-diastolic one. Interpolation by the periodic monotone cubic of Fritsch and Butland (1984,
    /// <https://doi.org/10.1137/0905021>), which never overshoots.
    Sampled(Vec<f64>),
}

/// The range of the cavity volume; `V_ref` is the reference volume of the inner membrane.
///
/// ```
/// use heart_phantom::VolumeRange;
/// // The paper's gain of 0.6 is an ejection fraction of 0.375.
/// let gains = VolumeRange::EjectionFraction(0.375).gains(93.0)?;
/// assert!(gains[0] == 0.0 && (gains[1] - 0.6).abs() < 1e-15);
/// let volumes = VolumeRange::Volumes { edv: 150.0, esv: 100.0 };
/// assert_eq!(volumes.gains(100.0)?, [0.0, 0.5]);
/// # Ok::<(), heart_phantom::PhantomError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum VolumeRange {
    /// The gain of the paper, `(EDV - ESV) / ESV` with `ESV = V_ref` (Eq. 35).
    Gain(f64),
    /// The gains at end-systole and at end-diastole.
    Gains(#[serde(deserialize_with = "exactly")] [f64; 2]),
    /// Ejection fraction `(EDV - ESV) / EDV` with `ESV = V_ref`.
    #[doc(alias = "LVEF")]
    EjectionFraction(f64),
    /// End-diastolic and end-systolic volume in mL, both at least `V_ref`: a deflated membrane has no solution.
    Volumes {
        /// Largest volume.
        edv: f64,
        /// Smallest volume.
        esv: f64,
    },
}

impl VolumeRange {
    /// Returns the volume gains at end-systole and end-diastole.
    ///
    /// # Errors
    /// [`PhantomError::OutOfRange`] unless `0 <= gain <= 20`, `0 <= fraction <= 20/21`, `V_ref <= ESV <= EDV <= 21 V_ref`, and
    /// `V_ref` is within 1e-30 to 1e30 mL.
    pub fn gains(&self, reference_volume: f64) -> Result<[f64; 2], PhantomError> {
        check("reference volume", reference_volume, [1e-30, 1e30])?;
        match *self {
            Self::Gain(gain) => Ok([0.0, check("gain", gain, GAIN)?]),
            Self::Gains([low, high]) => {
                check("largest gain", high, GAIN)?;
                Ok([check("smallest gain", low, [0.0, high])?, high])
            }
            Self::EjectionFraction(fraction) => {
                check("ejection_fraction", fraction, EJECTION_FRACTION)?;
                Ok([0.0, fraction / (1.0 - fraction)])
            }
            Self::Volumes { edv, esv } => {
                check(
                    "edv",
                    edv,
                    [reference_volume, reference_volume * (1.0 + GAIN[1])],
                )?;
                check("esv", esv, [reference_volume, edv])?;
                Ok([esv, edv].map(|volume| (volume - reference_volume) / reference_volume))
            }
        }
    }
}

/// A volume curve prepared for one heart rate: phase to normalised volume, 0 (ESV) to 1 (EDV).
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Height {
    Sinusoid,
    /// `sin(pi p)^(2 n)`, for breathing.
    Power(i32),
    Monotone(Vec<Knot>),
}

/// A point of a periodic monotone cubic with its slope.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Knot {
    phase: f64,
    height: f64,
    slope: f64,
}

impl Height {
    pub(crate) fn new(curve: &VolumeCurve, beats_per_minute: f64) -> Result<Self, PhantomError> {
        match curve {
            VolumeCurve::Sinusoid => Ok(Self::Sinusoid),
            VolumeCurve::Physiological => {
                let [low, high] = PHYSIOLOGICAL_BPM;
                check(
                    "beats_per_minute of a physiological curve",
                    beats_per_minute,
                    [low, high],
                )?;
                Ok(Self::Monotone(with_slopes(&physiological(
                    beats_per_minute,
                ))))
            }
            VolumeCurve::Sampled(volumes) => {
                check_count("number of samples of the curve", volumes.len(), SAMPLES)?;
                for &volume in volumes {
                    check("sample of the curve", volume, [-1e12, 1e12])?;
                }
                let low = volumes.iter().copied().fold(f64::INFINITY, f64::min);
                let high = volumes.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                check(
                    "range of the samples of the curve",
                    high - low,
                    [f64::MIN_POSITIVE, 1e13],
                )?;
                let n = volumes.len() as f64;
                let points: Vec<[f64; 2]> = (volumes.iter().enumerate())
                    .map(|(j, volume)| [j as f64 / n, (volume - low) / (high - low)])
                    .collect();
                Ok(Self::Monotone(with_slopes(&points)))
            }
        }
    }

    /// Returns the first phases of height 0 and of height 1.
    pub(crate) fn extreme_phases(&self) -> [f64; 2] {
        match self {
            Self::Sinusoid | Self::Power(_) => [0.0, 0.5],
            Self::Monotone(knots) => {
                // A monotone cubic has its extrema at knots.
                let first = |height: f64| knots.iter().find(|knot| knot.height == height);
                [0.0, 1.0].map(|height| first(height).map_or(0.0, |knot| knot.phase))
            }
        }
    }

    /// Returns the phases strictly between two others at which the curve may have an extremum or change its polynomial.
    pub(crate) fn knots_between(&self, from: f64, to: f64) -> Vec<f64> {
        let inside = |phase: &f64| *phase > from && *phase < to;
        match self {
            // More than the extrema, so that polynomials of low degree follow the cosine between them.
            Self::Sinusoid | Self::Power(_) => (0..=16)
                .map(|k| f64::from(k) / 16.0)
                .filter(inside)
                .collect(),
            Self::Monotone(knots) => {
                let first = knots.partition_point(|knot| knot.phase <= from);
                let phases = knots[first..].iter().map(|knot| knot.phase);
                phases.take_while(|phase| *phase < to).collect()
            }
        }
    }

    /// Returns the height at a phase in [0, 1]; NaN for NaN.
    pub(crate) fn at(&self, phase: f64) -> f64 {
        match self {
            Self::Sinusoid => {
                // Folded, so that mirrored phases have bitwise identical heights and share a shape.
                let phase = phase.min(1.0 - phase);
                (1.0 - (TAU * phase).cos()) / 2.0
            }
            Self::Power(n) => (PI * phase.min(1.0 - phase)).sin().powi(2 * n),
            Self::Monotone(_) if phase.is_nan() => f64::NAN,
            Self::Monotone(knots) => {
                let next = knots.partition_point(|knot| knot.phase <= phase);
                // The first knot is at phase 0.
                let a = &knots[next - 1];
                let (b, end) = knots.get(next).map_or((&knots[0], 1.0), |b| (b, b.phase));
                if a.height == b.height {
                    return a.height; // exactly, so that a standstill is one shape
                }
                let width = end - a.phase;
                let u = (phase - a.phase) / width;
                let rise = b.height - a.height;
                let (s, t) = (a.slope * width, b.slope * width);
                let height =
                    a.height + u * (s + u * (3.0 * rise - 2.0 * s - t + u * (s + t - 2.0 * rise)));
                height.clamp(a.height.min(b.height), a.height.max(b.height))
            }
        }
    }
}

/// Knots of the physiological curve.
fn physiological(beats_per_minute: f64) -> Vec<[f64; 2]> {
    let beat = 60.0 / beats_per_minute;
    let opening = (131.0 - 0.4 * beats_per_minute) / 1000.0;
    let closure = opening + (413.0 - 1.7 * beats_per_minute) / 1000.0;
    let filling = closure + ISOVOLUMIC_RELAXATION;
    let left = beat - filling;
    let lasting = |[longest, share]: [f64; 2]| f64::min(longest, share * left);
    [
        [0.0, 1.0],
        [opening, 1.0],
        [closure, 0.0],
        [filling, 0.0],
        [filling + lasting(EARLY_FILLING), FILLED[0]],
        [beat - lasting(ATRIAL_FILLING), FILLED[1]],
    ]
    .map(|[time, height]| [time / beat, height])
    .to_vec()
}

/// The slopes of Fritsch and Butland: a weighted harmonic mean of the neighbouring differences, 0 at an extremum.
fn with_slopes(points: &[[f64; 2]]) -> Vec<Knot> {
    let n = points.len();
    let step = |j: usize| {
        let ([a, from], [b, to]) = (points[j % n], points[(j + 1) % n]);
        let width = (b - a).rem_euclid(1.0);
        (width, (to - from) / width)
    };
    (0..n)
        .map(|j| {
            let ((h0, d0), (h1, d1)) = (step(j + n - 1), step(j));
            let slope = if d0 * d1 > 0.0 {
                let (w0, w1) = (2.0 * h1 + h0, h1 + 2.0 * h0);
                (w0 + w1) / (w0 / d0 + w1 / d1)
            } else {
                0.0
            };
            let [phase, height] = points[j];
            Knot {
                phase,
                height,
                slope,
            }
        })
        .collect()
}

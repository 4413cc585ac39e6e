//! Variable R-R intervals: start, acceptance and phases of each beat.

use super::volume_curve::Height;
use crate::error::{PhantomError, check, check_count};
use crate::ranges::{ECTOPIC, INTERVALS, LIST};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use rand_distr::{Distribution, StandardNormal};

/// Number of beats drawn before the sequence repeats.
const DRAWN: usize = 16_384;
/// Interval of a premature beat as a fraction of the mean interval; a compensatory pause follows.
const COUPLING: f64 = 0.6;
/// Shortest diastole as a fraction of that at the mean rate.
const SHORTEST_DIASTOLE: f64 = 0.05;

/// R-R intervals; the mean rate is that of the cycle.
#[doc(alias("arrhythmia", "heart rate variability"))]
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum RrIntervals {
    /// Intervals in seconds, repeated after the last.
    List(Vec<f64>),
    /// Random intervals about the period of the cycle, reproducible from the seed. Normal intervals that are too short for their
    /// systole or beyond four standard deviations are drawn again. A fully compensatory pause follows each premature beat (0.6 of
    /// the period): both together last two periods.
    Random {
        /// Standard deviation in seconds.
        deviation: f64,
        /// Fraction of premature beats.
        ectopic: f64,
        /// Seed.
        seed: u64,
    },
}

/// The definition of cardiac gates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum GatedBy {
    /// Equal fractions of each interval: gate g of n from `g/n` to `(g+1)/n` of it.
    #[default]
    FractionOfInterval,
    /// Time after R: gate g of n from `g/n` to `(g+1)/n` of the period of the cycle. The remainder of a longer beat belongs to no
    /// gate; a shorter beat lacks the last gates.
    TimeAfterR,
}

/// `[beats]`: variable R-R intervals.
///
/// A beat begins at phase 0. Systole, from the first largest to the next smallest volume, has the duration that it has at the rate
/// of the cycle; diastole absorbs the variation. With the systolic fraction S, the period P of the cycle and the interval R,
///
/// ```text
/// seconds per unit of phase:  P in systole,   (R - S P) / (1 - S) in diastole
/// ```
///
/// Electromechanical systole changes by 2.1 ms per beat/min (Weissler 1968, see
/// [`VolumeCurve::Physiological`](crate::VolumeCurve)), the interval by 14 ms between 60 and 70 beats/min: diastole absorbs 85 % of
/// the change, here all of it. EDV and ESV do not change.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Beats {
    /// The intervals.
    pub intervals: RrIntervals,
    /// Shortest and longest accepted interval in seconds; the time of other beats is not used, except by instantaneous views.
    /// `None` accepts all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accepted: Option<[f64; 2]>,
    /// The definition of cardiac gates.
    #[serde(default)]
    pub gated_by: GatedBy,
}

impl Beats {
    /// Accepts all beats; gates are fractions of the interval.
    #[must_use]
    pub fn new(intervals: RrIntervals) -> Self {
        Self {
            intervals,
            accepted: None,
            gated_by: GatedBy::default(),
        }
    }
}

/// A beat.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Beat {
    /// Its start, seconds.
    pub(crate) start: f64,
    /// Its length, seconds.
    pub(crate) length: f64,
}

/// Beats prepared for evaluation.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Rhythm {
    /// Start of each beat, and the end of the last.
    starts: Vec<f64>,
    accepted: Option<[f64; 2]>,
    gated_by: GatedBy,
    /// Length of a beat at the rate of the cycle.
    period: f64,
    /// Phases at which systole begins or ends, with 0 and 1, and whether each part is systole.
    parts: Vec<([f64; 2], bool)>,
    systole: f64,
}

impl Rhythm {
    /// Beats of the period of the cycle.
    pub(crate) fn regular(period: f64) -> Self {
        Self {
            starts: vec![0.0, period],
            accepted: None,
            gated_by: GatedBy::default(),
            period,
            parts: vec![([0.0, 1.0], false)],
            systole: 0.0,
        }
    }

    pub(crate) fn new(beats: &Beats, period: f64, height: &Height) -> Result<Self, PhantomError> {
        let [systolic, diastolic] = height.extreme_phases();
        let parts = parts(diastolic, systolic);
        let systole: f64 = (parts.iter())
            .filter(|(_, systole)| *systole)
            .map(|([a, b], _)| b - a)
            .sum();
        let shortest = period * (systole + SHORTEST_DIASTOLE * (1.0 - systole));
        let least = shortest.max(INTERVALS[0]);
        if let Some([low, high]) = beats.accepted {
            check("shortest accepted R-R interval", low, [0.0, f64::MAX])?;
            check("longest accepted R-R interval", high, [low, f64::MAX])?;
        }
        let lengths = match &beats.intervals {
            RrIntervals::List(lengths) => {
                check_count("number of R-R intervals", lengths.len(), LIST)?;
                for &length in lengths {
                    let what = "R-R interval, at least systole and 5 % of diastole,";
                    check(what, length, [least, INTERVALS[1]])?;
                }
                lengths.clone()
            }
            &RrIntervals::Random {
                deviation,
                ectopic,
                seed,
            } => {
                check("deviation of R-R intervals", deviation, [0.0, 0.5 * period])?;
                check("fraction of ectopic beats", ectopic, ECTOPIC)?;
                if ectopic > 0.0 {
                    let premature = COUPLING * period;
                    check(
                        "R-R interval of an ectopic beat, 0.6 of the period,",
                        premature,
                        [least, INTERVALS[1]],
                    )?;
                }
                drawn(deviation, ectopic, seed, [period, least])
            }
        };
        let mut starts = vec![0.0];
        starts.extend(lengths.iter().scan(0.0, |sum, length| {
            *sum += length;
            Some(*sum)
        }));
        Ok(Self {
            starts,
            accepted: beats.accepted,
            gated_by: beats.gated_by,
            period,
            parts,
            systole,
        })
    }

    /// Returns whether all beats have the period and are accepted.
    pub(crate) fn is_plain(&self) -> bool {
        let equal = (0..self.starts.len() - 1).all(|k| {
            let length = self.starts[k + 1] - self.starts[k];
            (length - self.period).abs() <= 4.0 * f64::EPSILON * self.starts[k + 1]
        });
        equal && self.accepts(&self.beat(0))
    }

    /// Returns a beat by its index, from 0.
    pub(crate) fn beat(&self, k: usize) -> Beat {
        let n = self.starts.len() - 1;
        let (round, k) = (k / n, k % n);
        Beat {
            start: round as f64 * self.starts[n] + self.starts[k],
            length: self.starts[k + 1] - self.starts[k],
        }
    }

    /// Returns the index of the beat at a time not before the first.
    pub(crate) fn number_at(&self, seconds: f64) -> usize {
        let n = self.starts.len() - 1;
        let round = (seconds / self.starts[n]).floor().max(0.0);
        let within = seconds - round * self.starts[n];
        let k = self.starts.partition_point(|start| *start <= within);
        round as usize * n + k.clamp(1, n) - 1
    }

    /// Shortest and longest accepted interval in seconds; `None` accepts all.
    pub(crate) fn accepted(&self) -> Option<[f64; 2]> {
        self.accepted
    }

    /// Returns whether the beat is accepted.
    pub(crate) fn accepts(&self, beat: &Beat) -> bool {
        self.accepted
            .is_none_or(|[low, high]| beat.length >= low && beat.length <= high)
    }

    /// Returns the length of the longest beat.
    pub(crate) fn longest(&self) -> f64 {
        let lengths = self.starts.windows(2).map(|pair| pair[1] - pair[0]);
        lengths.fold(0.0, f64::max)
    }

    /// Returns the start and end of a gate in a beat, in seconds after its start; equal if the gate does not occur.
    pub(crate) fn gate(&self, beat: &Beat, gate: usize, gates: usize) -> [f64; 2] {
        let of = match self.gated_by {
            GatedBy::FractionOfInterval => beat.length,
            GatedBy::TimeAfterR => self.period,
        };
        [gate, gate + 1].map(|g| (g as f64 / gates as f64 * of).min(beat.length))
    }

    /// Returns the phase at a time after the start of a beat.
    pub(crate) fn phase(&self, beat: &Beat, seconds: f64) -> f64 {
        let mut left = seconds;
        for &([a, b], systole) in &self.parts {
            let rate = self.rate(beat, systole);
            if left <= rate * (b - a) {
                return (a + left / rate).clamp(a, b);
            }
            left -= rate * (b - a);
        }
        1.0
    }

    /// Returns the parts of a beat with linear phase: both ends in seconds after its start, and as phases.
    pub(crate) fn linear_parts(&self, beat: &Beat) -> Vec<([f64; 2], [f64; 2])> {
        let mut from = 0.0;
        (self.parts.iter())
            .map(|&([a, b], systole)| {
                let to = from + self.rate(beat, systole) * (b - a);
                let part = ([from, to], [a, b]);
                from = to;
                part
            })
            .collect()
    }

    /// Seconds per unit of phase.
    fn rate(&self, beat: &Beat, systole: bool) -> f64 {
        match systole {
            true => self.period,
            false => (beat.length - self.systole * self.period) / (1.0 - self.systole),
        }
    }
}

/// Divides a beat at the start of systole (largest volume) and at its end (smallest volume).
fn parts(from: f64, to: f64) -> Vec<([f64; 2], bool)> {
    let (cuts, first) = match from < to {
        true => ([0.0, from, to, 1.0], false),
        false => ([0.0, to, from, 1.0], true),
    };
    let within = |k: usize| (k == 1) != first;
    (0..3)
        .map(|k| ([cuts[k], cuts[k + 1]], within(k)))
        .filter(|([a, b], _)| b > a)
        .collect()
}

/// Draws normal intervals and premature beats.
fn drawn(deviation: f64, ectopic: f64, seed: u64, [mean, least]: [f64; 2]) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut lengths = Vec::with_capacity(DRAWN + 1);
    while lengths.len() < DRAWN {
        let share = random.next_u32() as f64 / u32::MAX as f64;
        // A premature beat and its pause are drawn together: with probability q of such pairs, the fraction q / (1 + q) of beats is
        // premature.
        if share < ectopic / (1.0 - ectopic) {
            lengths.extend([COUPLING * mean, (2.0 - COUPLING) * mean]);
            continue;
        }
        let length = loop {
            let z: f64 = StandardNormal.sample(&mut random);
            let length = mean + deviation * z;
            if z.abs() <= 4.0 && length >= least {
                break length;
            }
        };
        lengths.push(length);
    }
    lengths
}

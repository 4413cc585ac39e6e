//! Beats of different length: when each begins, which of them count, and how a beat's phases lie in its time.

use super::volume_curve::Height;
use crate::error::{PhantomError, check, check_count};
use crate::ranges::{ECTOPIC, INTERVALS, LIST};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use rand_distr::{Distribution, StandardNormal};

/// Beats that are drawn; then they come again.
const DRAWN: usize = 16_384;
/// A premature beat comes after this share of the mean interval, and the pause after it makes up for that.
const COUPLING: f64 = 0.6;
/// Diastole lasts at least this share of what it does at the mean rate.
const SHORTEST_DIASTOLE: f64 = 0.05;

/// R-R intervals, whose mean rate is the cycle's.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "scene", serde(rename_all = "kebab-case"))]
#[non_exhaustive]
pub enum RrIntervals {
    /// Seconds of each beat; after the last one they come again.
    List(Vec<f64>),
    /// Drawn around the cycle's own period, the same from the same seed: normal intervals (those too short for their systole, or
    /// beyond four deviations, drawn again), and premature beats after 0.6 of the period, each followed by a pause that makes up for it
    /// (a fully compensatory one: both together last two periods).
    Random {
        /// Standard deviation in seconds.
        deviation: f64,
        /// Share of beats that are premature.
        ectopic: f64,
        /// Seed.
        seed: u64,
    },
}

/// What a cardiac gate is a part of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "scene", serde(rename_all = "kebab-case"))]
#[non_exhaustive]
pub enum GatedBy {
    /// Equal shares of each interval: gate g of n from `g/n` to `(g+1)/n` of it.
    #[default]
    ShareOfInterval,
    /// Time after R: gate g of n from `g/n` to `(g+1)/n` of the cycle's own period. What a longer beat has left after the last gate
    /// counts to none, and a shorter one has no time for the last.
    TimeAfterR,
}

/// Beats that differ in length.
///
/// A beat begins at phase 0. Systole, from the first largest to the next smallest volume, lasts as long in each as at the cycle's
/// own rate, and diastole takes the change: with S the share of systole, P the cycle's period and R the interval,
///
/// ```text
/// seconds for each unit of phase:  P in systole,   (R - S P) / (1 - S) in diastole
/// ```
///
/// From one rate to another electromechanical systole changes by 2.1 ms for each beat a minute (Weissler 1968, see
/// [`VolumeCurve::Physiological`](crate::VolumeCurve)), where the interval changes by 14 ms between 60 and 70: diastole takes 85 % of the change, and here all of it.
/// The volumes at both ends stay what they are.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "scene", serde(deny_unknown_fields))]
pub struct Beats {
    /// How long they are.
    pub intervals: RrIntervals,
    /// Shortest and longest interval in seconds that is accepted; the time of other beats is not used, but by instants. `None` for all.
    #[cfg_attr(
        feature = "scene",
        serde(default, skip_serializing_if = "Option::is_none")
    )]
    pub accepted: Option<[f64; 2]>,
    /// What gates are parts of.
    #[cfg_attr(feature = "scene", serde(default))]
    pub gated_by: GatedBy,
}

impl Beats {
    /// All of them accepted, gates as shares of the interval.
    pub fn new(intervals: RrIntervals) -> Self {
        Self {
            intervals,
            accepted: None,
            gated_by: GatedBy::default(),
        }
    }
}

/// A beat in real time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Beat {
    /// When it begins, seconds.
    pub(crate) start: f64,
    /// How long it is.
    pub(crate) length: f64,
}

/// Beats made ready.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Rhythm {
    /// When each begins, and the end of the last.
    starts: Vec<f64>,
    accepted: Option<[f64; 2]>,
    gated_by: GatedBy,
    /// Length of a beat at the cycle's own rate.
    period: f64,
    /// Phases at which systole begins or ends, 0 and 1, and whether each part is of systole.
    parts: Vec<([f64; 2], bool)>,
    systole: f64,
}

impl Rhythm {
    /// Every beat as long as the cycle's own.
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
                check_count("R-R intervals", lengths.len(), LIST)?;
                for &length in lengths {
                    check("R-R interval", length, [least, INTERVALS[1]])?;
                }
                lengths.clone()
            }
            &RrIntervals::Random {
                deviation,
                ectopic,
                seed,
            } => {
                check("deviation of R-R intervals", deviation, [0.0, 0.5 * period])?;
                check("share of ectopic beats", ectopic, ECTOPIC)?;
                if ectopic > 0.0 {
                    let premature = COUPLING * period;
                    check(
                        "R-R interval of an ectopic beat",
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

    /// Whether it is nothing but beats of the period, all of them counted.
    pub(crate) fn is_plain(&self) -> bool {
        let equal = (0..self.starts.len() - 1).all(|k| {
            let length = self.starts[k + 1] - self.starts[k];
            (length - self.period).abs() <= 4.0 * f64::EPSILON * self.starts[k + 1]
        });
        equal && self.accepts(&self.beat(0))
    }

    /// A beat by its number, from 0.
    pub(crate) fn beat(&self, k: usize) -> Beat {
        let n = self.starts.len() - 1;
        let (round, k) = (k / n, k % n);
        Beat {
            start: round as f64 * self.starts[n] + self.starts[k],
            length: self.starts[k + 1] - self.starts[k],
        }
    }

    /// The number of the beat at a time that is not before the first.
    pub(crate) fn number_at(&self, seconds: f64) -> usize {
        let n = self.starts.len() - 1;
        let round = (seconds / self.starts[n]).floor().max(0.0);
        let within = seconds - round * self.starts[n];
        let k = self.starts.partition_point(|start| *start <= within);
        round as usize * n + k.clamp(1, n) - 1
    }

    /// Shortest and longest interval in seconds that is accepted; `None` for all.
    #[cfg(feature = "scene")]
    pub(crate) fn accepted(&self) -> Option<[f64; 2]> {
        self.accepted
    }

    /// Does its time count?
    pub(crate) fn accepts(&self, beat: &Beat) -> bool {
        self.accepted
            .is_none_or(|[low, high]| beat.length >= low && beat.length <= high)
    }

    /// The longest beat.
    pub(crate) fn longest(&self) -> f64 {
        let lengths = self.starts.windows(2).map(|pair| pair[1] - pair[0]);
        lengths.fold(0.0, f64::max)
    }

    /// From where to where a gate goes in a beat, in seconds after its start; of no length if it does not come.
    pub(crate) fn gate(&self, beat: &Beat, gate: usize, gates: usize) -> [f64; 2] {
        let of = match self.gated_by {
            GatedBy::ShareOfInterval => beat.length,
            GatedBy::TimeAfterR => self.period,
        };
        [gate, gate + 1].map(|g| (g as f64 / gates as f64 * of).min(beat.length))
    }

    /// Phase at a time after the start of a beat.
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

    /// Parts of a beat in which phase is linear in time: both ends in seconds after its start, and as phases.
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

    /// Seconds for each unit of phase.
    fn rate(&self, beat: &Beat, systole: bool) -> f64 {
        match systole {
            true => self.period,
            false => (beat.length - self.systole * self.period) / (1.0 - self.systole),
        }
    }
}

/// A beat cut where systole begins, at the largest volume, and where it ends, at the smallest.
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

/// Normal intervals with premature beats among them.
fn drawn(deviation: f64, ectopic: f64, seed: u64, [mean, least]: [f64; 2]) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut lengths = Vec::with_capacity(DRAWN + 1);
    while lengths.len() < DRAWN {
        let share = random.next_u32() as f64 / u32::MAX as f64;
        // A premature beat and its pause are drawn as one: of q such pairs to 1 - q other beats, q / (1 + q) are premature.
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

//! The R-R intervals of an acquisition.

use super::Phantom;
use crate::files::BeatCounts;

/// Statistics of the beats, if R-R intervals vary or beats are rejected.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct BeatReport {
    /// Number of beats that begin before the last view ends.
    pub beats: usize,
    /// Number of beats with rejected R-R intervals; their time is not used. [`ViewTime::window`](crate::ViewTime::window) is the remaining
    /// acquisition time of each view and gate.
    pub rejected: usize,
    /// Start of each beat, seconds.
    pub start_s: Vec<f64>,
    /// R-R interval of each beat, seconds.
    pub interval_s: Vec<f64>,
    /// Whether each beat is accepted.
    pub accepted: Vec<bool>,
}

impl Phantom {
    /// Counts the R-R intervals from the start of the first view to the end of the last, for headers.
    pub(crate) fn beat_counts(&self) -> BeatCounts {
        let (camera, period) = (self.camera(), self.cycle().period());
        let Some(report) = self.beats() else {
            return BeatCounts {
                accepted: ((camera.end() / period).round() as usize).max(1),
                rejected: 0,
                mean: period,
                limits: [period; 2],
                rejects: false,
            };
        };
        let accepted = report.interval_s.iter().zip(&report.accepted);
        let accepted: Vec<f64> = accepted.filter(|(_, yes)| **yes).map(|(s, _)| *s).collect();
        let least = accepted.iter().copied().fold(f64::INFINITY, f64::min);
        let most = accepted.iter().copied().fold(0.0, f64::max);
        let limits = self.cycle().rhythm().and_then(|rhythm| rhythm.accepted());
        BeatCounts {
            accepted: accepted.len(),
            rejected: report.rejected,
            mean: match accepted.is_empty() {
                true => period,
                false => accepted.iter().sum::<f64>() / accepted.len() as f64,
            },
            limits: limits.unwrap_or([least.min(most), most]),
            rejects: limits.is_some(),
        }
    }

    /// Returns the beats from the start of the first view to the end of the last; `None` if all are equal and accepted.
    #[must_use]
    pub fn beats(&self) -> Option<BeatReport> {
        let rhythm = self.cycle().rhythm()?;
        let end = self.camera().end();
        let beats: Vec<_> = (0..)
            .map(|k| rhythm.beat(k))
            .take_while(|beat| beat.start < end)
            .collect();
        let accepted: Vec<bool> = beats.iter().map(|beat| rhythm.accepts(beat)).collect();
        Some(BeatReport {
            beats: beats.len(),
            rejected: accepted.iter().filter(|accepted| !**accepted).count(),
            start_s: beats.iter().map(|beat| beat.start).collect(),
            interval_s: beats.iter().map(|beat| beat.length).collect(),
            accepted,
        })
    }
}

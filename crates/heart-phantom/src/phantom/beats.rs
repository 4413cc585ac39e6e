//! Which beats came while the camera looked.

use super::Phantom;

/// The beats of a scan whose beats differ, or of which some are not accepted.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize))]
#[non_exhaustive]
pub struct BeatReport {
    /// Beats that began before the last view ended.
    pub beats: usize,
    /// Those whose intervals are not accepted: their time is not used. How long each gate was seen in each view, and so what is left,
    /// is [`ViewTime::window`](crate::ViewTime::window).
    pub rejected: usize,
    /// When each begins, in seconds.
    pub start_s: Vec<f64>,
    /// R-R interval of each in seconds.
    pub interval_s: Vec<f64>,
    /// Whether it is accepted.
    pub accepted: Vec<bool>,
}

impl Phantom {
    /// The beats from the start of the first view to the end of the last; `None` if they are all alike and count.
    pub fn beats(&self) -> Option<BeatReport> {
        let rhythm = self.cycle().rhythm()?;
        let camera = self.camera();
        let end = camera.view_start(camera.n_views() - 1) + camera.interval();
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

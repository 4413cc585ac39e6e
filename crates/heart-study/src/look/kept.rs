//! What is kept of a run until it is shown.

use super::beat::Beat;
use super::planes::Planes;
use crate::StudyError;
use crate::figures::{Cut, Picture, sections};
use heart_phantom::{Mode, Phantom};

/// What the pictures and the page are of.
#[derive(Debug)]
pub(super) struct Kept<'a> {
    pub(super) phantom: &'a Phantom,
    planes: Option<Planes>,
    pub(super) shown: Vec<Shown>,
    /// Sum of the samples of each view, by gate.
    pub(super) sums: Vec<Vec<f64>>,
    /// Of the first gate: the row of the heart's middle in each view, and three views.
    pub(super) sinogram: Option<(Cut, Vec<Cut>)>,
}

/// A kind of volume: all that is kept of its gates.
#[derive(Debug)]
pub(super) struct Shown {
    /// `reconstruction`, or `truth`.
    pub(super) name: &'static str,
    /// The sections of each gate.
    pub(super) cuts: Vec<Vec<Cut>>,
    /// Its largest sample in these, and the smallest.
    range: [f32; 2],
    pub(super) beat: Beat,
}

impl<'a> Kept<'a> {
    pub(super) fn new(phantom: &'a Phantom) -> Self {
        Self {
            phantom,
            planes: None,
            shown: Vec::new(),
            sums: Vec::new(),
            sinogram: None,
        }
    }

    /// A volume of the next gate; `moves` if the beat is kept too.
    pub(super) fn keep(&mut self, name: &'static str, volume: &[f32], moves: bool) {
        let phantom = self.phantom;
        let planes = self.planes.get_or_insert_with(|| Planes::new(phantom));
        let cuts = planes.cut(volume);
        let known = self.shown.iter().position(|shown| shown.name == name);
        let at = known.unwrap_or_else(|| {
            self.shown.push(Shown {
                name,
                cuts: Vec::new(),
                range: [f32::INFINITY, f32::NEG_INFINITY],
                beat: Beat::new(phantom),
            });
            self.shown.len() - 1
        });
        let shown = &mut self.shown[at];
        for &value in cuts.iter().flat_map(|cut| &cut.values) {
            shown.range = [shown.range[0].min(value), shown.range[1].max(value)];
        }
        shown.cuts.push(cuts);
        if moves {
            shown.beat.push(volume);
        }
    }

    /// The sections of a gate in the window of all gates.
    pub(super) fn picture(&self, shown: &Shown, gate: usize) -> Result<Picture, StudyError> {
        let window = shown.window();
        let rate = 60.0 / self.phantom.cycle().period();
        let heading = format!(
            "{}, {}, {rate:.0} beats a minute",
            shown.what(),
            self.when(gate)
        );
        sections(&shown.cuts[gate], window, self.unit(), &heading)
    }

    /// What a sample of a volume is.
    pub(super) fn unit(&self) -> &'static str {
        match self.phantom.scene().counting {
            Some(_) => "MBq/mL",
            None => "activity/mL",
        }
    }

    pub(super) fn when(&self, gate: usize) -> String {
        match self.phantom.scene().acquisition.mode {
            Mode::Static { phase } => format!("phase {phase}"),
            Mode::Gated { gates } => {
                let phase = (gate as f64 + 0.5) / gates as f64;
                format!("gate {} of {gates}, phase {phase:.3}", gate + 1)
            }
            Mode::Instants => "an instant a view".into(),
            Mode::Exposure { seconds } => format!("{seconds} s a view"),
            _ => "whole beats".into(),
        }
    }
}

impl Shown {
    pub(super) fn what(&self) -> &'static str {
        match self.name {
            "reconstruction" => "reconstruction",
            "truth" => "exact activity",
            _ => "exact activity, mean of all views",
        }
    }

    /// Black is nothing, or the smallest sample if that is further below than a tenth of the largest; white is the largest of all
    /// sections of all gates.
    pub(super) fn window(&self) -> [f64; 2] {
        let [low, high] = self.range.map(f64::from);
        let high = if high > 0.0 { high } else { 1.0 };
        [if low < -0.1 * high { low } else { 0.0 }, high]
    }
}

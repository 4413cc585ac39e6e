//! Data of a run for its images and page.

use super::beat::Beat;
use super::planes::Planes;
use crate::StudyError;
use crate::figures::{Cut, Picture, sections};
use heart_phantom::{Mode, Phantom};

/// Collected data.
#[derive(Debug)]
pub(super) struct Kept<'a> {
    pub(super) phantom: &'a Phantom,
    planes: Option<Planes>,
    pub(super) shown: Vec<Shown>,
    /// Sum of the samples of each view, by gate.
    pub(super) sums: Vec<Vec<f64>>,
    /// Of the first gate: the row at the centre of the heart in each view, and three views.
    pub(super) sinogram: Option<(Cut, Vec<Cut>)>,
}

/// The data of one kind of volume for all gates.
#[derive(Debug)]
pub(super) struct Shown {
    /// `reconstruction`, or `truth`.
    pub(super) name: &'static str,
    /// The sections of each gate.
    pub(super) cuts: Vec<Vec<Cut>>,
    /// Largest and smallest sample in these.
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

    /// Adds the volume of the next gate; `moves` keeps it for the viewer too.
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

    /// Returns the sections of a gate with the window of all gates.
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

    /// Returns the label of samples.
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
                format!("gate {gate} (of {gates}), phase {phase:.3}")
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
            _ => "exact activity, average over all views",
        }
    }

    /// Black is 0, or the smallest sample if it is below minus a tenth of the largest; white is the largest sample of all sections
    /// of all gates.
    pub(super) fn window(&self) -> [f64; 2] {
        let [low, high] = self.range.map(f64::from);
        let high = if high > 0.0 { high } else { 1.0 };
        [if low < -0.1 * high { low } else { 0.0 }, high]
    }
}

//! Data of a run for its images and page.

use super::beat::Beat;
use super::planes::Planes;
use crate::figures::{Cut, Picture, sections};
use heart_phantom::PhantomError;
use heart_phantom::{Mode, Phantom};

/// Images and page of a run: collects the results of each gate and writes files at the end.
#[derive(Debug)]
pub(crate) struct Look<'a> {
    pub(super) phantom: &'a Phantom,
    /// Whether a page is written.
    pub(super) page: bool,
    pub(super) planes: Planes,
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

impl Look<'_> {
    /// Adds the volume of the next gate, for a page also to the viewer.
    pub(super) fn keep(&mut self, name: &'static str, volume: &[f32]) {
        let phantom = self.phantom;
        let cuts = self.planes.cut(volume);
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
        if self.page {
            shown.beat.push(volume);
        }
    }

    /// Returns the sections of a gate with the window of all gates.
    pub(super) fn picture(&self, shown: &Shown, gate: usize) -> Result<Picture, PhantomError> {
        let window = shown.window();
        let rate = 60.0 / self.phantom.cycle().period();
        let heading = format!(
            "{}, {}, {rate:.0} beats per minute",
            shown.what(),
            self.when(gate)
        );
        sections(&shown.cuts[gate], window, self.unit(), &heading)
    }

    /// Returns the sections of the reconstruction of a gate minus the exact activity, and the value of white; black is its negative.
    /// `None` without both.
    pub(super) fn difference(&self, gate: usize) -> Result<Option<(Picture, f64)>, PhantomError> {
        let [image, truth] = &self.shown[..] else {
            return Ok(None);
        };
        let minus = |(a, b): (&Cut, &Cut)| Cut {
            values: (a.values.iter().zip(&b.values))
                .map(|(a, b)| a - b)
                .collect(),
            ..a.clone()
        };
        let all = (image.cuts.iter().zip(&truth.cuts))
            .map(|(image, truth)| image.iter().zip(truth).map(minus).collect())
            .collect::<Vec<Vec<Cut>>>();
        let values = all.iter().flatten().flat_map(|cut| &cut.values);
        let most = values.fold(0.0f32, |most, value| most.max(value.abs()));
        let white = if most > 0.0 { f64::from(most) } else { 1.0 };
        let heading = format!(
            "{} minus {}, {}",
            image.what(),
            truth.what(),
            self.when(gate)
        );
        let picture = sections(&all[gate], [-white, white], self.unit(), &heading)?;
        Ok(Some((picture, white)))
    }

    /// Returns the unit of activity concentration.
    pub(super) fn unit(&self) -> &'static str {
        match self.phantom.scene().counting {
            Some(_) => "MBq/mL",
            None => "1/mL",
        }
    }

    /// Returns `, respiratory gate K (of N)` for a gated projection set; empty without respiratory gates.
    pub(super) fn respiratory_gate(&self, gate: usize) -> String {
        let cardiac = self.phantom.n_cardiac_gates();
        match self.phantom.n_gates() / cardiac {
            1 => String::new(),
            n => format!(", respiratory gate {} (of {n})", gate / cardiac),
        }
    }

    pub(super) fn when(&self, gate: usize) -> String {
        let cardiac = match self.phantom.scene().acquisition.mode {
            Mode::Static { phase } => format!("phase {phase}"),
            Mode::Gated { gates } => {
                // Respiratory gates have all cardiac gates each.
                let phase = ((gate % gates) as f64 + 0.5) / gates as f64;
                let name = match self.phantom.n_gates() / gates {
                    1 => format!("gate {gate}"),
                    _ => format!("set {gate}: cardiac gate {}", gate % gates),
                };
                format!("{name} (of {gates}), phase {phase:.3}")
            }
            Mode::Instants => "one instant per view".into(),
            Mode::Exposure { seconds } => format!("{seconds} s per view"),
            _ => "whole beats".into(),
        };
        cardiac + &self.respiratory_gate(gate)
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

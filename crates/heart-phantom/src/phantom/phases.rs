//! Phases of the cycle that represent projections: those of labels, maps and surfaces.

use crate::error::PhantomError;
use crate::scan::{Acquisition, Scan};
use crate::{HeartShape, Mode, Phantom, RespiratoryGates, Thickness};
use std::fmt;

/// A phase and the projections that it represents.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct ScenePhase {
    /// The represented projections.
    pub of: PhaseOf,
    /// The phase; for a respiratory gate its middle.
    pub at: MotionPhase,
}

/// A cardiac phase and a respiratory position. A phase alone is at end-expiration.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MotionPhase {
    /// Cardiac phase.
    pub phase: f64,
    /// Respiratory position, from 0 at end-expiration to 1 at end-inspiration. Without `[breathing]` it has no effect.
    pub breath: f64,
    /// Respiratory phase, 0 to 1 from end-expiration, of which `breath` is the position; [`Phantom::motion`] adds the velocity of respiration
    /// there. `None` during a breath-hold, and for a gate by amplitude, which contains inspiration and expiration.
    pub breath_phase: Option<f64>,
}

impl From<f64> for MotionPhase {
    fn from(phase: f64) -> Self {
        Self {
            phase,
            ..Self::default()
        }
    }
}

/// The projections that a phase represents. [`fmt::Display`] writes the suffix of file names: `labels-gate-03`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PhaseOf {
    /// All projections of a static scene.
    Static,
    /// A gate, by its middle.
    Gate {
        /// Index of the gate, from 0.
        gate: usize,
        /// Number of gates.
        gates: usize,
    },
    /// The largest cavity.
    EndDiastole,
    /// The smallest one.
    EndSystole,
}

impl fmt::Display for PhaseOf {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Static => f.write_str("static"),
            // Padded with zeros, so that names sort.
            Self::Gate { gate, gates } => {
                let digits = (gates - 1).to_string().len().max(2);
                write!(f, "gate-{gate:0digits$}")
            }
            Self::EndDiastole => f.write_str("end-diastole"),
            Self::EndSystole => f.write_str("end-systole"),
        }
    }
}

/// The heart at a phase.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct PhaseReport {
    /// Name of the phase: `static`, `gate-03`, `end-diastole`, `end-systole`.
    pub of: String,
    /// Cardiac phase.
    pub phase: f64,
    /// Respiratory position with respiration: 0 at end-expiration, 1 at end-inspiration.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub breath: Option<f64>,
    /// Volume of the cavity in mL, at this phase.
    pub cavity_ml: f64,
    /// Volume of the cavity averaged over the time of the projections of a gate, mL, as an image of the gate shows it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_cavity_ml: Option<f64>,
    /// Volume gain, `(V - V_ref) / V_ref`.
    pub gain: f64,
    /// Wall thickness.
    pub thickness: Thickness,
    /// Load f of the inner membrane, the pressure in the chosen law. Unit: stiffness times cm; stiffness under
    /// `PressureLaw::PerCurrentLength`; kPa across a membrane of rubber.
    pub f_inner: f64,
    /// Load f of the outer membrane.
    pub f_outer: f64,
    /// [`HeartShape::pressures_mmhg`], if the membranes are of rubber.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pressures_mmhg: Option<[f64; 2]>,
}

impl Phantom {
    /// Returns the phases that represent the projections: that of a static scene, the middle of each gate, else end-diastole and end-systole;
    /// with respiration at end-expiration or in the middle of each respiratory gate.
    #[must_use]
    pub fn phases(&self) -> Vec<ScenePhase> {
        let gates = self.n_gates();
        let middle = |gate: usize| {
            let (breath, breath_phase) = self.middle_breath(gate);
            let phase = match self.scene().acquisition.mode {
                Mode::Static { phase } => phase,
                Mode::Gated { gates } => ((gate % gates) as f64 + 0.5) / gates as f64,
                // A respiratory gate covers the whole cardiac cycle: it is represented by end-diastole.
                Mode::Instants | Mode::Exposure { .. } | Mode::WholeCycle => {
                    self.cycle().extreme_phases()[1]
                }
            };
            ScenePhase {
                of: PhaseOf::Gate { gate, gates },
                at: MotionPhase {
                    phase,
                    breath,
                    breath_phase,
                },
            }
        };
        let mode = self.scene().acquisition.mode;
        let is_gated = gates > 1 || matches!(mode, Mode::Gated { .. });
        match mode.static_phase() {
            _ if is_gated => (0..gates).map(middle).collect(),
            None => self.ends().to_vec(),
            Some(phase) => {
                let (of, at) = (PhaseOf::Static, phase.into());
                vec![ScenePhase { of, at }]
            }
        }
    }

    /// Evaluates a function of the heart at a motion phase.
    pub(crate) fn at_motion_phase<T>(
        &self,
        moment: MotionPhase,
        look: impl FnOnce(&Scan<'_>) -> Result<T, PhantomError>,
    ) -> Result<T, PhantomError> {
        let heart = self.parts.heart.with_pose(self.pose(moment.breath)?);
        let cycle = self.parts.cycle.clone().without_breathing();
        look(&Scan {
            heart: &heart,
            cycle: &cycle,
            ..self.scan(Acquisition::still(moment.phase))
        })
    }

    /// Returns respiratory position and phase at the middle of the respiratory gate of a projection set.
    fn middle_breath(&self, gate: usize) -> (f64, Option<f64>) {
        let gate = gate / self.n_cardiac_gates();
        let middle = |gate: usize, n: usize| (gate as f64 + 0.5) / n as f64;
        let Some(breathing) = self.cycle().breathing() else {
            return (0.0, None);
        };
        match breathing.breathing().gates {
            None => (0.0, None),
            Some(RespiratoryGates::Phase(n)) => {
                let phase = middle(gate, n);
                (breathing.at_phase(phase), Some(phase))
            }
            Some(RespiratoryGates::Amplitude(n)) => (middle(gate, n), None),
        }
    }

    /// Returns the heart at each of [`Phantom::phases`], at end-diastole and at end-systole.
    ///
    /// # Errors
    /// Errors of the solver.
    pub fn phase_reports(&self) -> Result<Vec<PhaseReport>, PhantomError> {
        let mut phases = self.phases();
        for end in self.ends() {
            if !phases.contains(&end) {
                phases.push(end);
            }
        }
        let gains: Vec<f64> = phases
            .iter()
            .map(|p| self.cycle().gain(p.at.phase))
            .collect();
        // Solved together, in parallel.
        let shapes = self.heart().shapes(&gains)?;
        let report = |ScenePhase { of, at }: &ScenePhase, shape: &HeartShape| {
            let cavity_ml = shape.volumes()[0];
            // Volumes are proportional to 1 + gain.
            let mean_cavity_ml = match *of {
                PhaseOf::Gate { gate, .. } => {
                    let [gain, _] = self.heart_scan(gate)?.means()?;
                    Some(cavity_ml * (1.0 + gain) / (1.0 + shape.gain()))
                }
                PhaseOf::Static | PhaseOf::EndDiastole | PhaseOf::EndSystole => None,
            };
            Ok(PhaseReport {
                of: of.to_string(),
                phase: at.phase,
                breath: self.cycle().breathing().map(|_| at.breath),
                cavity_ml,
                mean_cavity_ml,
                gain: shape.gain(),
                thickness: self.thickness_of(shape),
                f_inner: shape.solution().inner.intensity,
                f_outer: shape.solution().outer.intensity,
                pressures_mmhg: shape.pressures_mmhg(),
            })
        };
        (phases.iter().zip(&shapes))
            .map(|(at, shape)| report(at, shape))
            .collect()
    }

    fn ends(&self) -> [ScenePhase; 2] {
        let [systole, diastole] = self.cycle().extreme_phases();
        [
            (PhaseOf::EndDiastole, diastole),
            (PhaseOf::EndSystole, systole),
        ]
        .map(|(of, phase)| ScenePhase {
            of,
            at: phase.into(),
        })
    }
}

//! The phases of the beat that stand for the views: what labels, maps and surfaces are made at.

use crate::error::PhantomError;
use crate::scan::Mode;
use crate::{HeartShape, Phantom, RespiratoryGates, Thickness};
use std::fmt;

/// A phase, and what it stands for.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct ScenePhase {
    /// What it stands for.
    pub of: PhaseOf,
    /// The phase.
    pub phase: f64,
    /// How far the breath has come: 0 at end-expiration, and without one; 1 at end-inspiration.
    pub breath: f64,
    /// The phase of the breath, 0 to 1 from end-expiration on, in the middle of a respiratory gate by phase; `None` where the breath is
    /// held, and for a gate by amplitude, which the breath passes on the way in and on the way out.
    pub breath_phase: Option<f64>,
}

impl ScenePhase {
    fn at_end_expiration(of: PhaseOf, phase: f64) -> Self {
        Self {
            of,
            phase,
            breath: 0.0,
            breath_phase: None,
        }
    }

    /// Its phase of the beat, and its breath.
    pub fn moment(&self) -> Moment {
        Moment {
            phase: self.phase,
            breath: self.breath,
        }
    }
}

/// A phase of the beat at a place of the breath. A phase alone is at end-expiration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    /// The phase of the beat.
    pub phase: f64,
    /// How far the breath has come, from 0 at end-expiration to 1 at end-inspiration.
    pub breath: f64,
}

impl From<f64> for Moment {
    fn from(phase: f64) -> Self {
        Self { phase, breath: 0.0 }
    }
}

/// What a phase stands for; its name ([`fmt::Display`]) ends the names of files: `labels-gate-03`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PhaseOf {
    /// All views: nothing moves.
    Static,
    /// The middle of a gate.
    Gate {
        /// Which one, from 0.
        gate: usize,
        /// Of how many.
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
            // As many digits as sort by name.
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
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize))]
#[non_exhaustive]
pub struct PhaseReport {
    /// What the phase stands for: `static`, `gate-03`, `end-diastole`, `end-systole`.
    pub of: String,
    /// The phase.
    pub phase: f64,
    /// How far the breath has come, of a heart that breathes: 0 at end-expiration, 1 at end-inspiration.
    #[cfg_attr(feature = "scene", serde(skip_serializing_if = "Option::is_none"))]
    pub breath: Option<f64>,
    /// Volume of the cavity in mL.
    pub cavity_ml: f64,
    /// Its gain, `(V - V_rest) / V_rest`.
    pub gain: f64,
    /// Thickness of the wall.
    pub thickness: Thickness,
    /// Force intensity of the inner membrane, what its pressure is in the law chosen: stiffness times cm, under
    /// `PressureLaw::PerCurrentLength` stiffness. Of rubber it is the pressure across it, in kPa.
    pub f_inner: f64,
    /// That of the outer membrane.
    pub f_outer: f64,
    /// [`HeartShape::pressures_mmhg`], if the membranes are of rubber.
    #[cfg_attr(feature = "scene", serde(skip_serializing_if = "Option::is_none"))]
    pub pressures_mmhg: Option<[f64; 2]>,
}

impl Phantom {
    /// The phases that stand for the views: the one of a static scene, the middle of each gate, and end-diastole and end-systole
    /// where every view sees many; of a heart that breathes at end-expiration, or in the middle of each respiratory gate.
    pub fn phases(&self) -> Vec<ScenePhase> {
        let gates = self.n_gates();
        let middle = |gate: usize, phase: f64| {
            let (breath, breath_phase) = self.middle_breath(gate);
            ScenePhase {
                of: PhaseOf::Gate { gate, gates },
                phase,
                breath,
                breath_phase,
            }
        };
        match self.scene().acquisition.mode {
            Mode::Static { phase } if gates == 1 => {
                vec![ScenePhase::at_end_expiration(PhaseOf::Static, phase)]
            }
            Mode::Static { phase } => (0..gates).map(|gate| middle(gate, phase)).collect(),
            Mode::Gated { gates: cardiac } => (0..gates)
                .map(|gate| {
                    let phase = ((gate % cardiac) as f64 + 0.5) / cardiac as f64;
                    middle(gate, phase)
                })
                .collect(),
            Mode::Instants | Mode::Exposure { .. } | Mode::WholeCycle if gates == 1 => {
                self.ends().to_vec()
            }
            // Each respiratory gate sees all of the beat: it is shown at end-diastole.
            Mode::Instants | Mode::Exposure { .. } | Mode::WholeCycle => {
                let [diastole, _] = self.ends();
                (0..gates)
                    .map(|gate| middle(gate, diastole.phase))
                    .collect()
            }
        }
    }

    /// The breath in the middle of the respiratory gate that a set of views is of, and its phase where there is one.
    fn middle_breath(&self, gate: usize) -> (f64, Option<f64>) {
        let cycle = self.cycle_of(gate);
        let middle = |gate: usize, n: usize| (gate as f64 + 0.5) / n as f64;
        let Some((gate, breathing)) = cycle.breath_gate().zip(cycle.breathing()) else {
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

    /// The heart at each of [`Phantom::phases`], and at end-diastole and end-systole.
    ///
    /// # Errors
    /// What solving the shapes can return.
    pub fn phase_reports(&self) -> Result<Vec<PhaseReport>, PhantomError> {
        let mut phases = self.phases();
        for end in self.ends() {
            if !phases.contains(&end) {
                phases.push(end);
            }
        }
        let gains: Vec<f64> = phases.iter().map(|p| self.cycle().gain(p.phase)).collect();
        // All at once, in parallel.
        let shapes = self.heart().shapes(&gains)?;
        let report = |at: &ScenePhase, shape: &HeartShape| PhaseReport {
            of: at.of.to_string(),
            phase: at.phase,
            breath: self.cycle().breathing().map(|_| at.breath),
            cavity_ml: shape.volumes()[0],
            gain: shape.gain(),
            thickness: self.thickness_of(shape),
            f_inner: shape.solution().inner.intensity,
            f_outer: shape.solution().outer.intensity,
            pressures_mmhg: shape.pressures_mmhg(),
        };
        Ok((phases.iter().zip(&shapes))
            .map(|(at, shape)| report(at, shape))
            .collect())
    }

    fn ends(&self) -> [ScenePhase; 2] {
        let [systole, diastole] = self.extreme_phases();
        [
            (PhaseOf::EndDiastole, diastole),
            (PhaseOf::EndSystole, systole),
        ]
        .map(|(of, phase)| ScenePhase::at_end_expiration(of, phase))
    }
}

//! Volumes and ejection fractions of a case, from the images of expected counts and of realisations of the noise.

use super::EjectionOptions;
use super::cases::{Acquired, COUNTS, Case, Timing, scene};
use heart_phantom::radon::{CountScale, poisson_counts};
use heart_phantom::scene::Mode;
use heart_phantom::{Numbers, Phantom, PhantomError};
use rayon::prelude::*;
use serde::Serialize;

/// Gates that are projected; fewer gates are averages of these.
const PROJECTED: usize = 16;

/// Volumes in mL and ejection fraction.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
#[non_exhaustive]
pub struct Volumes {
    /// Largest volume of all gates.
    pub edv: f64,
    /// Smallest volume of all gates.
    pub esv: f64,
    /// `(EDV - ESV) / EDV`.
    pub fraction: f64,
}

impl Volumes {
    pub(super) fn of(volumes: impl Iterator<Item = f64>) -> Self {
        let ends = |[least, most]: [f64; 2], v: f64| [least.min(v), most.max(v)];
        let [esv, edv] = volumes.fold([f64::INFINITY, 0.0], ends);
        let fraction = if edv > 0.0 { (edv - esv) / edv } else { 0.0 };
        Self { edv, esv, fraction }
    }

    fn map2(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        Self {
            edv: f(self.edv, other.edv),
            esv: f(self.esv, other.esv),
            fraction: f(self.fraction, other.fraction),
        }
    }
}

/// A result by one edge rule.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
#[non_exhaustive]
pub struct Measured {
    /// From expected counts.
    pub expected: Volumes,
    /// Mean of the realisations.
    pub mean: Volumes,
    /// Standard deviation of one study, from the realisations.
    pub deviation: Volumes,
    /// Volume of each gate from expected counts, mL.
    pub gates: Vec<f64>,
}

/// A case with its results.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct CaseResult {
    /// The case.
    #[serde(flatten)]
    pub case: Case,
    /// Exact values of the phantom.
    pub truth: Volumes,
    /// With the edge at half maximum.
    pub half_maximum: Measured,
    /// With the edge at the steepest gradient.
    pub steepest_gradient: Measured,
}

impl CaseResult {
    pub(super) fn rules(&self) -> [&Measured; 2] {
        [&self.half_maximum, &self.steepest_gradient]
    }
}

/// Projections that adjacent cases share.
pub(super) struct Shared {
    acquired: Acquired,
    at_rest: bool,
    /// Expected projections of each gate, or at end-diastole and end-systole.
    sets: Vec<Vec<f32>>,
}

/// Computes a case; `shared` contains the projections of the case before.
pub(super) fn measure(
    case: &Case,
    options: &EjectionOptions,
    shared: &mut Option<Shared>,
) -> Result<CaseResult, PhantomError> {
    let build = |mode| Phantom::new(scene(case, mode, options)?);
    // A phantom with its gate for each image; the first and the second of a heart at rest are different phantoms.
    let phantoms = match case.timing {
        Timing::Gates(gates) => vec![build(Mode::Gated { gates })?],
        Timing::Static => {
            let probe = build(Mode::WholeCycle)?;
            let [systole, diastole] = probe.extreme_phases();
            vec![
                build(Mode::Static { phase: diastole })?,
                build(Mode::Static { phase: systole })?,
            ]
        }
    };
    let at_rest = case.timing == Timing::Static;
    let known =
        (shared.as_ref()).is_some_and(|s| s.acquired == case.acquired && s.at_rest == at_rest);
    if !known {
        let sets = match case.timing {
            Timing::Gates(_) => {
                let all = build(Mode::Gated { gates: PROJECTED })?.sinograms_of_gates()?;
                all.chunks(all.len() / PROJECTED)
                    .map(<[f32]>::to_vec)
                    .collect()
            }
            Timing::Static => (phantoms.iter())
                .map(|phantom| Ok(phantom.sinograms(0, &|_| ())?.samples))
                .collect::<Result<_, PhantomError>>()?,
        };
        *shared = Some(Shared {
            acquired: case.acquired.clone(),
            at_rest,
            sets,
        });
    }
    let sets = shared.as_ref().map_or(&[][..], |shared| &shared.sets);
    let (joined, fraction) = match case.timing {
        Timing::Gates(gates) => (averages(sets, gates), 1.0),
        // The counts of two of eight gates.
        Timing::Static => (sets.to_vec(), 0.25),
    };
    let volumes = |views: &[Vec<f32>]| -> Result<Vec<[f64; 2]>, PhantomError> {
        (views.par_iter().enumerate())
            .map(|(set, views)| {
                let (phantom, gate) = match at_rest {
                    true => (&phantoms[set], 0),
                    false => (&phantoms[0], set),
                };
                let map = phantom.polar_map(gate, &phantom.reconstruct(gate, views)?)?;
                Ok([map.cavity_ml, map.cavity_gradient_ml])
            })
            .collect()
    };
    let expected = volumes(&joined)?;
    let all = joined.concat();
    let per_unit = CountScale::Total(fraction * COUNTS).per_unit(&all)?;
    let drawn = (0..case.realisations)
        .map(|seed| {
            let mut counts = poisson_counts(&all, CountScale::PerUnit(per_unit), seed as u64)?;
            counts
                .iter_mut()
                .for_each(|count| *count /= per_unit as f32);
            let sets: Vec<Vec<f32>> = (counts.chunks(all.len() / joined.len()))
                .map(<[f32]>::to_vec)
                .collect();
            volumes(&sets)
        })
        .collect::<Result<Vec<_>, PhantomError>>()?;
    let by_rule = |rule: usize| {
        let gates: Vec<f64> = expected.iter().map(|volumes| volumes[rule]).collect();
        let of = |volumes: &Vec<[f64; 2]>| Volumes::of(volumes.iter().map(|v| v[rule]));
        let drawn: Vec<Volumes> = drawn.iter().map(of).collect();
        let (mean, deviation) = statistics(&drawn);
        Measured {
            expected: of(&expected),
            mean,
            deviation,
            gates,
        }
    };
    let Numbers { edv, esv, .. } = phantoms[0].numbers()?;
    Ok(CaseResult {
        case: case.clone(),
        truth: Volumes::of([edv, esv].into_iter()),
        half_maximum: by_rule(0),
        steepest_gradient: by_rule(1),
    })
}

/// The projections of fewer gates, as averages of adjacent ones.
fn averages(sets: &[Vec<f32>], gates: usize) -> Vec<Vec<f32>> {
    let each = sets.len() / gates;
    let average = |group: &[Vec<f32>]| -> Vec<f32> {
        let sum = |k: usize| group.iter().map(|set| set[k]).sum::<f32>() / each as f32;
        (0..group[0].len()).map(sum).collect()
    };
    sets.chunks(each).map(average).collect()
}

/// Mean and standard deviation.
fn statistics(drawn: &[Volumes]) -> (Volumes, Volumes) {
    let n = drawn.len() as f64;
    let sum = |each: Vec<Volumes>| {
        (each.into_iter()).fold(Volumes::default(), |sum, v| sum.map2(v, |a, b| a + b))
    };
    let mean = sum(drawn.to_vec()).map2(Volumes::default(), |a, _| a / n);
    let squares = drawn.iter().map(|v| v.map2(mean, |a, b| (a - b).powi(2)));
    let freedom = (n - 1.0).max(1.0);
    (
        mean,
        sum(squares.collect()).map2(Volumes::default(), |a, _| (a / freedom).sqrt()),
    )
}

//! Volumes and ejection fractions of a case, from the images of expected counts and of realisations of the noise.

use super::cases::Case;
use heart_phantom::Mode;
use heart_phantom::radon::{CountScale, poisson_counts};
use heart_phantom::{Phantom, PhantomError, Scene, no_observer};
use rayon::prelude::*;
use serde::Serialize;

/// Counts in all projections of all gates, in the axial field of view of 20 cm.
pub(super) const COUNTS: f64 = 4e6;
/// Gates that are projected; fewer gates are averages of these.
const PROJECTED: usize = 16;

/// Volumes in mL and ejection fraction, or their errors: EDV and ESV, the largest and smallest volume of all gates, and `(EDV - ESV) / EDV`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub(crate) struct Volumes {
    /// End-diastolic volume.
    pub(crate) edv: f64,
    /// End-systolic volume.
    pub(crate) esv: f64,
    /// Ejection fraction.
    pub(crate) fraction: f64,
}

impl Volumes {
    fn of(volumes: impl Iterator<Item = f64>) -> Self {
        let ends = |[least, most]: [f64; 2], v: f64| [least.min(v), most.max(v)];
        let [esv, edv] = volumes.fold([f64::INFINITY, 0.0], ends);
        let fraction = if edv > 0.0 { (edv - esv) / edv } else { 0.0 };
        Self { edv, esv, fraction }
    }

    pub(super) fn values(&self) -> [f64; 3] {
        [self.edv, self.esv, self.fraction]
    }

    /// Returns means and standard deviations.
    fn statistics(all: &[Self]) -> [Self; 2] {
        let n = all.len() as f64;
        let both = [0, 1, 2].map(|part| {
            let values = || all.iter().map(|volumes| volumes.values()[part]);
            let mean = values().sum::<f64>() / n;
            let squares: f64 = values().map(|value| (value - mean).powi(2)).sum();
            [mean, (squares / (n - 1.0).max(1.0)).sqrt()]
        });
        [0, 1].map(|k| {
            let [edv, esv, fraction] = both.map(|pair| pair[k]);
            Self { edv, esv, fraction }
        })
    }
}

/// A result by one edge rule.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Measured {
    /// From expected counts.
    pub(crate) expected: Volumes,
    /// Mean of the realisations.
    pub(crate) mean: Volumes,
    /// Standard deviation of one study, from the realisations.
    pub(crate) deviation: Volumes,
    /// Volume of each gate from expected counts, mL.
    pub(crate) gates: Vec<f64>,
}

/// A case with its results.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct CaseResult {
    /// The case.
    #[serde(flatten)]
    pub(crate) case: Case,
    /// Exact values of the phantom.
    pub(crate) truth: Volumes,
    /// With the edges at half maximum and at the steepest gradient ([`PolarMap`](heart_phantom::PolarMap)).
    pub(crate) rules: [Measured; 2],
}

/// Projections that adjacent cases share: each gated projection set of the scene with the base reconstruction.
pub(super) type Shared = Option<(Scene, Vec<Vec<f32>>)>;

/// Computes a case; `shared` contains the projections of the case before.
pub(super) fn measure(case: &Case, shared: &mut Shared) -> Result<CaseResult, PhantomError> {
    let build = |mode| Phantom::new(case.scene.clone().with_mode(mode));
    let mode = case.scene.acquisition.mode;
    // One phantom with all gates, or one at end-diastole and one at end-systole.
    let (phantoms, projected) = match mode {
        Mode::Static { .. } => {
            let [systole, diastole] = build(mode)?.cycle().extreme_phases();
            let at_rest = |phase| build(Mode::Static { phase });
            (vec![at_rest(diastole)?, at_rest(systole)?], mode)
        }
        _ => (vec![build(mode)?], Mode::Gated { gates: PROJECTED }),
    };
    let mut key = case.scene.clone().with_mode(projected);
    key.reconstruction = Default::default();
    if shared.as_ref().is_none_or(|(known, _)| *known != key) {
        let sets = match mode {
            Mode::Static { .. } => (phantoms.iter())
                .map(|phantom| Ok(phantom.sinograms(0, &no_observer)?.samples))
                .collect::<Result<_, PhantomError>>()?,
            _ => {
                let all = build(projected)?.sinograms_of_gates()?;
                (all.chunks(all.len() / PROJECTED))
                    .map(<[f32]>::to_vec)
                    .collect()
            }
        };
        *shared = Some((key, sets));
    }
    let sets = shared.as_ref().map_or(&[][..], |(_, sets)| sets);
    let (gates, fraction) = match mode {
        Mode::Gated { gates } => (gates, 1.0),
        // The counts of two of eight gates.
        _ => (sets.len(), 0.25),
    };
    let all = averages(sets, gates);
    let volumes = |views: &[f32]| -> Result<Vec<[f64; 2]>, PhantomError> {
        (views.par_chunks(views.len() / gates).enumerate())
            .map(|(set, views)| {
                let (phantom, gate) = match phantoms.get(set) {
                    Some(phantom) if phantoms.len() > 1 => (phantom, 0),
                    _ => (&phantoms[0], set),
                };
                let map = phantom.polar_map(gate, &phantom.reconstruct(gate, views)?)?;
                Ok([map.cavity_ml, map.cavity_gradient_ml].map(Option::unwrap_or_default))
            })
            .collect()
    };
    let expected = volumes(&all)?;
    let per_unit = CountScale::Total(fraction * COUNTS).per_unit(&all)?;
    let drawn = (0..case.realisations as u64)
        .map(|seed| {
            let mut counts = poisson_counts(&all, CountScale::PerUnit(per_unit), seed)?;
            (counts.iter_mut()).for_each(|count| *count /= per_unit as f32);
            volumes(&counts)
        })
        .collect::<Result<Vec<_>, PhantomError>>()?;
    let by_rule = |rule: usize| {
        let of = |volumes: &Vec<[f64; 2]>| Volumes::of(volumes.iter().map(|v| v[rule]));
        let [mean, deviation] = Volumes::statistics(&drawn.iter().map(of).collect::<Vec<_>>());
        Measured {
            expected: of(&expected),
            mean,
            deviation,
            gates: expected.iter().map(|volumes| volumes[rule]).collect(),
        }
    };
    let numbers = phantoms[0].numbers()?;
    Ok(CaseResult {
        case: case.clone(),
        truth: Volumes::of([numbers.edv, numbers.esv].into_iter()),
        rules: [0, 1].map(by_rule),
    })
}

/// The projections of fewer gates, one after the other, as averages of adjacent ones.
fn averages(sets: &[Vec<f32>], gates: usize) -> Vec<f32> {
    let each = sets.len() / gates;
    let average = |group: &[Vec<f32>]| -> Vec<f32> {
        let sum = |k: usize| group.iter().map(|set| set[k]).sum::<f32>() / each as f32;
        (0..group[0].len()).map(sum).collect()
    };
    sets.chunks(each).flat_map(average).collect()
}

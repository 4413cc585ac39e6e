//! The balloons of the paper as rubber and as springs: shapes, pressures, wall, and projections.

use super::run::Run;
use crate::report;
use heart_phantom::membrane_newton::membrane_forces::StrainEnergy;
use heart_phantom::membrane_newton::{Control, Discretisation, NewtonOptions, Solver};
use heart_phantom::scene::MaterialSettings;
use heart_phantom::{Balloon, HeartShape, MMHG_PER_KPA, Mode, Phantom, PhantomError};
use std::sync::Arc;

/// Shear modulus in kPa and thickness in mm of all rubbers.
pub(super) const RUBBER: (f64, f64) = (400.0, 0.5);
/// Volume gains of the pressure curves.
const GAINS: (usize, f64) = (24, 3.0);
/// Membranes of the pressure curves.
const SPECTRAL: Discretisation = Discretisation::Spectral {
    degree: 16,
    per_piece: 1,
};

pub(super) struct RubberStudy {
    pub(super) figures: report::Rubber,
    /// Dilated: springs, rubber.
    pub(super) dilated: [Arc<HeartShape>; 2],
    /// Angle of one view of each, and its middle row: s in cm, wall on the ray in cm.
    pub(super) angle: f64,
    pub(super) profiles: [Vec<[f64; 2]>; 2],
    /// Pressure in mmHg over the volume gain, of the inner balloon.
    pub(super) pressures: Vec<Curve>,
}

/// Solves the heart of the study at its largest volume with springs and with neo-Hookean rubber, and projects both at one angle.
pub(super) fn rubber(run: &Run<'_>) -> Result<RubberStudy, PhantomError> {
    let (mu, thickness) = RUBBER;
    let phantom = |material: MaterialSettings| {
        let mut scene = run.options.scene();
        scene.heart.material = material;
        let [_, diastole] = run.phantom.cycle().extreme_phases();
        Phantom::new(scene.with_mode(Mode::Static { phase: diastole }))
    };
    let energy = StrainEnergy::NeoHookean { mu };
    let both = [
        phantom(MaterialSettings::Springs)?,
        phantom(MaterialSettings::Rubber { energy, thickness })?,
    ];
    let [springs, of_rubber] = &both;
    let (n, view) = (
        run.phantom.camera().n_bins(),
        run.phantom.camera().n_views() / 3,
    );
    let views = [springs.view(0, view)?, of_rubber.view(0, view)?];
    let [_, diastole] = springs.cycle().extreme_phases();
    let dilated = [springs.shape(diastole)?, of_rubber.shape(diastole)?];
    let side = |phantom: &Phantom| phantom.thickness(diastole);
    let [of_springs, of_rubber] = [side(springs)?, side(of_rubber)?];
    let [inner_mmhg, outer_mmhg] = dilated[1].pressures_mmhg().unwrap_or_default();
    Ok(RubberStudy {
        figures: report::Rubber {
            inner_mmhg,
            outer_mmhg,
            wall_volume_error: dilated[1].solution().wall_volume_error,
            side: [of_springs.side, of_rubber.side],
            apex: [of_springs.apex, of_rubber.apex],
            view_difference: difference(&views),
        },
        dilated,
        angle: run.phantom.camera().geometry().angles()[view],
        profiles: views.map(|samples| {
            let geometry = run.phantom.camera().geometry();
            let row = samples.chunks_exact(n).nth(n / 2).unwrap_or_default();
            let bins = row.iter().enumerate();
            bins.map(|(k, value)| [geometry.bin_centre(k), f64::from(*value)])
                .collect()
        }),
        pressures: pressures(run.options.gain.max(0.01))?,
    })
}

/// Root mean square difference of two views relative to the first.
fn difference([first, second]: &[Vec<f32>; 2]) -> f64 {
    let square = |a: f32| f64::from(a) * f64::from(a);
    let off: f64 = first.iter().zip(second).map(|(a, b)| square(a - b)).sum();
    (off / first.iter().map(|a| square(*a)).sum::<f64>()).sqrt()
}

/// A labelled line of a diagram.
type Curve = (&'static str, Vec<[f64; 2]>);

/// Pressure over volume of the inner balloon for three rubbers, and for springs scaled to the neo-Hookean pressure at `gain`.
fn pressures(gain: f64) -> Result<Vec<Curve>, PhantomError> {
    let (mu, thickness) = RUBBER;
    let rubbers = [
        ("neo-Hookean", StrainEnergy::NeoHookean { mu }),
        (
            "Mooney-Rivlin, c2 = c1 / 4",
            StrainEnergy::MooneyRivlin {
                c1: 0.4 * mu,
                c2: 0.1 * mu,
            },
        ),
        ("Gent, jm = 10", StrainEnergy::Gent { mu, jm: 10.0 }),
    ];
    let options = NewtonOptions::default();
    let at = |solver: &Solver, gain: f64| -> Result<f64, PhantomError> {
        Ok(MMHG_PER_KPA
            * solver
                .solve(Control::VolumeGain(gain), &options)?
                .pressure())
    };
    let curve = |solver: &Solver, scale: f64| {
        let (n, most) = GAINS;
        (0..=n)
            .map(|k| most * k as f64 / n as f64)
            .map(|gain| Ok([gain, scale * at(solver, gain)?]))
            .collect::<Result<Vec<_>, PhantomError>>()
    };
    let mut curves = Vec::new();
    let mut scale = 1.0;
    let springs = Solver::new(&Balloon::INNER.membrane()?, SPECTRAL)?;
    for (label, energy) in rubbers {
        let membrane = Balloon::INNER.of_rubber(energy, 0.1 * thickness)?;
        let solver = Solver::new(&membrane, SPECTRAL)?;
        if curves.is_empty() {
            scale = at(&solver, gain)? / at(&springs, gain)?;
        }
        curves.push((label, curve(&solver, 1.0)?));
    }
    curves.push(("springs of the paper", curve(&springs, scale)?));
    Ok(curves)
}

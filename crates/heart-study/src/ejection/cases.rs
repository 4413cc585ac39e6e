//! The cases of the study: a base case of each heart, and one change at a time.

use heart_phantom::Mode;
use heart_phantom::radon::{HoleResponse, ParallelHoles, Window};
use heart_phantom::scene::{CollimatorSettings, HolesSettings};
use heart_phantom::{Accuracy, Balloon, Method, Osem, PhantomError, Scene, VolumeRange};
use serde::Serialize;
use std::f64::consts::PI;

/// End-diastolic volumes in mL. A medium heart with an ejection fraction of 0.55 has a stroke volume of 70 mL.
const SIZES: [(&str, f64); 3] = [("small", 60.0), ("medium", 127.0), ("large", 200.0)];
const FRACTIONS: [f64; 4] = [0.45, 0.55, 0.65, 0.70];

pub(super) const BASE: &str = "base: LEHR, 8 gates, FBP";
pub(super) const SIXTEEN: &str = "16 gates";
pub(super) const NO_GATES: &str = "no motion: static heart";
pub(super) const NO_RESPONSE: &str = "no collimator";
pub(super) const NO_WINDOW: &str = "no filter window";
pub(super) const NO_ATTENUATION: &str = "no attenuation";
pub(super) const NOTHING: &str = "no filter window, motion, collimator or attenuation";
const IDEAL: &str = "no filter window, motion, collimator or attenuation; bins of 2 mm";
/// The cases of a quick run.
const QUICK: [&str; 5] = [BASE, SIXTEEN, "OSEM, both", NOTHING, IDEAL];

/// A case: a heart, projections and reconstruction.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Case {
    /// The difference from the base case.
    pub(crate) name: &'static str,
    /// `small`, `medium` or `large`.
    pub(crate) size: &'static str,
    /// Ejection fraction in the scene.
    pub(crate) fraction: f64,
    /// Realisations of the noise.
    pub(crate) realisations: usize,
    /// The scene; a static one represents the heart at end-diastole and at end-systole.
    pub(crate) scene: Scene,
}

impl Case {
    /// Whether the case has the heart for which the edge rules were calibrated.
    pub(super) fn is_of_reference(&self) -> bool {
        (self.size, self.fraction) == ("medium", FRACTIONS[1])
    }
}

/// The hearts of a case: all, the medium ones, or the one with the ejection fraction 0.55 of these.
enum Hearts {
    All,
    Medium,
    Reference,
}

/// Name and hearts of a case, and its change of the base scene.
type Change = (&'static str, Hearts, fn(&mut Scene));

/// Cases with equal projections are adjacent.
const CASES: [Change; 13] = [
    (BASE, Hearts::All, |_| ()),
    (SIXTEEN, Hearts::All, |scene| {
        scene.acquisition.mode = Mode::Gated { gates: 16 };
    }),
    (NO_WINDOW, Hearts::Reference, unfilter),
    ("OSEM", Hearts::Reference, |scene| {
        osem(scene, [false, false])
    }),
    ("OSEM, attenuation", Hearts::Reference, |scene| {
        osem(scene, [true, false])
    }),
    ("OSEM, resolution", Hearts::Reference, |scene| {
        osem(scene, [false, true])
    }),
    ("OSEM, both", Hearts::Reference, |scene| {
        osem(scene, [true, true])
    }),
    (NO_GATES, Hearts::Medium, rest),
    (NO_RESPONSE, Hearts::Medium, |scene| scene.collimator = None),
    (NO_ATTENUATION, Hearts::Medium, stop_attenuating),
    (NOTHING, Hearts::Medium, switch_off),
    ("camera of higher resolution", Hearts::Reference, sharpen),
    (IDEAL, Hearts::Reference, |scene| {
        switch_off(scene);
        let camera = &mut scene.camera;
        (camera.bins, camera.rows, camera.pitch) = (205, 102, [0.2; 2]);
    }),
];

/// All cases, or some of one heart.
pub(super) fn all(quick: bool) -> Result<Vec<Case>, PhantomError> {
    let mut cases = Vec::new();
    for (size, edv) in SIZES {
        for fraction in FRACTIONS {
            let scene = scene(edv, fraction, quick)?;
            for (name, hearts, change) in &CASES {
                let mut case = Case {
                    name,
                    size,
                    fraction,
                    realisations: if quick { 2 } else { 16 },
                    scene: scene.clone(),
                };
                change(&mut case.scene);
                if case.scene.reconstruction.method != Method::Fbp {
                    case.realisations = (case.realisations / 4).max(2);
                }
                let has_heart = match hearts {
                    Hearts::All => true,
                    Hearts::Medium => size == "medium",
                    Hearts::Reference => case.is_of_reference(),
                };
                let is_quick = case.is_of_reference() && QUICK.contains(name);
                if has_heart && (is_quick || !quick) {
                    cases.push(case);
                }
            }
        }
    }
    Ok(cases)
}

/// OSEM of 8 subsets and 4 iterations, with models of attenuation and resolution.
fn osem(scene: &mut Scene, [attenuation, resolution]: [bool; 2]) {
    scene.reconstruction.method = Method::Osem(Osem {
        attenuation,
        resolution,
        ..Osem::new(8, 4)
    });
}

fn rest(scene: &mut Scene) {
    scene.acquisition.mode = Mode::Static { phase: 0.0 };
}

fn unfilter(scene: &mut Scene) {
    (scene.reconstruction.window, scene.reconstruction.cutoff) = (Window::RamLak, 1.0);
}

fn stop_attenuating(scene: &mut Scene) {
    (scene.attenuation.iter_mut()).for_each(|attenuation| attenuation.coefficient = 0.0);
    (scene.organs.iter_mut()).for_each(|organ| organ.attenuation = 0.0);
}

fn switch_off(scene: &mut Scene) {
    scene.collimator = None;
    rest(scene);
    unfilter(scene);
    stop_attenuating(scene);
}

/// Hexagonal holes of 1 mm, 35 mm long, intrinsic FWHM 2.5 mm, bins of 4 mm.
fn sharpen(scene: &mut Scene) {
    let camera = &mut scene.camera;
    (camera.bins, camera.rows, camera.pitch) = (104, 52, [0.4; 2]);
    scene.collimator = Some(CollimatorSettings {
        holes: HolesSettings::Parallel(ParallelHoles {
            diameter: 0.1,
            length: 3.5,
            attenuation: ParallelHoles::LEAD_140_KEV,
            response: HoleResponse::Hexagonal,
        }),
        intrinsic_fwhm: 0.25,
    });
}

/// The base scene of a heart. The reference volume of the inner membrane is 0.29 EDV; one heart thus covers all ejection fractions to 0.70.
fn scene(edv: f64, fraction: f64, quick: bool) -> Result<Scene, PhantomError> {
    let mut scene = Scene::from_toml(include_str!("scene.toml"))?;
    let (inner, outer) = ([5.5, 1.6], [5.2, 2.9]);
    let volume = PI * inner[1] * inner[1] * (inner[0] + 2.0 / 3.0 * inner[1]);
    let scale = (0.29 * edv / volume).cbrt();
    let balloon = |[length, radius]: [f64; 2]| Balloon {
        length: scale * length,
        radius: scale * radius,
        stiffness: 1.0,
    };
    (scene.heart.inner, scene.heart.outer) = (balloon(inner), balloon(outer));
    scene.cycle.volume = VolumeRange::Volumes {
        edv,
        esv: edv * (1.0 - fraction),
    };
    if quick {
        scene.camera.views = 4;
        scene.acquisition.accuracy = Accuracy::Tolerance(0.2);
    }
    Ok(scene)
}

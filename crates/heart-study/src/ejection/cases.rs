//! The cases of the study: a base case, changes of one thing at a time, and the grid of hearts.

use super::EjectionOptions;
use heart_phantom::scene::{CollimatorSettings, HolesSettings, Mode};
use heart_phantom::{Accuracy, Balloon, Method, Osem, PhantomError, Scene, VolumeRange};
use serde::Serialize;

/// End-diastolic volumes in mL. A medium heart with an ejection fraction of 0.55 has a stroke volume of 70 mL.
const SIZES: [(&str, f64); 3] = [("small", 60.0), ("medium", 127.0), ("large", 200.0)];
const FRACTIONS: [f64; 4] = [0.45, 0.55, 0.65, 0.70];
/// Counts in all projections, of the axial field of view of 20 cm.
pub(super) const COUNTS: f64 = 4e6;

/// A camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum CameraKind {
    /// GE LEHR, bins of 6.4 mm.
    Lehr,
    /// Hexagonal holes of 1 mm, 35 mm long, a crystal of 2.5 mm, bins of 4 mm.
    Sharp,
}

/// The timing of the projections.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Timing {
    /// This many gates.
    Gates(usize),
    /// A heart at rest at end-diastole and at end-systole.
    Static,
}

/// What the projections of a case depend on.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Acquired {
    /// `small`, `medium` or `large`.
    pub size: &'static str,
    /// End-diastolic volume in the scene, mL.
    pub edv_ml: f64,
    /// Ejection fraction in the scene.
    pub fraction: f64,
    /// The camera.
    pub camera: CameraKind,
    /// Whether the collimator and the crystal blur.
    pub response: bool,
    /// Whether tissue attenuates.
    pub attenuation: bool,
}

/// A reconstruction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Reconstruction {
    /// Filtered back-projection.
    Fbp,
    /// OSEM of 8 subsets and 4 iterations, with models of attenuation and response.
    Osem {
        /// Models attenuation.
        attenuation: bool,
        /// Models collimator and crystal.
        response: bool,
    },
}

/// A case: its projections, timing and reconstruction.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Case {
    /// What it differs in from the base case.
    pub name: &'static str,
    /// The projections.
    #[serde(flatten)]
    pub acquired: Acquired,
    /// The timing.
    pub timing: Timing,
    /// The reconstruction.
    pub reconstruction: Reconstruction,
    /// Realisations of the noise.
    pub realisations: usize,
}

impl Case {
    fn of((size, edv_ml): (&'static str, f64), fraction: f64, realisations: usize) -> Self {
        Self {
            name: BASE,
            acquired: Acquired {
                size,
                edv_ml,
                fraction,
                camera: CameraKind::Lehr,
                response: true,
                attenuation: true,
            },
            timing: Timing::Gates(8),
            reconstruction: Reconstruction::Fbp,
            realisations,
        }
    }

    fn with(&self, name: &'static str, change: impl FnOnce(&mut Self)) -> Self {
        let mut case = Self {
            name,
            ..self.clone()
        };
        change(&mut case);
        case
    }

    /// Whether another case has the same heart.
    pub(super) fn has_heart_of(&self, other: &Self) -> bool {
        (self.acquired.size, self.acquired.fraction)
            == (other.acquired.size, other.acquired.fraction)
    }
}

pub(super) const BASE: &str = "base: LEHR, 8 gates, FBP";
pub(super) const SIXTEEN: &str = "16 gates";
pub(super) const NO_GATES: &str = "no gates: heart at rest";
pub(super) const NO_RESPONSE: &str = "no collimator";
pub(super) const NO_ATTENUATION: &str = "no attenuation";
pub(super) const NOTHING: &str = "none of the three";
/// The cases of [`all`] for each ejection fraction of the medium heart.
pub(super) const OFF: [&str; 5] = [BASE, NO_GATES, NO_RESPONSE, NO_ATTENUATION, NOTHING];

/// All cases; those of the grid first, cases with equal projections adjacent.
pub(super) fn all(options: &EjectionOptions) -> Vec<Case> {
    let (sizes, fractions, realisations) = match options.quick {
        true => (&SIZES[1..2], &FRACTIONS[1..2], [2, 1]),
        false => (&SIZES[..], &FRACTIONS[..], [16, 4]),
    };
    let mut cases = Vec::new();
    for size in sizes {
        for &fraction in fractions {
            let base = Case::of(*size, fraction, realisations[0]);
            let mut add = |name, change: fn(&mut Case)| cases.push(base.with(name, change));
            add(BASE, |_| ());
            add(SIXTEEN, |case| case.timing = Timing::Gates(16));
            if *size != SIZES[1] {
                continue;
            }
            if fraction == FRACTIONS[1] {
                for (name, attenuation, response) in [
                    ("OSEM", false, false),
                    ("OSEM, attenuation", true, false),
                    ("OSEM, resolution", false, true),
                    ("OSEM, both", true, true),
                ] {
                    cases.push(base.with(name, |case| {
                        case.reconstruction = Reconstruction::Osem {
                            attenuation,
                            response,
                        };
                        case.realisations = realisations[1];
                    }));
                }
            }
            let mut add = |name, change: fn(&mut Case)| cases.push(base.with(name, change));
            add(NO_GATES, |case| case.timing = Timing::Static);
            add(NO_RESPONSE, |case| case.acquired.response = false);
            add(NO_ATTENUATION, |case| case.acquired.attenuation = false);
            add(NOTHING, |case| {
                case.timing = Timing::Static;
                (case.acquired.response, case.acquired.attenuation) = (false, false);
            });
            if fraction == FRACTIONS[1] {
                add("sharper camera", |case| {
                    case.acquired.camera = CameraKind::Sharp;
                });
                add("sharper camera, none of the three", |case| {
                    (case.timing, case.acquired.camera) = (Timing::Static, CameraKind::Sharp);
                    (case.acquired.response, case.acquired.attenuation) = (false, false);
                });
            }
        }
    }
    cases
}

/// The scenes of a timing: one with all gates, or two of a heart at rest (end-diastole, end-systole).
pub(super) fn scene(
    case: &Case,
    mode: Mode,
    options: &EjectionOptions,
) -> Result<Scene, PhantomError> {
    let mut scene = Scene::from_toml(include_str!("scene.toml"))?.with_mode(mode);
    let acquired = &case.acquired;
    // The reference volume of the inner balloon is 0.29 of the end-diastolic volume, so that all ejection fractions up to 0.70 are of one heart
    // with one wall volume.
    let (inner, outer) = ([5.5, 1.6], [5.2, 2.9]);
    let [length, radius] = inner;
    let volume = std::f64::consts::PI * radius * radius * (length + 2.0 / 3.0 * radius);
    let scale = (0.29 * acquired.edv_ml / volume).cbrt();
    let balloon = |[length, radius]: [f64; 2]| Balloon {
        length: scale * length,
        radius: scale * radius,
        stiffness: 1.0,
    };
    (scene.heart.inner, scene.heart.outer) = (balloon(inner), balloon(outer));
    scene.cycle.volume = VolumeRange::Volumes {
        edv: acquired.edv_ml,
        esv: acquired.edv_ml * (1.0 - acquired.fraction),
    };
    if acquired.camera == CameraKind::Sharp {
        let camera = &mut scene.camera;
        (camera.bins, camera.rows, camera.pitch) = (104, 52, [0.4; 2]);
        let holes = HolesSettings::Parallel {
            diameter: 0.1,
            length: 3.5,
            attenuation: 26.9,
            response: heart_phantom::radon::HoleResponse::Hexagonal,
        };
        scene.collimator = Some(CollimatorSettings {
            holes,
            intrinsic_fwhm: 0.25,
        });
    }
    if !acquired.response {
        scene.collimator = None;
    }
    if !acquired.attenuation {
        scene
            .attenuation
            .iter_mut()
            .for_each(|a| a.coefficient = 0.0);
        scene
            .organs
            .iter_mut()
            .for_each(|organ| organ.attenuation = 0.0);
    }
    let mut osem = Osem::new(8, 4);
    if options.quick {
        scene.camera.views = 8;
        scene.acquisition.accuracy = Accuracy::Tolerance(0.1);
        osem = Osem::new(4, 1);
    }
    if let Reconstruction::Osem {
        attenuation,
        response,
    } = case.reconstruction
    {
        (osem.attenuation, osem.resolution) = (attenuation, response);
        scene.reconstruction.method = Method::Osem(osem);
    }
    Ok(scene)
}

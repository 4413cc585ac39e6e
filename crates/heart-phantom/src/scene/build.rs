//! From a scene's settings to the parts of a phantom: degrees become radians, settings the domain's own types.

use crate::error::PhantomError;
use crate::model::{Attenuation, Background};
use crate::phantom::{PhantomParts, WORK_BYTES};
use crate::scan::{CameraGeometry, Collimation};
use crate::scene::{
    AttenuationSettings, BackgroundSettings, CollimatorSettings, DefectSettings,
    DiscretisationSettings, HeadsSettings, HolesSettings, MaterialSettings, MediumSettings,
    OrganSettings, OrganShapeSettings, ReconstructionSettings, Scene,
};
use crate::{Balloon, Camera, Cycle, Defect, Heads, Heart, VolumeRange, WallRegion};
use membrane_newton::membrane_forces::balloon_at_rest;
use membrane_newton::{Discretisation, Membrane};
use radon::{Collimator, FbpOptions, ParallelHoles};
use revolve_voxel::nalgebra::Vector3;
use revolve_voxel::{Ellipsoid, EllipticCylinder, Organ, OrganShape, Organs, Pose};
use std::f64::consts::{LN_2, PI};

impl Scene {
    /// What a phantom of the scene is made of; whoever changes some of it makes the phantom by
    /// [`Phantom::from_parts`](crate::Phantom::from_parts).
    ///
    /// ```
    /// use heart_phantom::{Heart, Phantom, Scene};
    /// let mut parts = Scene::default().with_size(32).parts()?;
    /// parts.heart = Heart::study(101)?;
    /// assert_eq!(Phantom::from_parts(parts)?.view(0, 0)?.len(), 32 * 32);
    /// # Ok::<(), heart_phantom::PhantomError>(())
    /// ```
    ///
    /// # Errors
    /// [`PhantomError::Scene`]; [`PhantomError::Membrane`] if the discretised balloons make no pair.
    pub fn parts(&self) -> Result<PhantomParts, PhantomError> {
        let rest = self.checked()?;
        let inner = &self.heart.inner;
        let cycle = cycle_of(self, rest.volume)?;
        Ok(PhantomParts {
            heart: (rest.heart.map_or_else(|| heart_of(self), Ok)?)
                .with_base_descent(self.cycle.base_descent, cycle.gains())?,
            cycle,
            camera: Camera::with_geometry(&geometry_of(self))?,
            activity: self.activity,
            background: self.background.as_ref().map(background_of).transpose()?,
            organs: organs_of(self)?,
            defects: self.defects.iter().map(defect_of).collect(),
            twist: (self.twist.as_ref())
                .map(|twist| twist.twist())
                .transpose()?,
            points: self.points.iter().map(|point| point.point()).collect(),
            attenuation: self.attenuates().as_ref().map(attenuation_of).transpose()?,
            blur: self.blur.map(|blur| blur.fwhm),
            collimator: self.collimator.as_ref().map(collimation_of).transpose()?,
            noise: self.noise,
            counting: self.counting,
            mode: self.acquisition.mode,
            accuracy: self.acquisition.accuracy,
            method: self.reconstruction.method,
            compensation: self.reconstruction.compensation,
            reconstruction: fbp_of(&self.reconstruction),
            truth_tolerance: self.truth.tolerance,
            // the middle of the inner cylinder
            side: 0.5 * (inner.length / (2.0 * inner.length + PI * inner.radius)),
            orbit: self.camera.radius.clone(),
            bin_sample: self.camera.samples,
            output: self.output.clone(),
        })
    }
}

/// Thicknesses of rubber are in mm.
const MM_PER_CM: f64 = 10.0;

fn heart_of(scene: &Scene) -> Result<Heart, PhantomError> {
    let (settings, pose) = (&scene.heart, &scene.pose);
    let membrane = |balloon: Balloon| -> Result<Membrane, PhantomError> {
        match &settings.material {
            MaterialSettings::Springs => Ok(balloon.membrane()?.with_law(settings.law)),
            MaterialSettings::Rubber { energy, thickness } => {
                balloon.of_rubber(energy.clone(), thickness / MM_PER_CM)
            }
        }
    };
    let (discretisation, tolerance) = match settings.discretisation {
        DiscretisationSettings::Differences { nodes } => {
            (Discretisation::FiniteDifferences { nodes }, 0.0)
        }
        DiscretisationSettings::Spectral {
            degree,
            per_piece,
            tolerance,
        } => (Discretisation::Spectral { degree, per_piece }, tolerance),
    };
    let middle = (settings.outer.length + settings.outer.radius) / 2.0;
    let place = Pose::axis_along_z(pose.centre.unwrap_or(middle))?
        .turned_x(pose.turn_x.to_radians())?
        .turned_y(pose.turn_y.to_radians())?
        .turned_z(pose.turn_z.to_radians())?
        .shifted(Vector3::from(pose.shift))?;
    let membranes = [membrane(settings.inner)?, membrane(settings.outer)?];
    Heart::of_membranes(
        [&membranes[0], &membranes[1]],
        discretisation,
        tolerance,
        place,
    )
}

/// What gains of the volume are over.
pub(crate) struct Rest {
    /// Volume at rest: that of the inner balloon as it is solved, so that volumes which are asked for are those that come out; ratios need
    /// no such thing.
    pub(crate) volume: f64,
    /// The heart, if it had to be made for that.
    pub(crate) heart: Option<Heart>,
}

impl Rest {
    pub(crate) fn of(scene: &Scene) -> Result<Self, PhantomError> {
        let inner = scene.heart.inner;
        let exact = balloon_at_rest(inner.length, inner.radius)?.volume;
        let heart = match scene.cycle.volume {
            // What makes no heart is told where the heart is made.
            VolumeRange::Volumes { .. } => heart_of(scene).ok(),
            VolumeRange::Gain(_) | VolumeRange::EjectionFraction(_) => None,
        };
        let solved = |heart: &Heart| heart.pair().inner().start_measures().volume;
        Ok(Self {
            volume: heart.as_ref().map_or(exact, solved),
            heart,
        })
    }
}

pub(crate) fn cycle_of(scene: &Scene, rest: f64) -> Result<Cycle, PhantomError> {
    let mut cycle = regular_cycle_of(scene, rest)?;
    if let Some(beats) = &scene.beats {
        cycle = cycle.with_beats(beats)?;
    }
    if let Some(settings) = &scene.breathing {
        cycle = cycle.with_breathing(settings.breathing()?);
    }
    Ok(cycle)
}

/// Without beats that differ, and without breathing.
pub(crate) fn regular_cycle_of(scene: &Scene, rest: f64) -> Result<Cycle, PhantomError> {
    let (cycle, gains) = (&scene.cycle, scene.cycle.volume.gains(rest)?);
    Cycle::with_curve(cycle.beats_per_minute, &cycle.curve, gains)
}

fn background_of(settings: &BackgroundSettings) -> Result<Background, PhantomError> {
    Ok(Background {
        torso: EllipticCylinder::new(settings.centre, settings.semi_axes)?,
        concentration: settings.concentration,
    })
}

fn organs_of(scene: &Scene) -> Result<Option<Organs>, PhantomError> {
    let organ = |settings: &OrganSettings| -> Result<Organ, PhantomError> {
        let shape = match settings.shape {
            OrganShapeSettings::Cylinder { centre, semi_axes } => {
                OrganShape::Cylinder(EllipticCylinder::new(centre, semi_axes)?)
            }
            OrganShapeSettings::Ellipsoid { centre, semi_axes } => {
                OrganShape::Ellipsoid(Ellipsoid::new(centre, semi_axes)?)
            }
        };
        Ok(Organ {
            shape,
            activity: settings.activity,
            attenuation: settings.attenuation,
        })
    };
    let mut organs = match scene.chest {
        Some(chest) => chest.organs()?.as_slice().to_vec(),
        None => Vec::new(),
    };
    for settings in &scene.organs {
        organs.push(organ(settings)?);
    }
    Ok(match organs.is_empty() {
        true => None,
        false => Some(Organs::new(organs)?),
    })
}

pub(crate) fn defect_of(settings: &DefectSettings) -> Defect {
    Defect {
        region: WallRegion {
            layers: settings.layers,
            s: settings.s,
            azimuths: settings.azimuths_degrees.map(f64::to_radians),
        },
        activity: settings.activity,
    }
}

fn attenuation_of(settings: &AttenuationSettings) -> Result<Attenuation, PhantomError> {
    Ok(Attenuation {
        coefficient: settings.coefficient,
        torso: match settings.medium {
            MediumSettings::Heart => None,
            MediumSettings::Torso { centre, semi_axes } => {
                Some(EllipticCylinder::new(centre, semi_axes)?)
            }
        },
    })
}

pub(crate) fn collimation_of(settings: &CollimatorSettings) -> Result<Collimation, PhantomError> {
    let intrinsic = settings.intrinsic_fwhm;
    let of = |holes: &ParallelHoles| Collimator::parallel_holes(holes, intrinsic);
    let response = match settings.holes {
        HolesSettings::GeLehr => of(&ParallelHoles::GE_LEHR),
        HolesSettings::GeLegp => of(&ParallelHoles::GE_LEGP),
        HolesSettings::SiemensLehr => of(&ParallelHoles::SIEMENS_LEHR),
        HolesSettings::Parallel {
            diameter,
            length,
            attenuation,
        } => of(&ParallelHoles {
            diameter,
            length,
            attenuation,
        }),
        HolesSettings::Widths { slope, at_face } => {
            Collimator::new(slope, at_face, intrinsic / (8.0 * LN_2).sqrt())
        }
    };
    Ok(Collimation {
        response: response?,
        tolerance: settings.tolerance,
    })
}

fn fbp_of(settings: &ReconstructionSettings) -> FbpOptions {
    FbpOptions::default()
        .with_memory(WORK_BYTES)
        .with_window(settings.window.clone())
        .with_cutoff(settings.cutoff)
        .with_arc(settings.arc)
}

pub(crate) fn heads_of(heads: HeadsSettings) -> Heads {
    match heads {
        HeadsSettings::One => Heads::One,
        HeadsSettings::Two { angle } => Heads::Two {
            angle: angle.to_radians(),
        },
    }
}

pub(crate) fn geometry_of(scene: &Scene) -> CameraGeometry {
    let (camera, volume) = (&scene.camera, &scene.reconstruction);
    let pixels = volume.pixels.unwrap_or(camera.bins);
    let pixel = volume.pixel.unwrap_or(camera.pitch[0]);
    let part = volume
        .region
        .map_or([[0, pixels]; 2], |region| [region.x, region.y]);
    CameraGeometry {
        views: camera.views,
        arc: camera.arc.to_radians(),
        start: camera.start.to_radians(),
        heads: heads_of(camera.heads),
        bins: camera.bins,
        rows: camera.rows,
        pitch: camera.pitch,
        rotation: camera.rotation,
        interval: camera.seconds_per_view,
        pixels: part.map(|[from, to]| to - from),
        pixel,
        centre: part.map(|[from, to]| 0.5 * ((from + to) as f64 - pixels as f64) * pixel),
    }
}

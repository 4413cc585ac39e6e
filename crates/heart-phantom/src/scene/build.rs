//! Conversion of a scene to the parts of a phantom: degrees to radians, settings to the types of the domain.

use crate::error::PhantomError;
use crate::model::Surroundings;
use crate::scan::Voxels;
use crate::scene::Parts;
use crate::scene::{
    CollimatorSettings, DiscretisationSettings, HolesSettings, MaterialSettings, OrganSettings,
    OrganShapeSettings, ReconstructionSettings, Scene,
};
use crate::{Balloon, Camera, Cycle, Heart};
use membrane_newton::{Discretisation, Membrane};
use radon::{Collimator, FbpOptions, ParallelHoles};
use revolve_voxel::nalgebra::Vector3;
use revolve_voxel::{Organ, OrganShape, Organs, Pose};
use std::f64::consts::{LN_2, PI};

/// Memory limit of the work arrays of a reconstruction in bytes: the most that [`FbpMethod::Auto`](radon::FbpMethod::Auto) needs, plus as much
/// for 40 threads.
pub(crate) const WORK_BYTES: usize = 320 << 20;
/// Material coordinate of the side of the wall of a heart of given membranes: two fifths of the way from base to apex.
const SIDE: f64 = 0.2;

/// Builds the objects of a validated scene from its heart, which may be a given one, its cycle and its camera.
pub(super) fn parts(
    scene: Scene,
    (heart, own_heart): (Heart, bool),
    cycle: Cycle,
    camera: Camera,
) -> Result<Parts, PhantomError> {
    let inner = &scene.heart.inner;
    let organs = organs_of(&scene)?;
    Ok(Parts {
        own_heart,
        heart: heart
            .with_av_plane_displacement(scene.cycle.av_plane_displacement, cycle.gains())?,
        cycle,
        camera,
        surroundings: Surroundings::new(
            scene.background.as_ref(),
            organs.as_ref(),
            scene.attenuates().as_ref(),
        )?,
        organs,
        collimator: scene.collimator.map(|own| own.response()).transpose()?,
        side: match own_heart {
            true => SIDE,
            // The middle of the inner cylinder.
            false => 0.5 * (inner.length / (2.0 * inner.length + PI * inner.radius)),
        },
        scene,
    })
}

/// Rubber thicknesses are in mm.
const MM_PER_CM: f64 = 10.0;

pub(super) fn heart_of(scene: &Scene) -> Result<Heart, PhantomError> {
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
        .rotated_x(pose.rotate_x.to_radians())?
        .rotated_y(pose.rotate_y.to_radians())?
        .rotated_z(pose.rotate_z.to_radians())?
        .shifted(Vector3::from(pose.shift))?;
    let membranes = [membrane(settings.inner)?, membrane(settings.outer)?];
    Heart::of_membranes(
        [&membranes[0], &membranes[1]],
        discretisation,
        tolerance,
        place,
    )
}

/// Builds the cycle without variable R-R intervals and without respiration.
pub(super) fn cycle_of(scene: &Scene, heart: &Heart) -> Result<Cycle, PhantomError> {
    let gains = scene.cycle.volume.gains(heart.reference_volume())?;
    Cycle::new(scene.cycle.beats_per_minute, &scene.cycle.curve, gains)
}

fn organs_of(scene: &Scene) -> Result<Option<Organs>, PhantomError> {
    let organ = |settings: &OrganSettings| -> Result<Organ, PhantomError> {
        let shape = match settings.shape {
            OrganShapeSettings::Cylinder { centre, semi_axes } => {
                OrganShape::cylinder(centre, semi_axes)?
            }
            OrganShapeSettings::Ellipsoid { centre, semi_axes } => {
                OrganShape::ellipsoid(centre, semi_axes)?
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

impl CollimatorSettings {
    /// Returns the response of collimator and crystal.
    ///
    /// # Errors
    /// [`PhantomError::Radon`] if a dimension is out of range.
    pub fn response(&self) -> Result<Collimator, PhantomError> {
        let intrinsic = self.intrinsic_fwhm;
        let of = |holes: &ParallelHoles| Collimator::parallel_holes(holes, intrinsic);
        Ok(match self.holes {
            HolesSettings::GeLehr => of(&ParallelHoles::GE_LEHR),
            HolesSettings::GeLegp => of(&ParallelHoles::GE_LEGP),
            HolesSettings::GeVentriLehr => of(&ParallelHoles::GE_VENTRI_LEHR),
            HolesSettings::SiemensLehr => of(&ParallelHoles::SIEMENS_LEHR),
            HolesSettings::Parallel(holes) => of(&holes),
            HolesSettings::Widths { slope, at_face } => {
                Collimator::new(slope, at_face, intrinsic / (8.0 * LN_2).sqrt())
            }
        }?)
    }
}

impl ReconstructionSettings {
    /// Returns the options of filtered back-projection.
    pub(crate) fn fbp(&self) -> FbpOptions {
        FbpOptions::default()
            .with_memory(WORK_BYTES)
            .with_window(self.window.clone())
            .with_cutoff(self.cutoff)
            .with_arc(self.arc)
    }
}

/// Builds the camera with parallel rays.
pub(super) fn camera_of(scene: &Scene) -> Result<Camera, PhantomError> {
    let (camera, volume) = (&scene.camera, &scene.reconstruction);
    let pixels = volume.pixels.unwrap_or(camera.bins);
    let pixel = volume.pixel.unwrap_or(camera.pitch[0]);
    let part = volume
        .region
        .map_or([[0, pixels]; 2], |region| [region.x, region.y]);
    let voxels = Voxels {
        pixels: part.map(|[from, to]| to - from),
        pixel,
        centre: part.map(|[from, to]| 0.5 * ((from + to) as f64 - pixels as f64) * pixel),
    };
    Camera::new(camera, voxels)
}

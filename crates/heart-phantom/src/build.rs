//! From a scene's settings to the heart and the camera.

use crate::activity::Background;
use crate::camera::{CameraGeometry, Rotation};
use crate::error::PhantomError;
use crate::readout::Readout;
use crate::scene::{
    BackgroundSettings, BlurSettings, DefectSettings, DiscretisationSettings, Law, Mode,
    RotationSettings, Scene,
};
use crate::{Acquisition, Balloon, Cycle, Defect, Heart, WallRegion};
use membrane_newton::membrane_forces::{PressureLaw, balloon_at_rest};
use membrane_newton::{Discretisation, Membrane};
use revolve_voxel::nalgebra::Vector3;
use revolve_voxel::{EllipticCylinder, Pose};

pub(crate) fn heart_of(scene: &Scene) -> Result<Heart, PhantomError> {
    let (settings, pose) = (&scene.heart, &scene.pose);
    let law = match settings.law {
        Law::PerMaterialLength => PressureLaw::PerMaterialLength,
        Law::TotalForce => PressureLaw::TotalForce,
        Law::PerCurrentLength => PressureLaw::PerCurrentLength,
    };
    let membrane = |balloon: crate::scene::BalloonSettings| -> Result<Membrane, PhantomError> {
        let balloon = Balloon {
            length: balloon.length,
            radius: balloon.radius,
            stiffness: balloon.stiffness,
        };
        Ok(balloon.membrane()?.with_law(law))
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

pub(crate) fn gates_of(scene: &Scene) -> usize {
    match scene.acquisition.mode {
        Mode::Gated { gates } => gates,
        _ => 1,
    }
}

/// The acquisition of a gate, with a number of steps a cycle.
pub(crate) fn acquisition_of(scene: &Scene, gate: usize, points: usize) -> Acquisition {
    let interval = scene.camera.seconds_per_view;
    match scene.acquisition.mode {
        Mode::Static { phase } => Acquisition::Static { phase },
        Mode::Instants => Acquisition::Instants { interval },
        Mode::Exposure { seconds } => Acquisition::Exposure {
            interval,
            window: seconds,
            points,
        },
        Mode::WholeCycle => Acquisition::WholeCycle { points },
        Mode::Gated { gates } => Acquisition::Gate {
            gate,
            gates,
            points,
        },
    }
}

pub(crate) fn cycle_of(scene: &Scene) -> Result<Cycle, PhantomError> {
    let inner = scene.heart.inner;
    let rest = balloon_at_rest(inner.length, inner.radius)?.volume;
    let (cycle, gains) = (&scene.cycle, scene.cycle.volume.gains(rest)?);
    Cycle::with_curve(cycle.beats_per_minute, &cycle.curve, gains)
}

pub(crate) fn background_of(settings: &BackgroundSettings) -> Result<Background, PhantomError> {
    Ok(Background {
        torso: EllipticCylinder::new(settings.centre, settings.semi_axes)?,
        concentration: settings.concentration,
    })
}

pub(crate) fn defect_of(settings: &DefectSettings) -> Defect {
    Defect {
        region: WallRegion {
            layers: settings.layers,
            s: settings.s,
            azimuths: settings.azimuths.map(f64::to_radians),
        },
        activity: settings.activity,
    }
}

pub(crate) fn readout_of(scene: &Scene) -> Result<Readout, PhantomError> {
    let size = [scene.camera.bins, scene.camera.rows];
    let blur = |settings: BlurSettings| radon::Blur::new(size, scene.camera.pitch, settings.fwhm);
    Ok(Readout {
        blur: scene.blur.map(blur).transpose()?,
        noise: scene.noise,
        size,
    })
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
        bins: camera.bins,
        rows: camera.rows,
        pitch: camera.pitch,
        rotation: match camera.rotation {
            RotationSettings::StepAndShoot => Rotation::StepAndShoot,
            RotationSettings::Continuous => Rotation::Continuous {
                interval: camera.seconds_per_view,
            },
        },
        pixels: part.map(|[from, to]| to - from),
        pixel,
        centre: part.map(|[from, to]| 0.5 * ((from + to) as f64 - pixels as f64) * pixel),
    }
}

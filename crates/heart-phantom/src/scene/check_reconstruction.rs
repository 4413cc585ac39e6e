//! What a scene may say of volumes from views.

use super::fault::{Checked, Section, all_within, count, fault, within};
use super::*;
use crate::Camera;
use crate::files::Format;
use crate::ranges;
use crate::scan::MOST_SAMPLES;
use crate::scene::build::{geometry_of, heads_of};
use crate::text::{Number, enough};
use crate::{Compensation, Uptake};
use radon::RadonError;

pub(super) fn reconstruction(scene: &Scene) -> Checked {
    let settings = &scene.reconstruction;
    if let Method::Osem(osem) = &settings.method {
        check_osem(osem, scene)?;
    }
    compensation(scene)?;
    match &settings.window {
        Window::Butterworth { order } => {
            let field = "reconstruction.window.butterworth.order";
            count(field, *order as usize, [1, 1000])?;
        }
        Window::Custom(gains) => {
            let field = "reconstruction.window.custom";
            count(field, gains.len(), [2, 65_536])?;
            all_within(field, gains, [-1e6, 1e6])?;
        }
        _ => {}
    }
    within("reconstruction.cutoff", settings.cutoff, [1e-3, 1.0])?;
    if let Some(pixels) = settings.pixels {
        count("reconstruction.pixels", pixels, [1, 8192])?;
    }
    if let Some(pixel) = settings.pixel {
        within("reconstruction.pixel", pixel, ranges::SIZE)?;
    }
    let pixels = settings.pixels.unwrap_or(scene.camera.bins);
    let voxels = (pixels * pixels) as f64 * scene.camera.rows as f64;
    if voxels > MOST_SAMPLES {
        let field = match settings.pixels {
            Some(_) => "reconstruction.pixels",
            None => "camera.bins",
        };
        let wanted = format!(
            "voxels: reconstruction.pixels^2 x camera.rows = {voxels:e} must be at most {MOST_SAMPLES:e}"
        );
        return Err(fault(field, pixels, wanted));
    }
    if let Some(region) = settings.region {
        for (field, [from, to]) in [
            ("reconstruction.region.x", region.x),
            ("reconstruction.region.y", region.y),
        ] {
            if from >= to || to > pixels {
                let wanted = format!("must be [from, to] with from < to <= {pixels}");
                return Err(fault(field, format!("[{from}, {to}]"), wanted));
            }
        }
    }
    let views = scene.camera.views;
    // No gap between neighbouring directions is wider than two steps.
    let least = 180.0 / (1.0 + 1.0 / views as f64);
    let needs_all = settings.method == Method::Fbp && settings.arc == ArcPolicy::Complete;
    if needs_all && scene.camera.heads != HeadsSettings::One {
        return both_heads(scene);
    }
    if needs_all && scene.camera.arc.abs() < least {
        // Its default would do, so that it stands in the file; `reconstruction.arc` may not.
        let wanted = format!(
            "must be 180 or more, either way ({} is enough for {views} views: no gap is wider than two steps), \
             or reconstruction.arc one of extend, truncate, rescale",
            Number(enough(least))
        );
        return Err(fault("camera.arc", Number(scene.camera.arc), wanted));
    }
    Ok(())
}

/// The directions of two heads together.
fn both_heads(scene: &Scene) -> Checked {
    // What else is wrong has been said, or will be.
    let Ok(camera) = Camera::with_geometry(&geometry_of(scene)) else {
        return Ok(());
    };
    match camera.geometry().view_weights(ArcPolicy::Complete) {
        Err(RadonError::ShortArc { .. }) => {
            let wanted = "must leave no direction out, with camera.heads and either way, or reconstruction.arc be one of extend, truncate, rescale";
            Err(fault("camera.arc", Number(scene.camera.arc), wanted))
        }
        _ => Ok(()),
    }
}

/// What has no frame that all of it could be seen in.
fn compensation(scene: &Scene) -> Checked {
    let settings = &scene.reconstruction;
    let turns = |breathing: &BreathingSettings| breathing.turn_degrees != [0.0; 3];
    let wanted = match (settings.compensation, settings.method) {
        (Compensation::None, _) => return Ok(()),
        (Compensation::KnownMotion, Method::Fbp) => {
            if !scene.breathing.as_ref().is_some_and(turns) {
                return Ok(());
            }
            "moves views by fbp, which undoes no turn: breathing.turn_degrees has to be nothing, or the method osem"
        }
        (Compensation::KnownMotion, Method::Osem(_)) => match scene.activity.cavity {
            Uptake::Concentration(_) => return Ok(()),
            Uptake::Total(_) => {
                "has no frame for a cavity whose concentration changes over the beat: activity.cavity has to be a concentration"
            }
        },
    };
    Err(fault("reconstruction.compensation", "known-motion", wanted))
}

fn check_osem(osem: &Osem, scene: &Scene) -> Checked {
    let section = Section("reconstruction.method.osem");
    let views = scene.camera.views * heads_of(scene.camera.heads).count();
    section.count("subsets", osem.subsets, [1, views])?;
    section.count("iterations", osem.iterations, [1, Osem::MOST])?;
    if let Some(tolerance) = osem.tolerance {
        section.within("tolerance", tolerance, Osem::TOLERANCE)?;
    }
    let (medium, response) = (scene.attenuates().is_some(), scene.collimator.is_some());
    for (name, asked, there, needed) in [
        ("attenuation", osem.attenuation, medium, "[attenuation]"),
        ("resolution", osem.resolution, response, "[collimator]"),
    ] {
        if asked && !there {
            let wanted = format!("needs a section {needed}");
            return Err(fault(&section.field(name), asked, wanted));
        }
    }
    Ok(())
}

/// Interfile 3.3 has no key for a place: readers take the volume as centred.
pub(super) fn region_has_a_place(scene: &Scene) -> Checked {
    let settings = &scene.reconstruction;
    let pixels = settings.pixels.unwrap_or(scene.camera.bins);
    match settings.region {
        Some(PixelRange { x, y })
            if scene.output.volumes == Format::InterfileSimind
                && [x, y].iter().any(|[from, to]| from + to != pixels) =>
        {
            let wanted = format!(
                "has no place for a region off the centre; choose another format, or [from, to] with from + to = {pixels}"
            );
            Err(fault("output.volumes", "interfile-simind", wanted))
        }
        _ => Ok(()),
    }
}

//! Validation of the section `[reconstruction]`.

use super::finding::{Check, array_of};
use super::*;
use crate::files::Format;
use crate::phantom::Needs;
use crate::ranges;
use crate::scan::LEAST_DIRECTIONS;
use crate::text::{Number, enough};
use crate::{Breathing, Camera, Compensation, Method, Osem, Uptake};
use radon::{ArcPolicy, RadonError, Window};

/// Largest width of a filter in voxels.
const MOST_FILTERED: f64 = 1e6;

pub(super) fn reconstruction(scene: &Scene, c: &mut Check) {
    let settings = &scene.reconstruction;
    c.at("reconstruction", |c| {
        if let Method::Osem(osem) = &settings.method {
            c.at("method.osem", |c| check_osem(osem, scene, c));
        }
        match &settings.window {
            Window::Butterworth { order } => {
                c.count("window.butterworth.order", *order as usize, [1, 1000]);
            }
            Window::Custom(gains) => {
                if !(2..=65_536).contains(&gains.len()) {
                    let wanted = "must have between 2 and 65536 values";
                    c.fault("window.custom", array_of(gains.len()), wanted);
                }
                c.all_within("window.custom", gains, [-1e6, 1e6]);
            }
            _ => {}
        }
        c.within("cutoff", settings.cutoff, [1e-3, 1.0]);
        if let Some(pixels) = settings.pixels {
            c.count("pixels", pixels, [1, 8192]);
        }
        if let Some(pixel) = settings.pixel {
            let ([least, most], bin) = (ranges::SIZE, scene.camera.pitch[0]);
            // The limits of the model of OSEM, pitch / pixel.
            let range = match settings.method.osem() {
                Some(_) if c.is_clean(&["camera"]) => {
                    [least.max(bin / 100.0), most.min(100.0 * bin)]
                }
                _ => [least, most],
            };
            c.within("pixel", pixel, range);
        }
        if let Some(fwhm) = settings.filter_fwhm {
            let [low, high] = ranges::FILTER;
            let [bin, row] = scene.camera.pitch;
            let most = high.min(MOST_FILTERED * settings.pixel.unwrap_or(bin).min(row));
            c.within("filter_fwhm", fwhm, [low, most]);
            if settings.region.is_some() {
                let wanted =
                    "needs the voxels outside reconstruction.region; remove one of the two";
                c.fault("filter_fwhm", fwhm, wanted);
            }
        }
    });
    if c.is_clean(&["breathing", "activity"]) {
        compensation(scene, c);
    }
    if let Some(region) = scene.reconstruction.region {
        check_region(region, scene, c);
    }
}

fn check_region(PixelRange { x, y }: PixelRange, scene: &Scene, c: &mut Check) {
    let pixels = scene.reconstruction.pixels.unwrap_or(scene.camera.bins);
    for (field, [from, to]) in [
        ("reconstruction.region.x", x),
        ("reconstruction.region.y", y),
    ] {
        if from >= to || to > pixels {
            let wanted = format!("must be [from, to] with from < to <= {pixels}");
            c.fault(field, format!("[{from}, {to}]"), wanted);
        }
    }
    // Interfile 3.3 has no key for a position: readers centre the volume.
    if scene.output.volumes == Format::InterfileSimind
        && c.is_clean(&["reconstruction.region"])
        && [x, y].iter().any(|[from, to]| from + to != pixels)
    {
        let wanted = format!(
            "cannot store an off-centre region; choose another format, or [from, to] with from + to = {pixels}"
        );
        c.fault("output.volumes", "interfile-simind", wanted);
    }
}

/// Filtered back-projection needs all directions, unless the arc policy allows gaps.
pub(super) fn directions(scene: &Scene, camera: &Camera, c: &mut Check) {
    let settings = &scene.reconstruction;
    if scene.camera.geometry != BeamSettings::Parallel {
        return;
    }
    let filters = settings.method == Method::Fbp && scene.output.needs(Needs::Reconstruction);
    if !filters || settings.arc != ArcPolicy::Complete {
        return;
    }
    let (views, arc) = (scene.camera.views, scene.camera.arc);
    let n = camera.n_directions();
    if n < LEAST_DIRECTIONS {
        let wanted = format!(
            "gives {n} distinct directions (modulo 180 degrees); fbp needs at least {LEAST_DIRECTIONS}; \
             otherwise set reconstruction.arc to extend, truncate or rescale"
        );
        return match camera.n_views() < LEAST_DIRECTIONS {
            true => c.fault("camera.views", views, wanted),
            false => c.fault("camera.arc", Number(arc), wanted),
        };
    }
    if scene.camera.heads != HeadsSettings::One {
        let weights = camera.geometry().view_weights(ArcPolicy::Complete);
        if let Err(RadonError::ShortArc { .. }) = weights {
            let wanted = "the views of all heads must cover 180 degrees; otherwise set reconstruction.arc to extend, truncate or rescale";
            c.fault("camera.arc", Number(arc), wanted);
        }
        return;
    }
    // Gaps between neighbouring directions are at most two steps.
    let least = 180.0 / (1.0 + 1.0 / views as f64);
    if arc.abs() < least {
        // The default of `camera.arc` is sufficient, so this field is in the file; `reconstruction.arc` may be absent.
        let wanted = format!(
            "its magnitude must be at least 180 ({} for {views} views: no gap wider than two steps); \
             otherwise set reconstruction.arc to extend, truncate or rescale",
            Number(enough(least))
        );
        c.fault("camera.arc", Number(arc), wanted);
    }
}

/// Motion compensation needs a reference phase that all gates share.
fn compensation(scene: &Scene, c: &mut Check) {
    let settings = &scene.reconstruction;
    let turns = |breathing: &Breathing| breathing.rotation_degrees != [0.0; 3];
    let wanted = match (settings.compensation, settings.method) {
        (Compensation::KnownMotion, Method::Fbp) if scene.breathing.as_ref().is_some_and(turns) => {
            "fbp shifts projections and cannot correct a rotation: set breathing.rotation_degrees to zero or use osem"
        }
        (Compensation::KnownMotion, Method::Osem(_))
            if matches!(scene.activity.cavity, Uptake::Total(_)) =>
        {
            "the concentration of the cavity must be constant: activity.cavity must be a concentration"
        }
        (Compensation::None | Compensation::KnownMotion, _) => return,
    };
    c.fault("reconstruction.compensation", "known-motion", wanted);
}

fn check_osem(osem: &Osem, scene: &Scene, c: &mut Check) {
    let views = scene.camera.views * scene.camera.heads.count();
    if c.is_clean(&["camera.views"]) {
        c.count("subsets", osem.subsets, [1, views]);
    }
    c.count("iterations", osem.iterations, [1, Osem::MOST]);
    if let Some(tolerance) = osem.tolerance {
        c.within("tolerance", tolerance, Osem::TOLERANCE);
    }
    let (medium, response) = (scene.attenuates().is_some(), scene.collimator.is_some());
    let sections = "[attenuation] or [chest]";
    for (name, asked, there, needed) in [
        ("attenuation", osem.attenuation, medium, sections),
        ("resolution", osem.resolution, response, "[collimator]"),
        (
            "scatter",
            osem.scatter,
            scene.scatter.is_some(),
            "[scatter]",
        ),
    ] {
        if asked && !there {
            c.fault(name, asked, format!("needs a section {needed}"));
        }
    }
}

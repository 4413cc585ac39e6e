//! What the camera of a scene may be.

use super::fault::{Checked, Section, all_within, fault, spelled, within};
use super::*;
use crate::Camera;
use crate::error::PhantomError;
use crate::ranges;
use crate::scan::MOST_SAMPLES;
use crate::scene::build::{geometry_of, heads_of};
use crate::text::Number;

/// Sizes of an arc in degrees.
const ARC: [f64; 2] = [1e-3, 3600.0];

pub(super) fn camera(camera: &CameraSettings) -> Checked {
    let section = Section("camera");
    section.count("views", camera.views, [1, 10_000])?;
    if !(ARC[0]..=ARC[1]).contains(&camera.arc.abs()) {
        let [least, most] = ARC.map(Number);
        let wanted = format!(
            "its size must be between {least} and {most}, and below 0 it turns the other way"
        );
        return Err(fault("camera.arc", Number(camera.arc), wanted));
    }
    section.within("start", camera.start, [-360.0, 360.0])?;
    section.count("bins", camera.bins, [2, 8192])?;
    section.count("rows", camera.rows, [1, 8192])?;
    all_within("camera.pitch", &camera.pitch, ranges::SIZE)?;
    section.within("seconds_per_view", camera.seconds_per_view, ranges::SIZE)?;
    if let BinSample::Means { tolerance } = camera.samples {
        section.within("samples.means.tolerance", tolerance, ranges::BIN_TOLERANCE)?;
    }
    let heads = heads_of(camera.heads).count();
    if let HeadsSettings::Two { angle } = camera.heads {
        within("camera.heads.two.angle", angle, [-360.0, 360.0])?;
    }
    orbit(&camera.radius, heads * camera.views)?;
    let samples = (heads * camera.views) as f64 * camera.bins as f64 * camera.rows as f64;
    if samples > MOST_SAMPLES {
        let wanted = format!(
            "views of all heads x bins x rows = {samples:e} must be at most {MOST_SAMPLES:e}"
        );
        return Err(fault("camera.views", camera.views, wanted));
    }
    Ok(())
}

fn orbit(orbit: &Orbit, n_views: usize) -> Checked {
    let wanted = match orbit.check(n_views) {
        Ok(()) => return Ok(()),
        Err(PhantomError::WrongLength { .. }) => format!("must have {n_views}, one for each view"),
        Err(PhantomError::OutOfRange { least, most, .. }) => {
            format!("must be between {} and {}", Number(least), Number(most))
        }
        Err(other) => other.to_string(),
    };
    let (field, given) = match orbit {
        Orbit::Circle(radius) => ("camera.radius", Number(*radius).to_string()),
        Orbit::PerView(radii) => (
            "camera.radius.per_view",
            format!("an array of {} values", radii.len()),
        ),
        Orbit::Ellipse { semi_axes } => (
            "camera.radius.ellipse.semi_axes",
            format!("[{}, {}]", Number(semi_axes[0]), Number(semi_axes[1])),
        ),
        Orbit::Contour { gap } => ("camera.radius.contour.gap", Number(*gap).to_string()),
    };
    Err(fault(field, given, wanted))
}

/// Interfile and DICOM have no other.
pub(super) fn even_steps(scene: &Scene) -> Checked {
    let projections = scene.output.projections;
    let Ok(camera) = Camera::with_geometry(&geometry_of(scene)) else {
        // It has been said what is wrong.
        return Ok(());
    };
    if projections.info().even_steps && !camera.has_even_steps() {
        let wanted = "needs even steps from the first view to the last of both heads: an arc as large as the angle between them";
        return Err(fault("output.projections", spelled(projections), wanted));
    }
    Ok(())
}

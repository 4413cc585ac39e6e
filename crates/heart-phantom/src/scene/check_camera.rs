//! Validation of the section `[camera]`.

use super::finding::{Check, array_of};
use super::*;
use crate::error::PhantomError;
use crate::ranges;
use crate::scan::MOST_SAMPLES;
use crate::scene::build::camera_of;
use crate::text::Number;

/// Allowed arcs in degrees.
const ARC: [f64; 2] = [1e-3, 3600.0];

impl CameraSettings {
    pub(super) fn check(&self, c: &mut Check) {
        c.count("views", self.views, [1, 10_000]);
        if !(ARC[0]..=ARC[1]).contains(&self.arc.abs()) {
            let [least, most] = ARC.map(Number);
            let wanted =
                format!("its magnitude must be between {least} and {most}; negative is clockwise");
            c.fault("arc", Number(self.arc), wanted);
        }
        c.within("start", self.start, [-360.0, 360.0]);
        c.count("bins", self.bins, [2, 8192]);
        c.count("rows", self.rows, [1, 8192]);
        c.all_within("pitch", &self.pitch, ranges::SIZE);
        c.within("seconds_per_view", self.seconds_per_view, ranges::SIZE);
        if let HeadsSettings::Two { angle } = self.heads {
            c.within("heads.two.angle", angle, [-360.0, 360.0]);
        }
        if !c.is_clean(&["camera.views", "camera.bins", "camera.rows"]) {
            return;
        }
        let views = self.heads.count() * self.views;
        orbit(&self.radius, views, c);
        let samples = views as f64 * self.bins as f64 * self.rows as f64;
        if samples > MOST_SAMPLES {
            let wanted = format!(
                "views of all heads x bins x rows = {samples:e} must be at most {MOST_SAMPLES:e}"
            );
            c.fault("views", self.views, wanted);
        }
    }
}

fn orbit(orbit: &Orbit, n_views: usize, c: &mut Check) {
    let wanted = match orbit.check(n_views) {
        Ok(()) => return,
        Err(PhantomError::WrongLength { .. }) => format!("must have {n_views}, one for each view"),
        Err(PhantomError::OutOfRange { least, most, .. }) => {
            format!("must be between {} and {}", Number(least), Number(most))
        }
        Err(other) => other.to_string(),
    };
    let (name, given) = match orbit {
        Orbit::Circle(radius) => ("radius", Number(*radius).to_string()),
        Orbit::PerView(radii) => ("radius.per_view", array_of(radii.len())),
        Orbit::Ellipse { semi_axes } => (
            "radius.ellipse.semi_axes",
            format!("[{}, {}]", Number(semi_axes[0]), Number(semi_axes[1])),
        ),
        Orbit::Contour { gap } => ("radius.contour.gap", Number(*gap).to_string()),
    };
    c.fault(name, given, wanted);
}

impl Scene {
    /// Whether all angle steps between views are equal, as Interfile requires.
    pub(super) fn has_even_steps(&self) -> bool {
        camera_of(self).is_ok_and(|camera| camera.has_even_steps())
    }
}

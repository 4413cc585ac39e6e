//! Validation of the section `[camera]`.

use super::finding::{Check, array_of};
use super::*;
use crate::Orbit;
use crate::ranges;
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
        if c.is_clean(&["camera.views"]) {
            orbit(&self.radius, self.heads.count() * self.views, c);
        }
    }
}

fn orbit(orbit: &Orbit, n_views: usize, c: &mut Check) {
    match orbit {
        Orbit::Circle(radius) => c.within("radius", *radius, ranges::SIZE),
        Orbit::PerView(radii) if radii.len() != n_views => {
            let wanted = format!("must have {n_views}, one for each view");
            c.fault("radius.per_view", array_of(radii.len()), wanted);
        }
        Orbit::PerView(radii) => c.all_within("radius.per_view", radii, ranges::SIZE),
        Orbit::Ellipse { semi_axes } => {
            c.all_within("radius.ellipse.semi_axes", semi_axes, ranges::SIZE);
        }
        Orbit::Contour { gap } => c.within("radius.contour.gap", *gap, [0.0, ranges::SIZE[1]]),
    }
}

//! Detection of objects that views truncate or miss.

use super::Phantom;
use super::reach::extent;
use super::warning::{Warning, WarningKind};
use super::warnings::{half_extents, span, turned};
use crate::Rotation;
use crate::error::PhantomError;
use crate::text::{brief, enough};
use revolve_voxel::{Body, Organ, OrganShape};
use std::f64::consts::PI;

/// Number of directions over half a turn in which a gap is searched; the widest one is found with a relative error of 1 - cos(pi / 128) = 3e-4.
const DIRECTIONS: usize = 64;
/// The distance of no object, at no view angle.
const NOTHING: (f64, Option<f64>) = (0.0, None);
/// The settings that define length and height of the views.
const BINS: &str = "camera.bins";
const ROWS: &str = "camera.rows";

impl Phantom {
    /// Returns warnings for the heart, given by the bodies of [`Phantom::outermost`], and for all other objects.
    pub(super) fn truncations(&self, bodies: &[Body]) -> Result<Vec<Warning>, PhantomError> {
        let mut found = match self.out_of_view(bodies)? {
            Some(warning) => vec![warning],
            None => self.truncated_heart(bodies)?,
        };
        found.extend(self.truncated_organs());
        let medium = (self.scene().attenuates()).filter(|medium| medium.coefficient > 0.0);
        if let Some(Organ { shape: torso, .. }) = medium.and_then(|medium| medium.torso()) {
            let widest = self.widest_ellipse(&torso);
            found.extend(self.truncated(WarningKind::TruncatedTorso, BINS, widest));
            let times = (bodies.iter()).map(|body| torso.scale_to_contain(body));
            let times = times.fold(0.0, f64::max);
            // The factor is too large by less than 1e-4.
            if times > 1.0 + 1e-4 {
                found.push(Warning::new(
                    WarningKind::OutOfTorso,
                    "attenuation.medium",
                    [("times", times)],
                    format!(
                        "the heart extends beyond the attenuating torso, to {} times the distance of its surface: the part outside does not attenuate",
                        brief(times)
                    ),
                ));
            }
        }
        Ok(found)
    }

    /// Returns warnings for background and active organs, and for organs that only attenuate, that extend farthest beyond the bins or the rows.
    fn truncated_organs(&self) -> Vec<Warning> {
        let organs = self.parts.surroundings.sources().iter();
        let (active, others): (Vec<&Organ>, Vec<&Organ>) =
            organs.partition(|organ| organ.activity > 0.0);
        let attenuates = |organ: &&Organ| organ.attenuation > 0.0;
        let passive: Vec<&Organ> = others.into_iter().filter(attenuates).collect();
        let mut found = Vec::new();
        for (what, organs) in [
            (WarningKind::TruncatedActivity, active),
            (WarningKind::TruncatedTorso, passive),
        ] {
            let (mut widest, mut highest) = (NOTHING, 0.0f64);
            for organ in organs {
                let ([.., z], [.., c]) = organ.shape.bounds();
                widest = wider(widest, self.widest_ellipse(&organ.shape));
                // An infinite cylinder extends beyond any rows, as a background does.
                if c.is_finite() {
                    highest = highest.max(z.abs() + c);
                }
            }
            found.extend(self.truncated(what, BINS, widest));
            found.extend(self.truncated(what, ROWS, (highest, None)));
        }
        found
    }

    fn truncated_heart(&self, bodies: &[Body]) -> Result<Vec<Warning>, PhantomError> {
        let (mut widest, mut highest) = (NOTHING, 0.0f64);
        for body in bodies {
            let [x, y, z] = half_extents(body);
            highest = highest.max(z);
            // No view truncates a body that is nearer to the axis.
            let views = match 2.0 * x.hypot(y) > self.width() {
                true => self.view_angles(),
                false => Vec::new(),
            };
            for theta in views {
                let [half, ..] = half_extents(&turned(body, theta)?);
                widest = wider(widest, (half, Some(theta)));
            }
        }
        let what = WarningKind::TruncatedHeart;
        let bins = self.truncated(what, BINS, widest);
        let rows = self.truncated(what, ROWS, (highest, None));
        Ok(bins.into_iter().chain(rows).collect())
    }

    /// Returns a warning if the field of view misses the heart at every phase. All phases lie between the outermost ones.
    fn out_of_view(&self, bodies: &[Body]) -> Result<Option<Warning>, PhantomError> {
        let [low, high] = span(bodies, 2)?;
        let (from, then) = ("the middle row", "no view contains it");
        let mut found = vec![(ROWS, low.max(-high), self.height(), from, then)];
        // Distance of a convex body from the axis: the widest gap in any direction.
        let mut gap = f64::NEG_INFINITY;
        for k in 0..DIRECTIONS {
            let theta = PI * k as f64 / DIRECTIONS as f64;
            let turned = (bodies.iter())
                .map(|body| turned(body, theta))
                .collect::<Result<Vec<_>, _>>()?;
            let [low, high] = span(&turned, 0)?;
            gap = gap.max(low.max(-high));
        }
        let (from, then) = ("the axis of rotation", "only some views contain it");
        found.push((BINS, gap, self.width(), from, then));
        let outside = (found.into_iter()).find(|(_, nearest, size, ..)| *nearest >= 0.5 * size);
        Ok(outside.map(|(key, nearest, size, from, then)| {
            let reach = 0.5 * size;
            let numbers = [("nearest_cm", nearest), ("reach_cm", reach)];
            let [nearest, reach] = [nearest, reach].map(brief);
            let message = format!(
                "the heart is outside the field of view, at least {nearest} cm from {from}; half of {} is {reach} cm: {then}",
                product(key)
            );
            Warning::new(WarningKind::OutOfView, key, numbers, message)
        }))
    }

    /// Returns the angles of the views; with continuous rotation also those at start and end of each view.
    fn view_angles(&self) -> Vec<f64> {
        let shares: &[f64] = match self.camera().rotation() {
            Rotation::StepAndShoot => &[0.5],
            Rotation::Continuous => &[0.0, 0.5, 1.0],
        };
        (0..self.camera().n_views())
            .flat_map(|view_idx| shares.iter().map(move |share| (view_idx, *share)))
            .map(|(view_idx, share)| self.camera().angle(view_idx, share))
            .collect()
    }

    /// Returns the largest distance of an organ from the axis across the rays, and the angle of that view.
    fn widest_ellipse(&self, torso: &OrganShape) -> (f64, Option<f64>) {
        let half = |theta: f64| {
            let (sin, cos) = theta.sin_cos();
            let [low, high] = extent(torso, [cos, sin]);
            (high.max(-low), Some(theta))
        };
        (self.view_angles().into_iter().map(half)).fold(NOTHING, wider)
    }

    /// Returns a warning if an object extends beyond the bins or the rows, at a view angle if there is one.
    fn truncated(
        &self,
        what: WarningKind,
        key: &'static str,
        (half, angle): (f64, Option<f64>),
    ) -> Option<Warning> {
        let (available, side) = match key {
            BINS => (self.width(), "wide"),
            _ => (self.height(), "high"),
        };
        let needed = 2.0 * half;
        // Differences within rounding do not count.
        if needed <= available * (1.0 + 1e-9) {
            return None;
        }
        let (name, then) = match what {
            WarningKind::TruncatedTorso => (
                "the attenuating torso",
                "projections, and osem with attenuation = true, include all of it; attenuation maps that are written end at the field of view",
            ),
            WarningKind::TruncatedActivity => ("the activity around the heart", cut_off(key)),
            _ => ("the heart", cut_off(key)),
        };
        let at = angle.map(|angle| format!(" (at {:.1} degrees)", angle.to_degrees()));
        let message = format!(
            "{name} needs a detector {} cm {side}{}; {} is {} cm: {then}",
            enough(needed),
            at.unwrap_or_default(),
            product(key),
            brief(available)
        );
        let numbers = [("needed_cm", needed), ("available_cm", available)];
        let mut warning = Warning::new(what, key, numbers, message);
        let angle = angle.map(|angle| ("angle_degrees", angle.to_degrees()));
        warning.numbers.extend(angle);
        Some(warning)
    }

    fn unless_parallel(&self) -> f64 {
        (self.camera().ray_geometry()).map_or(1.0, |_| f64::INFINITY)
    }

    /// Returns the length of the rows of a view, cm; infinite unless rays are parallel, so that truncation is not examined.
    pub(super) fn width(&self) -> f64 {
        self.unless_parallel() * self.camera().n_bins() as f64 * self.camera().pitch()
    }

    /// Returns the height of a view, cm.
    fn height(&self) -> f64 {
        self.unless_parallel() * self.camera().n_rows() as f64 * self.camera().detector().pitch()[1]
    }
}

/// The product that defines the length or the height of the views.
fn product(key: &str) -> &'static str {
    match key {
        BINS => "bins x pitch",
        _ => "rows x pitch",
    }
}

/// The consequence of a truncation of activity.
fn cut_off(key: &str) -> &'static str {
    match key {
        BINS => "projections are truncated and reconstructions have streaks",
        _ => "slices contain only a part of it",
    }
}

/// Returns the larger of two distances, each with its view angle; the first of equal ones.
fn wider(a: (f64, Option<f64>), b: (f64, Option<f64>)) -> (f64, Option<f64>) {
    if b.0 > a.0 { b } else { a }
}

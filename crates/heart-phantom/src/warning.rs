//! What is allowed and yet may surprise: said before any work, and in the report.

use crate::error::PhantomError;
use crate::files::Format;
use crate::settings::{Mode, Product};
use crate::{HeartShape, Phantom, Rotation};
use revolve_voxel::{Body, EllipticCylinder};
#[cfg(feature = "scene")]
use serde::ser::{Serialize, SerializeMap, Serializer};
use std::fmt;

/// Something allowed that a user may not expect; its text says what it does, with the numbers.
///
/// In `report.json` an object with a `message` and with the fields `what`, `edge`, `needed_cm`, `seen_cm`, `angle_degrees` of what is
/// truncated, or `off_degrees` of uneven angles.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Warning {
    /// The detector is too small for something.
    Truncated {
        /// What it does not see whole.
        what: Seen,
        /// Where it ends.
        edge: Edge,
        /// How long the rows would have to be, or how high the views, in cm; centred on the axis of turning.
        needed: f64,
        /// How long, or high, they are.
        seen: f64,
        /// Of bins: from where most is missing, in radians.
        angle: Option<f64>,
    },
    /// A turning camera sees gates from uneven angles, and the format of the projections has room for even ones only: their mean
    /// is right.
    UnevenAngles {
        /// How far a view is from where its file says it is, at most; in radians.
        off: f64,
    },
}

/// What a camera should see whole.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Seen {
    /// Cavity and wall, at end-diastole and end-systole, or at the one phase that is looked at.
    Heart,
    /// The section `[background]`.
    Background,
    /// The torso of the section `[attenuation]`.
    Torso,
}

/// An edge of a view.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Edge {
    /// The ends of its rows.
    Bins,
    /// Its lowest and highest row.
    Rows,
}

impl Phantom {
    /// What is allowed in the scene and yet may surprise; nothing if all is as one expects. It solves the shapes that are looked
    /// at most, one or two, and casts no ray.
    ///
    /// Views that end before the heart or the background does are truncated: filtered back-projection takes what they do not
    /// see for nothing, which streaks. A torso that attenuates does so however wide it is, but volumes hold no more of it than
    /// the bins see.
    ///
    /// ```
    /// use heart_phantom::{Edge, Phantom, Seen, Warning, scene::{Mode, Scene}};
    /// let mut scene = Scene::default().with_size(32).with_mode(Mode::Static { phase: 0.5 });
    /// assert!(Phantom::new(scene.clone())?.warnings()?.is_empty());
    /// scene.pose.shift = [3.0, 0.0, 0.0];
    /// let warnings = Phantom::new(scene)?.warnings()?;
    /// assert!(matches!(warnings[..], [Warning::Truncated { what: Seen::Heart, edge: Edge::Bins, .. }]));
    /// println!("{}", warnings[0]);
    /// # Ok::<(), heart_phantom::PhantomError>(())
    /// ```
    ///
    /// # Errors
    /// What solving the shapes can return.
    pub fn warnings(&self) -> Result<Vec<Warning>, PhantomError> {
        let parts = self.parts();
        let mut found = Vec::new();
        let phases = match parts.mode {
            Mode::Static { phase } => vec![phase],
            _ => self.extreme_phases().to_vec(),
        };
        let mut widest: Option<(f64, f64)> = None;
        let mut highest = 0.0f64;
        for phase in phases {
            let shape = self.shape(phase)?;
            let body = outside_of(&shape)?;
            let [x, y, z] = half_extents(&body);
            highest = highest.max(z);
            // No view can miss what is nearer to the axis than that.
            let views = match 2.0 * x.hypot(y) > self.width() {
                true => self.seen_from(),
                false => Vec::new(),
            };
            for theta in views {
                let turned = Body::new(body.layers().to_vec(), body.pose().turned_z(-theta)?)?;
                wider(&mut widest, half_extents(&turned)[0], theta);
            }
        }
        found.extend(self.beyond_bins(Seen::Heart, widest));
        let seen = parts.camera.n_rows() as f64 * parts.camera.detector().pitch()[1];
        found.extend(truncated(
            Seen::Heart,
            Edge::Rows,
            2.0 * highest,
            seen,
            None,
        ));
        let background = parts.background.filter(|around| around.concentration > 0.0);
        if let Some(around) = background {
            let widest = self.widest_ellipse(&around.torso);
            found.extend(self.beyond_bins(Seen::Background, widest));
        }
        let medium = parts.attenuation.filter(|medium| medium.coefficient > 0.0);
        if let Some(torso) = medium.and_then(|medium| medium.torso) {
            let widest = self.widest_ellipse(&torso);
            found.extend(self.beyond_bins(Seen::Torso, widest));
        }
        if parts.output.write.contains(&Product::Projections) {
            found.extend(self.uneven_angles()?);
        }
        Ok(found)
    }

    fn uneven_angles(&self) -> Result<Option<Warning>, PhantomError> {
        let mut off = 0.0f64;
        for gate in 0..self.n_gates() {
            let times = self.view_times(gate)?;
            for (time, written) in times.iter().zip(self.written_angles(gate)?) {
                off = off.max((time.angle - written).abs());
            }
        }
        // Below what a header in degrees tells.
        Ok((off > 1e-9).then_some(Warning::UnevenAngles { off }))
    }

    /// The angles of the views of a gate as the format of the projections has them: Interfile knows of even steps only.
    pub(crate) fn written_angles(&self, gate: usize) -> Result<Vec<f64>, PhantomError> {
        let angles = self.view_times(gate)?.into_iter().map(|time| time.angle);
        Ok(match self.parts().output.projections {
            Format::InterfileStir | Format::InterfileSimind => {
                let nominal = self.camera().geometry().angles();
                let off: f64 = angles.zip(nominal).map(|(a, b)| a - b).sum();
                let off = off / nominal.len() as f64;
                nominal.iter().map(|angle| angle + off).collect()
            }
            _ => angles.collect(),
        })
    }

    /// The angles of the views; of a camera that turns, those at which each begins and ends besides.
    fn seen_from(&self) -> Vec<f64> {
        let shares: &[f64] = match self.camera().rotation() {
            Rotation::StepAndShoot => &[0.5],
            Rotation::Continuous { .. } => &[0.0, 0.5, 1.0],
        };
        (0..self.camera().n_views())
            .flat_map(|view_idx| shares.iter().map(move |share| (view_idx, *share)))
            .map(|(view_idx, share)| self.camera().angle(view_idx, share))
            .collect()
    }

    /// How far to either side an elliptic cylinder reaches, and from where that is seen.
    fn widest_ellipse(&self, torso: &EllipticCylinder) -> Option<(f64, f64)> {
        let ([x, y], [a, b]) = (torso.centre(), torso.semi_axes());
        let mut widest = None;
        for theta in self.seen_from() {
            let (sin, cos) = theta.sin_cos();
            let middle = x * cos + y * sin;
            wider(&mut widest, middle.abs() + (a * cos).hypot(b * sin), theta);
        }
        widest
    }

    fn beyond_bins(&self, what: Seen, widest: Option<(f64, f64)>) -> Option<Warning> {
        let edge = Edge::Bins;
        widest
            .and_then(|(half, theta)| truncated(what, edge, 2.0 * half, self.width(), Some(theta)))
    }

    /// Length of the rows of a view in cm.
    fn width(&self) -> f64 {
        self.camera().n_bins() as f64 * self.camera().pitch()
    }
}

fn truncated(
    what: Seen,
    edge: Edge,
    needed: f64,
    seen: f64,
    angle: Option<f64>,
) -> Option<Warning> {
    // What only rounding puts outside is inside.
    (needed > seen * (1.0 + 1e-9)).then_some(Warning::Truncated {
        what,
        edge,
        needed,
        seen,
        angle,
    })
}

fn wider(widest: &mut Option<(f64, f64)>, half: f64, theta: f64) {
    if widest.is_none_or(|(most, _)| half > most) {
        *widest = Some((half, theta));
    }
}

/// The solid within the outer membrane.
pub(crate) fn outside_of(shape: &HeartShape) -> Result<Body, PhantomError> {
    let layers = shape.body().layers();
    Ok(Body::new(
        vec![layers[layers.len() - 1].clone()],
        *shape.body().pose(),
    )?)
}

/// How far a body reaches from the planes through the origin, to the farther side.
pub(crate) fn half_extents(body: &Body) -> [f64; 3] {
    let [low, high] = body.bounding_box(0).unwrap_or_default();
    [0, 1, 2].map(|a| high[a].max(-low[a]))
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (what, edge, needed, seen, angle) = match *self {
            Self::Truncated {
                what,
                edge,
                needed,
                seen,
                angle,
            } => (what, edge, needed, seen, angle),
            Self::UnevenAngles { off } => {
                return write!(
                    f,
                    "the gates of a turning camera are seen from uneven angles, up to {:.3} degrees from where Interfile puts them; \
                     other formats hold each angle, and report.json does",
                    off.to_degrees()
                );
            }
        };
        let (name, then) = match (what, edge) {
            (Seen::Heart, Edge::Bins) => (
                "the heart",
                "views are truncated, and reconstructions streak",
            ),
            (Seen::Heart, Edge::Rows) => ("the heart", "its ends are in no slice"),
            (Seen::Background, _) => (
                "the background",
                "views are truncated, and reconstructions streak",
            ),
            (Seen::Torso, _) => (
                "the torso that attenuates",
                "it does so whole, but no volume holds all of it",
            ),
        };
        let (sides, field) = match edge {
            Edge::Bins => ("wide", "camera.bins x camera.pitch[0]"),
            Edge::Rows => ("high", "camera.rows x camera.pitch[1]"),
        };
        write!(f, "{name} needs views {needed:.2} cm {sides}")?;
        if let Some(angle) = angle {
            write!(f, " (at {:.1} degrees)", angle.to_degrees())?;
        }
        write!(f, "; {field} is {seen:.2} cm: {then}")
    }
}

#[cfg(feature = "scene")]
impl Serialize for Warning {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let mut map = to.serialize_map(None)?;
        let (what, edge, needed, seen, angle) = match *self {
            Self::Truncated {
                what,
                edge,
                needed,
                seen,
                angle,
            } => (what, edge, needed, seen, angle),
            Self::UnevenAngles { off } => {
                map.serialize_entry("what", "angles")?;
                map.serialize_entry("off_degrees", &off.to_degrees())?;
                map.serialize_entry("message", &self.to_string())?;
                return map.end();
            }
        };
        let what = match what {
            Seen::Heart => "heart",
            Seen::Background => "background",
            Seen::Torso => "torso",
        };
        let edge = match edge {
            Edge::Bins => "bins",
            Edge::Rows => "rows",
        };
        map.serialize_entry("what", what)?;
        map.serialize_entry("edge", edge)?;
        map.serialize_entry("needed_cm", &needed)?;
        map.serialize_entry("seen_cm", &seen)?;
        if let Some(angle) = angle {
            map.serialize_entry("angle_degrees", &angle.to_degrees())?;
        }
        map.serialize_entry("message", &self.to_string())?;
        map.end()
    }
}

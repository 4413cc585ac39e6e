//! Orbits: the distance of the collimator face from the axis of rotation in each view.

/// The orbit of a camera head. At the angle theta the face is at `R (-sin theta, cos theta)`, perpendicular to the rays. `R` is constant
/// during a view.
///
/// In a scene a number is a circle.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(remote = "Self", rename_all = "snake_case", deny_unknown_fields)]
#[non_exhaustive]
pub enum Orbit {
    /// Circular orbit; the radius in cm.
    Circle(f64),
    /// Radius of each view, cm.
    PerView(Vec<f64>),
    /// The centre of the face follows an ellipse about the axis: `R = 1 / sqrt((sin theta / a)^2 + (cos theta / b)^2)`.
    Ellipse {
        /// Semi-axes `a` along x and `b` along y, cm.
        semi_axes: [f64; 2],
    },
    /// Body contour: the face is as near as heart, torso and organs (active or not) allow.
    Contour {
        /// Distance of the face from the nearest of them, cm.
        gap: f64,
    },
}

impl Orbit {
    /// Returns the radius of view `view_idx` at the angle `theta`; `None` for a contour.
    pub(crate) fn radius(&self, view_idx: usize, theta: f64) -> Option<f64> {
        match self {
            Self::Circle(radius) => Some(*radius),
            Self::PerView(radii) => radii.get(view_idx).copied(),
            Self::Ellipse { semi_axes: [a, b] } => {
                let (sin, cos) = theta.sin_cos();
                Some(1.0 / (sin / a).hypot(cos / b))
            }
            Self::Contour { .. } => None,
        }
    }
}

mod file {
    use super::Orbit;
    use serde::de::value::MapAccessDeserializer;
    use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};
    use serde::ser::{Serialize, Serializer};
    use std::fmt;

    impl Serialize for Orbit {
        fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
            match self {
                Self::Circle(radius) => to.serialize_f64(*radius),
                Self::PerView(_) | Self::Ellipse { .. } | Self::Contour { .. } => {
                    Self::serialize(self, to)
                }
            }
        }
    }

    impl<'de> Deserialize<'de> for Orbit {
        fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
            from.deserialize_any(NumberOrTable)
        }
    }

    struct NumberOrTable;

    impl<'de> Visitor<'de> for NumberOrTable {
        type Value = Orbit;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            // Selects the advice of the template.
            f.write_str("struct variant or a number")
        }

        fn visit_f64<E>(self, radius: f64) -> Result<Orbit, E> {
            Ok(Orbit::Circle(radius))
        }

        fn visit_i64<E>(self, radius: i64) -> Result<Orbit, E> {
            Ok(Orbit::Circle(radius as f64))
        }

        fn visit_u64<E>(self, radius: u64) -> Result<Orbit, E> {
            Ok(Orbit::Circle(radius as f64))
        }

        fn visit_map<A: MapAccess<'de>>(self, table: A) -> Result<Orbit, A::Error> {
            Orbit::deserialize(MapAccessDeserializer::new(table))
        }
    }
}

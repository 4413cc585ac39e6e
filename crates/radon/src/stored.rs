//! Geometries in files (feature `serde`): their fields by the names of their methods, with lengths in one unit and angles in radians. Reading
//! validates them as their constructors do.

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::{Collimator, ImageGrid, ParallelGeometry, RadonError, SliceAxis, SpectGeometry};

macro_rules! stored {
    ($type:ident { $($field:ident: $kind:ty),* } => $make:expr) => {
        const _: () = {
            #[derive(Serialize, Deserialize)]
            #[serde(deny_unknown_fields)]
            struct Stored {
                $($field: $kind),*
            }

            impl Serialize for $type {
                fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
                    Stored { $($field: self.$field().to_owned()),* }.serialize(to)
                }
            }

            impl<'de> Deserialize<'de> for $type {
                fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
                    let make: fn(Stored) -> Result<Self, RadonError> = $make;
                    make(Stored::deserialize(from)?).map_err(D::Error::custom)
                }
            }
        };
    };
}

stored!(ParallelGeometry { angles: Vec<f64>, n_bins: usize, pitch: f64, offset: f64 } => |g| {
    Self::from_radians(g.angles, g.n_bins, g.pitch)?.with_offset(g.offset)
});
stored!(ImageGrid { nx: usize, ny: usize, spacing: [f64; 2], centre: [f64; 2] } => |g| {
    Self::anisotropic(g.nx, g.ny, g.spacing)?.with_centre(g.centre)
});
stored!(SliceAxis { n_slices: usize, spacing: f64, centre: f64 } => |a| {
    Self::new(a.n_slices, a.spacing)?.with_centre(a.centre)
});
stored!(SpectGeometry { views: ParallelGeometry, rows: SliceAxis, radii: Vec<f64> } => |g| {
    Self::new(&g.views, &g.rows, g.radii)
});
stored!(Collimator { slope: f64, at_face: f64, intrinsic: f64 } => |c| {
    Self::new(c.slope, c.at_face, c.intrinsic)
});

/// Reads a number, or nothing: JSON has no infinity.
pub(crate) fn or_infinity<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(from)?.unwrap_or(f64::INFINITY))
}

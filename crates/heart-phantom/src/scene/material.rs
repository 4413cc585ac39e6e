//! `heart.material`: springs, or rubber with its constants and thickness.

use super::finding::{Check, spelled};
use crate::Balloon;
use crate::text::Number;
pub(super) use file::EXPECTED;
use membrane_forces::{MembraneError, PressureLaw, StrainEnergy};

/// The material of both membranes.
///
/// `"springs"`, or a [`StrainEnergy`] with its constants in kPa and its thickness in mm: `{ neo_hookean = { mu = 400.0, thickness = 0.5 } }`.
///
/// ```
/// use heart_phantom::membrane_forces::StrainEnergy;
/// use heart_phantom::scene::MaterialSettings;
/// use heart_phantom::Scene;
/// let scene = Scene::from_toml("[heart]\nmaterial = { gent = { mu = 400.0, jm = 30.0, thickness = 0.5 } }\n")?;
/// let energy = StrainEnergy::Gent { mu: 400.0, jm: 30.0 };
/// assert_eq!(scene.heart.material, MaterialSettings::Rubber { energy, thickness: 0.5 });
/// # Ok::<(), heart_phantom::PhantomError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub enum MaterialSettings {
    /// The springs of the paper; each membrane has its own stiffness.
    Springs,
    /// Rubber, the same in both membranes.
    Rubber {
        /// Strain energy; moduli in kPa.
        energy: StrainEnergy,
        /// Thickness in the reference configuration, mm.
        thickness: f64,
    },
}

/// The field of the table that is not a constant of the energy.
const THICKNESS: &str = "thickness";

/// Names of the constants of rubber.
const CONSTANTS: [&str; 4] = ["mu", "c1", "c2", "jm"];

/// Allowed thicknesses in mm, allowed shear moduli in kPa.
const THICKNESSES: [f64; 2] = [1e-3, 10.0];
const SHEAR_MODULI: [f64; 2] = [1e-6, 1e9];

/// Validates the constants of rubber and the absence of parameters of springs.
pub(super) fn check(
    material: &MaterialSettings,
    [inner, outer]: [Balloon; 2],
    law: PressureLaw,
    c: &mut Check,
) {
    let MaterialSettings::Rubber { energy, thickness } = material else {
        return;
    };
    let table = format!("material.{}", spelled(energy).replace('-', "_"));
    c.at(&table, |c| {
        c.within(THICKNESS, *thickness, THICKNESSES);
        let [least, most] = SHEAR_MODULI;
        let modulus = energy.shear_modulus();
        match energy.check() {
            Err(MembraneError::OutOfRange {
                what, given, least, ..
            }) if CONSTANTS.contains(&what) => {
                let wanted = match least {
                    0.0 => "must be finite and not negative",
                    _ => "must be finite and positive",
                };
                c.fault(what, Number(given), wanted);
            }
            Err(error) => c.fault("", "", error.to_string()),
            Ok(()) if !(least..=most).contains(&modulus) => {
                let [modulus, least, most] = [modulus, least, most].map(Number);
                let wanted =
                    format!("shear modulus is {modulus} kPa, must be between {least} and {most}");
                c.fault("", "", wanted);
            }
            Ok(()) => {}
        }
    });
    for (name, balloon) in [("inner.stiffness", inner), ("outer.stiffness", outer)] {
        if balloon.stiffness != 1.0 {
            let wanted = "must be absent: heart.material defines the stiffness of rubber";
            c.fault(name, Number(balloon.stiffness), wanted);
        }
    }
    match law {
        // The default, and a pressure.
        PressureLaw::PerMaterialLength | PressureLaw::PerCurrentLength => {}
        PressureLaw::TotalForce => {
            let wanted = "must be absent: the load of rubber is a pressure";
            c.fault("law", spelled(law), wanted);
        }
    }
}

mod file {
    use super::{MaterialSettings, THICKNESS};
    use membrane_forces::StrainEnergy;
    use serde::de::{Deserializer, Error as _};
    use serde::ser::{Error as _, Serializer};
    use serde::{Deserialize, Serialize};
    use toml::Value;

    /// Allowed values of `heart.material` in error messages; the template has details.
    pub(in crate::scene) const EXPECTED: &str = "\"springs\" or a rubber with its constants";

    impl Serialize for MaterialSettings {
        fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
            let Self::Rubber { energy, thickness } = self else {
                return to.serialize_str("springs");
            };
            let mut named = serde_json::to_value(energy).map_err(S::Error::custom)?;
            for constants in named
                .as_object_mut()
                .into_iter()
                .flat_map(|map| map.values_mut())
            {
                constants[THICKNESS] = (*thickness).into();
            }
            named.serialize(to)
        }
    }

    impl<'de> Deserialize<'de> for MaterialSettings {
        fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
            let mut named = match Value::deserialize(from)? {
                Value::String(name) if name == "springs" => return Ok(Self::Springs),
                Value::Table(named) if named.len() == 1 => named,
                Value::Table(named) if named.len() > 1 => {
                    return Err(D::Error::custom("only one of these can be chosen"));
                }
                _ => return Err(D::Error::custom(EXPECTED)),
            };
            let mut constants = named
                .iter_mut()
                .filter_map(|(_, table)| table.as_table_mut());
            let constants = constants.next().ok_or_else(|| D::Error::custom(EXPECTED))?;
            let thickness = constants.remove(THICKNESS);
            let thickness = thickness.ok_or_else(|| D::Error::missing_field(THICKNESS))?;
            // Places in messages refer to this table only.
            let wrong = |error: toml::de::Error| D::Error::custom(error.message());
            Ok(Self::Rubber {
                energy: StrainEnergy::deserialize(named).map_err(wrong)?,
                thickness: f64::deserialize(thickness).map_err(wrong)?,
            })
        }
    }
}

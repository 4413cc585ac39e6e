//! JSON read as TOML.

use serde::de::{Deserialize, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use std::fmt;
use toml::{Table, Value};

/// Reads JSON as TOML: null is NaN, an integer beyond i64 is a real number. A repeated key is an error, as in TOML.
pub(super) fn toml_of(json: &str) -> serde_json::Result<Value> {
    serde_json::from_str(json).map(|Json(value)| value)
}

struct Json(Value);

impl<'de> Deserialize<'de> for Json {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        from.deserialize_any(Reader).map(Self)
    }
}

struct Reader;

impl<'de> Visitor<'de> for Reader {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("JSON")
    }

    fn visit_unit<E>(self) -> Result<Value, E> {
        Ok(Value::Float(f64::NAN))
    }

    fn visit_bool<E>(self, given: bool) -> Result<Value, E> {
        Ok(Value::Boolean(given))
    }

    fn visit_i64<E>(self, given: i64) -> Result<Value, E> {
        Ok(Value::Integer(given))
    }

    fn visit_u64<E>(self, given: u64) -> Result<Value, E> {
        Ok(i64::try_from(given).map_or(Value::Float(given as f64), Value::Integer))
    }

    fn visit_f64<E>(self, given: f64) -> Result<Value, E> {
        Ok(Value::Float(given))
    }

    fn visit_str<E>(self, given: &str) -> Result<Value, E> {
        Ok(Value::String(given.to_owned()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut given: A) -> Result<Value, A::Error> {
        let mut values = Vec::new();
        while let Some(Json(value)) = given.next_element()? {
            values.push(value);
        }
        Ok(Value::Array(values))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut given: A) -> Result<Value, A::Error> {
        let mut fields = Table::new();
        while let Some((name, Json(value))) = given.next_entry::<String, Json>()? {
            if fields.contains_key(&name) {
                return Err(A::Error::custom(format_args!("`{name}`: duplicate key")));
            }
            fields.insert(name, value);
        }
        Ok(Value::Table(fields))
    }
}

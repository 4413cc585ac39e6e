//! Arrays of a fixed length in a file.

use serde::Deserialize;
use serde::de::{Deserializer, Error as _, SeqAccess, Visitor};
use std::fmt;
use std::marker::PhantomData;

/// An array of exactly N values; the TOML parser alone would ignore surplus values.
struct Exactly<T, const N: usize>(PhantomData<T>);

impl<'de, T: Deserialize<'de>, const N: usize> Visitor<'de> for Exactly<T, N> {
    type Value = [T; N];

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "an array of {N} values")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut values: A) -> Result<Self::Value, A::Error> {
        let mut given = Vec::with_capacity(N);
        while let Some(value) = values.next_element()? {
            given.push(value);
        }
        let n = given.len();
        (given.try_into()).map_err(|_| A::Error::invalid_length(n, &self))
    }
}

pub(crate) fn exactly<'de, D, T, const N: usize>(from: D) -> Result<[T; N], D::Error>
where
    D: Deserializer<'de>,
    T: Deserialize<'de>,
{
    from.deserialize_seq(Exactly(PhantomData))
}

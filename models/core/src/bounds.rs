//! A range as text formats can carry it: JSON has no infinity, so an absent bound travels as `"inf"` or `"-inf"`.
//!
//! Next file to read: [`crate::spec`], whose ranges these are.

use std::fmt;

use serde::de::{Error, SeqAccess, Visitor};
use serde::ser::SerializeTuple;
use serde::{Deserialize, Deserializer, Serializer};

/// Writes a range of two numbers.
pub(crate) fn serialize<S: Serializer>(range: &[f64; 2], serializer: S) -> Result<S::Ok, S::Error> {
    let mut pair = serializer.serialize_tuple(2)?;
    for bound in range {
        if bound.is_finite() {
            pair.serialize_element(bound)?;
        } else {
            pair.serialize_element(&bound.to_string())?;
        }
    }
    pair.end()
}

/// Reads a range of two numbers, either of which may be the text `inf` or `-inf`.
pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[f64; 2], D::Error> {
    deserializer.deserialize_tuple(2, Pair)
}

struct Pair;

impl<'de> Visitor<'de> for Pair {
    type Value = [f64; 2];

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a range [smallest, largest]")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<[f64; 2], A::Error> {
        let mut range = [0.0; 2];
        for (i, bound) in range.iter_mut().enumerate() {
            let Bound(value) = seq.next_element()?.ok_or_else(|| A::Error::invalid_length(i, &self))?;
            *bound = value;
        }
        if seq.next_element::<Bound>()?.is_some() {
            return Err(A::Error::invalid_length(3, &self));
        }
        Ok(range)
    }
}

/// One end of a range.
struct Bound(f64);

impl<'de> Deserialize<'de> for Bound {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(BoundVisitor)
    }
}

struct BoundVisitor;

impl Visitor<'_> for BoundVisitor {
    type Value = Bound;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number, \"inf\" or \"-inf\"")
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Bound, E> {
        if value.is_nan() {
            return Err(E::invalid_value(serde::de::Unexpected::Float(value), &self));
        }
        Ok(Bound(value))
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<Bound, E> {
        Ok(Bound(value as f64))
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<Bound, E> {
        Ok(Bound(value as f64))
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<Bound, E> {
        match text.parse::<f64>() {
            Ok(value) if !value.is_nan() => Ok(Bound(value)),
            _ => Err(E::invalid_value(serde::de::Unexpected::Str(text), &self)),
        }
    }
}

/// Unbounded on both sides.
pub(crate) fn unbounded() -> [f64; 2] {
    [f64::NEG_INFINITY, f64::INFINITY]
}

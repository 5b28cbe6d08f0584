//! Reading the layout of a model that is put together from pieces: cells, regions, segments, elements.
//!
//! A layout is written in the study under `[model.layout]` and travels as it is written; each such model has a type of its
//! own for it. Values that can be estimated are parameters of the model and no part of its layout. Next file to read:
//! [`mod@crate::setup`].

use serde::de::DeserializeOwned;

use crate::SetupError;
use crate::setup::ModelDef;
use crate::{meant, nearest};

/// The layout of a definition as a model's own type; the type's default where the definition has none.
///
/// # Errors
/// When a key is unknown or missing, or a value has the wrong type; the error says where.
pub fn read<T: DeserializeOwned + Default>(def: &ModelDef) -> Result<T, SetupError> {
    let Some(layout) = &def.layout else { return Ok(T::default()) };
    serde_path_to_error::deserialize(layout).map_err(|error| SetupError::Layout {
        path: error.path().to_string(),
        message: in_words(&error.inner().to_string()),
    })
}

/// The message of a failed reading without the names of Rust's types, and with the nearest key for an unknown one.
fn in_words(message: &str) -> String {
    if let Some((said, expected)) = message.rsplit_once(", expected ") {
        let word = expected.split(' ').next().unwrap_or_default();
        let plain = match word {
            "usize" | "u8" | "u16" | "u32" | "u64" => "a whole number, 0 or above",
            "i32" | "i64" => "a whole number",
            "f32" | "f64" => "a number",
            "struct" => "a table",
            _ => {
                return message.to_owned() + &meant(nearest_key(said, expected));
            }
        };
        return format!("{said}, expected {plain}");
    }
    message.to_owned()
}

/// The nearest of the expected names, which stand between backticks, to the unknown one.
fn nearest_key(said: &str, expected: &str) -> Option<String> {
    let unknown = said.strip_prefix("unknown field `").or_else(|| said.strip_prefix("unknown variant `"))?;
    nearest(unknown.strip_suffix('`')?, expected.split('`').skip(1).step_by(2))
}

/// A fault of meaning at a place of the layout, such as `regions[2].to`.
pub fn fault(path: &str, message: impl Into<String>) -> SetupError {
    SetupError::Layout { path: path.to_owned(), message: message.into() }
}

/// Refuses a layout for a model that has none.
///
/// # Errors
/// When the definition has a layout.
pub fn none(def: &ModelDef) -> Result<(), SetupError> {
    match def.layout {
        None => Ok(()),
        Some(_) => Err(fault("", format!("model `{}` has no layout: remove `[model.layout]`", def.kind))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;
    use serde_json::{Value, json};

    #[derive(Default, Deserialize)]
    #[serde(deny_unknown_fields, default)]
    struct Pipe {
        cells: usize,
        step: f64,
    }

    fn told(layout: Value) -> String {
        let def = ModelDef { layout: Some(layout), ..ModelDef::default() };
        read::<Pipe>(&def).err().map_or(String::new(), |error| error.to_string())
    }

    #[test]
    fn a_layout_that_cannot_be_read_is_told_without_the_types_of_the_program() {
        assert_eq!(told(json!({ "cells": 3, "step": 0.1 })), "");
        let cases = [
            (json!({ "cells": -3 }), "integer `-3`, expected a whole number, 0 or above"),
            (json!({ "step": "short" }), "string \"short\", expected a number"),
            (json!(5), "integer `5`, expected a table"),
            (json!({ "cell": 3 }), "unknown field `cell`, expected `cells` or `step`; did you mean `cells`?"),
        ];
        for (layout, message) in cases {
            let told = told(layout);
            assert!(told.ends_with(message), "{told}");
        }
    }
}

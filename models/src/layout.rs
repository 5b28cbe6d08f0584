//! Reading the layout of a model that is put together from pieces: cells, regions, segments, elements.
//!
//! A layout is written in the study under `[model.layout]` and travels as it is written; each such model has a type of its
//! own for it. Values that can be estimated are parameters of the model and no part of its layout. Next file to read:
//! [`crate::native`].

use serde::de::DeserializeOwned;

use crate::setup::{ModelDef, SetupError};

/// The layout of a definition as a model's own type; the type's default where the definition has none.
///
/// # Errors
/// When a key is unknown or missing, or a value has the wrong type; the error says where.
pub fn read<T: DeserializeOwned + Default>(def: &ModelDef) -> Result<T, SetupError> {
    let Some(layout) = &def.layout else { return Ok(T::default()) };
    serde_path_to_error::deserialize(layout).map_err(|error| SetupError::Layout {
        path: error.path().to_string(),
        message: error.inner().to_string(),
    })
}

/// A fault of meaning at a place of the layout, such as `regions[2].to`.
pub fn fault(path: &str, message: impl Into<String>) -> SetupError {
    SetupError::Layout { path: path.to_owned(), message: message.into() }
}

/// Refuses a layout for a model that has none.
///
/// # Errors
/// When the definition has a layout.
pub(crate) fn none(def: &ModelDef) -> Result<(), SetupError> {
    match def.layout {
        None => Ok(()),
        Some(_) => Err(fault("", format!("model `{}` has no layout: remove `[model.layout]`", def.kind))),
    }
}

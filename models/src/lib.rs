//! Forward models, observers and effects: the catalogue of what a study can name, and what is built from it.
//!
//! A [`Setup`] names a model, its constants, its observer and its effects; [`BuildSetup::build`] makes a [`Forward`] of it,
//! which turns a [`Job`] into a [`Prediction`]. No model and no run is written here: this crate puts the families of built-in
//! models above what they have in common and shows all of it under one name. What does not build is a [`SetupError`].
//!
//! Next file to read: [`catalogue`], then `models/core/src/lib.rs`.

mod build;
pub mod catalogue;

pub use starlings_models_core::*;

pub use build::{BuildSetup, Factory};
pub use starlings_haemodynamics::prestress;
pub use starlings_structures as structures;

/// The built-in models of all families, by the names of their types.
pub mod native {
    pub use starlings_haemodynamics::*;
    pub use starlings_propulsion::RocketMotor;
}

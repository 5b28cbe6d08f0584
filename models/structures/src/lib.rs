//! Built-in models of structures that vibrate: a plate that has lost stiffness in a patch, a conical shell, a
//! gimballed nozzle.
//!
//! They are those of the chapter on fault diagnosis by Smelyanskiy, Luchinsky et al. ("Physics-based methods of failure analysis
//! and diagnostics in human space flight"). Nothing here knows studies, estimation or how a run is made; the search for damage in
//! [`plate`] is physics of the plate and least squares in three unknowns, nothing else. Next file to read: [`plate`].

pub mod conical_shell;
mod error;
mod modal;
pub mod plate;
pub mod thrust_vector_control;

use starlings_models_core::NativeModel;

pub use error::StructureError;

/// Every model of this family.
pub const MODELS: &[NativeModel] = &[
    NativeModel::laid_out("plate", plate::PlateModel::build),
    NativeModel::laid_out("conical-shell", conical_shell::ConicalShell::build),
    NativeModel::laid_out("thrust-vector-control", thrust_vector_control::ThrustVectorControl::build),
];

//! Built-in models of solid rocket motors: the chamber as one volume, and the gas dynamics along a burning bore.
//!
//! Both share the grain (`grain.rs`), the nozzle (`nozzle.rs`) and the course of the throat's area (`throat.rs`). Erosive burning,
//! two-phase flow, ignition and the structure of the case are not here. A layout that a model refuses is a
//! [`starlings_models_core::SetupError`], a run that it cannot finish a [`starlings_models_core::ModelFailure`]. Next file to read:
//! [`rocket_motor`], then `docs/propulsion.md`.

mod grain;
mod nozzle;
mod rocket_motor;
mod rocket_motor_1d;
mod throat;

use starlings_models_core::NativeModel;

pub use rocket_motor::RocketMotor;
pub use rocket_motor_1d::{Balance, RocketMotor1d};

/// Every model of this family.
pub const MODELS: &[NativeModel] = &[
    NativeModel::laid_out("rocket-motor", RocketMotor::build),
    NativeModel::laid_out("rocket-motor-1d", RocketMotor1d::build).of_own_order(),
];

//! What models, observers and effects are made of, and how a run of them is made.
//!
//! Everything here is pure: the same [`Job`] gives the same bits, with no network, clock, file or randomness. A [`Setup`] names
//! a model, its constants, its observer and its effects; a [`Simulator`] of it is a [`Forward`], which turns a [`Job`] into a
//! [`Prediction`]. There is no built-in model here, so that nothing here builds a setup: families of models stand beside this
//! crate and list theirs as [`NativeModel`], and the crate above looks them up. A setup that does not fit together is a
//! [`SetupError`], a run without a prediction a [`ParticleError`].
//!
//! Next file to read: [`job`], then [`model`], then [`simulator`].

mod binding;
pub mod blocks;
mod bounds;
pub mod cache;
pub mod effect;
pub mod equations;
pub mod exponential;
pub mod external;
mod failure;
mod inputs;
pub mod integrate;
mod job;
mod job_check;
pub mod layout;
pub mod limits;
pub mod memory;
mod model;
mod names;
mod native_models;
mod noise;
pub mod observer;
pub mod oscillation;
mod past;
pub mod periodic;
mod scratch;
pub mod segment;
mod sensitivity;
mod setup;
mod setup_error;
mod simulator;
pub mod slopes;
pub mod solver;
mod spans;
mod spec;
pub mod spectrum;
mod state_values;
mod sums_def;
pub mod surface;
pub mod units;

pub use blocks::Blocks;
pub use effect::{Addition, EffectDef, EffectParameter, EffectState};
pub use external::{External, Run, Solve, Solved};
pub use failure::{Failure, ModelFailure, ParticleError, Timeout};
pub use job::{Forward, Job, Prediction, Signal, Window};
pub use limits::{Stop, Until};
pub use memory::{Memory, with_memories};
pub use model::{Model, advance_by};
pub use names::{did_you_mean, meant, nearest, quoted_list};
pub use native_models::{NativeModel, NativeModels};
pub use noise::WhiteNoise;
pub use observer::Observer;
pub use segment::Drive;
pub use setup::{ModelDef, ObserverDef, Setup};
pub use setup_error::SetupError;
pub use simulator::Simulator;
pub use solver::{Description, FaultPlace, FilesDef, SOLVER, SolverDef, SolverFault};
pub use spec::{Quantity, Role, Spec};
pub use state_values::StateValues;
pub use sums_def::{PolynomialDef, SumsDef, SumsFile};

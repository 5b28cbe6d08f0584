//! Forward models, observers and effects.
//!
//! Everything here is pure: the same [`Job`] gives the same bits, with no network, clock, file or randomness. The data path
//! reads top down: a [`Setup`] names a model, its constants, its observer and its effects; [`Setup::build`] makes a
//! [`Forward`]; a [`Forward`] turns a [`Job`] into a [`Prediction`].
//!
//! Next file to read: [`job`], then [`model`], then [`simulator`].

mod binding;
pub mod blocks;
mod bounds;
mod build;
pub mod catalogue;
pub mod effect;
pub mod equations;
mod exponential;
pub mod external;
pub mod failure;
mod inputs;
pub mod integrate;
pub mod job;
pub mod layout;
pub mod limits;
pub mod memory;
pub mod model;
pub mod native;
mod nearest;
pub mod observer;
mod past;
pub mod prestress;
pub mod segment;
pub mod setup;
pub mod setup_error;
pub mod simulator;
pub mod solver;
pub mod spec;
pub mod spectrum;
pub mod surface;
pub mod units;

pub use blocks::Blocks;
pub use build::Factory;
pub use effect::{Addition, Effect, EffectDef, EffectParameter, EffectState};
pub use external::{External, Run, Solve, Solved};
pub use failure::{Failure, ModelFailure, ParticleError, Timeout};
pub use job::{Forward, Job, Prediction, Signal, Window};
pub use memory::Memory;
pub use model::Model;
pub use nearest::nearest;
pub use observer::Observer;
pub use segment::Drive;
pub use setup::{ModelDef, ObserverDef, Setup};
pub use setup_error::SetupError;
pub use simulator::Simulator;
pub use solver::{Description, FaultPlace, FilesDef, SOLVER, SolverDef, SolverFault};
pub use spec::{Quantity, Role, Spec};

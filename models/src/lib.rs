//! Forward models, observers and effects.
//!
//! Everything here is pure: the same [`Job`] gives the same bits, with no network, clock, file or randomness. The data path
//! reads top down: a [`Setup`] names a model, its constants, its observer and its effects; [`Setup::build`] makes a
//! [`Forward`]; a [`Forward`] turns a [`Job`] into a [`Prediction`].
//!
//! Next file to read: [`job`], then [`model`], then [`simulator`].

pub mod catalogue;
pub mod effect;
pub mod equations;
pub mod integrate;
pub mod job;
pub mod model;
pub mod native;
pub mod observer;
pub mod setup;
pub mod simulator;
pub mod spec;

pub use effect::Effect;
pub use job::{Forward, Job, ParticleError, Prediction, Signal, Window};
pub use model::{Drive, Model};
pub use observer::Observer;
pub use setup::{ModelDef, ObserverDef, Setup, SetupError};
pub use spec::{Quantity, Role, Spec};

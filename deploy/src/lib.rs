//! Workers of a study under the engines that start and supervise processes: what is written for them, submitted, asked and cancelled.
//!
//! An engine is a file that implements [`Engine`] and a line in [`ENGINES`]; it runs the programs of the engine and nothing else.
//! Deliberately absent: reading a study, a connection to a worker, a clock. Next files to read: [`Order`], then [`Engine`], then
//! [`Slurm`].

mod deployment;
mod engine;
mod error;
mod hosts;
mod kubernetes;
mod logs;
mod order;
mod program;
mod script;
mod slurm;
mod task;

pub use deployment::{Deployment, FILE};
pub use engine::{ENGINES, Engine, engine};
pub use error::DeployError;
pub use hosts::Hosts;
pub use kubernetes::{KubernetesOrder, PORT};
pub use order::Order;
pub use slurm::Slurm;
pub use task::{Role, State, Task};

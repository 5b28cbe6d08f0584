//! Workers of a study under the engines that start and supervise processes: what is written for them, submitted, asked and cancelled.
//!
//! An engine is a file that implements [`Engine`] and a line in [`ENGINES`]; it runs the programs of the engine and nothing else.
//! Deliberately absent: reading a study, a connection to a worker, a clock. Next files to read: [`Order`], then [`Engine`], then
//! [`Slurm`]; [`elastic`] for a number of workers that follows the work.

mod deployment;
pub mod elastic;
mod engine;
mod error;
mod hosts;
mod kubernetes;
mod logs;
mod options;
mod order;
mod pbs;
mod program;
mod script;
mod slurm;
mod task;
pub mod work;

pub use deployment::{Deployment, FILE};
pub use engine::{ENGINES, Engine, engine};
pub use error::DeployError;
pub use hosts::Hosts;
pub use kubernetes::{KubernetesOrder, PORT};
pub use order::Order;
pub use pbs::Pbs;
pub use slurm::Slurm;
pub use task::{Role, State, Task};

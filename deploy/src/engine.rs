//! What every engine can be asked, and the list of all engines.

use std::path::Path;

use crate::deployment::Deployment;
use crate::error::DeployError;
use crate::hosts::Hosts;
use crate::order::Order;
use crate::pbs::Pbs;
use crate::slurm::Slurm;
use crate::task::Task;

/// An engine that starts and supervises processes.
pub trait Engine: Sync {
    /// Its name on the command line and in `deployment.json`.
    fn name(&self) -> &'static str;

    /// The files of a deployment in `folder`, name and text of each.
    ///
    /// # Errors
    /// When an option for the engine is one that a deployment sets itself.
    fn files(&self, order: &Order, folder: &Path) -> Result<Vec<(String, String)>, DeployError>;

    /// The commands that submit these files, in order, for a shell.
    fn commands(&self, deployment: &Deployment) -> Vec<Vec<String>>;

    /// Submits the files; where one is refused, nothing of them is left in the queue.
    ///
    /// # Errors
    /// When a program of the engine is missing, refuses or gives no answer.
    fn submit(&self, deployment: &Deployment) -> Result<(), DeployError>;

    /// Every process of a deployment: the coordinator where it is a job, then the workers by number.
    ///
    /// # Errors
    /// When the engine gives no answer.
    fn tasks(&self, deployment: &Deployment) -> Result<Vec<Task>, DeployError>;

    /// Has the engine end all processes of a deployment, and does not wait for that.
    ///
    /// # Errors
    /// When the engine gives no answer.
    fn cancel(&self, deployment: &Deployment) -> Result<(), DeployError>;

    /// Submits the workers with these numbers, of which none is live.
    ///
    /// # Errors
    /// When the engine cannot do that, refuses or gives no answer.
    fn add(&self, _deployment: &Deployment, _workers: &[usize]) -> Result<(), DeployError> {
        Err(DeployError::NotElastic(self.name()))
    }

    /// Has the engine end these processes, and does not wait for that.
    ///
    /// # Errors
    /// When the engine cannot do that, refuses or gives no answer.
    fn end(&self, _tasks: &[&Task]) -> Result<(), DeployError> {
        Err(DeployError::NotElastic(self.name()))
    }

    /// Has the engine start a process at once that it holds back only because it was started before; whether it was such a one.
    ///
    /// # Errors
    /// When the engine gives no answer, or refuses.
    fn release(&self, _task: &Task) -> Result<bool, DeployError> {
        Ok(false)
    }
}

/// All engines.
pub const ENGINES: &[&dyn Engine] = &[&Slurm, &Pbs, &Hosts];

/// The engine of a name.
pub fn engine(name: &str) -> Option<&'static dyn Engine> {
    ENGINES.iter().find(|engine| engine.name() == name).copied()
}

//! `starlings deploy remove`: cancels everything of a deployment and waits until nothing is left.

use std::path::PathBuf;
use std::thread::sleep;
use std::time::{Duration, Instant};

use clap::Parser;
use starlings_deploy::{Deployment, State, Task};

use super::failed;
use crate::console::{line, note};
use crate::failure::Failure;

/// How often it is looked whether something is left.
const TICK: Duration = Duration::from_millis(500);

/// Cancel everything of a deployment and wait until nothing is left. Its folder stays, with scripts and logs.
#[derive(Parser)]
pub(crate) struct Args {
    /// Folder of the deployment.
    folder: PathBuf,
    /// Seconds to wait for the end of what was cancelled.
    #[arg(long, default_value_t = 120, value_name = "SECONDS")]
    within: u64,
}

/// Removes a deployment.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let deployment = Deployment::read(&args.folder).map_err(failed)?;
    remove(&deployment, Duration::from_secs(args.within))
}

/// Cancels and waits.
pub(super) fn remove(deployment: &Deployment, within: Duration) -> Result<(), Failure> {
    let started = Instant::now();
    deployment.note_removed().map_err(failed)?;
    // Before any look, which may hang: a task may be on its way too.
    let cancelled = deployment.engine().cancel(deployment);
    let mut left = left(deployment)?;
    if let Err(error) = cancelled {
        if !left.iter().any(|task| task.state == State::Unreached) {
            return Err(failed(error));
        }
        note(format_args!("warning: {error}"));
    }
    while left.iter().any(|task| task.state.is_live()) && started.elapsed() < within {
        sleep(TICK);
        left = self::left(deployment)?;
    }
    if left.is_empty() {
        return line(format_args!("{} is cancelled, nothing is left", deployment.order.name));
    }
    let names: Vec<String> = left.iter().map(told).collect();
    Err(Failure::run(format!(
        "{} is cancelled, but there is left after {} s: {}; try again, or ask the administrator of {}",
        deployment.order.name,
        started.elapsed().as_secs(),
        names.join(", "),
        deployment.engine().name()
    )))
}

/// What is live, and what may be.
fn left(deployment: &Deployment) -> Result<Vec<Task>, Failure> {
    let tasks = deployment.tasks().map_err(failed)?;
    Ok(tasks.into_iter().filter(|task| task.state.is_live() || task.state == State::Unreached).collect())
}

fn told(task: &Task) -> String {
    let node = task.node.as_ref().map(|node| format!(" on {node}")).unwrap_or_default();
    format!("{} ({}, {}{node})", task.role, task.id, task.state.word())
}

//! Submitting a deployment, and looking whether it dies at once.

use std::path::PathBuf;
use std::thread::sleep;
use std::time::{Duration, Instant};

use clap::{Args, ValueEnum};
use starlings_deploy::{Deployment, Engine, Order, Slurm, State};

use super::failed;
use super::order::OrderArgs;
use super::status::last_words;
use crate::console::line;
use crate::failure::Failure;

/// How long it is looked whether what was submitted dies at once.
const LOOKED_AT: Duration = Duration::from_secs(3);

/// How often in that time.
const TICK: Duration = Duration::from_millis(250);

/// Where the coordinator runs.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Coordinator {
    /// Started by hand, on this machine or another one.
    Here,
    /// A job of its own, whose run folder stands in the folder of the deployment; it goes on where it was when it is started again.
    Job,
}

/// Submit an array of workers to Slurm.
#[derive(Args)]
pub(crate) struct SlurmArgs {
    #[command(flatten)]
    order: OrderArgs,
    /// Where the coordinator runs.
    #[arg(long, value_name = "WHERE", default_value = "here")]
    coordinator: Coordinator,
    /// Options for sbatch, such as -p PARTITION --time=2:00:00 -c 4.
    #[arg(last = true, value_name = "SBATCH OPTIONS")]
    options: Vec<String>,
}

/// Deploys under Slurm.
pub(crate) fn slurm(args: &SlurmArgs) -> Result<(), Failure> {
    let made = args.order.order(args.coordinator == Coordinator::Job, &args.options)?;
    submit(&Slurm, made, args.order.dry_run)
}

/// Writes a deployment, submits it and says what comes next.
fn submit(engine: &'static dyn Engine, made: (Order, PathBuf), dry_run: bool) -> Result<(), Failure> {
    let (order, folder) = made;
    let deployment = Deployment::write(engine, order, &folder).map_err(failed)?;
    let shown = folder.display();
    if dry_run {
        line(format_args!("{shown} is written, nothing is submitted; without --dry-run follows"))?;
        return engine
            .commands(&deployment)
            .iter()
            .try_for_each(|command| line(format_args!("  {}", in_shell(command))));
    }
    engine.submit(&deployment).map_err(failed)?;
    look(&deployment)?;
    told(&deployment)
}

fn in_shell(command: &[String]) -> String {
    shell_words::join(command)
}

/// What comes next.
fn told(deployment: &Deployment) -> Result<(), Failure> {
    let order = &deployment.order;
    let tasks = deployment.tasks().map_err(failed)?;
    let running = tasks.iter().filter(|task| task.state == State::Running).count();
    line(format_args!("submitted {} as {}: {running} of {} run", plural(order), order.name, tasks.len()))?;
    let waits = tasks.iter().find(|task| task.state == State::Waiting);
    if let Some(says) = waits.and_then(|task| task.says.as_deref()) {
        line(format_args!("the others wait: {says}"))?;
    }
    let folder = shell_words::quote(&deployment.folder.to_string_lossy()).into_owned();
    match &order.run_folder {
        Some(run) => line(format_args!("result:  {}", run.display()))?,
        None => line(format_args!("next:    {}", order.coordinator_command()))?,
    }
    line(format_args!("status:  starlings deploy status {folder}"))?;
    line(format_args!("keep:    starlings deploy watch {folder}"))?;
    line(format_args!("remove:  starlings deploy remove {folder}"))
}

fn plural(order: &Order) -> String {
    let workers = format!("{} worker{}", order.workers, if order.workers == 1 { "" } else { "s" });
    if order.run_folder.is_some() { format!("a coordinator and {workers}") } else { workers }
}

/// Waits a moment and refuses what died in it: where a script or a node is wrong, all tasks do.
fn look(deployment: &Deployment) -> Result<(), Failure> {
    let started = Instant::now();
    while started.elapsed() < LOOKED_AT {
        sleep(TICK);
        let tasks = deployment.tasks().map_err(failed)?;
        let n_failed = tasks.iter().filter(|task| task.state == State::Failed).count();
        if n_failed == 0 || tasks.iter().any(|task| task.state.is_live()) {
            continue;
        }
        let words = last_words(deployment, &tasks);
        // What is left of it would be started for nothing.
        let _ = deployment.engine().cancel(deployment);
        let says = tasks.iter().find_map(|task| task.says.clone()).unwrap_or_default();
        return Err(Failure::input(format!(
            "all {} tasks died at once ({says}); nothing is left in the queue. Their last lines:\n{words}",
            tasks.len()
        )));
    }
    Ok(())
}

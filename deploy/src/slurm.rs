//! Slurm: an array of workers, and the coordinator as a job of its own where that is asked for.
//!
//! Jobs are known by the name of the deployment, which stands in its folder before anything is submitted: what was submitted is found
//! whenever this program ended. Next files to read: [`queue`], [`reasons`].

mod queue;
mod reasons;

use std::path::Path;

use serde_json::json;

use crate::deployment::Deployment;
use crate::engine::Engine;
use crate::error::DeployError;
use crate::logs;
use crate::options::{Own, Syntax};
use crate::order::Order;
use crate::program::Programs;
use crate::script::{script, text, worker_script};
use crate::task::{Role, State, Task};

/// Slurm 20.11 or later.
pub struct Slurm;

const PROGRAMS: Programs = Programs {
    engine: "Slurm",
    remedy: "deploy from a login node of the cluster, or use `starlings deploy hosts` for machines without an engine",
    // Times as seconds since 1970.
    environment: &[("SLURM_TIME_FORMAT", "%s")],
    withheld: &["SBATCH_", "SQUEUE_", "SCANCEL_"],
};

/// Options of sbatch(1), Slurm 22.05 to 25.05.
const SYNTAX: Syntax = Syntax {
    program: "sbatch",
    own: &[
        own_option("array", Some('a'), "the number of tasks is that of --workers"),
        own_option("job-name", Some('J'), "the jobs of a deployment are found by their name"),
        own_option("output", Some('o'), "the logs stand in the folder of the deployment"),
        own_option("error", Some('e'), "the logs stand in the folder of the deployment"),
        own_option("wrap", None, "the script of the deployment is submitted"),
        own_option("wait", Some('W'), "`starlings deploy watch` waits"),
        own_option("test-only", None, "use --dry-run"),
    ],
    flags: "hHIkOQsuvV",
    long_flags: &[
        "contiguous",
        "exclusive",
        "get-user-env",
        "help",
        "hold",
        "ignore-pbs",
        "immediate",
        "kill-on-invalid-dep",
        "nice",
        "no-kill",
        "no-requeue",
        "overcommit",
        "oversubscribe",
        "parsable",
        "propagate",
        "quiet",
        "reboot",
        "requeue",
        "share",
        "spread-job",
        "test-only",
        "usage",
        "use-min-nodes",
        "verbose",
        "version",
    ],
};

const fn own_option(long: &'static str, letter: Option<char>, reason: &'static str) -> Own {
    Own { long, letter, reason }
}

const WORKER: &str = "worker.sbatch";
/// The cores that a task was given, for a shell.
const CORES: &str = "${SLURM_CPUS_PER_TASK:-${SLURM_CPUS_ON_NODE:-1}}";

const COORDINATOR: &str = "coordinator.sbatch";

impl Engine for Slurm {
    fn name(&self) -> &'static str {
        "slurm"
    }

    fn files(&self, order: &Order, folder: &Path) -> Result<Vec<(String, String)>, DeployError> {
        SYNTAX.check(&order.options)?;
        let own = [
            ("array", json!(indices(&order.first()))),
            ("cores", json!(order.slots.unwrap_or(1))),
            ("log", json!(log(folder, "worker-%a.log"))),
            ("processes", json!(text(&folder.join(logs::FOLDER)))),
        ];
        let mut files = vec![(WORKER.to_owned(), worker_script(WORKER, order, CORES, own)?)];
        if let Some(run_folder) = &order.run_folder {
            let values = json!({
                "name": order.coordinator_name(),
                "workers": order.name,
                "log": log(folder, &Role::Coordinator.log()),
                "program": text(&order.program),
                "access": text(&order.access),
                "study": text(&order.study),
                "run_folder": text(run_folder),
            });
            files.push((COORDINATOR.to_owned(), script(COORDINATOR, values)?));
        }
        Ok(files)
    }

    fn commands(&self, deployment: &Deployment) -> Vec<Vec<String>> {
        let order = &deployment.order;
        // The workers wait for what the coordinator writes, so it is the first in the queue.
        let coordinator = order.run_folder.as_ref().map(|_| COORDINATOR);
        let first = order.first();
        let workers = Some(WORKER).filter(|_| !first.is_empty());
        coordinator.into_iter().chain(workers).map(|script| submission(deployment, script, &first)).collect()
    }

    fn submit(&self, deployment: &Deployment) -> Result<(), DeployError> {
        deployment.submit(&PROGRAMS, &self.commands(deployment))
    }

    fn tasks(&self, deployment: &Deployment) -> Result<Vec<Task>, DeployError> {
        let (order, roles) = (&deployment.order, deployment.roles());
        let answer = PROGRAMS.run(&queue::command(order), "")?.answer()?;
        Ok(queue::tasks(&answer, order, &roles))
    }

    fn cancel(&self, deployment: &Deployment) -> Result<(), DeployError> {
        // The coordinator first: the workers of one that goes on are missed.
        let names = [deployment.order.coordinator_name(), deployment.order.name.clone()];
        let cancelled = names.map(|name| {
            PROGRAMS.run(&["scancel".to_owned(), user(), format!("--name={name}")], "")?.answer().map(drop)
        });
        cancelled.into_iter().collect()
    }

    fn add(&self, deployment: &Deployment, workers: &[usize]) -> Result<(), DeployError> {
        let said = PROGRAMS.run(&submission(deployment, WORKER, workers), "")?;
        if said.is_well { Ok(()) } else { Err(said.refused()) }
    }

    fn end(&self, tasks: &[&Task]) -> Result<(), DeployError> {
        let ids = tasks.iter().map(|task| task.id.clone());
        let command: Vec<String> = ["scancel".to_owned(), user()].into_iter().chain(ids).collect();
        PROGRAMS.run(&command, "")?.answer().map(drop)
    }

    fn release(&self, task: &Task) -> Result<bool, DeployError> {
        let is_held_back =
            task.state == State::Waiting && task.restarts > 0 && task.reason.as_deref() == Some("BeginTime");
        if is_held_back {
            let update = ["scontrol", "update", &format!("JobId={}", task.id), "StartTime=now"];
            PROGRAMS.run(&update.map(str::to_owned), "")?.answer()?;
        }
        Ok(is_held_back)
    }
}

/// Nobody else's jobs, whatever their name, also where this user may end them.
fn user() -> String {
    format!("--user={}", rustix::process::geteuid().as_raw())
}

/// The pattern of a log for Slurm, in which only that of `name` is one, inside double quotes.
fn log(folder: &Path, name: &str) -> String {
    pattern(folder, name).replace('"', "\\\"")
}

/// The same as a word of its own.
fn pattern(folder: &Path, name: &str) -> String {
    format!("{}/{name}", text(&folder.join(logs::FOLDER)).replace('%', "%%"))
}

/// The command that submits a script, for workers with these numbers.
fn submission(deployment: &Deployment, script: &str, workers: &[usize]) -> Vec<String> {
    let head = ["sbatch", "--parsable"].map(str::to_owned);
    // After the options of the user: of an option that is given twice the last holds.
    let own = own(deployment, script, workers);
    let options = deployment.order.options.iter().cloned();
    head.into_iter().chain(options).chain(own).chain([text(&deployment.folder.join(script))]).collect()
}

/// Numbers in the form of `sbatch --array`, such as `0-3,7`.
fn indices(workers: &[usize]) -> String {
    let ranges = workers.chunk_by(|one, next| one + 1 == *next);
    let range = |range: &[usize]| match range {
        [first, .., last] => format!("{first}-{last}"),
        _ => range.iter().map(ToString::to_string).collect(),
    };
    ranges.map(range).collect::<Vec<_>>().join(",")
}

/// What a deployment sets itself for a script.
fn own(deployment: &Deployment, script: &str, workers: &[usize]) -> Vec<String> {
    let (order, folder) = (&deployment.order, &deployment.folder);
    if script == COORDINATOR {
        let name = format!("--job-name={}", order.coordinator_name());
        return vec![name, format!("--output={}", pattern(folder, &Role::Coordinator.log()))];
    }
    vec![
        format!("--job-name={}", order.name),
        format!("--array={}", indices(workers)),
        format!("--output={}", pattern(folder, "worker-%a.log")),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_as_ranges() {
        let written = [&[][..], &[0], &[0, 1, 2], &[0, 2, 3, 7]].map(indices);
        assert_eq!(written, ["", "0", "0-2", "0,2-3,7"]);
    }
}

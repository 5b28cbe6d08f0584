//! PBS: an array job of workers, by the documented forms of qsub(1B), qselect(1B), qstat(1B) and qdel(1B) of OpenPBS.
//!
//! Jobs are known by the name of the deployment, as under Slurm. Next file to read: [`status`].

mod status;

use std::path::Path;

use serde_json::json;

use crate::deployment::Deployment;
use crate::engine::Engine;
use crate::error::DeployError;
use crate::logs;
use crate::options::{Own, Syntax};
use crate::order::Order;
use crate::program::Programs;
use crate::script::{text, worker_script};
use crate::task::Task;

/// OpenPBS or PBS Professional, 19 or later.
pub struct Pbs;

const PROGRAMS: Programs = Programs {
    engine: "PBS",
    remedy: "deploy from a login node of the cluster, or use `starlings deploy hosts` for machines without an engine",
    environment: &[],
    withheld: &[],
};

/// Options of qsub(1B).
const SYNTAX: Syntax = Syntax {
    program: "qsub",
    own: &[
        own_option('N', "the jobs of a deployment are found by their name"),
        own_option('J', "the number of tasks is that of --workers"),
        own_option('o', "the logs stand in the folder of the deployment"),
        own_option('e', "the logs stand in the folder of the deployment"),
        own_option('j', "the logs stand in the folder of the deployment"),
        own_option('k', "the logs stand in the folder of the deployment"),
        own_option('S', "the script of the deployment has its shell"),
        own_option('C', "the script of the deployment has its directives"),
        own_option('I', "a worker is no interactive job"),
        own_option('X', "a worker is no interactive job"),
        own_option('G', "a worker is no interactive job"),
        own_option('z', "the number of the job is told"),
    ],
    flags: "fhV",
    long_flags: &["version"],
};

const fn own_option(letter: char, reason: &'static str) -> Own {
    Own { long: "", letter: Some(letter), reason }
}

const WORKER: &str = "worker.pbs";

impl Engine for Pbs {
    fn name(&self) -> &'static str {
        "pbs"
    }

    fn files(&self, order: &Order, folder: &Path) -> Result<Vec<(String, String)>, DeployError> {
        SYNTAX.check(&order.options)?;
        let own = [
            ("workers", json!(order.workers)),
            ("cores", json!(order.slots.unwrap_or(1))),
            ("logs", json!(text(&folder.join(logs::FOLDER)))),
        ];
        Ok(vec![(WORKER.to_owned(), worker_script(WORKER, order, "${NCPUS:-1}", own)?)])
    }

    fn commands(&self, deployment: &Deployment) -> Vec<Vec<String>> {
        let order = &deployment.order;
        let own = ["-N", &order.name, "-j", "oe", "-o", "/dev/null"].map(str::to_owned);
        // An array has two tasks at least.
        let range = (order.workers > 1).then(|| ["-J".to_owned(), format!("0-{}", order.workers - 1)]);
        let script = text(&deployment.folder.join(WORKER));
        let head = std::iter::once("qsub".to_owned()).chain(order.options.iter().cloned());
        vec![head.chain(own).chain(range.into_iter().flatten()).chain([script]).collect()]
    }

    fn submit(&self, deployment: &Deployment) -> Result<(), DeployError> {
        deployment.submit(&PROGRAMS, &self.commands(deployment))
    }

    fn tasks(&self, deployment: &Deployment) -> Result<Vec<Task>, DeployError> {
        let roles = deployment.roles();
        // Also those that ended, where the server keeps them.
        let jobs = jobs(&deployment.order, &["-x"])?;
        if jobs.is_empty() {
            return Ok(roles.into_iter().map(Task::unknown).collect());
        }
        let head = ["qstat", "-x", "-t", "-f", "-F", "json"].map(str::to_owned);
        let command: Vec<String> = head.into_iter().chain(jobs).collect();
        let answer = PROGRAMS.run(&command, "")?.answer()?;
        status::tasks(&answer, &roles).map_err(|error| DeployError::Failed {
            program: "qstat".to_owned(),
            said: format!("its answer is no JSON that is understood: {error}"),
            command: shell_words::join(command),
        })
    }

    fn cancel(&self, deployment: &Deployment) -> Result<(), DeployError> {
        let jobs = jobs(&deployment.order, &[])?;
        if jobs.is_empty() {
            return Ok(());
        }
        let command: Vec<String> = std::iter::once("qdel".to_owned()).chain(jobs).collect();
        PROGRAMS.run(&command, "")?.answer().map(drop)
    }
}

/// Numbers of the jobs of a deployment: an array is one.
fn jobs(order: &Order, options: &[&str]) -> Result<Vec<String>, DeployError> {
    let own = ["-N", &order.name];
    let command = ["qselect"].iter().chain(options).chain(&own).map(|word| (*word).to_owned());
    let answer = PROGRAMS.run(&command.collect::<Vec<_>>(), "")?.answer()?;
    Ok(answer.split_whitespace().map(str::to_owned).collect())
}

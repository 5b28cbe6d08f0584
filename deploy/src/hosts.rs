//! A plain list of machines that `ssh` reaches, for those who have no engine: workers are started, asked and ended by a shell on each.
//!
//! Nothing starts them again. On each machine a deployment has a folder `.starlings/NAME` in the home folder, with a script, a log and the
//! number of the process of each worker there.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::thread;

use serde_json::json;

use crate::deployment::Deployment;
use crate::engine::Engine;
use crate::error::DeployError;
use crate::logs;
use crate::order::Order;
use crate::program::{Programs, Said};
use crate::script::{script, worker_script};
use crate::task::{Role, State, Task};

/// Machines that ssh reaches.
pub struct Hosts;

const PROGRAMS: Programs = Programs {
    engine: "the engine `hosts`",
    remedy: "install it, or name another with --ssh",
    environment: &[],
    withheld: &[],
};

/// Worker after worker on the next host; all of a host by its name.
fn places(order: &Order) -> BTreeMap<&str, Vec<usize>> {
    let mut places: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for (i, host) in (0..order.workers).zip(order.hosts.iter().cycle()) {
        places.entry(host).or_default().push(i);
    }
    places
}

/// Runs a script on a host.
fn on_host(order: &Order, host: &str, script: &str) -> Result<Said, DeployError> {
    let shell = [host, "sh", "-s"].map(str::to_owned);
    let command: Vec<String> = order.ssh.iter().cloned().chain(shell).collect();
    PROGRAMS.run(&command, script)
}

/// Asks every host at the same time, and tells in the order of their names.
fn on_all<'a>(
    order: &'a Order,
    script: impl Fn(&[usize]) -> Result<String, DeployError> + Sync,
) -> Vec<(&'a str, Vec<usize>, Result<Said, DeployError>)> {
    let places = places(order);
    let script = &script;
    thread::scope(|scope| {
        let ask = |(host, indices): (&'a str, Vec<usize>)| {
            let asked = scope.spawn({
                let indices = indices.clone();
                move || on_host(order, host, &script(&indices)?)
            });
            (host, indices, asked)
        };
        let all: Vec<_> = places.into_iter().map(ask).collect();
        let answer = |asked: thread::ScopedJoinHandle<'_, _>| {
            asked.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        };
        all.into_iter().map(|(host, indices, asked)| (host, indices, answer(asked))).collect()
    })
}

impl Engine for Hosts {
    fn name(&self) -> &'static str {
        "hosts"
    }

    fn files(&self, order: &Order, _folder: &Path) -> Result<Vec<(String, String)>, DeployError> {
        // Without the secrets: to read, not to run.
        Ok(vec![("start.sh".to_owned(), start(order, &[0], None)?)])
    }

    fn commands(&self, deployment: &Deployment) -> Vec<Vec<String>> {
        let order = &deployment.order;
        let command = |host: &&str| {
            order.ssh.iter().cloned().chain([(*host).to_owned(), "sh".to_owned(), "-s".to_owned()]).collect()
        };
        places(order).keys().map(command).collect()
    }

    fn submit(&self, deployment: &Deployment) -> Result<(), DeployError> {
        let order = &deployment.order;
        let access = order.copies_access.then(|| fs::read_to_string(&order.access)).transpose();
        let access =
            access.map_err(|source| DeployError::Unreadable { path: order.access.clone(), source })?;
        let started = on_all(order, |indices| start(order, indices, access.as_deref()));
        for (_, _, said) in started {
            let refused = match said {
                Ok(said) if said.is_well => continue,
                Ok(said) => said.refused(),
                Err(error) => error,
            };
            return Err(deployment.given_up(refused));
        }
        Ok(())
    }

    fn tasks(&self, deployment: &Deployment) -> Result<Vec<Task>, DeployError> {
        let order = &deployment.order;
        let mut tasks = Vec::new();
        for (host, indices, said) in on_all(order, |indices| ask(order, indices, false)) {
            tasks.extend(of_host(deployment, host, &indices, said)?);
        }
        tasks.sort_by_key(|task| task.role);
        Ok(tasks)
    }

    fn cancel(&self, deployment: &Deployment) -> Result<(), DeployError> {
        let order = &deployment.order;
        // All have been asked before the first that failed is told.
        let asked = on_all(order, |indices| ask(order, indices, true));
        asked.into_iter().try_for_each(|(_, _, said)| said?.answer().map(drop))
    }
}

fn start(order: &Order, indices: &[usize], access: Option<&str>) -> Result<String, DeployError> {
    // A copy of the access file is found without its path.
    let own = [
        ("indices", json!(indices)),
        ("access_text", json!(access.map(str::trim_end))),
        ("is_copied", json!(order.copies_access)),
        ("keeps_code", json!(true)),
    ];
    worker_script("hosts-start.sh", order, "$(nproc)", own)
}

fn ask(order: &Order, indices: &[usize], cancels: bool) -> Result<String, DeployError> {
    script("hosts-ask.sh", json!({ "name": order.name, "indices": indices, "cancels": cancels }))
}

/// The workers of a host by what came of asking it; a host that does not answer is no error for the others.
fn of_host(
    deployment: &Deployment,
    host: &str,
    indices: &[usize],
    said: Result<Said, DeployError>,
) -> Result<Vec<Task>, DeployError> {
    let words = match said {
        Ok(said) if said.is_well => return Ok(told(deployment, host, indices, &said.stdout)),
        Ok(said) => said.words(),
        Err(error @ DeployError::NoAnswer { .. }) => error.to_string(),
        Err(error) => return Err(error),
    };
    Ok(indices.iter().map(|i| unreached(host, *i, &words)).collect())
}

/// A worker on a host that does not answer: it may well run.
fn unreached(host: &str, i: usize, words: &str) -> Task {
    let says = Some(format!("{host} is not reached: {words}"));
    Task { state: State::Unreached, node: Some(host.to_owned()), says, ..Task::unknown(Role::Worker(i)) }
}

/// What the script says of the workers of a host; the ends of their logs are kept in the folder of the deployment.
fn told(deployment: &Deployment, host: &str, indices: &[usize], answer: &str) -> Vec<Task> {
    let mut tasks: Vec<Task> = Vec::new();
    let mut log = String::new();
    for line in answer.lines() {
        if let Some(words) = line.strip_prefix("log ") {
            log += words;
            log += "\n";
            if let Some(task) = tasks.last() {
                // A log that cannot be kept is not shown.
                let _ = fs::write(deployment.folder.join(logs::FOLDER).join(task.role.log()), &log);
            }
        } else if let Some(task) = line.strip_prefix("starlings ").and_then(|rest| task(host, rest)) {
            log.clear();
            tasks.push(task);
        }
    }
    let is_told = |i: &&usize| !tasks.iter().any(|task| task.role == Role::Worker(**i));
    let silent: Vec<Task> =
        indices.iter().filter(is_told).map(|i| unreached(host, *i, "its shell says nothing")).collect();
    tasks.into_iter().chain(silent).collect()
}

/// A line of the script: number, state, time, exit code.
fn task(host: &str, line: &str) -> Option<Task> {
    let [i, word, since, code] = line.split_whitespace().collect::<Vec<_>>()[..] else { return None };
    let role = Role::Worker(i.parse().ok()?);
    let node = Some(host.to_owned());
    let (state, says) = match (word, code) {
        ("running", _) => (State::Running, None),
        ("ended", "0") => (State::Done, None),
        ("ended", code) => (State::Failed, Some(format!("ended with exit code {code}"))),
        _ => return Some(Task { node, ..Task::unknown(role) }),
    };
    let id = format!("{host}:{i}");
    Some(Task { role, id, state, since: since.parse().ok(), node, reason: None, says, restarts: 0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_host_that_hangs_leaves_its_own_workers_unreached_and_is_no_error() {
        let order: Order = serde_json::from_value(json!({
            "name": "starlings-a-1", "study": "/s.toml", "is_solver": false, "program": "/p", "workers": 2,
            "access": "/a.json", "idle": "10m", "hosts": ["a", "b"],
        }))
        .unwrap();
        let folder = tempfile::tempdir().unwrap();
        let deployment = Deployment::write(&Hosts, order, folder.path()).unwrap();
        let hangs =
            DeployError::NoAnswer { program: "ssh".to_owned(), seconds: 120, command: "ssh b".to_owned() };
        let tasks = of_host(&deployment, "b", &[1], Err(hangs)).unwrap();
        assert_eq!((tasks.len(), tasks[0].role, tasks[0].state), (1, Role::Worker(1), State::Unreached));
        assert!(tasks[0].says.as_deref().unwrap().contains("b is not reached"), "{tasks:?}");
    }
}

//! What qstat says of a deployment in its form `-f -F json`.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde_json::Value;

use crate::task::{Role, State, Task};

/// The answer.
#[derive(Deserialize)]
struct Answer {
    /// When it was given, seconds since 1970.
    #[serde(default)]
    timestamp: i64,
    /// Jobs, arrays and their tasks by their numbers.
    #[serde(default, rename = "Jobs")]
    jobs: BTreeMap<String, Job>,
}

/// Attributes of pbs_job_attributes(7B).
#[derive(Deserialize)]
struct Job {
    #[serde(default, rename = "job_state")]
    state: String,
    #[serde(default)]
    exec_host: Option<String>,
    #[serde(default)]
    comment: Option<String>,
    #[serde(default, rename = "Exit_status")]
    exit_status: Option<i64>,
    #[serde(default)]
    eligible_time: Option<String>,
    #[serde(default)]
    resources_used: BTreeMap<String, Value>,
    /// Starts so far.
    #[serde(default)]
    run_count: Option<u32>,
}

/// An exit status above this is a signal.
const SIGNALS: i64 = 256;

/// The signal by which qdel and the time limit end a job.
const SIGTERM: i64 = 15;

/// The tasks of an answer in the order of `roles`; one that it lacks is unknown.
pub(super) fn tasks(answer: &str, roles: &[Role]) -> Result<Vec<Task>, serde_json::Error> {
    let answer: Answer = serde_json::from_str(answer)?;
    let of_role = |role: &Role| {
        let is_it = |id: &&String| index(id).is_some_and(|i| *role == Role::Worker(i));
        let found = answer.jobs.keys().find(is_it);
        found.map_or_else(|| Task::unknown(*role), |id| answer.jobs[id].task(*role, id, answer.timestamp))
    };
    Ok(roles.iter().map(of_role).collect())
}

/// The number of a task of an array, `17[3].server`; zero for a job that is none; nothing for a whole array, `17[].server`.
fn index(id: &str) -> Option<usize> {
    match id.split_once('[') {
        None => Some(0),
        Some((_, rest)) => rest.split(']').next()?.parse().ok(),
    }
}

impl Job {
    fn task(&self, role: Role, id: &str, now: i64) -> Task {
        let state = self.state();
        let since = match state {
            State::Waiting => self.eligible_time.as_deref().and_then(seconds),
            State::Running => self.resources_used.get("walltime").and_then(Value::as_str).and_then(seconds),
            _ => None,
        };
        let comment = self.comment.as_deref().map(str::trim).filter(|comment| !comment.is_empty());
        let ended = match self.exit_status {
            Some(code) if state == State::Failed && code >= SIGNALS => {
                Some(format!("ended by signal {}", code - SIGNALS))
            }
            Some(code) if state == State::Failed && code >= 0 => Some(format!("ended with exit code {code}")),
            // Below zero PBS itself could not start or keep it, and its comment says why.
            _ => None,
        };
        let node = self.exec_host.as_deref().and_then(|host| host.split(['/', '+']).next());
        Task {
            role,
            id: id.to_owned(),
            state,
            since: since.map(|since| now - since),
            node: node.filter(|node| !node.is_empty()).map(str::to_owned),
            reason: comment.map(str::to_owned),
            says: ended
                .or_else(|| comment.map(str::to_owned))
                .filter(|_| !matches!(state, State::Running | State::Done)),
            restarts: self.run_count.unwrap_or(0).saturating_sub(1),
        }
    }

    /// States of qstat(1B).
    fn state(&self) -> State {
        match (self.state.as_str(), self.exit_status) {
            ("Q" | "H" | "W" | "T" | "M", _) => State::Waiting,
            ("R" | "S" | "U" | "B", _) => State::Running,
            ("E", _) => State::Ending,
            ("F" | "X", Some(0)) => State::Done,
            // One that was deleted before it began has none.
            ("F" | "X", None) => State::Cancelled,
            ("F" | "X", Some(code)) if code == SIGNALS + SIGTERM => State::Cancelled,
            ("F" | "X", Some(_)) => State::Failed,
            _ => State::Unknown,
        }
    }
}

/// Seconds of a duration, `HH:MM:SS`.
fn seconds(text: &str) -> Option<i64> {
    text.split(':').try_fold(0, |sum, part| Some(60 * sum + part.parse::<i64>().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In the form of version 20, less what is not read.
    const ANSWER: &str = r#"{
    "timestamp":1000, "pbs_version":"20.0.1", "pbs_server":"head",
    "Jobs":{
        "17[].head":{ "Job_Name":"starlings-a-1", "job_state":"B", "array":"True" },
        "17[0].head":{ "job_state":"R", "exec_host":"n1/0*2", "resources_used":{ "cput":"00:00:01", "walltime":"00:02:05" }, "run_count":2 },
        "17[1].head":{ "job_state":"Q", "eligible_time":"01:00:00", "comment":"Not Running: Insufficient amount of resource: ncpus" },
        "17[2].head":{ "job_state":"X", "Exit_status":2, "exec_host":"n3/0" },
        "17[3].head":{ "job_state":"F", "Exit_status":271 },
        "17[4].head":{ "job_state":"X", "Exit_status":0 },
        "17[5].head":{ "job_state":"F", "Exit_status":-3, "comment":"job failed to start" },
        "17[6].head":{ "job_state":"F", "Exit_status":265 }
    }}"#;

    #[test]
    fn every_task_is_told_with_its_state_its_time_and_its_reason() {
        let roles: Vec<Role> = (0..8).map(Role::Worker).collect();
        let found = tasks(ANSWER, &roles).unwrap();
        let told: Vec<_> = found.iter().map(|t| (t.state, t.since, t.node.as_deref(), t.restarts)).collect();
        let expected = [
            (State::Running, Some(875), Some("n1"), 1),
            (State::Waiting, Some(-2600), None, 0),
            (State::Failed, None, Some("n3"), 0),
            (State::Cancelled, None, None, 0),
            (State::Done, None, None, 0),
            (State::Failed, None, None, 0),
            (State::Failed, None, None, 0),
            (State::Unknown, None, None, 0),
        ];
        assert_eq!(told, expected);
        assert!(found[1].says.as_deref().unwrap().contains("Insufficient amount of resource"));
        assert_eq!(found[2].says.as_deref(), Some("ended with exit code 2"));
        assert_eq!(found[5].says.as_deref(), Some("job failed to start"));
        assert_eq!(found[6].says.as_deref(), Some("ended by signal 9"));
        assert_eq!((found[0].says.as_deref(), found[1].id.as_str()), (None, "17[1].head"));
    }

    #[test]
    fn a_job_that_is_no_array_is_one_worker_and_an_empty_answer_knows_none() {
        let one = r#"{ "Jobs":{ "18.head":{ "job_state":"R", "exec_host":"n1/0" } } }"#;
        assert_eq!(tasks(one, &[Role::Worker(0)]).unwrap()[0].state, State::Running);
        assert_eq!(tasks("{}", &[Role::Worker(0)]).unwrap()[0].state, State::Unknown);
        assert!(tasks("qstat: busy", &[]).is_err());
    }
}

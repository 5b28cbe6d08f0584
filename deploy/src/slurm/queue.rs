//! What squeue says of a deployment.

use crate::order::Order;
use crate::task::{Role, State, Task};

use super::reasons::says;

/// Fields and their widths, an end of field after each.
const FIELDS: [(&str, usize); 11] = [
    ("JobArrayID", 64),
    ("ArrayTaskID", 24),
    ("State", 24),
    ("NodeList", 128),
    ("SubmitTime", 24),
    ("StartTime", 24),
    ("EndTime", 24),
    ("Reason", 96),
    ("RestartCnt", 12),
    ("exit_code", 12),
    ("Name", 160),
];

const END: char = '|';

/// Asks for all tasks of a deployment, a line each, also for those that ended while Slurm remembers them.
pub(super) fn command(order: &Order) -> Vec<String> {
    let fields: Vec<String> = FIELDS.iter().map(|(name, width)| format!("{name}:{width}{END}")).collect();
    let names = format!("--name={},{}", order.name, order.coordinator_name());
    let format = format!("--Format={}", fields.join(","));
    ["squeue", "--me", "--noheader", "--array", "--states=all", &names, &format].map(str::to_owned).into()
}

/// The tasks of an answer in the order of `roles`; one that it lacks is unknown.
pub(super) fn tasks(answer: &str, order: &Order, roles: &[Role]) -> Vec<Task> {
    let rows: Vec<Row<'_>> = answer.lines().filter_map(Row::of).collect();
    let of_role = |role: &Role| {
        let (name, index) = match role {
            Role::Coordinator => (order.coordinator_name(), None),
            Role::Worker(i) => (order.name.clone(), Some(i.to_string())),
        };
        let is_named = |row: &&Row<'_>| row.name() == name;
        let is_it = |row: &&Row<'_>| index.as_deref().is_none_or(|index| row.index() == index);
        // An array that was cancelled before any of it started is one row for all; of several arrays it tells nothing of the others.
        let is_whole = |row: &&Row<'_>| row.index() == "N/A" && order.elastic.is_none();
        let named = || rows.iter().filter(is_named);
        // A number that was given again is that of the live task, else of the last one.
        let found = named().filter(is_it).max_by_key(|row| row.age());
        let found = found.or_else(|| named().rfind(is_whole));
        found.map_or_else(|| Task::unknown(*role), |row| row.task(*role))
    };
    roles.iter().map(of_role).collect()
}

/// A line of the answer.
struct Row<'a>(Vec<&'a str>);

impl<'a> Row<'a> {
    fn of(line: &'a str) -> Option<Self> {
        let cells: Vec<&str> = line.split(END).map(str::trim).collect();
        (cells.len() > FIELDS.len() - 1).then_some(Self(cells))
    }

    fn index(&self) -> &'a str {
        self.0[1]
    }

    fn name(&self) -> &'a str {
        self.0[10]
    }

    /// Orders tasks of one number: whether it is live, when it was submitted, the number of its job.
    fn age(&self) -> (bool, i64, u64) {
        let job = self.0[0].split(['_', '+']).next().and_then(|job| job.parse().ok());
        (state(self.0[2]).is_live(), self.0[4].parse().unwrap_or(0), job.unwrap_or(0))
    }

    fn task(&self, role: Role) -> Task {
        let word = self.0[2];
        let state = state(word);
        let since = match state {
            State::Waiting => self.0[4],
            State::Running => self.0[5],
            _ => self.0[6],
        };
        let reason = Some(self.0[7]).filter(|reason| !["", "None", "(null)"].contains(reason));
        let ended = (state == State::Failed).then(|| ended(word, self.0[9]));
        // What an ended task waited for before is no reason.
        let of_reason = reason.filter(|_| state != State::Cancelled).map(says);
        Task {
            role,
            id: self.0[0].to_owned(),
            state,
            since: since.parse().ok(),
            node: Some(self.0[3]).filter(|node| !node.is_empty()).map(str::to_owned),
            reason: reason.map(str::to_owned),
            says: ended.or(of_reason).filter(|_| !matches!(state, State::Running | State::Done)),
            restarts: self.0[8].parse().unwrap_or(0),
        }
    }
}

/// States of squeue(1).
fn state(word: &str) -> State {
    match word {
        "PENDING" | "REQUEUED" | "REQUEUE_HOLD" | "SPECIAL_EXIT" | "REQUEUE_FED" | "RESV_DEL_HOLD" => {
            State::Waiting
        }
        "RUNNING" | "CONFIGURING" | "SUSPENDED" | "STOPPED" | "RESIZING" | "SIGNALING" | "STAGE_OUT" => {
            State::Running
        }
        "COMPLETING" => State::Ending,
        "COMPLETED" => State::Done,
        "CANCELLED" | "REVOKED" => State::Cancelled,
        // BOOT_FAIL, DEADLINE, FAILED, NODE_FAIL, OUT_OF_MEMORY, PREEMPTED, TIMEOUT.
        _ => State::Failed,
    }
}

/// How a task failed: the status of wait(2) holds the exit code in its upper byte.
fn ended(word: &str, status: &str) -> String {
    match word {
        "TIMEOUT" => "the time limit of the job was reached".to_owned(),
        "OUT_OF_MEMORY" => "it used more memory than the job was given".to_owned(),
        "NODE_FAIL" => "its node was lost".to_owned(),
        "PREEMPTED" => "it made room for a job of higher priority".to_owned(),
        _ => {
            let status: i64 = status.parse().unwrap_or(0);
            match (status >> 8, status & 0x7f) {
                (0, 0) => word.to_lowercase().replace('_', " "),
                (0, signal) => format!("ended by signal {signal}"),
                (code, _) => format!("ended with exit code {code}"),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn order(workers: usize) -> Order {
        serde_json::from_value(serde_json::json!({
            "name": "starlings-a-1", "study": "/s.toml", "is_solver": false, "program": "/p", "workers": workers,
            "access": "/a.json", "idle": "10m", "run_folder": "/r",
        }))
        .unwrap()
    }

    /// Lines as squeue 22.05 writes them, without the blanks between.
    const ANSWER: &str = "\
3|N/A|RUNNING|n2|100|110|NONE|None|0|0|starlings-a-1-coordinator|
4_0|0|RUNNING|n1|100|107|1826988007|None|0|0|starlings-a-1|
4_1|1|PENDING||125|129|NONE|BeginTime|1|0|starlings-a-1|
4_2|2|FAILED|n3|100|107|108|NonZeroExitCode|0|512|starlings-a-1|
4_3|3|TIMEOUT|n3|100|107|208|TimeLimit|0|0|starlings-a-1|
9_0|0|RUNNING|n4|100|107|NONE|None|0|0|somebody-else|
";

    #[test]
    fn every_task_is_told_with_its_state_its_time_and_its_reason_in_words() {
        let roles = [Role::Coordinator].into_iter().chain((0..5).map(Role::Worker)).collect::<Vec<_>>();
        let found = tasks(ANSWER, &order(5), &roles);
        let told: Vec<_> = found.iter().map(|t| (t.state, t.since, t.node.as_deref(), t.restarts)).collect();
        let expected = [
            (State::Running, Some(110), Some("n2"), 0),
            (State::Running, Some(107), Some("n1"), 0),
            (State::Waiting, Some(125), None, 1),
            (State::Failed, Some(108), Some("n3"), 0),
            (State::Failed, Some(208), Some("n3"), 0),
            (State::Unknown, None, None, 0),
        ];
        assert_eq!(told, expected);
        assert!(found[2].says.as_deref().unwrap().contains("before its start time"), "{found:?}");
        assert_eq!(found[3].says.as_deref(), Some("ended with exit code 2"));
        assert!(found[4].says.as_deref().unwrap().contains("time limit"));
        assert_eq!((found[1].says.as_deref(), found[2].id.as_str()), (None, "4_1"));
    }

    #[test]
    fn a_number_that_was_given_again_is_that_of_the_live_task_or_the_last() {
        let line = |job: u32, state: &str, submitted: u32| {
            format!("{job}_1|1|{state}|n1|{submitted}|1|2|None|0|0|starlings-a-1|\n")
        };
        let id = |answer: String| tasks(&answer, &order(2), &[Role::Worker(1)])[0].id.clone();
        assert_eq!(id(line(9, "RUNNING", 50) + &line(12, "CANCELLED", 70)), "9_1");
        assert_eq!(id(line(12, "CANCELLED", 70) + &line(9, "COMPLETED", 50)), "12_1");
        assert_eq!(id(line(12, "PENDING", 70) + &line(9, "COMPLETING", 50)), "12_1");
    }

    #[test]
    fn an_array_that_was_cancelled_as_a_whole_tells_for_all_of_it() {
        let answer = "2|N/A|CANCELLED||1|2|3|Priority|0|0|starlings-a-1|\n";
        let found = tasks(answer, &order(2), &[Role::Worker(0), Role::Worker(1)]);
        assert!(found.iter().all(|task| task.state == State::Cancelled), "{found:?}");
    }
}

//! Keeps as many workers as the work asks for: what `starlings deploy watch` does for a deployment with `--elastic`.
//!
//! A worker that computes is never ended. Next file to read: `deploy/src/elastic.rs`, which decides how many there should be.

use std::fs::OpenOptions;
use std::io::Write;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use serde_json::json;
use starlings_deploy::elastic::{Change, Limits, Patience, Policy};
use starlings_deploy::work::{self, Work};
use starlings_deploy::{Deployment, Role, State, Task};

use super::now;
use crate::console::note;

/// Seconds without a run after which a worker counts as idle.
const IDLE_S: u64 = 2;

/// How long a file that its coordinator does not write any more is believed.
const BELIEVED: Duration = Duration::from_secs(60);

/// Name of the file with the changes in the folder of a deployment.
const EVENTS: &str = "events.jsonl";

/// The number of workers of one deployment.
pub(super) struct Scale {
    limits: Limits,
    policy: Policy,
    started: Instant,
    file: PathBuf,
    /// The count of the file that was read last, and since when it is that.
    seen: Option<(u64, Instant)>,
    slots: usize,
    /// Whether a coordinator has been there.
    has_come: bool,
}

impl Scale {
    /// For a deployment whose number of workers follows the work.
    pub(super) fn of(deployment: &Deployment, patience: Patience) -> Option<Self> {
        let order = &deployment.order;
        let limits = order.elastic?;
        Some(Self {
            limits,
            policy: Policy::new(limits, patience),
            started: Instant::now(),
            file: work::path(&order.access),
            seen: None,
            slots: order.slots.unwrap_or(1),
            has_come: false,
        })
    }

    /// Looks at the work and at the tasks, and has the engine add or end workers. Whether a coordinator is there
    /// or may still come.
    pub(super) fn look(&mut self, deployment: &Deployment, tasks: &[Task]) -> bool {
        if deployment.is_removed() {
            return false;
        }
        let told = self.told();
        let work = if let Told::Work(work) = &told { Some(work) } else { None };
        let workers: Vec<&Task> = tasks.iter().filter(|task| is_there(task)).collect();
        let unfinished = work.map_or(0, |work| work.unfinished);
        self.slots = work.iter().flat_map(|work| &work.workers).map(|w| w.slots).max().unwrap_or(self.slots);
        let wanted = self.limits.wanted(unfinished, self.slots);
        match self.policy.look(self.started.elapsed(), wanted, workers.len()) {
            // Without a coordinator a pool ends by its idle time.
            Change::Add(n) if work.is_some() => add(deployment, tasks, workers.len(), n, unfinished),
            Change::Release(n) => release(deployment, &told, &workers, n, unfinished),
            Change::Add(_) | Change::None => {}
        }
        self.has_come |= work.is_some();
        work.is_some() || !self.has_come
    }

    /// What the coordinator says.
    fn told(&mut self) -> Told {
        let Some(work) = Work::read(&self.file) else { return Told::Nothing };
        if work.ended {
            return Told::Ended;
        }
        let (count, since) = *self.seen.get_or_insert_with(|| (work.count, Instant::now()));
        if count != work.count {
            self.seen = Some((work.count, Instant::now()));
        } else if since.elapsed() > BELIEVED {
            return Told::Nothing;
        }
        Told::Work(work)
    }
}

/// What a coordinator says of its work.
enum Told {
    /// Nothing: none has come, or it is gone without a word.
    Nothing,
    /// It has ended.
    Ended,
    /// This.
    Work(Work),
}

/// Whether a task is a worker that is there or on its way.
fn is_there(task: &Task) -> bool {
    task.role != Role::Coordinator && matches!(task.state, State::Waiting | State::Running)
}

fn add(deployment: &Deployment, tasks: &[Task], there: usize, n: usize, unfinished: usize) {
    // What died is not submitted again and again: its number is free when the engine has forgotten it.
    let has_died = |task: &Task| task.state == State::Failed && task.reason.as_deref() != Some("TimeLimit");
    let is_taken = |task: &Task| task.state.is_live() || has_died(task);
    let is_free = |i: &usize| !tasks.iter().any(|task| task.role == Role::Worker(*i) && is_taken(task));
    let numbers: Vec<usize> = (0..deployment.order.workers).filter(is_free).take(n).collect();
    if numbers.is_empty() {
        return;
    }
    match deployment.unless_removed(|| deployment.engine().add(deployment, &numbers)) {
        None => {}
        Some(Ok(())) => tell(deployment, "workers-added", there, there + numbers.len(), unfinished),
        Some(Err(error)) => note(format_args!("warning: no workers are added: {error}")),
    }
}

/// Ends workers that have not begun, then those that are idle, of each the last first.
fn release(deployment: &Deployment, told: &Told, workers: &[&Task], n: usize, unfinished: usize) {
    let is_idle = |task: &Task| {
        let work = match told {
            Told::Work(work) => work,
            Told::Ended => return true,
            // Workers may hold results that the coordinator needs when it is back.
            Told::Nothing => return false,
        };
        let process = deployment.process(task.role).unwrap_or_default();
        let own = work.workers.iter().find(|worker| worker.is(&process));
        own.is_some_and(|worker| worker.runs == 0 && worker.idle_s >= IDLE_S)
    };
    let waiting = workers.iter().rev().filter(|task| task.state == State::Waiting);
    let idle = workers.iter().rev().filter(|task| task.state == State::Running && is_idle(task));
    let ended: Vec<&Task> = waiting.chain(idle).take(n).copied().collect();
    if ended.is_empty() {
        return;
    }
    match deployment.engine().end(&ended) {
        Ok(()) => {
            tell(deployment, "workers-released", workers.len(), workers.len() - ended.len(), unfinished);
        }
        Err(error) => note(format_args!("warning: no workers are ended: {error}")),
    }
}

/// Says what was changed and why, and keeps it in the folder of the deployment.
fn tell(deployment: &Deployment, event: &str, from: usize, to: usize, unfinished: usize) {
    let what = if to > from { "added" } else { "released" };
    let n = from.abs_diff(to);
    let workers = if n == 1 { "worker" } else { "workers" };
    note(format_args!("{n} {workers} {what}, {from} → {to}: {unfinished} runs without a result"));
    let line = json!({ "time": now(), "event": event, "from": from, "to": to, "unfinished": unfinished });
    let path = deployment.folder.join(EVENTS);
    let file = OpenOptions::new().create(true).append(true).open(&path);
    if let Err(error) = file.and_then(|mut file| writeln!(file, "{line}")) {
        note(format_args!("warning: cannot write {}: {error}", path.display()));
    }
}

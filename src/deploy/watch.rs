//! `starlings deploy watch`: keeps the pool of a deployment until it is empty.

use std::path::PathBuf;
use std::thread::sleep;
use std::time::{Duration, Instant};

use clap::Parser;
use starlings_deploy::elastic::Patience;
use starlings_deploy::{Deployment, State, Task};
use tokio_util::sync::CancellationToken;

use super::scale::Scale;
use super::status::{last_words, span};
use super::{failed, now, remove};
use crate::console::{cancel_on_signal, note};
use crate::failure::Failure;
use crate::worker::duration;

/// How often Ctrl-C is looked for.
const TICK: Duration = Duration::from_millis(100);

/// How long a removal on exit may take.
const REMOVAL: Duration = Duration::from_secs(120);

/// Seconds in the queue after which it is told, the first time; then after twice as long each time.
const PATIENCE: i64 = 60;

/// Failed questions to the engine in a row after which it is given up.
const ATTEMPTS: u32 = 10;

/// Keep the pool of a deployment: have what the engine starts again started at once, say what waits and why, and with --elastic add
/// and end workers as the work asks. Ends when no process of it is left.
#[derive(Parser)]
pub(crate) struct Args {
    /// Folder of the deployment.
    folder: PathBuf,
    /// Seconds between two looks.
    #[arg(long, default_value_t = 5.0, value_name = "SECONDS")]
    every: f64,
    /// With --elastic: end workers when the work has not asked for as many for so long, such as 90s or 10m.
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = duration)]
    release_after: Duration,
    /// Remove the deployment at Ctrl-C.
    #[arg(long)]
    remove_on_exit: bool,
}

/// Watches until the pool is empty or a signal comes.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let every = Duration::try_from_secs_f64(args.every)
        .ok()
        .filter(|every| !every.is_zero())
        .ok_or_else(|| Failure::input("--every must be a number of seconds above zero"))?;
    let deployment = Deployment::read(&args.folder).map_err(failed)?;
    let ask = CancellationToken::new();
    cancel_on_signal(&ask);
    let patience = Patience { add: every, release: args.release_after.max(every) };
    let mut scale = Scale::of(&deployment, patience);
    let mut seen = Seen { tasks: Vec::new(), told_at: PATIENCE };
    let mut failures = 0;
    loop {
        match deployment.tasks() {
            Ok(tasks) => {
                let unreached = tasks.iter().filter(|task| task.state == State::Unreached).count();
                seen.look(&deployment, tasks);
                failures = if unreached == 0 { 0 } else { failures + 1 };
                if failures > ATTEMPTS {
                    return Err(given_up(&deployment, unreached));
                }
                let has_work = scale.as_mut().is_some_and(|scale| scale.look(&deployment, &seen.tasks));
                if unreached == 0 && !has_work && !seen.tasks.iter().any(|task| task.state.is_live()) {
                    note(format_args!("{}: no process is left", deployment.order.name));
                    return Ok(());
                }
            }
            // An engine that is started again, or busy, answers later.
            Err(error) if failures < ATTEMPTS && !error.is_input() => {
                failures += 1;
                note(format_args!("warning: {error}"));
            }
            Err(error) => return Err(failed(error)),
        }
        if wait(every, &ask) {
            return interrupted(&deployment, args.remove_on_exit);
        }
    }
}

/// What is said of processes on machines that did not answer for many looks in a row.
fn given_up(deployment: &Deployment, unreached: usize) -> Failure {
    let folder = deployment.folder.display();
    Failure::run(format!(
        "{unreached} of {} processes are not reached and may still run: see starlings deploy status {folder}, and watch again",
        deployment.roles().len()
    ))
}

/// Whether a signal came in this time.
fn wait(every: Duration, ask: &CancellationToken) -> bool {
    let started = Instant::now();
    while started.elapsed() < every {
        if ask.is_cancelled() {
            return true;
        }
        sleep(TICK.min(every));
    }
    ask.is_cancelled()
}

fn interrupted(deployment: &Deployment, removes: bool) -> Result<(), Failure> {
    let folder = deployment.folder.display();
    let message = if removes {
        remove::remove(deployment, REMOVAL)?;
        "interrupted; the deployment is removed".to_owned()
    } else {
        format!("interrupted; the deployment goes on: remove it with starlings deploy remove {folder}")
    };
    Err(Failure::Interrupted { message, code: 130 })
}

/// What was seen last, and when a wait is told next.
struct Seen {
    tasks: Vec<Task>,
    told_at: i64,
}

impl Seen {
    fn look(&mut self, deployment: &Deployment, tasks: Vec<Task>) {
        for task in &tasks {
            match deployment.engine().release(task) {
                Ok(true) => note(format_args!("{}: started again at once on another node", task.role)),
                Ok(false) => {}
                Err(error) => note(format_args!("warning: {}: {error}", task.role)),
            }
            let before = self.tasks.iter().find(|before| before.role == task.role);
            let is_news = before.is_none_or(|before| {
                let is_running = task.state == State::Running;
                (before.state, before.restarts, &before.node) != (task.state, task.restarts, &task.node)
                    || is_running && before.says != task.says && task.says.is_some()
            });
            if is_news {
                tell(deployment, task);
            }
        }
        self.tell_wait(&tasks);
        self.tasks = tasks;
    }

    /// Says of a queue that does not start since when and why, less and less often.
    fn tell_wait(&mut self, tasks: &[Task]) {
        let waiting: Vec<&Task> = tasks.iter().filter(|task| task.state == State::Waiting).collect();
        let longest = waiting
            .iter()
            .filter_map(|task| Some((now() - task.since?, *task)))
            .max_by_key(|(for_s, _)| *for_s);
        match longest {
            Some((for_s, task)) if for_s >= self.told_at => {
                let why = task.says.as_deref().unwrap_or("the engine gives no reason");
                note(format_args!("{} of {} wait, for {}: {why}", waiting.len(), tasks.len(), span(for_s)));
                self.told_at = 2 * for_s;
            }
            Some(_) => {}
            None => self.told_at = PATIENCE,
        }
    }
}

fn tell(deployment: &Deployment, task: &Task) {
    let node = task.node.as_ref().map(|node| format!(" on {node}")).unwrap_or_default();
    let why = task.says.as_ref().map(|says| format!(": {says}")).unwrap_or_default();
    note(format_args!("{} {}{node}{why}", task.role, task.state.word()));
    if task.state == State::Failed {
        note(last_words(deployment, std::slice::from_ref(task)).trim_end());
    }
}

//! `starlings deploy status`: where every process of a deployment stands.

use std::path::PathBuf;

use clap::Parser;
use serde_json::json;
use starlings_deploy::{Deployment, Role, State, Task};

use super::{failed, now};
use crate::console::{line, table, text};
use crate::failure::Failure;

/// Lines of a log that are shown.
const LINES: usize = 5;

/// Logs that are shown at most; workers that die alike are many.
const LOGS: usize = 4;

/// Say of every process of a deployment where it stands, since when, and why.
#[derive(Parser)]
pub(crate) struct Args {
    /// Folder of the deployment.
    folder: PathBuf,
    /// Print it as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Prints the table.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let deployment = Deployment::read(&args.folder).map_err(failed)?;
    let tasks = deployment.tasks().map_err(failed)?;
    if args.json {
        return line(format_args!("{:#}", as_json(&deployment, &tasks)));
    }
    let order = &deployment.order;
    line(format_args!(
        "{} under {}, study {}",
        order.name,
        deployment.engine().name(),
        order.study.display()
    ))?;
    let head = ["task", "state", "for", "node", "why"].map(str::to_owned).to_vec();
    let now = now();
    let rows: Vec<Vec<String>> = [head].into_iter().chain(tasks.iter().map(|task| row(task, now))).collect();
    text(table(&rows, false))?;
    text(last_words(&deployment, &tasks))
}

fn as_json(deployment: &Deployment, tasks: &[Task]) -> serde_json::Value {
    let of_task = |task: &Task| {
        let failed = task.state == State::Failed;
        let last_lines = if failed { deployment.last_lines(task.role, LINES) } else { Vec::new() };
        json!({
            "task": task.role.to_string(), "id": task.id, "state": task.state.word(), "since": task.since, "node": task.node,
            "reason": task.reason, "says": task.says, "restarts": task.restarts, "last_lines": last_lines,
        })
    };
    json!({
        "name": deployment.order.name,
        "engine": deployment.engine().name(),
        "study": deployment.order.study,
        "access": deployment.order.access,
        "tasks": tasks.iter().map(of_task).collect::<Vec<_>>(),
    })
}

fn row(task: &Task, now: i64) -> Vec<String> {
    let restarts = match task.restarts {
        0 => String::new(),
        n => format!(", started again {n}×"),
    };
    vec![
        task.role.to_string(),
        format!("{}{restarts}", task.state.word()),
        task.since.map_or_else(|| "–".to_owned(), |since| span(now - since)),
        task.node.clone().unwrap_or_else(|| "–".to_owned()),
        task.says.clone().unwrap_or_default(),
    ]
}

/// A time as people read it.
pub(super) fn span(seconds: i64) -> String {
    let seconds = seconds.max(0);
    match seconds {
        0..120 => format!("{seconds} s"),
        120..7200 => format!("{} min", seconds / 60),
        7200..172_800 => format!("{} h", seconds / 3600),
        _ => format!("{} d", seconds / 86_400),
    }
}

/// The last lines of the logs of tasks that failed; the same lines once.
pub(super) fn last_words(deployment: &Deployment, tasks: &[Task]) -> String {
    let mut told: Vec<(Vec<String>, Vec<Role>)> = Vec::new();
    for task in tasks.iter().filter(|task| task.state == State::Failed) {
        let lines = deployment.last_lines(task.role, LINES);
        match told.iter_mut().find(|(known, _)| *known == lines) {
            Some((_, roles)) => roles.push(task.role),
            None => told.push((lines, vec![task.role])),
        }
    }
    let mut shown: Vec<String> = Vec::new();
    for (lines, roles) in told.iter().take(LOGS) {
        let more = if roles.len() > 1 { format!(" and {} more", roles.len() - 1) } else { String::new() };
        shown.push(format!("  {}{more}:", roles[0]));
        if lines.is_empty() {
            shown.push("    it left no log".to_owned());
        }
        shown.extend(lines.iter().map(|line| format!("    {line}")));
    }
    if told.len() > LOGS {
        shown.push(format!("  others: {}", deployment.folder.join("logs").display()));
    }
    shown.into_iter().map(|line| line + "\n").collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_is_told_in_the_unit_that_people_use() {
        let told = [-3, 0, 119, 120, 7199, 7200, 172_799, 172_800].map(span);
        assert_eq!(told, ["0 s", "0 s", "119 s", "2 min", "119 min", "2 h", "47 h", "2 d"]);
    }
}

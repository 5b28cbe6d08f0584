//! Why a run is where it is, and what a worker or a particle did in it.
//!
//! Next file to read: [`super::parameter`].

use starlings_study::RunFolder;
use starlings_study::store::{Store, StoreError};

use super::{count, digits};
use crate::number;

/// Reasons that are listed.
const LISTED: usize = 3;

/// (kind, text) of an event.
type Event = (String, String);

/// Where a run stands, and what held it up.
pub(super) fn run(folder: &RunFolder) -> Result<Vec<String>, StoreError> {
    // Before the store: a run that ends meanwhile is done.
    let holder = folder.holder();
    let store = &folder.store;
    let mut says = Vec::new();
    match (folder.summary()?, &holder) {
        (Some(summary), _) => says.push(format!(
            "It is finished: {} of the model in {}.",
            count(summary.runs.total, "run"),
            number::duration(summary.wall_s)
        )),
        (None, Some(holder)) => says.push(format!("It is running, by {holder}.")),
        (None, None) => says.push(format!(
            "Nobody runs it: it was killed or broke off after {}; --out {} --resume goes on.",
            number::duration(store.elapsed_s()?),
            folder.path.display()
        )),
    }
    let analyses: Vec<u64> = store.rows("SELECT count(*) FROM analyses", |row| row.get(0))?;
    if analyses.first() == Some(&0) {
        says.push("No analysis is made yet.".to_owned());
    }
    let told = events(
        store,
        "kind IN ('waiting', 'worker-left', 'worker-set-aside', 'worker-excluded', 'worker-given-up', 'setup-failed')",
    )?;
    if let Some((_, last)) = told.last() {
        says.push(format!(
            "{} was told of workers that are missing or not used; the last: {last}.",
            count(told.len() as u64, "time")
        ));
    }
    says.extend(failures(store, "1")?);
    Ok(says)
}

/// What a worker did, and why it does nothing more.
pub(super) fn worker(store: &Store, name: &str) -> Result<Vec<String>, StoreError> {
    let quoted = name.replace('\'', "''");
    let rows: Vec<(u64, u64, Option<f64>)> = store.rows(
        &format!("SELECT count(*), coalesce(sum(status != 'done'), 0), avg(cost_s) FROM jobs WHERE worker = '{quoted}'"),
        |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?)),
    )?;
    let (runs, failed, mean) = rows.first().copied().unwrap_or_default();
    let all: Vec<Option<f64>> =
        store.rows("SELECT avg(cost_s) FROM jobs WHERE status = 'done'", |row| row.get(0))?;
    let mut says = vec![format!("It answered {}, of which {failed} failed.", count(runs, "run"))];
    if let (Some(own), Some(Some(all))) = (mean, all.first()) {
        says.push(format!(
            "A run took {} on it, {} on all workers together.",
            number::duration(own),
            number::duration(*all)
        ));
    }
    let told = events(store, "1")?;
    let kinds = [
        "worker-left",
        "worker-set-aside",
        "worker-excluded",
        "worker-given-up",
        "setup-failed",
        "worker-back",
        "workers-differ",
    ];
    let mut found = told
        .into_iter()
        .filter(|(kind, text)| kinds.contains(&kind.as_str()) && names(text, name))
        .peekable();
    if found.peek().is_none() {
        says.push("Nothing was told against it: it was in use until the end, or left with it.".to_owned());
    }
    says.extend(found.map(|(_, text)| format!("{text}.")));
    Ok(says)
}

/// What became of a particle.
pub(super) fn particle(store: &Store, particle: u32) -> Result<Vec<String>, StoreError> {
    let of = format!("particle = {particle}");
    let rows: Vec<(u64, u64, u64)> = store.rows(
        &format!("SELECT count(*), coalesce(sum(status != 'done'), 0), coalesce(sum(attempts - 1), 0) FROM jobs WHERE {of}"),
        |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?)),
    )?;
    let (runs, failed, again) = rows.first().copied().unwrap_or_default();
    let mut says = vec![format!(
        "It was run {}; {failed} failed for good, {again} were started again.",
        count(runs, "time")
    )];
    // A step with more runs of a particle than one per record had it pulled towards the mean.
    let pulled: Vec<(u64, u64, u64)> = store.rows(
        &format!(
            "SELECT pass, step, count(*) FROM jobs WHERE {of} AND pass > 0 GROUP BY pass, step, record HAVING count(*) > 1 ORDER BY pass, step"
        ),
        |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?)),
    )?;
    if let Some((pass, step, times)) = pulled.last() {
        says.push(format!(
            "It was pulled towards the mean at {}, last at pass {pass}, analysis {step}, where it was run {times} times: a sigma point at which \
             the model fails is moved until it runs.",
            if pulled.len() == 1 { "1 analysis".to_owned() } else { format!("{} analyses", pulled.len()) }
        ));
    } else if failed == 0 {
        says.push("It was never moved by a failure: it moved with the estimate alone.".to_owned());
    }
    says.extend(failures(store, &of)?);
    Ok(says)
}

/// The commonest reasons of failed runs.
fn failures(store: &Store, of: &str) -> Result<Vec<String>, StoreError> {
    let rows: Vec<(String, u64, Option<f64>)> = store.rows(
        &format!(
            "SELECT coalesce(error, 'no reason'), count(*), avg(cost_s) FROM jobs WHERE status != 'done' AND {of}
             GROUP BY error ORDER BY count(*) DESC, error LIMIT {LISTED}"
        ),
        |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?)),
    )?;
    Ok(rows.into_iter().map(|(error, n, _)| format!("{} failed: {error}.", count(n, "run"))).collect())
}

fn events(store: &Store, of: &str) -> Result<Vec<Event>, StoreError> {
    store.rows(&format!("SELECT kind, text FROM events WHERE {of} ORDER BY id"), |row| {
        Ok((row.get(0)?, row.get(1)?))
    })
}

/// Whether a text names a worker: `1@host/7` is not in `11@host/71`.
fn names(text: &str, worker: &str) -> bool {
    let ends = |c: Option<char>| c.is_none_or(|c| !c.is_alphanumeric());
    text.match_indices(worker)
        .any(|(at, _)| ends(text[..at].chars().next_back()) && ends(text[at + worker.len()..].chars().next()))
}

/// A share of a whole in words.
pub(super) fn of_all(part: f64, all: f64) -> String {
    if all > 0.0 { format!("{}\u{a0}%", number::significant(100.0 * part / all, 2)) } else { digits(part) }
}

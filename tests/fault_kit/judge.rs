//! What is asked of every case: the undisturbed result to the last byte, now or after an error that names the cause, repair
//! and `--resume`; no process and no scratch folder left behind; no hang.
//!
//! Next file to read: [`super::table`].

use std::collections::BTreeMap;
use std::sync::{Mutex, OnceLock};
use std::time::{Duration, Instant};

use super::plan::{Case, Must, Reached, Verb};
use super::processes;
use super::study_folder::{Ended, StudyFolder};

/// What came of a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Outcome {
    /// The undisturbed result at once.
    WentOn,
    /// An error, and the undisturbed result after repair and resume.
    Resumed,
}

/// An undisturbed study.
#[derive(Clone, Debug)]
pub(crate) struct Clean {
    pub(crate) result: Vec<u8>,
    pub(crate) n_run: u64,
}

/// How long the guards of ended workers may take.
const AFTERWARDS: Duration = Duration::from_secs(30);

/// The undisturbed study, run once.
pub(crate) fn clean(verb: Verb, reached: Reached) -> Clean {
    type CleanRuns = BTreeMap<(Verb, Reached), &'static OnceLock<Clean>>;
    static KNOWN: Mutex<CleanRuns> = Mutex::new(BTreeMap::new());
    let known = *KNOWN.lock().unwrap().entry((verb, reached)).or_insert_with(|| Box::leak(Box::default()));
    let make = || {
        let place = StudyFolder::new(verb, reached, "");
        let ended = place.go(&[]).unwrap();
        assert_eq!(ended.code, Some(0), "undisturbed: {}", ended.stderr);
        Clean { result: place.result().unwrap(), n_run: place.n_run() }
    };
    known.get_or_init(make).clone()
}

/// Settings of the model that a fault needs to be noticed within a test.
fn settings(case: &Case) -> &'static str {
    if case.fault.kind == "stopped" { "timeout = 5.0" } else { "" }
}

/// Lets a case happen.
///
/// # Errors
/// When anything else comes of it than may.
pub(crate) fn judge(case: &Case) -> Result<Outcome, String> {
    let clean = clean(case.verb, case.reached);
    let place = StudyFolder::new(case.verb, case.reached, settings(case));
    let runs = case.runs(clean.n_run);
    place.break_at(&case.fault, runs);
    let judged = disturbed(case, &place, &clean);
    processes::end(&place.mark());
    judged.map_err(|fault| format!("{}, at run {} of {}: {fault}", case.name(), runs.0, clean.n_run))
}

fn disturbed(case: &Case, place: &StudyFolder, clean: &Clean) -> Result<Outcome, String> {
    let first = place.go(&[])?;
    nothing_left(place, &[&first])?;
    let outcome = match first.code {
        Some(0) => Outcome::WentOn,
        Some(1) => {
            named(case, &first)?;
            place.repair();
            let second = place.go(&["--resume"])?;
            if second.code != Some(0) {
                return Err(format!(
                    "the resume ended with {:?}: {}\nafter: {}",
                    second.code, second.stderr, first.stderr
                ));
            }
            nothing_left(place, &[&first, &second])?;
            Outcome::Resumed
        }
        code => return Err(format!("ended with {code:?}: {}", first.stderr)),
    };
    if place.result()? != clean.result {
        return Err(format!("another result ({outcome:?}): {}", first.stderr));
    }
    match (case.fault.must, outcome) {
        (Must::GoOn, Outcome::Resumed) => Err(format!("it did not go on: {}", first.stderr)),
        (Must::Stop, Outcome::WentOn) => Err("it went on, although the fault lasts".to_owned()),
        _ => Ok(outcome),
    }
}

/// The error names the cause and says how to go on.
fn named(case: &Case, ended: &Ended) -> Result<(), String> {
    let at = ended.stderr.rfind("error: ").ok_or_else(|| format!("no error is told: {}", ended.stderr))?;
    let said = &ended.stderr[at..];
    if !case.fault.causes.iter().any(|cause| said.contains(cause)) {
        return Err(format!("the error names none of {:?}: {said}", case.fault.causes));
    }
    if said.contains("--resume") {
        Ok(())
    } else {
        Err(format!("the error does not say how to go on: {said}"))
    }
}

/// No process, and no scratch folder but those that the error says are kept.
pub(crate) fn nothing_left(place: &StudyFolder, ended: &[&Ended]) -> Result<(), String> {
    let said: String = ended.iter().map(|command| command.stderr.as_str()).collect();
    let started = Instant::now();
    loop {
        let processes = processes::of(&place.mark());
        let folders = scratch(place, &said);
        if processes.is_empty() && folders.is_empty() {
            return Ok(());
        }
        if started.elapsed() > AFTERWARDS {
            return Err(format!("left behind: {processes:?}, {folders:?}; it said: {said}"));
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Beginning of the folders that Open MPI keeps for itself, and leaves where its launcher is killed.
const OF_LAUNCHER: &str = "ompi.";

/// Scratch folders that are there and that nothing of what was `said` names.
fn scratch(place: &StudyFolder, said: &str) -> Vec<String> {
    let mut found = Vec::new();
    let is_ours = |entry: &std::fs::DirEntry| !entry.file_name().to_string_lossy().starts_with(OF_LAUNCHER);
    let roots = std::fs::read_dir(place.path("scratch")).unwrap().filter_map(Result::ok).filter(is_ours);
    for root in roots {
        let runs: Vec<_> =
            std::fs::read_dir(root.path()).into_iter().flatten().filter_map(Result::ok).collect();
        if runs.is_empty() {
            found.push(root.path().display().to_string());
        }
        found.extend(runs.iter().map(|run| run.path().display().to_string()));
    }
    found.retain(|folder| !said.contains(folder.as_str()) && !told_in_store(place, folder));
    found
}

/// Whether the folder stands in the row of a run that failed.
fn told_in_store(place: &StudyFolder, folder: &str) -> bool {
    let flags = rusqlite::OpenFlags::SQLITE_OPEN_READ_ONLY;
    let told = rusqlite::Connection::open_with_flags(place.out().join("run.db"), flags).and_then(|db| {
        let sql = "SELECT (SELECT count(*) FROM jobs WHERE instr(error, ?1)) + (SELECT count(*) FROM events WHERE instr(text, ?1))";
        db.query_row(sql, [folder], |row| row.get::<_, i64>(0))
    });
    told.is_ok_and(|n| n > 0)
}

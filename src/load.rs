//! Studies as commands load them: with somebody who starts the solvers that they name.
//!
//! A solver that was asked for its description, or made a trial run, stays for the next question; it ends before the workers
//! start theirs, or with the command. Next file to read: [`crate::solvers`].

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use starlings_coordinator::study::store::folder::StudyInfo;
use starlings_coordinator::study::{RunFolder, SolverHost, Study, Undescribed};
use starlings_models::{BuildSetup, SOLVER, Setup, SetupError};
use starlings_solver::Solvers;
use starlings_solver::{adapters, faults};

use crate::failure::Failure;
use crate::solvers::solvers;

/// The solvers of this process, once one was needed.
static HERE: Mutex<Option<Solvers>> = Mutex::new(None);

/// Reads and checks a study; a solver that it names is started here and asked what it is.
pub(crate) fn load(path: &Path) -> Result<Study, Failure> {
    load_where(path, true)
}

/// The same for the poles of its model.
pub(crate) fn load_for_poles(path: &Path) -> Result<Study, Failure> {
    Ok(Study::load_for_poles(path, &host(true))?)
}

/// A study for runs; where they are made elsewhere, no solver is started on this machine.
pub(crate) fn load_where(path: &Path, here: bool) -> Result<Study, Failure> {
    Ok(Study::load_with(path, &host(here))?)
}

/// The study of a run as it was run; `named` says where it and its recordings are, if not where they were.
pub(crate) fn of_run(folder: &RunFolder, named: Option<&Path>, here: bool) -> Result<Study, Failure> {
    let frozen = folder.store.meta("study").map_err(Failure::run)?.unwrap_or_default();
    let info = folder.store.meta("info").map_err(Failure::run)?.unwrap_or_default();
    let stood = serde_json::from_str::<StudyInfo>(&info).map(|info| info.file).unwrap_or_default();
    load_frozen(&place(&folder.path, named, &stood)?, &frozen, here)
}

/// Where the study of a folder stands, so that its recordings are found: `named`, or else where it `stood`.
pub(crate) fn place(folder: &Path, named: Option<&Path>, stood: &str) -> Result<PathBuf, Failure> {
    let place = match named {
        Some(file) => file.to_owned(),
        None if stood.is_empty() => folder.join("study.toml"),
        None => Path::new(stood).to_owned(),
    };
    if place.exists() {
        return Ok(place);
    }
    Err(Failure::input(format!(
        "the study of this run stood at {}, and is not there: say where it and its recordings are with --study FILE",
        place.display()
    )))
}

/// The same for the text of a study that stood at `path` when it was run.
fn load_frozen(path: &Path, text: &str, here: bool) -> Result<Study, Failure> {
    Ok(Study::from_text_with(path, text, &host(here))?)
}

/// Which record of a study a command is about: the first where none is named.
pub(crate) fn record(study: &Study, name: Option<&str>) -> Result<usize, Failure> {
    let Some(name) = name else { return Ok(0) };
    let names = || study.records.iter().map(|record| record.name.as_str());
    names().position(|known| known == name).ok_or_else(|| unknown_record(name, names()))
}

/// What is told of a record that is not there.
pub(crate) fn unknown_record<'a>(name: &str, names: impl Iterator<Item = &'a str>) -> Failure {
    let names: Vec<&str> = names.collect();
    Failure::input(format!("no record named `{name}` (the study has: {})", names.join(", ")))
}

/// What starts the solvers of a study: somebody on this machine, or nobody.
pub(crate) fn host(here: bool) -> SolverHost {
    if here { host_here() } else { host_elsewhere() }
}

fn host_elsewhere() -> SolverHost {
    let describe = |_: &_| {
        Err(Undescribed {
            reason: "with --listen no solver is started on this machine".to_owned(),
            last_words: None,
            is_absent: true,
        })
    };
    SolverHost::asking(describe, Arc::new(Setup::build)).inspecting(faults).by(adapters())
}

/// Starts solvers on this machine.
pub(crate) fn host_here() -> SolverHost {
    let describe = |def: &_| {
        here()?.describe(def).map_err(|error| Undescribed {
            reason: error.to_string(),
            last_words: error.last_words(),
            is_absent: error.is_absent(),
        })
    };
    let factory = Arc::new(|setup: &_| here().map_err(SetupError::Invalid)?.build(setup));
    SolverHost::asking(describe, factory).inspecting(faults).by(adapters())
}

/// Whether the model of a study is a program of its own.
pub(crate) fn is_outside(study: &Study) -> bool {
    study.setup.model.kind == SOLVER
}

/// Ends the solvers of this process; one that is needed again starts again.
pub(crate) fn end_solvers() {
    drop(HERE.lock().unwrap_or_else(PoisonError::into_inner).take());
}

fn here() -> Result<Solvers, String> {
    let mut here = HERE.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(solvers) = &*here {
        return Ok(solvers.clone());
    }
    let unknown = |_| "the path of this program, which watches over solvers, is not known".to_owned();
    Ok(here.insert(solvers().map_err(unknown)?).clone())
}

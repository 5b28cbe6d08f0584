//! Studies as commands load them: with somebody who starts the solvers that they name.
//!
//! A solver that was asked for its description, or made a trial run, stays for the next question; it ends before the workers
//! start theirs, or with the command. Next file to read: [`crate::solvers`].

use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use starlings_coordinator::study::{SolverHost, Study, Undescribed};
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

/// The same; where the runs are made elsewhere, no solver is started on this machine.
pub(crate) fn load_where(path: &Path, here: bool) -> Result<Study, Failure> {
    Ok(Study::load_with(path, &host(here))?)
}

/// The same for the text of a study that stood at `path` when it was run.
pub(crate) fn load_frozen(path: &Path, text: &str, here: bool) -> Result<Study, Failure> {
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

//! The ways in which a study is read: from a file or a text, for runs, poles, an inference or a diagnosis.
//!
//! Next file to read: [`super`].

use std::path::Path;

use starlings_models::SolverDef;

use super::{check, diagnose, infer, solver};
use crate::Study;
use crate::diagnosis::Diagnosis;
use crate::file::read::read;
use crate::problem::{Problem, Source, StudyError};
use crate::solver_host::SolverHost;

/// What a study is read for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Purpose {
    /// Runs of its model.
    Runs,
    /// The poles of its model alone: observers may be unstable together.
    Poles,
}

impl Study {
    /// Reads and checks a study file and its recordings, which stand relative to it.
    ///
    /// # Errors
    /// Everything that is wrong, each with its place and remedy.
    pub fn load(path: &Path) -> Result<Self, StudyError> {
        Self::load_with(path, &SolverHost::default())
    }

    /// Reads and checks a study file where solvers can be started.
    ///
    /// # Errors
    /// As [`Study::load`].
    pub fn load_with(path: &Path, solver_host: &SolverHost) -> Result<Self, StudyError> {
        Self::from_text_with(path, &text_of(path)?, solver_host)
    }

    /// Reads and checks a study file for the poles of its model: observers that are unstable together are no fault.
    ///
    /// # Errors
    /// As [`Study::load`].
    pub fn load_for_poles(path: &Path, solver_host: &SolverHost) -> Result<Self, StudyError> {
        check(path, &text_of(path)?, (solver_host, Purpose::Poles))
    }

    /// The solver of a study file as the study names it: its recordings are not looked at, and nothing is started.
    ///
    /// # Errors
    /// When the file is no study, its model is no solver, or a file of the solver is missing.
    pub fn solver_of(path: &Path, solver_host: &SolverHost) -> Result<SolverDef, StudyError> {
        let text = text_of(path)?;
        let source = Source::new(path, &text);
        let file = read(&source, solver_host.adapters())?;
        source.verdict()?;
        let own = solver::own(&source, &file);
        source.verdict()?;
        own.ok_or_else(|| StudyError { problems: Vec::new() })
    }

    /// Reads and checks a study file for an inference: its recordings are described in [`Study::infer`] and not read, and parameters
    /// need no prior.
    ///
    /// # Errors
    /// Everything that is wrong, each with its place and remedy.
    pub fn load_for_inference(path: &Path) -> Result<Self, StudyError> {
        infer::study(path, &text_of(path)?)
    }

    /// The same for the text of a study file that stands, or stood, at `file`.
    ///
    /// # Errors
    /// As [`Study::load_for_inference`].
    pub fn from_text_for_inference(file: &Path, text: &str) -> Result<Self, StudyError> {
        infer::study(file, text)
    }

    /// Reads and checks a study file for a diagnosis: the study as it is, and one for every scenario.
    ///
    /// # Errors
    /// Everything that is wrong, each with its place and remedy; of several scenarios the first that has something.
    pub fn load_for_diagnosis(path: &Path, solver_host: &SolverHost) -> Result<Diagnosis, StudyError> {
        diagnose::diagnosis(path, &text_of(path)?, solver_host)
    }

    /// Whether a study file has a section `[infer]`; a file that cannot be read has none.
    pub fn asks_to_infer(path: &Path) -> bool {
        has_section(path, "infer")
    }

    /// Whether a study file has a section `[diagnose]`; a file that cannot be read has none.
    pub fn asks_to_diagnose(path: &Path) -> bool {
        has_section(path, "diagnose")
    }

    /// Checks the text of a study file that stands, or stood, at `file`.
    ///
    /// # Errors
    /// As [`Study::load`].
    pub fn from_text(file: &Path, text: &str) -> Result<Self, StudyError> {
        Self::from_text_with(file, text, &SolverHost::default())
    }

    /// Checks the text of a study file that stands, or stood, at `file`, where solvers can be started.
    ///
    /// # Errors
    /// As [`Study::load`].
    pub fn from_text_with(file: &Path, text: &str, solver_host: &SolverHost) -> Result<Self, StudyError> {
        check(file, text, (solver_host, Purpose::Runs))
    }
}

fn has_section(path: &Path, name: &str) -> bool {
    let file = text_of(path).ok().and_then(|text| text.parse::<toml::Table>().ok());
    file.is_some_and(|file| file.contains_key(name))
}

fn text_of(path: &Path) -> Result<String, StudyError> {
    std::fs::read_to_string(path).map_err(|error| {
        let problem = Problem {
            message: format!("cannot read the study: {error}"),
            help: Some("give the path of a study file (TOML)".to_owned()),
            file: path.to_owned(),
            source_text: None,
            span: None,
        };
        StudyError { problems: vec![problem] }
    })
}

//! What can be told of a study whose form or whose model is wrong: its priors by themselves, and its files.
//!
//! Somebody who mends the one should not learn of the others only then. Nothing is judged against the model here. Next file to
//! read: [`crate::record`].

use crate::check::prior;
use crate::check::solver::check_files;
use crate::file::StudyFile;
use crate::problem::{Source, StudyError};
use crate::record::Recordings;

/// What is wrong with a study whose model is none.
pub(crate) fn without_model(source: &Source, file: &StudyFile) -> StudyError {
    survey(source, file);
    source.verdict().err().unwrap_or(StudyError { problems: vec![] })
}

/// Reports what is wrong with priors and files whatever the model is.
pub(crate) fn survey(source: &Source, file: &StudyFile) {
    let whole = source.count();
    for parameter in file.parameters.iter().filter(|p| p.prior.transform.is_some()) {
        prior::prior(source, parameter, None);
    }
    if let Some(section) = &file.model.solver {
        check_files(source, section);
    }
    let mut recordings = Recordings::new(source);
    for record in &file.records {
        recordings.survey(record);
    }
    tracing::debug!(found = source.count() - whole, "files of a study that is not understood");
}

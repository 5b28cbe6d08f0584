//! Faults that can be found in a study whose form or whose model is wrong: those of its priors by themselves, and of its files.
//!
//! They are reported together with the faults of form or model. Nothing is compared with the model here. Next file to read:
//! [`crate::record`].

use crate::check::prior;
use crate::check::solver::check_files;
use crate::file::StudyFile;
use crate::problem::{Source, StudyError};
use crate::record::Recordings;

/// The faults of a study whose model does not build.
pub(crate) fn without_model(source: &Source, file: &StudyFile) -> StudyError {
    survey(source, file);
    source.verdict().err().unwrap_or(StudyError { problems: vec![] })
}

/// Reports the faults of priors and files that do not depend on the model.
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

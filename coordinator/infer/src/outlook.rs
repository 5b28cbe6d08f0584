//! What an inference would do, told before it reads whole recordings.
//!
//! Next file to read: [`mod@crate::run`], which does it.

use starlings_study::Study;
use starlings_study::infer_choice::InferRecord;

use crate::blocks::start;
use crate::error::InferError;
use crate::run::{asked, check, choice};

/// What an inference would do.
#[derive(Debug, Clone, PartialEq)]
pub struct Outlook {
    /// The equations, by the names of their states.
    pub equations: Vec<String>,
    /// Functions of the basis.
    pub n_function: usize,
    /// Names of the coefficients.
    pub coefficients: Vec<String>,
    /// Name of every record, its sampling step and how many rows its length suggests.
    pub records: Vec<(String, f64, f64)>,
}

/// Checks a study as [`check`] does, and looks at the first rows of its recordings.
///
/// # Errors
/// As for [`check`]; for a recording that cannot be read, or lacks a column.
pub fn outlook(study: &Study) -> Result<Outlook, InferError> {
    check(study)?;
    let choice = choice(study)?;
    let asked = asked(study, choice, 1.0)?;
    let structure = &asked.question.structure;
    let record = |record: &InferRecord| {
        let at = start(record)?;
        Ok((record.name.clone(), at.step, at.n_row))
    };
    Ok(Outlook {
        equations: structure.equations().to_vec(),
        n_function: structure.n_function(),
        coefficients: structure.coefficients().iter().map(|c| c.name.clone()).collect(),
        records: choice.records.iter().map(record).collect::<Result<_, InferError>>()?,
    })
}

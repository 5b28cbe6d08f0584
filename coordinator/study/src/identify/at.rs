//! The point around which the analysis is made: the prior median, or what a finished run estimated.

use std::fmt;
use std::path::{Path, PathBuf};

use super::IdentifyError;
use crate::{RunFolder, Study};

/// Where the sensitivities are taken.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum At {
    /// At the prior median.
    Prior,
    /// At the estimate of the finished run in this folder.
    Run(PathBuf),
}

impl fmt::Display for At {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Prior => f.write_str("the prior median"),
            Self::Run(path) => write!(f, "the estimate of {}", path.display()),
        }
    }
}

impl At {
    /// `prior`, or a run folder.
    pub fn from_argument(text: &str) -> Self {
        if text == "prior" { Self::Prior } else { Self::Run(PathBuf::from(text)) }
    }

    /// The point in transformed units, in the order of the estimated vector.
    ///
    /// # Errors
    /// When the folder holds no finished run, or one that did not estimate the parameters of this study.
    pub fn centre(&self, study: &Study) -> Result<Vec<f64>, IdentifyError> {
        match self {
            Self::Prior => Ok(study.theta.iter().map(|t| t.prior_mean).collect()),
            Self::Run(path) => estimate(study, path),
        }
    }
}

fn estimate(study: &Study, path: &Path) -> Result<Vec<f64>, IdentifyError> {
    if let Some(message) = study.lacks_start("what is identified") {
        return Err(IdentifyError::Point(message));
    }
    let folder = RunFolder::open(path)?;
    let shown = path.display();
    let unfinished =
        || IdentifyError::Point(format!("the run in {shown} is not finished: continue it with --resume"));
    let summary = folder.summary()?.ok_or_else(unfinished)?;
    let of_entry = |entry: &crate::ThetaEntry| {
        let found = summary.parameters.iter().find(|p| p.name == entry.name).ok_or_else(|| {
            let names: Vec<&str> = summary.parameters.iter().map(|p| p.name.as_str()).collect();
            IdentifyError::Point(format!(
                "the run in {shown} did not estimate `{}` of this study; it has {}",
                entry.name,
                names.join(", ")
            ))
        })?;
        if entry.transform.contains(found.estimate) {
            return Ok(entry.transform.to_transformed(found.estimate));
        }
        Err(IdentifyError::Point(format!(
            "the run in {shown} estimated {} = {}, which the {} transform of this study does not reach",
            entry.name,
            found.estimate,
            entry.transform.name()
        )))
    };
    study.theta.iter().map(of_entry).collect()
}

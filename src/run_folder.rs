//! The run folder of a command: made or resumed, before anything runs.

use std::path::{Path, PathBuf};

use starlings_coordinator::study::store::Purpose;
use starlings_coordinator::study::{RunFolder, Study};

use crate::failure::Failure;

/// Opens the folder `out`, or one under `runs` with the names of the study and of the command and the time of now.
pub(crate) fn open(
    purpose: Purpose,
    study: &Study,
    out: Option<&Path>,
    resume: bool,
) -> Result<RunFolder, Failure> {
    let stamp = jiff::Timestamp::now().strftime("%Y%m%d-%H%M%S").to_string();
    let kind = match purpose {
        Purpose::Run => "",
        Purpose::Explanation => "-explain",
    };
    let default = || Path::new("runs").join(format!("{}{kind}-{stamp}", study.name));
    let path: PathBuf = out.map_or_else(default, Path::to_owned);
    if resume {
        return RunFolder::resume(purpose, &path, study).map_err(Failure::input);
    }
    let command = std::env::args().skip(1).collect::<Vec<_>>().join(" ");
    let command = format!("starlings {command}");
    RunFolder::create(purpose, &path, study, &command, &stamp).map_err(Failure::input)
}

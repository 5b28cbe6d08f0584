//! The run folder of a command: made or resumed, before anything runs.

use std::path::{Path, PathBuf};

use clap::Args;
use starlings_coordinator::study::store::Purpose;
use starlings_coordinator::study::store::folder::Call;
use starlings_coordinator::study::{FolderError, RunFolder, Study};

use crate::disk;
use crate::failure::Failure;

/// Whether an interrupted command goes on.
#[derive(Args, Clone, Copy)]
pub(crate) struct Resume {
    /// Continue what was interrupted in --out: nothing that is stored is computed again.
    #[arg(long, requires = "out")]
    resume: bool,
    /// Continue although this program is another build, or the solver another, than the one that began; the result says so.
    #[arg(long, requires = "resume")]
    other_build: bool,
}

impl Resume {
    /// Whether the command begins anew.
    pub(crate) fn is_first(self) -> bool {
        !self.resume
    }

    /// Whether the model was tried before in this folder, by this program: a run folder is made after the trial.
    pub(crate) fn was_tried(self, out: Option<&Path>) -> bool {
        self.resume && !self.other_build && out.is_some_and(|out| out.join("run.db").is_file())
    }
}

/// Opens the folder `out`, or one under `runs` with the names of the study and of the command and the time of now; `shares` says that
/// large states stand in a folder that machines share.
pub(crate) fn open(
    purpose: Purpose,
    study: &Study,
    out: Option<&Path>,
    shares: bool,
    resume: Resume,
) -> Result<RunFolder, Failure> {
    let stamp = jiff::Timestamp::now().strftime("%Y%m%d-%H%M%S").to_string();
    let kind = match purpose {
        Purpose::Run => "",
        Purpose::Explanation => "-explain",
    };
    let default = || Path::new("runs").join(format!("{}{kind}-{stamp}", study.name));
    let path: PathBuf = out.map_or_else(default, Path::to_owned);
    disk::check(study, &path, shares, resume.resume)?;
    let command = again(std::env::args().skip(1));
    if resume.resume {
        let call = Call { command: &command, started: &stamp, other_build: resume.other_build };
        return RunFolder::resume(purpose, &path, study, &call).map_err(|error| failed(&error));
    }
    RunFolder::create(purpose, &path, study, &command, &stamp).map_err(|error| failed(&error))
}

/// The command that makes a run again, as a shell takes it: without the folder that it wrote, which is taken now, and without what
/// continued it.
fn again(mut arguments: impl Iterator<Item = String>) -> String {
    let mut words = vec!["starlings".to_owned()];
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--out" => drop(arguments.next()),
            "--resume" | "--other-build" => {}
            other if other.starts_with("--out=") => {}
            other => words.push(quoted(other)),
        }
    }
    words.join(" ")
}

/// A word that a shell of POSIX takes as it is.
pub(crate) fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./=:,@%+".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

/// Key of where large states of a run stand: the folder that machines share, empty where they stand in the run folder.
const STATES: &str = "states_place";

/// What to say where a piece of a state is missing in a run whose states stood elsewhere before; notes where they stand from now on.
pub(crate) fn moved(folder: &RunFolder, place: Option<&str>) -> Result<Option<String>, Failure> {
    let now = place.unwrap_or_default();
    let before = folder.store.meta(STATES).map_err(Failure::run)?;
    let Some(before) = before else {
        folder.store.set_meta(STATES, now).map_err(Failure::run)?;
        return Ok(None);
    };
    let own = folder.path.join("states");
    Ok((before != now).then(|| match &*before {
        "" => format!("; the run was begun without --states, and its states stand in {}: leave it out", own.display()),
        before => format!("; the run was begun with --states {before}: name the same folder again, by its path on this machine"),
    }))
}

/// Removes a folder that was made for a command whose study cannot be run; one that was there before stays.
pub(crate) fn give_up(folder: RunFolder, resume: Resume) {
    if !resume.resume {
        folder.discard();
    }
}

fn failed(error: &FolderError) -> Failure {
    if error.is_input() { Failure::input(error) } else { Failure::run(error) }
}

#[cfg(test)]
mod tests {
    use super::again;

    fn of(arguments: &[&str]) -> String {
        again(arguments.iter().map(|a| (*a).to_owned()))
    }

    #[test]
    fn a_command_of_the_report_can_be_pasted() {
        let expected = "starlings run 'my studies/it'\\''s.toml' --workers 2 --set 'R=1 kPa'";
        let given = [
            "run",
            "my studies/it's.toml",
            "--out",
            "runs/a b",
            "--workers",
            "2",
            "--resume",
            "--set",
            "R=1 kPa",
        ];
        assert_eq!(of(&given), expected);
        assert_eq!(of(&["explain", "s.toml", "--out=x"]), "starlings explain s.toml");
    }
}

//! What an interrupted run may be continued with: the same study, the same recordings, the same programs.
//!
//! Changes that change no number are accepted, others are refused with a message; another build goes on only where that was
//! asked for, and then the result says so. Next file to read: [`super::meaning`].

use std::collections::BTreeSet;
use std::path::Path;

use super::call::Call;
use super::changes::changes;
use super::folder::{DATABASE, FolderError, RunFolder, StudyInfo, freeze, is_frozen};
use super::json::json;
use super::lock::{FolderLock, NAME};
use super::make::is_left_over;
use super::meaning::{Meaning, Part};
use super::{Program, Purpose, Store, StoreError};
use crate::Study;

/// Name under which the store notes that its numbers come from more than one program.
const MIXED: &str = "mixed";

impl RunFolder {
    /// Opens the folder of a run that was interrupted; one that was killed before its first step begins again.
    ///
    /// # Errors
    /// When there is no run, another process runs in it, it serves another purpose, or it was started from another study,
    /// other recordings, by another version or, unless that is accepted, by another build or with another solver.
    pub fn resume(
        purpose: Purpose,
        path: &Path,
        study: &Study,
        call: &Call<'_>,
    ) -> Result<Self, FolderError> {
        let database = path.join(DATABASE);
        if !database.exists() && was_begun(path, &database) {
            return Self::create(purpose, path, study, call.command, call.started);
        }
        if !database.is_file() {
            return Err(Store::open(&database)
                .err()
                .map_or(FolderError::NeverStarted(path.to_owned()), Into::into));
        }
        let lock = FolderLock::take(path)?;
        let store = Store::open(&database)?;
        let found = Purpose::of(&store)?;
        if found != purpose {
            let (folder, holds, command) = (path.to_owned(), found.with_article(), found.command());
            return Err(FolderError::OtherPurpose { folder, holds, command });
        }
        let text = store.meta("study")?.ok_or_else(|| FolderError::NeverStarted(path.to_owned()))?;
        same_study(&store, path, &text, study, purpose)?;
        if !is_frozen(path) {
            freeze(path, &text)?;
        }
        let folder = Self { path: path.to_owned(), store, _lock: Some(lock) };
        if !folder.is_finished(purpose)? {
            folder.same_programs(study, purpose, call)?;
            folder.told(&text, study, purpose, call)?;
        }
        Ok(folder)
    }

    /// Whether only its files are to be written again.
    pub(super) fn is_finished(&self, purpose: Purpose) -> Result<bool, StoreError> {
        Ok(self.store.meta(purpose.result())?.is_some())
    }

    /// Whether its numbers come from more than one program, and what that means; nothing where they do not.
    ///
    /// # Errors
    /// When the store fails.
    pub fn mixed(&self) -> Result<Option<String>, StoreError> {
        self.store.meta(MIXED)
    }

    /// What differs from what made the run that may change its numbers, in words; an error names the recordings that are others.
    pub(crate) fn changed(&self, study: &Study) -> Result<Result<Vec<String>, String>, StoreError> {
        let text = self.store.meta("study")?.unwrap_or_default();
        let mut told = match differing(&self.store, &text, study, Purpose::Run)? {
            Some((Part::Recordings, which)) => return Ok(Err(which.join(", "))),
            Some((Part::Solver, _)) => {
                vec!["the solver describes itself otherwise, or one of its files is another".to_owned()]
            }
            Some((Part::StudyFile, _)) => vec!["this program reads the study otherwise".to_owned()],
            None => Vec::new(),
        };
        let (before, now) = (self.store.program()?, Program::of(study));
        if before.version() != now.version() || before.is_other_build(&now) {
            told.push(format!(
                "it was made by {} {}, and this is {} {}",
                before.version(),
                before.build(),
                now.version(),
                now.build()
            ));
        }
        told.extend(before.solver_changes(&now).into_iter().map(|change| format!("of the solver {change}")));
        Ok(Ok(told))
    }

    fn same_programs(&self, study: &Study, purpose: Purpose, call: &Call<'_>) -> Result<(), FolderError> {
        let (before, now) = (self.store.program()?, Program::of(study));
        let folder = self.path.clone();
        if before.version() != now.version() {
            let (version, this) = (before.version().to_owned(), now.version().to_owned());
            return Err(FolderError::OtherVersion { folder, version, this });
        }
        let (is_other, solver) = (before.is_other_build(&now), before.solver_changes(&now));
        if !is_other && solver.is_empty() {
            return Ok(());
        }
        if !call.other_build {
            return Err(if is_other {
                let (version, build, this) =
                    (now.version().to_owned(), before.build().to_owned(), now.build().to_owned());
                FolderError::OtherBuild { folder, version, build, this, kept: kept(purpose) }
            } else {
                FolderError::OtherSolver { folder, what: solver.join(", "), kept: kept(purpose) }
            });
        }
        self.store.set_meta(Program::KEY, &json(&now))?;
        if purpose == Purpose::Run {
            self.store.set_meta(MIXED, &mixed(&before, &now, is_other, &solver))?;
        }
        Ok(())
    }

    /// Stores how the run goes on.
    fn told(&self, text: &str, study: &Study, purpose: Purpose, call: &Call<'_>) -> Result<(), FolderError> {
        if *text != *study.text {
            let at = self.store.elapsed_s()?;
            self.store.event(at, "study", "continued with a study file whose changes change no number")?;
        }
        // What an explanation answers depends on its command line as well.
        if purpose == Purpose::Explanation && !call.command.is_empty() {
            let info = self.store.meta("info")?.unwrap_or_default();
            if let Ok(info) = serde_json::from_str::<StudyInfo>(&info) {
                let info = StudyInfo { command: call.command.to_owned(), ..info };
                self.store.set_meta("info", &json(&info))?;
            }
        }
        Ok(())
    }
}

/// Whether a start was killed here before there was a run: an empty folder, or what [`Store::create`] leaves in one.
fn was_begun(path: &Path, database: &Path) -> bool {
    let left = |file: &Path| is_left_over(file, database) || file == path.join(NAME);
    std::fs::read_dir(path).is_ok_and(|mut entries| entries.all(|entry| entry.is_ok_and(|e| left(&e.path()))))
}

fn same_study(
    store: &Store,
    path: &Path,
    text: &str,
    study: &Study,
    purpose: Purpose,
) -> Result<(), FolderError> {
    let Some((part, which)) = differing(store, text, study, purpose)? else { return Ok(()) };
    let what = match part {
        Part::StudyFile => "the study file",
        Part::Recordings => "the recordings",
        Part::Solver => "the solver or one of its files",
    };
    let which = if which.is_empty() { String::new() } else { format!(": {}", which.join(", ")) };
    Err(FolderError::OtherStudy { folder: path.to_owned(), what, which })
}

/// The first part of a study that is not as the store has it, and what of it; `text` is that of the store.
fn differing(
    store: &Store,
    text: &str,
    study: &Study,
    purpose: Purpose,
) -> Result<Option<(Part, Vec<String>)>, StoreError> {
    let kept = store.meta(Meaning::KEY)?.unwrap_or_default();
    let kept: Meaning = serde_json::from_str(&kept).unwrap_or_default();
    let (parts, records) = kept.differences(&Meaning::of(study, purpose));
    let told = changes(text, &study.text);
    let part = first(&parts, &told);
    Ok(part.map(|part| match part {
        Part::StudyFile => (part, told),
        Part::Recordings => (part, records.iter().map(|name| format!("`{name}`")).collect()),
        Part::Solver => (part, Vec::new()),
    }))
}

/// The part to report. A change of the study file may change the other parts too; where the file is unchanged, a change of the
/// solver's description has changed the meaning of its words.
fn first(parts: &BTreeSet<Part>, told: &[String]) -> Option<Part> {
    let by_itself = parts.contains(&Part::Solver) && told.is_empty();
    parts.iter().copied().find(|part| !(by_itself && *part == Part::StudyFile))
}

/// What happens to the stored results, where a run goes on with another program.
fn kept(purpose: Purpose) -> &'static str {
    match purpose {
        Purpose::Run => "what is stored stays, the rest is computed anew, and the result says so",
        Purpose::Explanation => "runs that were made are made again",
    }
}

fn mixed(before: &Program, now: &Program, is_other: bool, solver: &[String]) -> String {
    let how = if is_other {
        format!("begun by build {} of this program and continued by build {}", before.build(), now.build())
    } else {
        format!("continued with another solver ({})", solver.join(", "))
    };
    format!(
        "the run was {how} (--other-build): its numbers are those of neither alone; start a new run for numbers that can be \
         reproduced"
    )
}

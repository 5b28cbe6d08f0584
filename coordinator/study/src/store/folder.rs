//! The run folder: a frozen study, the store, and the files made from it.
//!
//! A folder holds a run once its database stands under its name; whatever a killed start left before that is removed by the
//! next one. Result files are written beside their place and renamed into it, so a reader never sees half of one. Next files
//! to read: [`crate::store`], and [`super::resume`] for what a run may be continued with.

use std::io;
use std::path::{Path, PathBuf};

use starlings_fleet::StateStore;

use crate::store::{Program, Purpose, Store, StoreError};
use crate::summary::Summary;
use crate::{Fit, Study, posterior};

pub use super::call::Call;
pub use super::folder_error::FolderError;
pub use super::info::StudyInfo;
use super::info::info;
use super::json::json;
use super::lock::{FolderLock, holder};
use super::make;
use super::meaning::Meaning;

/// An open run folder.
pub struct RunFolder {
    /// The folder.
    pub path: PathBuf,
    /// Its database.
    pub store: Store,
    /// Held for as long as this process runs in the folder.
    pub(super) _lock: Option<FolderLock>,
}

/// Name under which the store keeps the course of the innovations with and without the observer.
pub const OBSERVER: &str = "observer";

/// Name under which the store keeps the covariance given the residuals: rows, in transformed units.
pub(crate) const GIVEN_RESIDUALS: &str = "covariance_given_residuals";

/// Name under which the store keeps the standard deviations of the predictions that the parameters' uncertainty makes: a list in the order
/// of the predictions, null where one is not known.
pub const PREDICTION_SD: &str = "prediction_sd";

/// The database of a run, and the study as it was run.
pub(super) const DATABASE: &str = "run.db";
const FROZEN: &str = "study.toml";

impl RunFolder {
    /// Makes the folder of a new run and freezes the study into it.
    ///
    /// # Errors
    /// When the folder holds a run or one of its files already, or cannot be written; nothing is left then.
    pub fn create(
        purpose: Purpose,
        path: &Path,
        study: &Study,
        command: &str,
        started: &str,
    ) -> Result<Self, FolderError> {
        let database = path.join(DATABASE);
        let free = || {
            if database.exists() {
                return Err(FolderError::Occupied(path.to_owned()));
            }
            let mut files = purpose.files().iter().map(|name| path.join(name));
            files.find(|file| file.exists()).map_or(Ok(()), |taken| Err(FolderError::InTheWay(taken)))
        };
        free()?;
        std::fs::create_dir_all(path)
            .map_err(|source| FolderError::Unwritable { path: path.to_owned(), source })?;
        let lock = FolderLock::take(path)?;
        // Another process may have started a run before the lock was taken.
        free()?;
        let info = json(&info(study, command, started));
        let (meaning, program) = (json(&Meaning::of(study, purpose)), json(&Program::of(study)));
        let meta = [
            ("study", &*study.text),
            (Meaning::KEY, &meaning),
            (Program::KEY, &program),
            ("info", &info),
            (Purpose::KEY, purpose.name()),
        ];
        let store = Store::create(&database, &meta)?;
        freeze(path, &study.text).inspect_err(|_| make::remove(&database))?;
        Ok(Self { path: path.to_owned(), store, _lock: Some(lock) })
    }

    /// Opens the folder of any run for reading.
    ///
    /// # Errors
    /// When there is no run.
    pub fn open(path: &Path) -> Result<Self, FolderError> {
        Ok(Self { path: path.to_owned(), store: Store::open_to_read(&path.join(DATABASE))?, _lock: None })
    }

    /// The store of a fleet, or a new one, with the folder for pieces that belongs to this run.
    ///
    /// # Errors
    /// When the store holds pieces of another run.
    pub(crate) fn settle_states(&self, states: Option<&StateStore>) -> Result<StateStore, StoreError> {
        let states = states.cloned().unwrap_or_else(|| StateStore::new(StateStore::MEMORY));
        if !states.settle(&self.path.join("states")) {
            let text =
                "the states of another run are still needed by this program: start the run in one of its own";
            return Err(StoreError::Unusable(text.to_owned()));
        }
        Ok(states)
    }

    /// Lets the pieces of a trial stand where those of the run will. Where there is a snapshot, which an earlier version may have made
    /// without such a trial, they do not: with a piece of the trial one of the snapshot that is equal would go.
    ///
    /// # Errors
    /// When the store fails.
    pub fn settle_states_of_trial(&self, states: Option<&StateStore>) -> Result<(), StoreError> {
        let count = "SELECT count(*) FROM snapshot";
        let n: i64 = self.store.guard(self.store.connection().query_row(count, [], |row| row.get(0)))?;
        if n == 0 { self.settle_states(states).map(drop) } else { Ok(()) }
    }

    /// Removes a run that came to nothing, and its folder where that is empty then.
    pub fn discard(self) {
        let Self { path, store, _lock: lock } = self;
        drop(store);
        make::remove(&path.join(DATABASE));
        // What cannot be removed is in the way of nothing: the next start says what it finds.
        let _ = std::fs::remove_file(path.join(FROZEN));
        drop(lock);
        let _ = std::fs::remove_dir(path);
    }

    /// Who runs in it, such as `process 17 on host`; `None` where nobody does.
    pub fn holder(&self) -> Option<String> {
        holder(&self.path)
    }

    /// Whether its command is done.
    ///
    /// # Errors
    /// When the store fails.
    pub fn is_done(&self) -> Result<bool, StoreError> {
        self.is_finished(self.purpose()?)
    }

    /// The command that it belongs to and what the store keeps of its study.
    ///
    /// # Errors
    /// When the store fails or its content is damaged.
    pub fn about(&self) -> Result<(&'static str, StudyInfo), StoreError> {
        let text = self.store.meta("info")?.unwrap_or_default();
        let info = serde_json::from_str(&text).map_err(|error| self.store.damaged("info", error))?;
        Ok((self.purpose()?.command(), info))
    }

    /// Folds the log into the database once more, after those who read the run while it ran: a finished run can be read from a
    /// read-only folder.
    pub fn rest(&self) {
        // Where another process still reads, the log stays; the run is finished all the same.
        let _ = self.store.close_log();
    }

    /// What the folder is for.
    ///
    /// # Errors
    /// When the store fails.
    pub fn purpose(&self) -> Result<Purpose, StoreError> {
        Purpose::of(&self.store)
    }

    /// The summary, once the run is finished.
    ///
    /// # Errors
    /// When the store fails or its content is damaged.
    pub fn summary(&self) -> Result<Option<Summary>, StoreError> {
        let text = self.store.meta("summary")?;
        text.map(|t| serde_json::from_str(&t).map_err(|e| self.store.damaged("summary", e))).transpose()
    }

    pub(crate) fn finish(&mut self, study: &Study, fit: &Fit, summary: &Summary) -> Result<(), StoreError> {
        let posterior =
            posterior::to_csv(study, &fit.posterior).map_err(|e| self.store.damaged("posterior", e))?;
        self.store.forget_states()?;
        self.store.set_meta("posterior", &posterior)?;
        self.store.set_meta("summary", &json(summary))?;
        self.store.forget_arrived()?;
        // The log stays open while another process reads the database; the run is finished all the same.
        let _ = self.store.close_log();
        Ok(())
    }
}

/// Writes the study as it is run.
pub(super) fn freeze(path: &Path, text: &str) -> Result<(), FolderError> {
    let frozen = path.join(FROZEN);
    write(&frozen, text).map_err(|source| FolderError::Unwritable { path: frozen, source })
}

/// Whether a folder has its study.
pub(super) fn is_frozen(path: &Path) -> bool {
    path.join(FROZEN).exists()
}

/// Writes a file beside its place and renames it into it.
///
/// # Errors
/// When the file cannot be written or renamed.
pub fn write(path: &Path, text: &str) -> io::Result<()> {
    let partial = path.with_extension("partial");
    std::fs::write(&partial, text).and_then(|()| std::fs::rename(&partial, path)).inspect_err(|_| {
        // The failure to write is returned; a partial file that cannot be removed either is left.
        let _ = std::fs::remove_file(&partial);
    })
}

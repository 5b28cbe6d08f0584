//! Makes the database of a new run: it is filled under another name and renamed when it is complete.
//!
//! So a database under its final name is complete, whenever the program that made it was killed; files left over from a killed
//! program are removed by the next one. Next file to read: [`super::schema`].

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use rusqlite::Connection;

use super::schema::{SCHEMA, SCHEMA_VERSION};
use super::{Store, StoreError, arrived, inputs, kept_states, remembered};

/// Endings of the files that SQLite keeps beside a database.
const COMPANIONS: [&str; 4] = ["", "-wal", "-shm", "-journal"];

impl Store {
    /// Makes the database of a new run with its first named values, all or nothing.
    ///
    /// # Errors
    /// When the file exists or cannot be written; a file begun is removed.
    pub fn create(path: &Path, meta: &[(&str, &str)]) -> Result<Self, StoreError> {
        if path.exists() {
            return Err(StoreError::Unusable(format!("{} already holds a run", path.display())));
        }
        let unfinished = unfinished(path);
        remove(&unfinished);
        let database = |source| StoreError::Database { path: path.to_owned(), source };
        let unusable = |error| StoreError::Unusable(format!("cannot write to {}: {error}", path.display()));
        fill(&unfinished, meta)
            .map_err(database)
            .and_then(|()| rename(&unfinished, path).map_err(unusable))
            .inspect_err(|_| remove(&unfinished))?;
        Self::open(path).inspect_err(|_| remove(path))
    }
}

/// The name of a database that is not complete yet.
pub(super) fn unfinished(path: &Path) -> PathBuf {
    with_ending(path, ".unfinished")
}

/// Whether a file was left over when a program was killed while it made the database.
pub(super) fn is_left_over(file: &Path, database: &Path) -> bool {
    COMPANIONS.iter().any(|ending| with_ending(&unfinished(database), ending) == file)
}

/// Removes a database and what SQLite keeps beside it.
pub(super) fn remove(path: &Path) {
    for ending in COMPANIONS {
        // Mostly there is none; a file that cannot be removed is reported by the later step that it hinders.
        let _ = std::fs::remove_file(with_ending(path, ending));
    }
}

fn with_ending(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(ending);
    name.into()
}

/// Fills a database and closes it.
fn fill(path: &Path, meta: &[(&str, &str)]) -> rusqlite::Result<()> {
    let mut connection = Connection::open(path)?;
    let transaction = connection.transaction()?;
    transaction.execute_batch(SCHEMA)?;
    transaction.execute_batch(remembered::TABLE)?;
    transaction.execute_batch(arrived::TABLE)?;
    transaction.execute_batch(kept_states::TABLE)?;
    transaction.execute_batch(inputs::TABLE)?;
    transaction.pragma_update(None, "user_version", SCHEMA_VERSION)?;
    for (key, value) in meta {
        transaction.execute("INSERT INTO meta (key, value) VALUES (?1, ?2)", [key, value])?;
    }
    transaction.commit()?;
    connection.close().map_err(|(_, error)| error)
}

fn rename(from: &Path, to: &Path) -> io::Result<()> {
    std::fs::rename(from, to)?;
    // So that the name lasts through a power cut as well; a file system that cannot do that has the name all the same.
    let _ = to.parent().map(|folder| File::open(folder).and_then(|folder| folder.sync_all()));
    Ok(())
}

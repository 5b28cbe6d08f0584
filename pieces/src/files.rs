//! Pieces as files in a folder, each under its name.
//!
//! A state is data of the study: folder and files are the user's own (0700 and 0600), unless the folder says that it is a group's.

use std::collections::HashSet;
use std::io::{ErrorKind, Write as _};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use bytes::Bytes;
use tempfile::{Builder, TempDir};

use crate::access::Access;
use crate::folder::{Staged, Storage};
use crate::{PieceError, PieceName, hex};

/// End of the name of a file that is being written.
const PARTIAL: &str = ".partial";

/// A folder of files. It is made when the first piece is written.
#[derive(Debug)]
pub(crate) struct Files {
    path: PathBuf,
    access: Access,
    /// What removes a temporary one.
    _temporary: Option<TempDir>,
}

impl Files {
    /// For nobody but the user.
    pub(crate) fn at(path: &Path) -> Self {
        Self { path: path.to_owned(), access: Access::Own, _temporary: None }
    }

    /// Inside a folder that machines share: for the group of that one where it is a group's.
    pub(crate) fn inside(place: &Path, name: &str) -> Self {
        Self { path: place.join(name), access: Access::of(place), _temporary: None }
    }

    /// Among the system's temporary ones; it goes with this value.
    pub(crate) fn temporary() -> Result<Self, PieceError> {
        let mut builder = Builder::new();
        builder.prefix("starlings-states-").permissions(Access::Own.of_folder());
        let folder = builder.tempdir().map_err(Self::failed("make a folder in", &std::env::temp_dir()))?;
        let path = folder.path().to_owned();
        Ok(Self { path, access: Access::Own, _temporary: Some(folder) })
    }

    /// Where a piece stands.
    fn file(&self, name: &PieceName) -> PathBuf {
        self.path.join(hex(name))
    }

    fn failed(what: &'static str, path: &Path) -> impl Fn(std::io::Error) -> PieceError {
        move |source| PieceError::Folder { what, path: path.to_owned(), source: Arc::new(source) }
    }
}

impl Storage for Files {
    fn path(&self) -> &Path {
        &self.path
    }

    fn stage(&self, bytes: &[u8]) -> Result<Staged, PieceError> {
        let write = || {
            let mut builder = Builder::new();
            builder.suffix(PARTIAL).permissions(self.access.of_file());
            let mut file = builder.tempfile_in(&self.path)?;
            file.write_all(bytes)?;
            self.access.open_up(file.path(), &self.access.of_file())?;
            Ok(file.into_temp_path())
        };
        let written = write().or_else(|error: std::io::Error| {
            if error.kind() != ErrorKind::NotFound {
                return Err(error);
            }
            self.access.make(&self.path)?;
            write()
        });
        written.map(Staged::File).map_err(Self::failed("write into", &self.path))
    }

    fn place(&self, written: Staged, name: &PieceName) -> Result<(), PieceError> {
        let path = self.file(name);
        match written {
            Staged::File(file) => {
                file.persist(&path).map_err(|refused| Self::failed("write", &path)(refused.error))
            }
            #[cfg(feature = "s3")]
            Staged::Object(bytes) => std::fs::write(&path, bytes).map_err(Self::failed("write", &path)),
        }
    }

    fn fetch(&self, name: &PieceName) -> Result<Bytes, PieceError> {
        let path = self.file(name);
        match std::fs::read(&path) {
            Err(error) if error.kind() == ErrorKind::NotFound => {
                Err(PieceError::Missing { piece: hex(name), path })
            }
            other => other.map(Bytes::from).map_err(Self::failed("read", &path)),
        }
    }

    fn length(&self, name: &PieceName) -> Result<u64, PieceError> {
        let path = self.file(name);
        let found = std::fs::metadata(&path);
        found.map(|found| found.len()).map_err(|_| PieceError::Missing { piece: hex(name), path })
    }

    fn remove(&self, name: &PieceName) {
        // A file that stays costs space; the next resume removes it.
        let _ = std::fs::remove_file(self.file(name));
    }

    fn keep_only(&self, names: &HashSet<String>) {
        let Ok(entries) = std::fs::read_dir(&self.path) else { return };
        for entry in entries.flatten() {
            if !entry.file_name().to_str().is_some_and(|name| names.contains(name)) {
                let _ = std::fs::remove_file(entry.path());
            }
        }
    }

    fn clear(&self) {
        let _ = std::fs::remove_dir_all(&self.path);
    }
}

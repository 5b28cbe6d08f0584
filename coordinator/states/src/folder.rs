//! The folder that holds pieces beyond the limit of memory, and those that a resumed run needs: a file per piece, by its name.

use std::collections::HashSet;
use std::hash::{BuildHasher, Hasher, RandomState};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use bytes::Bytes;
use starlings_proto::convert::state::ChunkId;

use crate::{StateError, hex};

/// End of the name of a file that is being written.
const PARTIAL: &str = "partial";

/// A folder of pieces. It is made when the first piece is written.
#[derive(Debug)]
pub(crate) struct Folder {
    path: PathBuf,
    /// Whether it goes with this value.
    temporary: bool,
    partial: AtomicU64,
}

impl Folder {
    /// A folder that stays.
    pub(crate) fn at(path: &Path) -> Self {
        Self { path: path.to_owned(), temporary: false, partial: AtomicU64::new(0) }
    }

    /// A folder among the system's temporary ones, which goes with this value. Nobody else can have made it before.
    pub(crate) fn temporary() -> Self {
        let path = loop {
            let name = format!("starlings-states-{:016x}", RandomState::new().build_hasher().finish());
            let path = std::env::temp_dir().join(name);
            // Whatever else is wrong is told when a piece is written.
            if private(&path, false).map_err(|error| error.kind()) != Err(ErrorKind::AlreadyExists) {
                break path;
            }
        };
        Self { path, temporary: true, partial: AtomicU64::new(0) }
    }

    /// Whether it is this one.
    pub(crate) fn is_at(&self, path: &Path) -> bool {
        self.path == path
    }

    /// Where a piece stands.
    fn file(&self, name: &ChunkId) -> PathBuf {
        self.path.join(hex(name))
    }

    fn failed(what: &'static str, path: &Path) -> impl Fn(std::io::Error) -> StateError {
        move |source| StateError::Folder { what, path: path.to_owned(), source: Arc::new(source) }
    }

    /// Writes a piece beside its place; [`Folder::place`] puts it there.
    pub(crate) fn write(&self, bytes: &[u8]) -> Result<PathBuf, StateError> {
        let number = self.partial.fetch_add(1, Ordering::Relaxed);
        let path = self.path.join(format!("{number}.{PARTIAL}"));
        let written = std::fs::write(&path, bytes).or_else(|error| {
            if error.kind() != ErrorKind::NotFound {
                return Err(error);
            }
            private(&self.path, true)?;
            std::fs::write(&path, bytes)
        });
        written.map_err(Self::failed("write", &path)).inspect_err(|_| {
            // The failure to write is returned.
            let _ = std::fs::remove_file(&path);
        })?;
        Ok(path)
    }

    /// Puts a written piece into its place.
    pub(crate) fn place(&self, written: &Path, name: &ChunkId) -> Result<(), StateError> {
        std::fs::rename(written, self.file(name)).map_err(Self::failed("write", written))
    }

    /// Drops a written piece that is not needed after all.
    pub(crate) fn discard(written: &Path) {
        let _ = std::fs::remove_file(written);
    }

    /// A piece, checked against its name.
    pub(crate) fn read(&self, name: &ChunkId) -> Result<Bytes, StateError> {
        let path = self.file(name);
        let bytes = match std::fs::read(&path) {
            Err(error) if error.kind() == ErrorKind::NotFound => {
                return Err(StateError::Missing { piece: hex(name), path });
            }
            other => other.map_err(Self::failed("read", &path))?,
        };
        if blake3::hash(&bytes) != *name {
            return Err(StateError::Damaged { piece: hex(name), path });
        }
        Ok(bytes.into())
    }

    /// Whether a piece is there, with so many bytes.
    pub(crate) fn check(&self, name: &ChunkId, bytes: usize) -> Result<(), StateError> {
        let path = self.file(name);
        match std::fs::metadata(&path) {
            Ok(found) if found.len() == bytes as u64 => Ok(()),
            Ok(_) => Err(StateError::Damaged { piece: hex(name), path }),
            Err(_) => Err(StateError::Missing { piece: hex(name), path }),
        }
    }

    /// Removes a piece that nobody needs.
    pub(crate) fn remove(&self, name: &ChunkId) {
        // A file that stays costs space; the next resume removes it.
        let _ = std::fs::remove_file(self.file(name));
    }

    /// Removes every file that is none of these pieces, as a killed process leaves them.
    pub(crate) fn keep_only(&self, names: &HashSet<String>) {
        let Ok(entries) = std::fs::read_dir(&self.path) else { return };
        for entry in entries.flatten() {
            if !entry.file_name().to_str().is_some_and(|name| names.contains(name)) {
                let _ = std::fs::remove_file(entry.path());
            }
        }
    }

    /// Removes the folder with all that is in it.
    pub(crate) fn clear(&self) {
        let _ = std::fs::remove_dir_all(&self.path);
    }
}

/// Makes a folder that other users cannot look into: a state is data of the study.
fn private(path: &Path, with_parents: bool) -> std::io::Result<()> {
    let mut builder = std::fs::DirBuilder::new();
    builder.recursive(with_parents);
    #[cfg(unix)]
    std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
    builder.create(path)
}

impl Drop for Folder {
    fn drop(&mut self) {
        if self.temporary {
            self.clear();
        }
    }
}

//! A folder of pieces: a file per piece, by its name. Whoever reads one checks it against its name.
//!
//! A state is data of the study: folder and files are the user's own (0700 and 0600), unless the folder says that it is a group's.

use std::collections::HashSet;
use std::io::{ErrorKind, Write as _};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use bytes::Bytes;
use tempfile::{Builder, TempDir, TempPath};

use crate::access::Access;
use crate::{PieceError, PieceName, hex};

/// End of the name of a file that is being written.
const PARTIAL: &str = ".partial";

/// A folder of pieces. It is made when the first piece is written. Several processes may write into one.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    access: Access,
    /// Whether it goes with this value.
    passing: bool,
    /// What removes a temporary one.
    _temporary: Option<TempDir>,
}

/// A piece that is written beside its place; dropped, it is gone.
#[derive(Debug)]
#[must_use]
pub struct Staged(TempPath);

impl Folder {
    fn new(path: PathBuf, access: Access) -> Self {
        Self { path, access, passing: false, _temporary: None }
    }

    /// A folder that stays, for nobody but the user.
    pub fn at(path: &Path) -> Self {
        Self::new(path.to_owned(), Access::Own)
    }

    /// A folder that stays, inside one that machines share: for the group of that one where it is a group's.
    pub(crate) fn inside(place: &Path, name: &str) -> Self {
        Self::new(place.join(name), Access::of(place))
    }

    /// A folder among the system's temporary ones, which goes with this value.
    ///
    /// # Errors
    /// When none can be made.
    pub fn temporary() -> Result<Self, PieceError> {
        let mut builder = Builder::new();
        builder.prefix("starlings-states-").permissions(Access::Own.of_folder());
        let folder = builder.tempdir().map_err(Self::failed("make a folder in", &std::env::temp_dir()))?;
        let path = folder.path().to_owned();
        Ok(Self { path, access: Access::Own, passing: false, _temporary: Some(folder) })
    }

    /// The same, which goes with this value.
    #[must_use]
    pub fn passing(mut self) -> Self {
        self.passing = true;
        self
    }

    /// Whether it is this one.
    pub fn is_at(&self, path: &Path) -> bool {
        self.path == path
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Where a piece stands.
    fn file(&self, name: &PieceName) -> PathBuf {
        self.path.join(hex(name))
    }

    fn failed(what: &'static str, path: &Path) -> impl Fn(std::io::Error) -> PieceError {
        move |source| PieceError::Folder { what, path: path.to_owned(), source: Arc::new(source) }
    }

    /// Writes a piece beside its place; [`Folder::place`] puts it there.
    ///
    /// # Errors
    /// When the folder refuses.
    pub fn stage(&self, bytes: &[u8]) -> Result<Staged, PieceError> {
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
        written.map(Staged).map_err(Self::failed("write into", &self.path))
    }

    /// Puts a written piece into its place.
    ///
    /// # Errors
    /// When the folder refuses.
    pub fn place(&self, written: Staged, name: &PieceName) -> Result<(), PieceError> {
        let path = self.file(name);
        written.0.persist(&path).map_err(|refused| Self::failed("write", &path)(refused.error))
    }

    /// Writes a piece into its place, whether it is there or not: what stands there may be damaged.
    ///
    /// # Errors
    /// When the folder refuses.
    pub fn put(&self, name: &PieceName, bytes: &[u8]) -> Result<(), PieceError> {
        self.place(self.stage(bytes)?, name)
    }

    /// A piece, checked against its name.
    ///
    /// # Errors
    /// When it is missing, damaged, or the folder refuses.
    pub fn read(&self, name: &PieceName) -> Result<Bytes, PieceError> {
        let path = self.file(name);
        let bytes = match std::fs::read(&path) {
            Err(error) if error.kind() == ErrorKind::NotFound => {
                return Err(PieceError::Missing { piece: hex(name), path });
            }
            other => other.map_err(Self::failed("read", &path))?,
        };
        if blake3::hash(&bytes) != *name {
            return Err(PieceError::Damaged { piece: hex(name), path });
        }
        Ok(bytes.into())
    }

    /// Whether a piece is there, with so many bytes.
    ///
    /// # Errors
    /// When it is not.
    pub fn check(&self, name: &PieceName, bytes: usize) -> Result<(), PieceError> {
        let path = self.file(name);
        match std::fs::metadata(&path) {
            Ok(found) if found.len() == bytes as u64 => Ok(()),
            Ok(_) => Err(PieceError::Damaged { piece: hex(name), path }),
            Err(_) => Err(PieceError::Missing { piece: hex(name), path }),
        }
    }

    /// Removes a piece that nobody needs.
    pub fn remove(&self, name: &PieceName) {
        // A file that stays costs space; the next resume removes it.
        let _ = std::fs::remove_file(self.file(name));
    }

    /// Removes every file that is none of these pieces, as a killed process leaves them.
    pub fn keep_only(&self, names: &HashSet<String>) {
        let Ok(entries) = std::fs::read_dir(&self.path) else { return };
        for entry in entries.flatten() {
            if !entry.file_name().to_str().is_some_and(|name| names.contains(name)) {
                let _ = std::fs::remove_file(entry.path());
            }
        }
    }

    /// Removes the folder with all that is in it.
    pub fn clear(&self) {
        let _ = std::fs::remove_dir_all(&self.path);
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        if self.passing {
            self.clear();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_writers_of_one_folder_are_in_nobodys_way_and_damage_is_told() {
        let scratch = tempfile::tempdir().expect("a folder");
        let path = scratch.path().join("pieces");
        let (a, b) = (Folder::at(&path), Folder::at(&path));
        let name = |bytes: &[u8]| *blake3::hash(bytes).as_bytes();
        let (one, other) = (a.stage(b"one").expect("room"), b.stage(b"other").expect("room"));
        a.place(one, &name(b"one")).expect("room");
        b.place(other, &name(b"other")).expect("room");
        assert_eq!(b.read(&name(b"one")).expect("it is there"), "one");
        assert_eq!(a.read(&name(b"other")).expect("it is there"), "other");
        std::fs::write(path.join(hex(&name(b"one"))), b"two").expect("room");
        a.check(&name(b"one"), 3).expect("its length is right");
        assert!(matches!(b.read(&name(b"one")), Err(PieceError::Damaged { .. })));
        a.put(&name(b"one"), b"one").expect("room");
        assert_eq!(b.read(&name(b"one")).expect("it was written again"), "one");
        assert!(matches!(a.read(&[0; 32]), Err(PieceError::Missing { .. })));
    }

    #[test]
    fn a_piece_that_is_not_placed_and_a_temporary_folder_leave_nothing() {
        let scratch = tempfile::tempdir().expect("a folder");
        let folder = Folder::at(scratch.path());
        drop(folder.stage(b"one").expect("room"));
        assert_eq!(std::fs::read_dir(scratch.path()).expect("readable").count(), 0);
        let folder = Folder::temporary().expect("room");
        folder.put(blake3::hash(b"one").as_bytes(), b"one").expect("room");
        let path = folder.path().to_owned();
        assert!(path.exists());
        drop(folder);
        assert!(!path.exists());
    }
}

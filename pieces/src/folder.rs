//! A folder of pieces: each under its name. Whoever reads one checks it against its name.
//!
//! What it is made of is one of two: files, or objects of a bucket. Next files to read: [`crate::files`], `bucket`.

use std::collections::HashSet;
use std::fmt::Debug;
use std::path::{Path, PathBuf};

use bytes::Bytes;
use tempfile::TempPath;

use crate::files::Files;
use crate::{PieceError, PieceName, hex};

/// What pieces stand in.
pub(crate) trait Storage: Debug + Send + Sync {
    /// Where it is, for people.
    fn path(&self) -> &Path;
    /// Writes a piece where nobody sees it yet.
    fn stage(&self, bytes: &[u8]) -> Result<Staged, PieceError>;
    /// Puts a written piece into its place.
    fn place(&self, written: Staged, name: &PieceName) -> Result<(), PieceError>;
    /// What stands in the place of a piece.
    fn fetch(&self, name: &PieceName) -> Result<Bytes, PieceError>;
    /// Bytes of what stands there.
    fn length(&self, name: &PieceName) -> Result<u64, PieceError>;
    fn remove(&self, name: &PieceName);
    /// Removes all but what has these names.
    fn keep_only(&self, names: &HashSet<String>);
    /// Removes all.
    fn clear(&self);
}

/// A folder of pieces. It is made when the first piece is written. Several processes may write into one.
#[derive(Debug)]
pub struct Folder {
    storage: Box<dyn Storage>,
    /// Whether it goes with this value.
    passing: bool,
}

/// A piece that is written and not yet in its place; dropped, it is gone.
#[derive(Debug)]
#[must_use]
pub enum Staged {
    /// Beside its place.
    File(TempPath),
    /// To be sent as a whole.
    #[cfg(feature = "s3")]
    Object(Bytes),
}

impl Folder {
    pub(crate) fn of(storage: impl Storage + 'static) -> Self {
        Self { storage: Box::new(storage), passing: false }
    }

    /// A folder of files that stays, for nobody but the user.
    pub fn at(path: &Path) -> Self {
        Self::of(Files::at(path))
    }

    /// A folder of files among the system's temporary ones, which goes with this value.
    ///
    /// # Errors
    /// When none can be made.
    pub fn temporary() -> Result<Self, PieceError> {
        Files::temporary().map(Self::of)
    }

    /// The same, which goes with this value.
    #[must_use]
    pub fn passing(mut self) -> Self {
        self.passing = true;
        self
    }

    /// Whether it is this one.
    pub fn is_at(&self, path: &Path) -> bool {
        self.path() == path
    }

    /// Where it is; of a bucket its URL.
    pub fn path(&self) -> &Path {
        self.storage.path()
    }

    /// Writes a piece where nobody sees it; [`Folder::place`] puts it into its place.
    ///
    /// # Errors
    /// When the folder refuses.
    pub fn stage(&self, bytes: &[u8]) -> Result<Staged, PieceError> {
        self.storage.stage(bytes)
    }

    /// Puts a written piece into its place.
    ///
    /// # Errors
    /// When the folder refuses.
    pub fn place(&self, written: Staged, name: &PieceName) -> Result<(), PieceError> {
        self.storage.place(written, name)
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
        let bytes = self.storage.fetch(name)?;
        if blake3::hash(&bytes) != *name {
            return Err(self.damaged(name));
        }
        Ok(bytes)
    }

    /// Whether a piece is there, with so many bytes.
    ///
    /// # Errors
    /// When it is not.
    pub fn check(&self, name: &PieceName, bytes: usize) -> Result<(), PieceError> {
        if self.storage.length(name)? == bytes as u64 { Ok(()) } else { Err(self.damaged(name)) }
    }

    fn damaged(&self, name: &PieceName) -> PieceError {
        let piece = hex(name);
        let path: PathBuf = self.path().join(&piece);
        PieceError::Damaged { piece, path }
    }

    /// Removes a piece that nobody needs.
    pub fn remove(&self, name: &PieceName) {
        self.storage.remove(name);
    }

    /// Removes everything that is none of these pieces, as a killed process leaves it.
    pub fn keep_only(&self, names: &HashSet<String>) {
        self.storage.keep_only(names);
    }

    /// Removes the folder with all that is in it.
    pub fn clear(&self) {
        self.storage.clear();
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

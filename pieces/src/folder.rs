//! A folder of pieces: a file per piece, by its name. Whoever reads one checks it against its name.

use std::collections::HashSet;
use std::hash::{BuildHasher, Hasher, RandomState};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use bytes::Bytes;

use crate::{PieceError, PieceName, hex};

/// End of the name of a file that is being written.
const PARTIAL: &str = "partial";

/// A folder of pieces. It is made when the first piece is written. Several processes may write into one.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    /// Whether it goes with this value.
    temporary: bool,
    /// What no other writer of the folder has in the names of its files.
    token: u64,
    partial: AtomicU64,
}

/// A piece that is written beside its place.
#[derive(Debug)]
#[must_use]
pub struct Staged(PathBuf);

impl Folder {
    fn new(path: PathBuf, temporary: bool) -> Self {
        Self {
            path,
            temporary,
            token: RandomState::new().build_hasher().finish(),
            partial: AtomicU64::new(0),
        }
    }

    /// A folder that stays.
    pub fn at(path: &Path) -> Self {
        Self::new(path.to_owned(), false)
    }

    /// A folder among the system's temporary ones, which goes with this value. Nobody else can have made it before.
    pub fn temporary() -> Self {
        let path = loop {
            let name = format!("starlings-states-{:016x}", RandomState::new().build_hasher().finish());
            let path = std::env::temp_dir().join(name);
            // Whatever else is wrong is told when a piece is written.
            if private(&path, false).map_err(|error| error.kind()) != Err(ErrorKind::AlreadyExists) {
                break path;
            }
        };
        Self::new(path, true)
    }

    /// The same, which goes with this value.
    #[must_use]
    pub fn passing(mut self) -> Self {
        self.temporary = true;
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
        let number = self.partial.fetch_add(1, Ordering::Relaxed);
        let path = self.path.join(format!("{:016x}-{number}.{PARTIAL}", self.token));
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
        Ok(Staged(path))
    }

    /// Puts a written piece into its place.
    ///
    /// # Errors
    /// When the folder refuses.
    pub fn place(&self, written: &Staged, name: &PieceName) -> Result<(), PieceError> {
        std::fs::rename(&written.0, self.file(name)).map_err(Self::failed("write", &written.0))
    }

    /// Drops a written piece that is not needed after all.
    pub fn discard(written: Staged) {
        let _ = std::fs::remove_file(written.0);
    }

    /// Writes a piece into its place, whether it is there or not: what stands there may be damaged.
    ///
    /// # Errors
    /// When the folder refuses.
    pub fn put(&self, name: &PieceName, bytes: &[u8]) -> Result<(), PieceError> {
        let written = self.stage(bytes)?;
        self.place(&written, name).inspect_err(|_| Self::discard(written))
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
        a.place(&one, &name(b"one")).expect("room");
        b.place(&other, &name(b"other")).expect("room");
        assert_eq!(b.read(&name(b"one")).expect("it is there"), "one");
        assert_eq!(a.read(&name(b"other")).expect("it is there"), "other");
        std::fs::write(path.join(hex(&name(b"one"))), b"two").expect("room");
        a.check(&name(b"one"), 3).expect("its length is right");
        assert!(matches!(b.read(&name(b"one")), Err(PieceError::Damaged { .. })));
        a.put(&name(b"one"), b"one").expect("room");
        assert_eq!(b.read(&name(b"one")).expect("it was written again"), "one");
        assert!(matches!(a.read(&[0; 32]), Err(PieceError::Missing { .. })));
    }
}

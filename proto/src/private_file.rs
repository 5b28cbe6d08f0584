//! Files that hold secrets: written for their owner alone, and refused where anybody else could have read or made them.
//!
//! Next file to read: [`crate::access`], the file by which a worker finds its coordinator.

use std::fs::{self, File, Metadata, OpenOptions, Permissions};
use std::io::{self, Read, Write};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt, PermissionsExt};
use std::path::{Path, PathBuf};

use rustix::fs::OFlags;
use tempfile::NamedTempFile;

/// What its owner may do with such a file, and nobody else.
const OWNER_ONLY: u32 = 0o600;

/// The longest text that is read, bytes: such a file has about two thousand.
const LONGEST: u64 = 64 * 1024;

/// Why a private file is not taken.
#[derive(Debug, thiserror::Error)]
pub enum PrivateFileError {
    /// It cannot be opened or read.
    #[error("cannot read {}: {source}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// Others can read or write it.
    #[error(
        "{} can be read or written by others (mode {mode:o}), so it is no secret any more: chmod 600 {}; if others could \
         have read it, remove it and start the coordinator again for a new one",
        path.display(),
        path.display()
    )]
    Open {
        /// The file.
        path: PathBuf,
        /// Its mode.
        mode: u32,
    },
    /// It belongs to somebody else.
    #[error(
        "{} belongs to the user with the number {owner}, who could have put anything into it: copy it to a file of your own",
        path.display()
    )]
    Foreign {
        /// The file.
        path: PathBuf,
        /// Its owner.
        owner: u32,
    },
    /// It is a folder, a pipe or something else that is no file, or too long for one.
    #[error("{} is no file of at most {LONGEST} bytes of text", path.display())]
    NoFile {
        /// The file.
        path: PathBuf,
    },
}

/// Reads a file that only its owner can, this user or root.
///
/// # Errors
/// When it cannot be read, or somebody else could.
pub fn read(path: &Path) -> Result<String, PrivateFileError> {
    let unreadable = |source| PrivateFileError::Unreadable { path: path.to_owned(), source };
    let no_file = || PrivateFileError::NoFile { path: path.to_owned() };
    // A pipe would be waited for otherwise.
    let unwaiting = OFlags::NONBLOCK.bits().cast_signed();
    let file = OpenOptions::new().read(true).custom_flags(unwaiting).open(path).map_err(unreadable)?;
    // Asked of what was opened: a name can be given to another file meanwhile.
    check(path, &file.metadata().map_err(unreadable)?)?;
    let mut text = String::new();
    file.take(LONGEST + 1).read_to_string(&mut text).map_err(|error| match error.kind() {
        io::ErrorKind::InvalidData => no_file(),
        _ => unreadable(error),
    })?;
    if text.len() as u64 > LONGEST { Err(no_file()) } else { Ok(text) }
}

/// Whether nobody else could have read or made it.
fn check(path: &Path, found: &Metadata) -> Result<(), PrivateFileError> {
    let path = path.to_owned();
    if !found.is_file() {
        return Err(PrivateFileError::NoFile { path });
    }
    let own = rustix::process::geteuid().as_raw();
    if found.uid() != own && found.uid() != 0 {
        return Err(PrivateFileError::Foreign { path, owner: found.uid() });
    }
    let mode = found.mode() & 0o777;
    if mode & 0o077 != 0 { Err(PrivateFileError::Open { path, mode }) } else { Ok(()) }
}

/// Writes a file for its owner alone beside its place and renames it into it, so that no reader sees half of one. A symbolic link
/// at its place is replaced, not followed.
///
/// # Errors
/// When it cannot be written or renamed.
pub fn write(path: &Path, text: &str) -> io::Result<()> {
    beside(path, text)?.persist(path).map(drop).map_err(|error| error.error)
}

/// The same where nothing stands yet.
///
/// # Errors
/// When something stands there, or it cannot be written or renamed.
pub fn write_new(path: &Path, text: &str) -> io::Result<()> {
    beside(path, text)?.persist_noclobber(path).map(drop).map_err(|error| error.error)
}

/// A file with this text beside a place, which goes unless it is put there.
fn beside(path: &Path, text: &str) -> io::Result<NamedTempFile> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut builder = tempfile::Builder::new();
    let mut file = builder.prefix(".access-").suffix(".partial").tempfile_in(folder)?;
    fill(file.as_file_mut(), text)?;
    Ok(file)
}

/// Makes a file for its owner alone, where there is none yet, and keeps it open.
///
/// # Errors
/// When there is one, or it cannot be written.
pub fn create(path: &Path, text: &str) -> io::Result<File> {
    let mut file = OpenOptions::new().read(true).write(true).create_new(true).mode(OWNER_ONLY).open(path)?;
    fill(&mut file, text).inspect_err(|_| drop(fs::remove_file(path)))?;
    Ok(file)
}

fn fill(file: &mut File, text: &str) -> io::Result<()> {
    // The mode at its making is what the system's mask leaves of it.
    file.set_permissions(Permissions::from_mode(OWNER_ONLY))?;
    file.write_all(text.as_bytes())?;
    file.sync_all()
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;

    #[test]
    fn a_file_is_its_owners_alone_and_one_that_others_can_read_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("secret");
        write(&path, "one").unwrap();
        write(&path, "two").unwrap();
        assert_eq!(fs::metadata(&path).unwrap().mode() & 0o777, OWNER_ONLY);
        assert_eq!(read(&path).unwrap(), "two");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "nothing else is left");
        for mode in [0o640, 0o604, 0o620, 0o602, 0o610] {
            fs::set_permissions(&path, Permissions::from_mode(mode)).unwrap();
            let says = read(&path).unwrap_err().to_string();
            assert!(says.contains(&format!("chmod 600 {}", path.display())), "{says}");
        }
        fs::set_permissions(&path, Permissions::from_mode(0o400)).unwrap();
        assert_eq!(read(&path).unwrap(), "two");
    }

    #[test]
    fn a_symbolic_link_is_replaced_and_what_it_names_is_left() {
        let folder = tempfile::tempdir().unwrap();
        let [own, other] = ["own", "other"].map(|name| folder.path().join(name));
        fs::write(&other, "theirs").unwrap();
        symlink(&other, &own).unwrap();
        assert!(create(&own, "mine").is_err(), "a name that is taken is not made anew");
        write(&own, "mine").unwrap();
        assert_eq!(fs::read_to_string(&other).unwrap(), "theirs");
        assert!(fs::symlink_metadata(&own).unwrap().is_file());
        assert_eq!(read(&own).unwrap(), "mine");
    }

    #[test]
    fn a_named_pipe_is_refused_at_once_and_a_new_file_takes_no_place() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&path).status().unwrap();
        assert!(made.success());
        // Nobody ever writes into it.
        assert!(matches!(read(&path), Err(PrivateFileError::NoFile { .. })));
        let error = write_new(&path, "mine").unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::AlreadyExists);
        write_new(&folder.path().join("new"), "mine").unwrap();
        assert_eq!(read(&folder.path().join("new")).unwrap(), "mine");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2, "nothing else is left");
    }

    #[test]
    fn a_folder_a_long_file_and_bytes_that_are_no_text_are_no_private_file() {
        let folder = tempfile::tempdir().unwrap();
        assert!(matches!(read(folder.path()), Err(PrivateFileError::NoFile { .. })));
        let path = folder.path().join("long");
        write(&path, &"x".repeat(LONGEST as usize + 1)).unwrap();
        assert!(matches!(read(&path), Err(PrivateFileError::NoFile { .. })));
        let path = folder.path().join("bytes");
        write(&path, "").unwrap();
        fs::write(&path, [0xff, 0xfe]).unwrap();
        assert!(matches!(read(&path), Err(PrivateFileError::NoFile { .. })));
        assert!(matches!(read(&folder.path().join("none")), Err(PrivateFileError::Unreadable { .. })));
    }
}

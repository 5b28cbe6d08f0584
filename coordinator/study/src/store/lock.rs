//! The lock of a run folder: one process runs in it at a time, and whoever comes second is told who that is.
//!
//! The lock is one of the operating system on the file [`NAME`], so that it ends with its process, however that ends; the file says who
//! holds it. On a file system over a network the lock holds between machines where that file system keeps locks (NFS from version 4 on;
//! Lustre mounted with `flock`). Where it keeps none, what the file says decides as far as it can: a process of this machine that
//! lives. Next file to read: [`super::folder`].

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde::{Deserialize, Serialize};
use starlings_proto::host::host_name;

use super::folder_error::FolderError;

/// Name of the file.
pub(super) const NAME: &str = "run.lock";

/// How often a file is opened anew that its holder removed in between.
const TRIES: usize = 100;

/// How often it is waited for somebody who only looks, and for how long.
const LOOKS: usize = 10;
const LOOK: Duration = Duration::from_millis(5);

/// Held until it is dropped.
#[derive(Debug)]
pub(super) struct FolderLock {
    path: PathBuf,
    _file: File,
}

/// Who holds a lock.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
struct Holder {
    host: String,
    pid: u32,
}

impl Holder {
    fn this() -> Self {
        Self { host: own_host(), pid: std::process::id() }
    }

    /// Whether it is certainly gone, or nobody.
    fn is_gone(&self) -> bool {
        // Of another machine nothing is known.
        self.pid == 0 || self.host == own_host() && !Path::new(&format!("/proc/{}", self.pid)).exists()
    }
}

impl FolderLock {
    /// Locks a folder.
    ///
    /// # Errors
    /// When another process holds it, or its file cannot be made.
    pub(super) fn take(folder: &Path) -> Result<Self, FolderError> {
        let path = folder.join(NAME);
        let unwritable = |source| FolderError::Unwritable { path: path.clone(), source };
        let mut looks = LOOKS;
        for _ in 0..TRIES {
            let file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&path);
            let mut file = file.map_err(unwritable)?;
            match file.try_lock() {
                Ok(()) => {}
                // Somebody may look who holds it, for an instant.
                Err(TryLockError::WouldBlock) if read(&mut file).is_gone() && looks > 0 => {
                    looks -= 1;
                    std::thread::sleep(LOOK);
                    continue;
                }
                Err(TryLockError::WouldBlock) => return Err(locked(folder, &mut file)),
                // A file system without locks.
                Err(TryLockError::Error(_)) => {
                    let holder = read(&mut file);
                    if !holder.is_gone() && holder != Holder::this() {
                        return Err(FolderError::MaybeLocked { path, pid: holder.pid, host: holder.host });
                    }
                }
            }
            // Its last holder may have removed the file between its being opened and locked.
            if is_still(&file, &path).map_err(unwritable)? {
                // Whoever comes second is told less then.
                let _ = write(&mut file);
                return Ok(Self { path, _file: file });
            }
        }
        Err(FolderError::Locked { folder: folder.to_owned(), by: String::new() })
    }
}

impl Drop for FolderLock {
    fn drop(&mut self) {
        // Before the lock ends with the file. One that stays says who was here last, and hinders nobody.
        let _ = std::fs::remove_file(&self.path);
    }
}

fn locked(folder: &Path, file: &mut File) -> FolderError {
    let Holder { host, pid } = read(file);
    let by = if pid == 0 { String::new() } else { format!(" (process {pid} on {host})") };
    FolderError::Locked { folder: folder.to_owned(), by }
}

/// Who runs in a folder, such as `process 17 on host`; `None` where nobody does. The folder may be read-only.
pub(super) fn holder(folder: &Path) -> Option<String> {
    let mut file = File::open(folder.join(NAME)).ok()?;
    let is_held = match file.try_lock_shared() {
        Ok(()) => false,
        Err(TryLockError::WouldBlock) => true,
        // A file system without locks.
        Err(TryLockError::Error(_)) => !read(&mut file).is_gone(),
    };
    let Holder { host, pid } = read(&mut file);
    is_held.then(|| if pid == 0 { "another process".to_owned() } else { format!("process {pid} on {host}") })
}

fn read(file: &mut File) -> Holder {
    let mut text = String::new();
    let read = file.rewind().and_then(|()| file.read_to_string(&mut text));
    read.ok().and_then(|_| serde_json::from_str(&text).ok()).unwrap_or_default()
}

fn write(file: &mut File) -> io::Result<()> {
    file.set_len(0)?;
    file.rewind()?;
    file.write_all(super::json::json(&Holder::this()).as_bytes())
}

/// Whether the file stands under its name.
fn is_still(file: &File, path: &Path) -> io::Result<bool> {
    use std::os::unix::fs::MetadataExt;
    let of = |meta: std::fs::Metadata| (meta.dev(), meta.ino());
    match std::fs::metadata(path) {
        Ok(named) => Ok(of(named) == of(file.metadata()?)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
}

fn own_host() -> String {
    host_name().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_second_is_told_who_the_first_is_and_comes_in_after_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let first = FolderLock::take(folder.path()).expect("nobody is there");
        let error = FolderLock::take(folder.path()).expect_err("somebody is there").to_string();
        let who = format!("(process {} on {})", std::process::id(), own_host());
        assert!(error.contains(&who), "{error}");
        let told = format!("process {} on {}", std::process::id(), own_host());
        assert_eq!(holder(folder.path()), Some(told));
        drop(first);
        assert_eq!(holder(folder.path()), None);
        assert!(!folder.path().join(NAME).exists(), "it leaves nothing");
        drop(FolderLock::take(folder.path()).expect("free again"));
    }

    #[test]
    fn a_lock_that_was_left_by_a_killed_process_hinders_nobody() {
        let folder = tempfile::tempdir().expect("a folder");
        for left in ["", "{\"host\": \"elsewhere\", \"pid\": 17}", "nonsense"] {
            std::fs::write(folder.path().join(NAME), left).expect("room");
            assert_eq!(holder(folder.path()), None, "{left}");
            drop(FolderLock::take(folder.path()).unwrap_or_else(|error| panic!("{left}: {error}")));
        }
    }

    #[test]
    fn who_is_gone_is_known_of_this_machine_only() {
        let of = |host: String, pid| Holder { host, pid };
        assert!(Holder::default().is_gone());
        assert!(!Holder::this().is_gone());
        // Beyond the largest process number of the system.
        assert!(of(own_host(), u32::MAX).is_gone());
        assert!(!of("elsewhere".to_owned(), u32::MAX).is_gone());
    }
}

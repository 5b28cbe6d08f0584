//! The coordinator's side of an access file: the secrets of a run, and the file by which workers learn them.
//!
//! The secrets stand in a private file beside the access file, so that a command that is resumed, moved to another host or
//! followed by the next one has them again and copies of the access file stay good. Next files to read: [`secrets`], then
//! [`super::door`], which asks callers for the token.

mod addresses;
mod secrets;

use std::fs::{File, TryLockError};
use std::io;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use starlings_proto::access::{AccessError, AccessFile};
use starlings_proto::private_file::{self, PrivateFileError};

use addresses::addresses;
pub use secrets::Secrets;

/// What is wrong with an access file or its private part.
#[derive(Debug, thiserror::Error)]
pub enum AccessFault {
    /// A file that stands there is no access file, or not private.
    #[error(transparent)]
    Standing(#[from] AccessError),
    /// The private part is not private.
    #[error("the private part of the access file is not taken: {0}")]
    Private(#[from] PrivateFileError),
    /// The private part is not what this program wrote.
    #[error("{} is no private part of an access file ({reason}): remove it and the access file for new ones", path.display())]
    Damaged {
        /// The private part.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// Only the part for workers is there.
    #[error(
        "{} is an access file without its private part {}: give a name that is free, or remove it",
        path.display(),
        private_part(path).display()
    )]
    Widowed {
        /// The access file.
        path: PathBuf,
    },
    /// Another coordinator has it.
    #[error("{} is in use by another command: wait for its end, or give another --access FILE", .0.display())]
    InUse(PathBuf),
    /// It cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    Unwritable {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The system gives no random bits, or no certificate can be made of them.
    #[error("cannot make the secrets of a run: {0}")]
    Draw(String),
}

impl AccessFault {
    /// Whether what the user gave is at fault, and not the machine.
    pub fn is_input(&self) -> bool {
        !matches!(self, Self::Unwritable { .. } | Self::Draw(_))
    }
}

/// The access of one command: secrets from its start on, files from [`Access::publish`] to its end.
pub struct Access {
    secrets: Secrets,
    /// Held so that no other command takes the same secrets at the same time; `None` while they stand in no file.
    lock: Option<File>,
    published: Option<(PathBuf, AccessFile)>,
}

impl Access {
    /// The secrets of the access file at this path, where it and its private part exist; new ones otherwise.
    ///
    /// # Errors
    /// When something else stands there, others can read it, or another command uses it.
    pub fn at(path: Option<&Path>) -> Result<Self, AccessFault> {
        if let Some(path) = path {
            let found = match AccessFile::read(path) {
                Err(AccessError::Missing(_)) => false,
                other => other.map(|_| true)?,
            };
            let private = private_part(path);
            if private.exists() {
                let secrets = Secrets::read(&private)?;
                let lock = lock(&private, path)?;
                return Ok(Self { secrets, lock: Some(lock), published: None });
            }
            if found {
                return Err(AccessFault::Widowed { path: path.to_owned() });
            }
        }
        Ok(Self { secrets: Secrets::draw()?, lock: None, published: None })
    }

    /// What the fleet shows and asks for.
    pub fn secrets(&self) -> &Secrets {
        &self.secrets
    }

    /// Writes the access file of a run that listens at an address; `given` is how the user named its host, where that was a name.
    ///
    /// # Errors
    /// When it cannot be written, or another command was faster.
    pub fn publish(
        &mut self,
        path: &Path,
        run: &str,
        address: SocketAddr,
        given: Option<&str>,
    ) -> Result<(), AccessFault> {
        let unwritable = |path: &Path| {
            let path = path.to_owned();
            move |source| AccessFault::Unwritable { path, source }
        };
        if self.lock.is_none() {
            let private = private_part(path);
            let made = private_file::create(&private, &self.secrets.text());
            drop(made.map_err(|source| match source.kind() {
                io::ErrorKind::AlreadyExists => AccessFault::InUse(path.to_owned()),
                _ => unwritable(&private)(source),
            })?);
            self.lock = Some(lock(&private, path)?);
        }
        let (authority, token) = (&self.secrets.authority, self.secrets.token.clone());
        let file = AccessFile::new(run, addresses(address, given), authority, token);
        file.write(path).map_err(unwritable(path))?;
        self.published = Some((path.to_owned(), file));
        Ok(())
    }

    /// Says in the access file that the run has ended. Dropping does the same.
    pub fn end(&mut self) {
        if let Some((path, mut file)) = self.published.take() {
            file.ended = true;
            if let Err(error) = file.write(&path) {
                tracing::warn!(%error, path = %path.display(), "the access file does not say that the run has ended");
            }
        }
    }
}

impl Drop for Access {
    fn drop(&mut self) {
        self.end();
    }
}

/// The private part of an access file: beside it, with the ending `key`.
fn private_part(path: &Path) -> PathBuf {
    path.with_extension("key")
}

fn lock(private: &Path, path: &Path) -> Result<File, AccessFault> {
    let opened = File::open(private);
    let file = opened.map_err(|source| AccessFault::Unwritable { path: private.to_owned(), source })?;
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => Err(AccessFault::InUse(path.to_owned())),
        // Some network file systems have no locks.
        Ok(()) | Err(TryLockError::Error(_)) => Ok(file),
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::{MetadataExt, PermissionsExt};

    use super::*;

    fn listening() -> SocketAddr {
        ([127, 0, 0, 1], 7000).into()
    }

    fn published(path: &Path) -> Access {
        let mut access = Access::at(Some(path)).unwrap();
        access.publish(path, "run", listening(), None).unwrap();
        access
    }

    #[test]
    fn the_next_command_has_the_secrets_of_the_first_and_only_one_at_a_time() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("access.json");
        let first = published(&path);
        let token = AccessFile::read(&path).unwrap().token;
        assert!(matches!(Access::at(Some(&path)), Err(AccessFault::InUse(_))));
        drop(first);
        let ended = AccessFile::read(&path).unwrap();
        assert!(ended.ended && ended.token.is(token.digits().as_bytes()));
        let second = published(&path);
        let again = AccessFile::read(&path).unwrap();
        assert!(!again.ended && again.token.is(token.digits().as_bytes()));
        assert_eq!(again.authority, ended.authority);
        drop(second);
        let elsewhere = folder.path().join("other.json");
        drop(published(&elsewhere));
        assert!(!AccessFile::read(&elsewhere).unwrap().token.is(token.digits().as_bytes()), "another run");
    }

    #[test]
    fn both_parts_are_their_owners_alone_and_the_key_is_in_the_private_one_only() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("access.json");
        let _access = published(&path);
        for file in [&path, &private_part(&path)] {
            assert_eq!(fs::metadata(file).unwrap().mode() & 0o777, 0o600, "{}", file.display());
        }
        let key = |file: &Path| fs::read_to_string(file).unwrap().contains("PRIVATE KEY");
        assert!(!key(&path) && key(&private_part(&path)));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2, "nothing else is left");
    }

    #[test]
    fn what_is_no_access_file_is_not_overwritten() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("study.json");
        private_file::write(&path, "{\"precious\": 1}").unwrap();
        assert!(matches!(Access::at(Some(&path)), Err(AccessFault::Standing(_))));
        let own = folder.path().join("access.json");
        drop(published(&own));
        fs::remove_file(private_part(&own)).unwrap();
        let fault = Access::at(Some(&own)).err().unwrap();
        assert!(matches!(fault, AccessFault::Widowed { .. }) && fault.is_input(), "{fault}");
    }

    #[test]
    fn a_private_part_that_others_can_read_or_that_is_damaged_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("access.json");
        drop(published(&path));
        let private = private_part(&path);
        fs::set_permissions(&private, fs::Permissions::from_mode(0o644)).unwrap();
        let fault = Access::at(Some(&path)).err().unwrap();
        assert!(fault.to_string().contains("chmod 600"), "{fault}");
        private_file::write(&private, "{}").unwrap();
        assert!(matches!(Access::at(Some(&path)), Err(AccessFault::Damaged { .. })));
    }
}

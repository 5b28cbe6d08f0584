//! The coordinator's side of an access file: the secrets of a run, and the file by which workers learn them.
//!
//! The secrets stand in a private file beside the access file, so that a command that is resumed, moved to another host or
//! followed by the next one has them again and copies of the access file stay good. Next files to read: [`secrets`], then
//! [`super::door`], which asks callers for the token.

mod addresses;
mod secrets;
#[cfg(test)]
mod tests;

use std::fs::{File, OpenOptions, TryLockError};
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
    /// Its name is that of a private part.
    #[error(
        "{}: the ending `{PRIVATE}` is for the private part of an access file: give a name such as {}",
        .0.display(),
        .0.with_extension("json").display()
    )]
    OwnPrivatePart(PathBuf),
    /// Another coordinator has it.
    #[error("{} is in use by another command: wait for its end, or give another --access FILE", .0.display())]
    InUse(PathBuf),
    /// It stands already where a new one is to be made.
    #[error("{} is an access file already: use it, or remove it and its private part for new secrets", .0.display())]
    Stands(PathBuf),
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
        match self {
            Self::Unwritable { source, .. } => source.kind() != io::ErrorKind::StorageFull,
            Self::Draw(_) => false,
            _ => true,
        }
    }
}

/// The access of one command: secrets from its start on, files from [`Access::publish`] to its end.
pub struct Access {
    secrets: Secrets,
    /// Held so that no other command takes the same secrets at the same time; `None` while they stand in no file.
    lock: Option<File>,
    /// The private part, where it was made here and no access file stands beside it yet.
    made: Option<PathBuf>,
    published: Option<(PathBuf, AccessFile)>,
}

impl Access {
    /// The secrets of the access file at this path, where it and its private part exist; new ones otherwise.
    ///
    /// # Errors
    /// When something else stands there, others can read it, or another command uses it.
    pub fn at(path: Option<&Path>) -> Result<Self, AccessFault> {
        if let Some(path) = path {
            if path.extension().is_some_and(|ending| ending == PRIVATE) {
                return Err(AccessFault::OwnPrivatePart(path.to_owned()));
            }
            let found = stands(path)?;
            let private = private_part(path);
            if private.exists() {
                // The other way round, another command could end in between and leave other secrets.
                let lock = lock(&private, path)?;
                let secrets = Secrets::read(&private)?;
                return Ok(Self { secrets, lock: Some(lock), made: None, published: None });
            }
            if found {
                return Err(AccessFault::Widowed { path: path.to_owned() });
            }
        }
        Ok(Self { secrets: Secrets::draw()?, lock: None, made: None, published: None })
    }

    /// Makes the private part of an access file that does not stand yet, so that it can be written and nobody else takes the name.
    ///
    /// # Errors
    /// When it cannot be written, or another command was faster.
    pub fn reserve(&mut self, path: &Path) -> Result<(), AccessFault> {
        if self.lock.is_some() {
            return Ok(());
        }
        let private = private_part(path);
        let made = private_file::create(&private, &self.secrets.text());
        drop(made.map_err(|source| match source.kind() {
            io::ErrorKind::AlreadyExists => AccessFault::InUse(path.to_owned()),
            _ => AccessFault::Unwritable { path: private.clone(), source },
        })?);
        self.lock = Some(lock(&private, path)?);
        self.made = Some(private);
        Ok(())
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
        self.reserve(path)?;
        let (authority, token) = (&self.secrets.authority, self.secrets.token.clone());
        let file = AccessFile::new(run, addresses(address, given), authority, token);
        // What came meanwhile is no access file of these secrets.
        let is_new = self.made.is_some() || !stands(path)?;
        let written = if is_new { file.write_new(path) } else { file.write(path) };
        written.map_err(|source| match source.kind() {
            io::ErrorKind::AlreadyExists => AccessFault::InUse(path.to_owned()),
            _ => AccessFault::Unwritable { path: path.to_owned(), source },
        })?;
        self.made = None;
        self.published = Some((path.to_owned(), file));
        Ok(())
    }

    /// Makes an access file and its private part for a coordinator that will be dialled at these addresses, `host:port`, and does not
    /// listen yet. It takes the secrets of both when it starts with the same `path`.
    ///
    /// # Errors
    /// When something stands there already, or it cannot be written.
    pub fn prepare(path: &Path, run: &str, addresses: Vec<String>) -> Result<(), AccessFault> {
        let mut access = Self::at(Some(path))?;
        if access.lock.is_some() {
            return Err(AccessFault::Stands(path.to_owned()));
        }
        access.reserve(path)?;
        let file = AccessFile::new(run, addresses, &access.secrets.authority, access.secrets.token.clone());
        file.write_new(path).map_err(|source| AccessFault::Unwritable { path: path.to_owned(), source })?;
        // From here on the private part belongs to the file.
        access.made = None;
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
        if let Some(private) = self.made.take() {
            // Nobody knows its secrets.
            let _ = std::fs::remove_file(private);
        }
    }
}

/// Ending of the name of a private part.
const PRIVATE: &str = "key";

/// The private part of an access file: beside it, with an ending of its own.
fn private_part(path: &Path) -> PathBuf {
    path.with_extension(PRIVATE)
}

/// Whether an access file stands there, and nothing else does.
fn stands(path: &Path) -> Result<bool, AccessFault> {
    match AccessFile::read(path) {
        Err(AccessError::Missing(_)) => Ok(false),
        other => Ok(other.map(|_| true)?),
    }
}

fn lock(private: &Path, path: &Path) -> Result<File, AccessFault> {
    // Over a network a lock may need a file that can be written.
    let opened = OpenOptions::new().read(true).write(true).open(private).or_else(|_| File::open(private));
    let file = opened.map_err(|source| AccessFault::Unwritable { path: private.to_owned(), source })?;
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => Err(AccessFault::InUse(path.to_owned())),
        // Some network file systems have no locks.
        Ok(()) | Err(TryLockError::Error(_)) => Ok(file),
    }
}

//! Where solvers run: their processes, their scratch folders, and the guard that ends them if this process dies.
//!
//! Every program is started in a process group of its own, with the end of its standard error remembered. Next files to read:
//! [`super::process`], [`super::scratch`], [`super::guard`].

use std::io;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use super::SolverError;
use super::guard::Guard;
use super::machine::cores;
use super::process::{Launch, Process};
use super::scratch::{Scratch, ScratchRoot};

/// Where solvers may write, and who ends them.
#[derive(Clone, Debug, Default)]
pub struct SiteOptions {
    /// Folder for scratch folders; the system's without it.
    pub scratch: Option<PathBuf>,
    /// Program and arguments that watch over process groups and folders, as [`super::guard`] says; without it a killed worker
    /// leaves its solvers to notice by themselves, and its scratch folders to somebody else.
    pub guard: Option<(PathBuf, Vec<String>)>,
}

/// The place where solvers run.
pub(crate) struct Site {
    options: SiteOptions,
    /// Number of its first program among all of the machine.
    first: usize,
    scratch: Mutex<Option<ScratchRoot>>,
    guard: Mutex<Option<Guard>>,
}

impl Site {
    pub(crate) fn new(options: SiteOptions, first: usize) -> Self {
        Self { options, first, scratch: Mutex::default(), guard: Mutex::default() }
    }

    /// A new folder of its own, removed when dropped unless it is kept.
    ///
    /// # Errors
    /// When it cannot be made.
    pub(crate) fn scratch(&self, label: &str) -> io::Result<Scratch> {
        let mut root = self.scratch.lock().unwrap_or_else(PoisonError::into_inner);
        // A cleaner of temporary folders may have taken it away with all that was in it.
        if root.as_ref().is_none_or(ScratchRoot::is_gone) {
            let notice = self.guard().map_err(io::Error::other)?;
            *root = Some(ScratchRoot::new(self.options.scratch.as_deref(), notice)?);
        }
        match &*root {
            Some(root) => root.folder(label),
            None => Err(io::Error::other("no scratch folder")),
        }
    }

    /// The cores of the program that has this number among those that run here at the same time.
    pub(crate) fn cores(&self, number: usize, threads: usize) -> Vec<usize> {
        cores(self.first.saturating_add(number), threads)
    }

    /// Starts a program in a process group of its own, under the guard.
    ///
    /// # Errors
    /// When it cannot be started.
    pub(crate) fn start(&self, launch: &Launch<'_>) -> Result<Process, SolverError> {
        let notice = self.guard()?;
        Process::start(launch, notice)
    }

    /// The way to tell the guard, which is started with the first folder or program.
    fn guard(&self) -> Result<Option<super::guard::Notice>, SolverError> {
        let Some((program, arguments)) = &self.options.guard else { return Ok(None) };
        let mut guard = self.guard.lock().unwrap_or_else(PoisonError::into_inner);
        if guard.is_none() {
            let started = Guard::start(program, arguments).map_err(|error| SolverError::Start {
                program: program.display().to_string(),
                reason: error.to_string(),
            })?;
            *guard = Some(started);
        }
        Ok(guard.as_ref().map(Guard::notice))
    }
}

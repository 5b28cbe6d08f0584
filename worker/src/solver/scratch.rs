//! Scratch folders: one for every program or run, removed when it is done; those of failed runs are kept, up to a limit.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use tempfile::{Builder, TempDir};

/// Folders of failed runs that one worker keeps.
const KEPT: usize = 8;

/// The folder of this process.
pub(crate) struct ScratchRoot {
    /// Removed with what is left in it, unless something is kept.
    folder: PathBuf,
    kept: Arc<AtomicUsize>,
}

impl ScratchRoot {
    pub(crate) fn new(base: Option<&Path>) -> io::Result<Self> {
        let base = base.map_or_else(std::env::temp_dir, Path::to_path_buf);
        std::fs::create_dir_all(&base)?;
        let prefix = format!("starlings-{}-", std::process::id());
        let folder = Builder::new().prefix(&prefix).tempdir_in(base)?.keep();
        Ok(Self { folder, kept: Arc::default() })
    }

    pub(crate) fn folder(&self, label: &str) -> io::Result<Scratch> {
        let folder = Builder::new().prefix(&format!("{label}-")).tempdir_in(&self.folder)?;
        Ok(Scratch { folder, kept: Arc::clone(&self.kept) })
    }
}

impl Drop for ScratchRoot {
    fn drop(&mut self) {
        // Not empty where runs failed: then it stays.
        let _ = std::fs::remove_dir(&self.folder);
    }
}

/// One folder.
pub(crate) struct Scratch {
    folder: TempDir,
    kept: Arc<AtomicUsize>,
}

impl Scratch {
    pub(crate) fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Keeps the folder for people to look at, unless as many are kept as may be; says where it is.
    pub(crate) fn keep(mut self) -> Option<PathBuf> {
        if self.kept.fetch_add(1, Ordering::Relaxed) >= KEPT {
            return None;
        }
        self.folder.disable_cleanup(true);
        Some(self.folder.path().to_path_buf())
    }
}

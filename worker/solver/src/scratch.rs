//! Scratch folders: one for every program or run, removed when it is done; of runs that failed alike one is kept, up to a limit.
//!
//! All of a process lie in one root, which goes with the last of them. A process that ends without dropping anything leaves
//! its root to the guard. Next files to read: [`super::guard`], [`super::clear`].

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use tempfile::Builder;

use super::clear::{patiently, remove};
use super::guard::Notice;

/// Folders of failed runs that one worker keeps.
const KEPT: usize = 8;

/// The folder of this process.
pub(crate) struct ScratchRoot(Arc<Root>);

/// Lives as long as the last folder in it.
struct Root {
    folder: PathBuf,
    /// By what is told of the failure.
    kept: Mutex<BTreeMap<String, PathBuf>>,
    notice: Option<Notice>,
}

impl ScratchRoot {
    /// A new root in `base`, under guard where there is one.
    pub(crate) fn new(base: Option<&Path>, notice: Option<Notice>) -> io::Result<Self> {
        let base = std::path::absolute(base.map_or_else(std::env::temp_dir, Path::to_path_buf))?;
        fs::create_dir_all(&base)?;
        let prefix = format!("starlings-{}-", std::process::id());
        let folder = private(&prefix, &base)?;
        if let Some(notice) = &notice {
            notice.begin_folder(&folder);
        }
        Ok(Self(Arc::new(Root { folder, kept: Mutex::default(), notice })))
    }

    /// Whether somebody else has removed it.
    pub(crate) fn is_gone(&self) -> bool {
        !self.0.folder.is_dir()
    }

    pub(crate) fn folder(&self, label: &str) -> io::Result<Scratch> {
        let folder = private(&format!("{label}-"), &self.0.folder)?;
        Ok(Scratch { folder, is_kept: false, root: Arc::clone(&self.0) })
    }
}

/// What became of the folder of a failed run.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Kept {
    /// It stays.
    This(PathBuf),
    /// It goes; the folder of a run that failed alike is there.
    Alike(PathBuf),
    /// It goes, with nothing that is like it.
    TooMany,
}

impl Drop for Root {
    fn drop(&mut self) {
        // Not empty where runs failed: then it stays.
        let _ = fs::remove_dir(&self.folder);
        if let Some(notice) = &self.notice {
            notice.end_folder(&self.folder);
        }
    }
}

/// A new private folder: other users of the machine neither read it nor reach the sockets in it.
fn private(prefix: &str, within: &Path) -> io::Result<PathBuf> {
    let permissions = fs::Permissions::from_mode(0o700);
    Ok(Builder::new().prefix(prefix).permissions(permissions).tempdir_in(within)?.keep())
}

/// One folder.
pub(crate) struct Scratch {
    folder: PathBuf,
    is_kept: bool,
    root: Arc<Root>,
}

impl Scratch {
    pub(crate) fn path(&self) -> &Path {
        &self.folder
    }

    /// Whether somebody else has removed it, as a cleaner of temporary folders does.
    pub(crate) fn is_gone(&self) -> bool {
        !self.folder.is_dir()
    }

    /// Keeps the folder for people to look at, unless one of the same failure is there already or as many are kept as may be.
    pub(crate) fn keep(mut self, failure: &str) -> Kept {
        let root = Arc::clone(&self.root);
        let mut kept = root.kept.lock().unwrap_or_else(PoisonError::into_inner);
        match kept.get(failure) {
            Some(folder) if folder.is_dir() => return Kept::Alike(folder.clone()),
            None if kept.len() >= KEPT => return Kept::TooMany,
            _ => {}
        }
        kept.insert(failure.to_owned(), self.folder.clone());
        if let Some(notice) = &root.notice {
            notice.keep_folder(&self.folder);
        }
        self.is_kept = true;
        // The failure that names it may be lost on its way to the coordinator.
        tracing::info!(folder = %self.folder.display(), "the folder of a failed run is kept");
        Kept::This(self.folder.clone())
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        if !self.is_kept {
            patiently(|| remove(&self.folder));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_root_goes_with_its_last_folder_whoever_is_dropped_first() {
        let base = tempfile::tempdir().expect("a folder");
        let root = ScratchRoot::new(Some(base.path()), None).expect("a root");
        let folder = root.folder("solver").expect("a folder in it");
        fs::write(folder.path().join("mesh"), "1 2 3").expect("written");
        drop(root);
        assert!(folder.path().join("mesh").exists());
        drop(folder);
        assert_eq!(fs::read_dir(base.path()).expect("readable").count(), 0);
    }

    #[test]
    fn nobody_else_looks_into_the_folders() {
        let base = tempfile::tempdir().expect("a folder");
        let root = ScratchRoot::new(Some(base.path()), None).expect("a root");
        let folder = root.folder("solver").expect("a folder in it");
        for path in [folder.path(), folder.path().parent().expect("the root")] {
            let mode = fs::metadata(path).expect("it is there").permissions().mode();
            assert_eq!(mode & 0o777, 0o700, "{}", path.display());
        }
    }

    #[test]
    fn of_runs_that_failed_alike_one_folder_stays_and_of_others_as_many_as_may() {
        let base = tempfile::tempdir().expect("a folder");
        let root = ScratchRoot::new(Some(base.path()), None).expect("a root");
        let keep = |failure: &str| root.folder("run").expect("a folder").keep(failure);
        let Kept::This(first) = keep("status 1") else { panic!("the first one stays") };
        assert_eq!(keep("status 1"), Kept::Alike(first.clone()));
        let others = (0..KEPT + 3).map(|i| keep(&format!("diverged at {i}")));
        assert_eq!(others.filter(|kept| *kept == Kept::TooMany).count(), 4);
        assert_eq!(keep("status 1"), Kept::Alike(first.clone()));
        fs::remove_dir_all(&first).expect("somebody cleans up");
        assert!(matches!(keep("status 1"), Kept::This(folder) if folder != first));
        let top = first.parent().expect("the root").to_path_buf();
        drop(root);
        assert_eq!(fs::read_dir(top).expect("it stays").count(), KEPT);
    }
}

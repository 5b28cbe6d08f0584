//! How much work a coordinator has: a file beside its access file, which it writes every second and `starlings deploy watch` reads.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

/// What the file says.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Work {
    /// Counts up: a coordinator that was killed leaves a file that stands still.
    pub count: u64,
    /// Whether the command has ended.
    pub ended: bool,
    /// The most runs that had no result at a time, of those given to a worker and those that wait, since it was written last.
    pub unfinished: usize,
    /// Its workers.
    pub workers: Vec<WorkerWork>,
}

/// What one worker has to do.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct WorkerWork {
    /// Its name in events, `NUMBER@HOST/PROCESS`.
    pub name: String,
    /// Runs at a time.
    pub slots: usize,
    /// Runs that it was given and has not answered.
    pub runs: usize,
    /// Seconds since it had one.
    pub idle_s: u64,
}

impl WorkerWork {
    /// Whether it is this process, `HOST/PROCESS`.
    pub fn is(&self, process: &str) -> bool {
        self.name.split_once('@').is_some_and(|(_, own)| own == process)
    }
}

/// Where the work of a coordinator with this access file is told.
pub fn path(access: &Path) -> PathBuf {
    access.with_extension("load")
}

impl Work {
    /// Writes the file; a reader sees the old one or the new one.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write(&self, path: &Path) -> io::Result<()> {
        let new = path.with_extension("load.new");
        fs::write(&new, serde_json::to_string(self)? + "\n")?;
        fs::rename(&new, path)
    }

    /// Reads the file; nothing where no coordinator has written it yet, or it says nothing that is understood.
    pub fn read(path: &Path) -> Option<Self> {
        serde_json::from_str(&fs::read_to_string(path).ok()?).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_and_an_empty_file_says_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = path(&folder.path().join("access.json"));
        fs::write(&path, "").unwrap();
        assert_eq!(Work::read(&path), None);
        let worker = WorkerWork { name: "3@node7/4711".to_owned(), slots: 2, runs: 0, idle_s: 7 };
        assert!(worker.is("node7/4711") && !worker.is("node7/47") && !worker.is("e7/4711"));
        let work = Work { count: 1, ended: false, unfinished: 9, workers: vec![worker] };
        work.write(&path).unwrap();
        assert_eq!(Work::read(&path), Some(work));
    }
}

//! The last words of a process.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

/// Folder of the logs in the folder of a deployment.
pub(crate) const FOLDER: &str = "logs";

/// Bytes at the end of a log that are looked at.
const LOOKED_AT: u64 = 16 * 1024;

/// The last lines of a file that are not empty, at most `n`; none where it cannot be read.
pub(crate) fn last_lines(path: &Path, n: usize) -> Vec<String> {
    let read = || {
        let mut file = File::open(path)?;
        let length = file.metadata()?.len();
        file.seek(SeekFrom::Start(length.saturating_sub(LOOKED_AT)))?;
        let mut bytes = Vec::new();
        file.take(LOOKED_AT).read_to_end(&mut bytes)?;
        std::io::Result::Ok(String::from_utf8_lossy(&bytes).into_owned())
    };
    let text = read().unwrap_or_default();
    let lines: Vec<&str> = text.lines().filter(|line| !line.trim().is_empty()).collect();
    lines[lines.len().saturating_sub(n)..].iter().map(|line| (*line).to_owned()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_lines_of_a_long_log_are_read_and_a_missing_one_has_none() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log");
        std::fs::write(&path, "x".repeat(100_000) + "\none\n\ntwo\n").unwrap();
        assert_eq!(last_lines(&path, 2), ["one", "two"]);
        assert!(last_lines(&folder.path().join("none"), 2).is_empty());
    }
}

//! Removing folders in which a program that was just killed may still write.
//!
//! Next file to read: [`super::scratch`], whose folders they are.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// How often a folder is tried to be removed while a program that was just killed still writes into it, and the wait between.
const TRIES: usize = 40;
const BETWEEN: Duration = Duration::from_millis(5);

/// Removes a root that its process left behind, except the kept folders in it.
pub(super) fn clear(root: &Path, kept: &BTreeSet<PathBuf>) {
    // A link in its place is not the folder that was made.
    if !fs::symlink_metadata(root).is_ok_and(|about| about.is_dir()) {
        return;
    }
    patiently(|| {
        let mut stays = false;
        for entry in fs::read_dir(root)? {
            let entry = entry?;
            if kept.contains(&entry.path()) {
                stays = true;
            } else if entry.file_type()?.is_dir() {
                remove(&entry.path())?;
            } else {
                fs::remove_file(entry.path())?;
            }
        }
        if stays { Ok(()) } else { fs::remove_dir(root) }
    });
}

/// Removes a folder; links in it are removed and not followed.
pub(super) fn remove(folder: &Path) -> io::Result<()> {
    match fs::remove_dir_all(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        removed => removed,
    }
}

/// Tries until it works, or somebody writes for too long.
pub(super) fn patiently(mut attempt: impl FnMut() -> io::Result<()>) {
    for _ in 0..TRIES {
        if attempt().is_ok() {
            return;
        }
        std::thread::sleep(BETWEEN);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_cleared_are_the_folders_of_the_root_and_never_what_links_lead_to() {
        let base = tempfile::tempdir().expect("a folder");
        let (root, other) = (base.path().join("root"), base.path().join("other"));
        for folder in ["run-1", "run-2"] {
            fs::create_dir_all(root.join(folder)).expect("made");
        }
        fs::create_dir(&other).expect("made");
        fs::write(other.join("precious"), "1").expect("written");
        std::os::unix::fs::symlink(&other, root.join("link")).expect("linked");
        std::os::unix::fs::symlink(&other, root.join("run-1").join("link")).expect("linked");
        std::os::unix::fs::symlink(&other, base.path().join("posing")).expect("linked");
        clear(&root, &BTreeSet::from([root.join("run-2")]));
        clear(&base.path().join("posing"), &BTreeSet::new());
        let left: Vec<_> =
            fs::read_dir(&root).expect("it stays").flatten().map(|entry| entry.file_name()).collect();
        assert_eq!(left, ["run-2"]);
        assert!(other.join("precious").exists());
        clear(&root, &BTreeSet::new());
        assert!(!root.exists());
    }
}

//! The processes of a study, found by a variable in their environment, which their children inherit.

use std::fs;

/// Living processes that carry the mark.
pub(crate) fn of(mark: &str) -> Vec<(i32, String)> {
    let named = |entry: fs::DirEntry| {
        let pid: i32 = entry.file_name().to_str()?.parse().ok()?;
        let environment = fs::read(entry.path().join("environ")).ok()?;
        if !environment.split(|byte| *byte == 0).any(|variable| variable == mark.as_bytes()) {
            return None;
        }
        let stat = fs::read_to_string(entry.path().join("stat")).ok()?;
        // A zombie has ended: it waits for its parent to look.
        if stat.rsplit(") ").next()?.starts_with('Z') {
            return None;
        }
        let line = fs::read(entry.path().join("cmdline")).ok()?;
        Some((pid, String::from_utf8_lossy(&line).replace('\0', " ")))
    };
    fs::read_dir("/proc").unwrap().filter_map(Result::ok).filter_map(named).collect()
}

/// Ends what a failed case left behind, so that it disturbs no other.
pub(crate) fn end(mark: &str) {
    for (pid, _) in of(mark) {
        let _ = std::process::Command::new("kill").args(["-9", &pid.to_string()]).status();
    }
}

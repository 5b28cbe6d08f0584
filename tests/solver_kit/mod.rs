//! A folder with a study whose model runs in a process of its own, and that process found by the folder's name.

#![allow(clippy::unwrap_used, dead_code)] // each test uses its part

use std::path::Path;

use crate::common::repository;

/// A folder whose path stands in the command line of every solver of its studies.
pub(crate) struct Folder(tempfile::TempDir);

impl Folder {
    /// With the data of the oscillator and its study as `native.toml`.
    pub(crate) fn new() -> Self {
        let folder = Self(tempfile::Builder::new().prefix("solver-").tempdir().unwrap());
        for file in ["force.csv", "position.csv"] {
            std::fs::copy(repository("examples/oscillator").join(file), folder.path().join(file)).unwrap();
        }
        std::fs::copy(repository("examples/oscillator/study.toml"), folder.path().join("native.toml"))
            .unwrap();
        folder
    }

    pub(crate) fn path(&self) -> &Path {
        self.0.path()
    }

    /// What stands in the command line of its solvers and of nothing else.
    pub(crate) fn mark(&self) -> String {
        self.path().join("native.toml").display().to_string()
    }

    /// The same study with the model behind `starlings serve`.
    pub(crate) fn serving(&self, file: &str, settings: &str) {
        let program = env!("CARGO_BIN_EXE_starlings");
        self.study(file, &[program, "serve", &self.mark()], settings);
    }

    /// The same study with a solver in Python.
    pub(crate) fn python(&self, file: &str, script: &str, settings: &str) {
        self.study(file, &["python3", "-c", script, &self.mark()], settings);
    }

    fn study(&self, file: &str, command: &[&str], settings: &str) {
        let text = std::fs::read_to_string(self.path().join("native.toml")).unwrap();
        let (head, tail) = (text.find("[model]").unwrap(), text.find("[[parameters]]").unwrap());
        let model = format!(
            "[model]\nkind = \"solver\"\ncommand = {command:?}\n{settings}\nconstants = {{ m = 1.0 }}\n\n"
        );
        std::fs::write(self.path().join(file), format!("{}{model}{}", &text[..head], &text[tail..])).unwrap();
    }
}

/// Processes with these words in their command line, as (process, group).
fn processes(mark: &str) -> Vec<(i32, i32)> {
    let of = |entry: std::fs::DirEntry| {
        let pid: i32 = entry.file_name().to_str()?.parse().ok()?;
        let line = std::fs::read(entry.path().join("cmdline")).ok()?;
        let line = String::from_utf8_lossy(&line).replace('\0', " ");
        if !line.contains(mark) || line.contains(" run ") {
            return None;
        }
        let stat = std::fs::read_to_string(entry.path().join("stat")).ok()?;
        let fields: Vec<&str> = stat.rsplit(") ").next()?.split(' ').collect();
        // A zombie has ended: it waits for its parent to look.
        (fields[0] != "Z").then(|| fields[2].parse().ok().map(|group| (pid, group)))?
    };
    std::fs::read_dir("/proc").unwrap().filter_map(Result::ok).filter_map(of).collect()
}

/// Process groups of the solvers of a folder.
pub(crate) fn groups_of(mark: &str) -> Vec<i32> {
    let mut groups: Vec<i32> = processes(mark).into_iter().map(|(_, group)| group).collect();
    groups.sort_unstable();
    groups.dedup();
    // The children of a solver have other command lines: they are found by their group.
    groups
}

/// Kills one solver of a folder; whether there was one.
pub(crate) fn kill_one(mark: &str) -> bool {
    let Some((pid, _)) = processes(mark).into_iter().next() else { return false };
    let killed = std::process::Command::new("kill")
        .args(["-9", &pid.to_string()])
        .stderr(std::process::Stdio::null())
        .status();
    killed.is_ok_and(|status| status.success())
}

//! What is to be deployed.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::elastic::Limits;
use crate::error::DeployError;

/// Workers of a study, how they find their coordinator, and what the engine is told besides. Paths are absolute, as the nodes see them.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Order {
    /// Name of the deployment in the engine, of letters, digits, `.`, `_` and `-`; no other deployment has it.
    pub name: String,
    /// The study file.
    pub study: PathBuf,
    /// Whether the model of the study is a program of its own, which the workers must be allowed to start.
    pub is_solver: bool,
    /// This program.
    pub program: PathBuf,
    /// Number of workers, at least one; where it follows the work, the most.
    pub workers: usize,
    /// The least and the most workers, where their number follows the work.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub elastic: Option<Limits>,
    /// Runs of one worker at a time; the number of cores that it is given where nothing is said.
    pub slots: Option<usize>,
    /// The access file, which the coordinator writes and may not stand yet.
    pub access: PathBuf,
    /// How long a worker waits for work, such as `10m`.
    pub idle: String,
    /// Folder on the nodes for files of runs; the system's where nothing is said.
    pub scratch: Option<PathBuf>,
    /// Run folder of a coordinator that is a job too; none where the coordinator is started by hand.
    pub run_folder: Option<PathBuf>,
    /// Options for the program that submits.
    #[serde(default)]
    pub options: Vec<String>,
    /// Machines, where no engine chooses them.
    #[serde(default)]
    pub hosts: Vec<String>,
    /// The command by which a machine is reached, in parts.
    #[serde(default)]
    pub ssh: Vec<String>,
    /// Whether the access file stands already and is copied to the machines.
    #[serde(default)]
    pub copies_access: bool,
    /// Port on which the coordinator is dialled, where that is settled beforehand.
    #[serde(default)]
    pub port: Option<u16>,
}

/// The longest part of a name that is taken from a study.
const LONGEST: usize = 40;

impl Order {
    /// A name for a deployment of a study: `stamp` tells it from others.
    pub fn name_of(study: &str, stamp: &str) -> String {
        let is_plain = |c: char| c.is_ascii_alphanumeric() || ".-_".contains(c);
        let plain: String = study.chars().map(|c| if is_plain(c) { c } else { '-' }).take(LONGEST).collect();
        format!("starlings-{plain}-{stamp}")
    }

    /// Whether a name is one that every engine and every script takes as one plain word.
    pub(crate) fn is_name(name: &str) -> bool {
        name.starts_with(|c: char| c.is_ascii_alphanumeric())
            && name.chars().all(|c| c.is_ascii_alphanumeric() || ".-_".contains(c))
    }

    /// Refuses paths that not every script and manifest can name.
    pub(crate) fn check_paths(&self, folder: &Path) -> Result<(), DeployError> {
        let paths = [folder, &self.program, &self.access, &self.study];
        paths.into_iter().chain(self.scratch.as_deref()).try_for_each(check_path)
    }

    /// Numbers of the workers that are submitted at first.
    pub fn first(&self) -> Vec<usize> {
        (0..self.elastic.map_or(self.workers, |limits| limits.least)).collect()
    }

    /// Name of the coordinator's job in the engine.
    pub fn coordinator_name(&self) -> String {
        format!("{}-coordinator", self.name)
    }

    /// The command that starts a coordinator for these workers by hand, for a shell.
    pub fn coordinator_command(&self) -> String {
        let path = |path: &Path| shell_words::quote(&path.to_string_lossy()).into_owned();
        let (study, access, port) = (path(&self.study), path(&self.access), self.port.unwrap_or(0));
        format!("starlings run {study} --listen 0.0.0.0:{port} --access {access}")
    }
}

/// Refuses a path with letters that a directive of a script, or a line of a list, has no way to write.
pub(crate) fn check_path(path: &Path) -> Result<(), DeployError> {
    let is_plain = |text: &str| !text.contains(|c: char| c.is_control() || c == '\\');
    if path.to_str().is_some_and(is_plain) { Ok(()) } else { Err(DeployError::Path(path.to_owned())) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_that_no_script_can_name_is_refused() {
        assert!(check_path(Path::new("/a pool, 100% \"new\"/\u{e9}.toml")).is_ok());
        for wrong in ["/a\\b", "/a\nb", "/a\tb"] {
            assert!(matches!(check_path(Path::new(wrong)), Err(DeployError::Path(_))), "{wrong:?}");
        }
    }

    #[test]
    fn a_name_has_only_what_every_engine_takes() {
        let name = Order::name_of("a b,c/%d\u{e9}", "7");
        assert_eq!(name, "starlings-a-b-c--d--7");
        assert_eq!(Order::name_of(&"x".repeat(99), "7").len(), "starlings-".len() + LONGEST + "-7".len());
    }
}

//! Programs that stand in for an engine's and say what engines say.

#![allow(clippy::unwrap_used, dead_code)] // each test uses its part

use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::{output, repository, starlings};

/// A folder with programs that stand in for an engine's, and a place for deployments.
pub(crate) struct Site(tempfile::TempDir);

impl Site {
    pub(crate) fn new() -> Self {
        let site = Self(tempfile::tempdir().unwrap());
        std::fs::create_dir(site.path("bin")).unwrap();
        site
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// A program that runs this script; `$SITE` is the folder.
    pub(crate) fn program(self, name: &str, script: &str) -> Self {
        let file = self.path("bin").join(name);
        std::fs::write(&file, format!("#!/bin/sh\nSITE={}\n{script}\n", self.0.path().display())).unwrap();
        std::fs::set_permissions(&file, std::fs::Permissions::from_mode(0o755)).unwrap();
        self
    }

    /// The command with these programs before all others, and without the machine's own engine.
    pub(crate) fn starlings(&self, arguments: &[&str]) -> Command {
        let mut command = starlings();
        let tools = self.path("tools");
        if !tools.exists() {
            std::fs::create_dir(&tools).unwrap();
            for tool in ["sh", "bash", "cat", "grep", "sleep", "touch", "rm", "mktemp", "uname", "setsid"] {
                std::os::unix::fs::symlink(Path::new("/bin").join(tool), tools.join(tool)).unwrap();
            }
        }
        command.env("PATH", format!("{}:{}", self.path("bin").display(), tools.display()));
        command.arg("deploy").args(arguments).current_dir(self.0.path());
        command
    }

    /// Deploys a study under Slurm into `pool`: exit code and everything that was said.
    pub(crate) fn slurm(&self, options: &[&str]) -> (i32, String) {
        let study = repository("examples/rcr/study.toml");
        let head = ["slurm", study.to_str().unwrap(), "--out", "pool"];
        self.said(&[&head, options].concat())
    }

    pub(crate) fn said(&self, arguments: &[&str]) -> (i32, String) {
        let (code, stdout, stderr) = output(&mut self.starlings(arguments));
        (code, stdout + &stderr)
    }
}

/// A Slurm in which every task has the same lot: a line of squeue for each of two workers, with a state, a reason and a number of starts.
pub(crate) fn slurm(state: &str, reason: &str, restarts: u32, status: u32) -> Site {
    let squeue = format!(
        "[ -e $SITE/cancelled ] && exit 0
name=${{3#--name=}}
for option; do case $option in --name=*) name=${{option#--name=}};; esac; done
name=${{name%%,*}}
for i in 0 1; do echo \"7_$i |$i |{state} |n1 |100 |100 |100 |{reason} |{restarts} |{status} |$name |\"; done"
    );
    Site::new()
        .program("sbatch", "echo \"$@\" >> $SITE/submitted; echo 7")
        .program("squeue", &squeue)
        .program("scancel", "echo \"$@\" >> $SITE/cancelled")
        .program("scontrol", "echo \"$@\" >> $SITE/updated")
}

/// A Slurm that runs worker 0 of an array on this machine, from its script, until it ends.
pub(crate) fn one_node() -> Site {
    let sbatch = "for script; do :; done
case $script in */worker.sbatch) ;; *) exit 1;; esac
cd /
SLURM_ARRAY_TASK_ID=0 setsid bash \"$script\" > $SITE/pool/logs/worker-0.log 2>&1 < /dev/null &
echo $! > $SITE/pid
echo 7";
    let squeue = "for option; do case $option in --name=*) name=${option#--name=};; esac; done
name=${name%%,*}
read pid < $SITE/pid
state=FAILED
kill -0 $pid 2> /dev/null && state=RUNNING
echo \"7_0 |0 |$state |n1 |100 |100 |100 |None |0 |256 |$name |\"";
    let site = Site::new().program("sbatch", sbatch).program("squeue", squeue);
    site.program("scancel", "read pid < $SITE/pid; kill $pid 2> /dev/null; exit 0")
}

//! `starlings deploy` with programs in the engines' place that say what engines say. The real ones: tests/slurm.rs.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;

use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Command;

use common::{output, repository, starlings};
use serde_json::Value;

/// A folder with programs that stand in for an engine's, and a place for deployments.
struct Site(tempfile::TempDir);

impl Site {
    fn new() -> Self {
        let site = Self(tempfile::tempdir().unwrap());
        std::fs::create_dir(site.path("bin")).unwrap();
        site
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// A program that runs this script; `$SITE` is the folder.
    fn program(self, name: &str, script: &str) -> Self {
        let file = self.path("bin").join(name);
        std::fs::write(&file, format!("#!/bin/sh\nSITE={}\n{script}\n", self.0.path().display())).unwrap();
        std::fs::set_permissions(&file, std::fs::Permissions::from_mode(0o755)).unwrap();
        self
    }

    /// The command with these programs before all others, and without the machine's own engine.
    fn starlings(&self, arguments: &[&str]) -> Command {
        let mut command = starlings();
        let tools = self.path("tools");
        if !tools.exists() {
            std::fs::create_dir(&tools).unwrap();
            for tool in ["sh", "cat", "grep", "sleep", "touch", "rm"] {
                std::os::unix::fs::symlink(Path::new("/bin").join(tool), tools.join(tool)).unwrap();
            }
        }
        command.env("PATH", format!("{}:{}", self.path("bin").display(), tools.display()));
        command.arg("deploy").args(arguments).current_dir(self.0.path());
        command
    }

    /// Deploys a study under Slurm into `pool`: exit code and everything that was said.
    fn slurm(&self, options: &[&str]) -> (i32, String) {
        let study = repository("examples/rcr/study.toml");
        let head = ["slurm", study.to_str().unwrap(), "--out", "pool"];
        self.said(&[&head, options].concat())
    }

    fn said(&self, arguments: &[&str]) -> (i32, String) {
        let (code, stdout, stderr) = output(&mut self.starlings(arguments));
        (code, stdout + &stderr)
    }
}

/// A Slurm in which every task has the same lot: a line of squeue for each of two workers, with a state, a reason and a number of starts.
fn slurm(state: &str, reason: &str, restarts: u32, status: u32) -> Site {
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

#[test]
fn without_slurm_the_program_that_is_missing_is_named() {
    let (code, said) = Site::new().slurm(&["--workers", "2"]);
    assert!(code == 2 && said.contains("no program `sbatch`") && said.contains("login node"), "{said}");
}

#[test]
fn what_sbatch_refuses_is_told_in_its_words() {
    let account = "sbatch: error: Batch job submission failed: Invalid account or account/partition combination specified";
    let site = slurm("PENDING", "None", 0, 0).program("sbatch", &format!("echo '{account}' >&2; exit 1"));
    let (code, said) = site.slurm(&["--workers", "2", "--", "-A", "nobody"]);
    assert!(
        code == 2 && said.contains("Invalid account or account/partition") && said.contains("-A nobody"),
        "{said}"
    );
    assert!(site.path("cancelled").exists(), "what may have been taken is cancelled");
}

#[test]
fn orders_that_cannot_be_are_refused_before_anything_is_written() {
    let site = slurm("RUNNING", "None", 0, 0);
    let cases: [(&[&str], &str); 6] = [
        (&["--workers", "0"], "--workers must be at least 1"),
        (&["--workers", "2", "--slots", "0"], "--slots must be at least 1"),
        (&["--workers", "2", "--idle", "soon"], "expected a time such as"),
        (&["--workers", "2", "--", "--array=0-7"], "the number of tasks is that of --workers"),
        (&["--workers", "2", "--", "-Jmine"], "found by their name"),
        (&["--workers", "2", "--", "--output", "x"], "logs stand in the folder"),
    ];
    for (options, words) in cases {
        let (code, said) = site.slurm(options);
        assert!(code == 2 && said.contains(words), "{options:?}: {code} {said}");
        assert!(!site.path("pool").exists(), "{options:?}");
    }
    std::fs::write(site.path("bad.toml"), "[study]\nname = 1\n").unwrap();
    let (code, said) = site.said(&["slurm", "bad.toml", "--workers", "2", "--out", "pool"]);
    assert!(code == 2 && said.contains("bad.toml"), "{said}");
    std::fs::create_dir(site.path("pool")).unwrap();
    std::fs::write(site.path("pool/mine"), "").unwrap();
    let (code, said) = site.slurm(&["--workers", "2"]);
    assert!(code == 2 && said.contains("is not empty"), "{said}");
    assert!(!site.path("submitted").exists(), "nothing was submitted");
}

#[test]
fn an_array_that_dies_at_once_is_an_error_with_its_last_lines() {
    let site = slurm("FAILED", "NonZeroExitCode", 0, 512);
    let site = site.program(
        "sbatch",
        "for i in 0 1; do echo 'node n1 says: no such library' > $SITE/pool/logs/worker-$i.log; done; echo 7",
    );
    let (code, said) = site.slurm(&["--workers", "2"]);
    assert!(code == 2 && said.contains("all 2 tasks died at once (ended with exit code 2)"), "{said}");
    assert_eq!(said.matches("no such library").count(), 1, "the same lines are shown once: {said}");
    assert!(said.contains("worker 0 and 1 more"), "{said}");
    assert!(site.path("cancelled").exists());
}

#[test]
fn a_dry_run_writes_the_scripts_and_submits_nothing() {
    let site = slurm("RUNNING", "None", 0, 0);
    let (code, said) =
        site.slurm(&["--workers", "2", "--coordinator", "job", "--dry-run", "--", "-p", "short"]);
    assert!(code == 0 && said.matches("sbatch --parsable -p short").count() == 2, "{said}");
    assert!(!site.path("submitted").exists());
    let script = std::fs::read_to_string(site.path("pool/worker.sbatch")).unwrap();
    for line in ["--array=0-1", "--requeue", "--open-mode=append", "--signal=B:TERM@30", "--idle 10m"] {
        assert!(script.contains(line), "{line}: {script}");
    }
    for name in ["worker.sbatch", "coordinator.sbatch"] {
        let (code, _, said) = output(Command::new("bash").arg("-n").arg(site.path("pool").join(name)));
        assert!(code == 0 && said.is_empty(), "{name}: {said}");
    }
}

#[test]
fn status_tells_the_reason_in_words_and_as_json() {
    let site = slurm("PENDING", "PartitionDown", 0, 0);
    let (code, said) = site.slurm(&["--workers", "2"]);
    assert!(
        code == 0 && said.contains("0 of 2 run") && said.contains("PartitionDown: the partition takes jobs"),
        "{said}"
    );
    let (code, said) = site.said(&["status", "pool"]);
    assert!(code == 0 && said.contains("worker 1") && said.contains("waiting"), "{said}");
    let (code, json) = site.said(&["status", "pool", "--json"]);
    let status: Value = serde_json::from_str(&json).unwrap();
    assert_eq!((code, &status["tasks"][1]["reason"]), (0, &Value::from("PartitionDown")));
    assert_eq!(
        (&status["tasks"][1]["state"], &status["tasks"][1]["since"]),
        (&"waiting".into(), &100.into())
    );
}

#[test]
fn watch_has_what_is_held_back_started_tells_a_queue_that_stands_and_ends_when_it_is_empty() {
    let site = slurm("PENDING", "BeginTime", 1, 0);
    assert_eq!(site.slurm(&["--workers", "2"]).0, 0);
    // After a few looks nothing is left.
    let looks = "echo look >> $SITE/looks; [ \"$(grep -c look $SITE/looks)\" -gt 5 ] && exit 0";
    let squeue = std::fs::read_to_string(site.path("bin/squeue")).unwrap();
    let site = site.program("squeue", &format!("{looks}\n{squeue}"));
    let (code, said) = site.said(&["watch", "pool", "--every", "0.01"]);
    assert!(
        code == 0 && said.contains("worker 1: started again at once") && said.contains("no process is left"),
        "{said}"
    );
    assert!(said.contains("2 of 2 wait, for ") && said.contains("BeginTime"), "since when and why: {said}");
    let updated = std::fs::read_to_string(site.path("updated")).unwrap();
    assert!(updated.contains("update JobId=7_0 StartTime=now"), "{updated}");
}

#[test]
fn remove_cancels_by_name_and_says_what_is_left() {
    let site = slurm("RUNNING", "None", 0, 0);
    assert_eq!(site.slurm(&["--workers", "2"]).0, 0);
    let (code, said) = site.said(&["remove", "pool"]);
    assert!(code == 0 && said.contains("is cancelled, nothing is left"), "{said}");
    let cancelled = std::fs::read_to_string(site.path("cancelled")).unwrap();
    assert!(cancelled.contains("--name=starlings-rcr-"), "{cancelled}");
    std::fs::remove_file(site.path("cancelled")).unwrap();
    let site = site.program("scancel", "");
    let (code, said) = site.said(&["remove", "pool", "--within", "0"]);
    assert!(code == 1 && said.contains("worker 0 (7_0, running on n1), worker 1"), "{said}");
}

#[test]
fn a_deployment_that_others_can_write_or_whose_name_is_no_plain_word_is_refused() {
    let site = slurm("RUNNING", "None", 0, 0);
    assert_eq!(site.slurm(&["--workers", "2"]).0, 0);
    let file = site.path("pool/deployment.json");
    std::fs::set_permissions(&file, std::fs::Permissions::from_mode(0o664)).unwrap();
    let (code, said) = site.said(&["remove", "pool"]);
    assert!(code == 2 && said.contains("others can write it"), "{said}");
    std::fs::set_permissions(&file, std::fs::Permissions::from_mode(0o644)).unwrap();
    let text = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, text.replace("starlings-rcr-", "$(touch here) ")).unwrap();
    let (code, said) = site.said(&["remove", "pool"]);
    assert!(code == 2 && said.contains("is no name of a deployment"), "{said}");
    assert!(!site.path("cancelled").exists());
}

#[test]
fn what_a_failed_submission_leaves_is_said_and_a_failed_look_is_no_failed_submission() {
    let site = slurm("PENDING", "None", 0, 0).program("sbatch", "echo no >&2; exit 1");
    let (code, said) = site.slurm(&["--workers", "2"]);
    assert!(code == 2 && said.contains("is cancelled, nothing is left"), "{said}");
    let site = site.program("scancel", "echo busy >&2; exit 1");
    std::fs::remove_dir_all(site.path("pool")).unwrap();
    let (code, said) = site.slurm(&["--workers", "2"]);
    assert!(
        code == 2 && said.contains("starlings deploy remove") && !said.contains("nothing is left"),
        "{said}"
    );

    let site = slurm("PENDING", "None", 0, 0).program("squeue", "echo busy >&2; exit 1");
    let (code, said) = site.slurm(&["--workers", "2"]);
    assert!(
        code == 0 && said.contains("busy") && said.contains("remove:  starlings deploy remove"),
        "{said}"
    );
}

#[test]
fn what_a_deployment_sets_itself_holds_over_the_environment_and_the_options() {
    let site = slurm("PENDING", "None", 0, 0)
        .program("sbatch", "echo \"$SBATCH_JOB_NAME:$*\" >> $SITE/submitted; echo 7");
    let study = repository("examples/rcr/study.toml");
    let mut command = site.starlings(&["slurm", study.to_str().unwrap(), "--out", "pool", "--workers", "2"]);
    let (code, _, said) = output(command.args(["--", "-p", "short"]).env("SBATCH_JOB_NAME", "mine"));
    assert_eq!(code, 0, "{said}");
    let submitted = std::fs::read_to_string(site.path("submitted")).unwrap();
    assert!(submitted.starts_with(":--parsable -p short --job-name=starlings-rcr-"), "{submitted}");
    assert!(submitted.contains(" --array=0-1 --output=/"), "{submitted}");
    assert_eq!(site.said(&["remove", "pool"]).0, 0);
    let cancelled = std::fs::read_to_string(site.path("cancelled")).unwrap();
    assert!(cancelled.contains("--user="), "{cancelled}");
    let (code, said) = site.said(&["slurm", study.to_str().unwrap(), "--out", "a\\b", "--workers", "2"]);
    assert!(code == 2 && said.contains("backslash"), "{said}");
}

#[test]
fn remove_cancels_before_it_looks() {
    let site = slurm("RUNNING", "None", 0, 0);
    assert_eq!(site.slurm(&["--workers", "2"]).0, 0);
    let site = site.program("squeue", "echo 'slurm_load_jobs error' >&2; exit 1");
    let (code, said) = site.said(&["remove", "pool"]);
    assert!(code == 1 && said.contains("slurm_load_jobs error"), "{said}");
    assert!(site.path("cancelled").exists(), "{said}");
}

#[test]
fn workers_on_a_host_that_is_lost_are_neither_live_nor_ended() {
    // A host that takes workers and is not reached afterwards.
    let ssh = "[ -e $SITE/lost ] && { echo 'No route to host' >&2; exit 255; }
for i in 0 1; do echo \"starlings $i running 100 0\"; done";
    let site = Site::new().program("ssh", ssh);
    let study = repository("examples/rcr/study.toml");
    let head = ["hosts", study.to_str().unwrap(), "--ssh", "ssh", "--out", "pool", "--hosts", "a"];
    let (code, said) = site.said(&[&head[..], &["--workers", "2"]].concat());
    assert!(code == 0 && said.contains("2 of 2 run"), "{said}");
    std::fs::write(site.path("lost"), "").unwrap();
    let (code, said) = site.said(&["status", "pool"]);
    assert!(code == 0 && said.contains("unreached") && said.contains("No route to host"), "{said}");
    let (code, said) = site.said(&["watch", "pool", "--every", "0.01"]);
    assert!(code == 1 && said.contains("2 of 2 processes are not reached"), "{said}");
    let (code, said) = site.said(&["remove", "pool"]);
    assert!(code == 1 && said.contains("worker 1 (") && said.contains("unreached on a"), "{said}");
}

#[test]
fn a_folder_that_is_no_deployment_is_refused_by_every_command() {
    let site = slurm("RUNNING", "None", 0, 0);
    std::fs::create_dir(site.path("other")).unwrap();
    std::fs::write(site.path("other/deployment.json"), "{}").unwrap();
    for folder in ["nowhere", "other"] {
        for command in ["status", "watch", "remove"] {
            let (code, said) = site.said(&[command, folder]);
            assert!(code == 2 && said.contains("is no folder of a deployment"), "{command} {folder}: {said}");
        }
    }
}

/// Whether a process with this name of a deployment in its environment runs.
fn runs(name: &str) -> bool {
    std::fs::read_dir("/proc").unwrap().flatten().any(|entry| {
        let environment = std::fs::read(entry.path().join("environ")).unwrap_or_default();
        String::from_utf8_lossy(&environment).contains(&format!("STARLINGS_DEPLOYMENT={name}"))
    })
}

#[test]
fn workers_on_a_list_of_hosts_serve_a_run_are_seen_and_are_removed() {
    // In the place of ssh: a shell on this machine with a home folder for every host.
    let site = Site::new().program(
        "ssh",
        "host=$1; shift; /bin/mkdir -p $SITE/$host; exec /usr/bin/env HOME=$SITE/$host PATH=/usr/bin:/bin \"$@\"",
    );
    let ssh = site.path("bin/ssh");
    let study = repository("examples/rcr/study.toml");
    let free = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
    let deploy = |out: &str, more: &[&str]| {
        let mut command = starlings();
        command
            .args(["deploy", "hosts"])
            .arg(&study)
            .args(["--hosts", "a,b", "--slots", "1", "--ssh"])
            .arg(&ssh);
        command.arg("--out").arg(site.path(out)).args(more);
        let (code, stdout, stderr) = output(&mut command);
        (code, stdout + &stderr)
    };
    let (code, said) = deploy("pool", &["--workers", "3", "--address", &free]);
    assert!(code == 0 && said.contains("3 of 3 run"), "{said}");
    let (access, out) = (site.path("pool/access.json"), site.path("run"));
    let mut run = starlings();
    run.arg("run").arg(&study).args(["--listen", &free, "--access"]).arg(&access).arg("--out").arg(&out);
    let (code, said, _) = output(&mut run);
    assert!(code == 0 && said.contains("on 3 workers"), "{said}");
    let (code, json) = site.said(&["status", "pool", "--json"]);
    let status: Value = serde_json::from_str(&json).unwrap();
    let name = status["name"].as_str().unwrap();
    let nodes: Vec<_> = (0..3).map(|i| status["tasks"][i]["node"].as_str().unwrap()).collect();
    assert_eq!((code, nodes), (0, vec!["a", "b", "a"]));
    assert!(runs(name));
    let (code, said) = site.said(&["remove", "pool"]);
    assert!(code == 0 && said.contains("is cancelled, nothing is left"), "{said}");
    assert!(!runs(name), "no process of it is left");

    let (code, said) = deploy("broken", &["--scratch", "/not/there"]);
    assert!(code == 2 && said.contains("no scratch folder can be made in /not/there"), "{said}");
}

#[test]
fn a_host_that_is_not_reached_is_named_with_the_words_of_ssh() {
    let site = Site::new()
        .program("ssh", "echo \"ssh: connect to host $1 port 22: No route to host\" >&2; exit 255");
    let study = repository("examples/rcr/study.toml");
    let head = ["hosts", study.to_str().unwrap(), "--ssh", "ssh", "--out", "pool"];
    let (code, said) = site.said(&[&head[..], &["--hosts", "a"]].concat());
    assert!(code == 2 && said.contains("connect to host a port 22: No route to host"), "{said}");
    let (code, said) = site.said(&[&head[..], &["--hosts=-oProxyCommand=x"]].concat());
    assert!(code == 2 && said.contains("is no name of a host"), "{said}");
}

//! `starlings deploy` with programs in the place of Slurm that say what Slurm says. The real one: tests/slurm.rs.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
mod deploy_kit;

use std::process::Command;

use common::{output, repository};
use deploy_kit::slurm;
use serde_json::Value;

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

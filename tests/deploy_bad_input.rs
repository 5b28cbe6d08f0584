//! What `starlings deploy` says of bad input, places that lack something and engines that refuse, line by line.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod access_kit;
mod common;
mod deploy_kit;

use std::os::unix::fs::PermissionsExt;
use std::process::Command;

use access_kit::{Started, listening};
use common::{output, repository, starlings, wait_until};
use deploy_kit::{Site, one_node, slurm};

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
    let cases: [(&[&str], &str); 11] = [
        (&["--workers", "0"], "--workers must be at least 1"),
        (&["--workers", "2", "--slots", "0"], "--slots must be at least 1"),
        (&["--workers", "2", "--idle", "soon"], "expected a time such as"),
        (&["--workers", "2", "--", "--array=0-7"], "the number of tasks is that of --workers"),
        (&["--workers", "2", "--", "-Jmine"], "found by their name"),
        (&["--workers", "2", "--", "--output", "x"], "logs stand in the folder"),
        (
            &["--workers", "2", "--", "-p", "short", "mine.sh"],
            "mine.sh cannot be given to sbatch: a word that is no option",
        ),
        (&["--workers", "2", "--", "-p"], "-p cannot be given to sbatch: it needs a value"),
        (&["--workers", "2", "--elastic", "1..2"], "cannot be used with"),
        (&["--elastic", "4..2"], "no fewer than the least"),
        (&["--elastic", "0..0"], "must be at least 1"),
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

/// The first line of what was said.
fn first(said: &str) -> &str {
    said.lines().next().unwrap_or_default()
}

#[test]
fn a_partition_that_does_not_exist_is_told_in_slurms_words_with_the_command() {
    let refusal = "sbatch: error: invalid partition specified: nowhere\nsbatch: error: Batch job submission failed: Invalid partition name specified";
    let site = slurm("PENDING", "None", 0, 0).program("sbatch", &format!("echo '{refusal}' >&2; exit 1"));
    let (code, said) = site.slurm(&["--workers", "2", "--", "-p", "nowhere"]);
    assert_eq!(code, 2, "{said}");
    assert!(
        first(&said)
            .contains("sbatch refused the submission: sbatch: error: invalid partition specified: nowhere"),
        "{said}"
    );
    assert!(said.contains("-p nowhere") && said.contains("is cancelled, nothing is left"), "{said}");
}

#[test]
fn a_queue_that_never_starts_is_told_since_when_and_with_slurms_own_reason() {
    let site = slurm("PENDING", "PartitionDown", 0, 0);
    let (code, said) = site.slurm(&["--workers", "2"]);
    assert!(code == 0 && said.contains("the others wait: PartitionDown: the partition takes jobs"), "{said}");
    let mut watch = Started::of(&mut site.starlings(&["watch", "pool", "--every", "0.1"]));
    watch.await_words("2 of 2 wait, for ");
    let line = watch.said().lines().find(|line| line.contains("2 of 2 wait")).unwrap().to_owned();
    // Since second 100 of 1970.
    assert!(line.contains(" d: PartitionDown: the partition takes jobs and starts none"), "{line}");
    std::fs::write(site.path("cancelled"), "").unwrap();
    assert_eq!(watch.end(), Some(0), "{}", watch.said());
}

#[test]
fn a_scratch_that_is_not_there_is_told_in_the_words_of_the_node() {
    let (code, said) = one_node().slurm(&["--workers", "1", "--scratch", "/not/there"]);
    assert_eq!(code, 2, "{said}");
    assert!(first(&said).contains("all 1 tasks died at once (ended with exit code 1); what was submitted is cancelled, nothing is left. Their last lines:"), "{said}");
    assert!(said.contains("no scratch folder can be made in /not/there: is it there, and may you write in it? Name another with --scratch"), "{said}");
}

#[test]
fn a_node_that_cannot_reach_the_coordinator_says_what_it_tried_from_there() {
    let site = one_node();
    // Nobody listens on a port that was just given back.
    let free = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
    let access = site.path("access.json");
    let (code, _, said) = output(starlings().args(["deploy", "access", "--address", &free]).arg(&access));
    assert_eq!(code, 0, "{said}");
    let (code, said) = site.slurm(&["--workers", "1", "--access", access.to_str().unwrap()]);
    assert_eq!(code, 0, "{said}");
    let tried = format!("it reaches no coordinator at {free} (as ");
    wait_until("what the node tried", || site.said(&["status", "pool"]).1.contains(&tried));
    let said = site.said(&["status", "pool"]).1;
    assert!(said.contains(&format!("({free}: ")) && said.contains("refused"), "the cause: {said}");
    let mut watch = Started::of(&mut site.starlings(&["watch", "pool", "--every", "0.1"]));
    watch.await_words(&format!("worker 0 running on n1: {tried}"));
    assert_eq!(site.said(&["remove", "pool"]).0, 0);
    assert_eq!(watch.end(), Some(0), "{}", watch.said());
}

#[test]
fn a_node_with_another_build_is_named_with_both_builds() {
    let folder = tempfile::tempdir().unwrap();
    let (study, out) = (repository("examples/rcr/study.toml"), folder.path().join("run"));
    // The same program to the system, and another one to whoever compares executables.
    let other = folder.path().join("starlings");
    let mut bytes = std::fs::read(env!("CARGO_BIN_EXE_starlings")).unwrap();
    bytes.push(0);
    std::fs::write(&other, bytes).unwrap();
    std::fs::set_permissions(&other, std::fs::Permissions::from_mode(0o755)).unwrap();
    let mut coordinator = listening("run", &study, &["--out", out.to_str().unwrap()]);
    let mut worker = Started::of(
        Command::new(&other).args(["worker", "--slots", "1", "--access"]).arg(out.join("access.json")),
    );
    assert_eq!(coordinator.end(), Some(0), "{}", coordinator.said());
    assert_eq!(worker.end(), Some(0), "{}", worker.said());
    let said = coordinator.said();
    let line = said.lines().find(|line| line.contains("another build")).unwrap_or_else(|| panic!("{said}"));
    assert!(
        line.starts_with("worker 1@") && line.contains(" runs another build of this version ("),
        "{line}"
    );
    assert!(line.contains(" instead of ") && line.contains("may differ in the last digits"), "{line}");
}

#[test]
fn ctrl_c_while_a_submission_is_looked_at_leaves_nothing_in_the_queue() {
    let site = slurm("PENDING", "Priority", 0, 0);
    let study = repository("examples/rcr/study.toml");
    let arguments = ["slurm", study.to_str().unwrap(), "--out", "pool", "--workers", "2"];
    // The signal comes once, from what is asked first after the submission, and has a second to arrive.
    let squeue = std::fs::read_to_string(site.path("bin/squeue")).unwrap();
    let site = site.program(
        "squeue",
        &format!("[ -e $SITE/sent ] || {{ echo > $SITE/sent; kill -INT $PPID; sleep 1; }}\n{squeue}"),
    );
    let (code, _, said) = output(&mut site.starlings(&arguments));
    assert!(
        code == 130 && said.contains("interrupted; what was submitted is cancelled, nothing is left"),
        "{code} {said}"
    );
    let cancelled = std::fs::read_to_string(site.path("cancelled")).unwrap();
    assert!(cancelled.contains("--name=starlings-rcr-"), "{cancelled}");
}

#[test]
fn ctrl_c_of_a_watch_that_removes_on_exit_leaves_nothing_in_the_queue() {
    let site = slurm("RUNNING", "None", 0, 0);
    assert_eq!(site.slurm(&["--workers", "2"]).0, 0);
    let arguments = ["watch", "pool", "--every", "0.1", "--remove-on-exit"];
    let mut watch = Started::of(&mut site.starlings(&arguments));
    watch.await_words("worker 1 running");
    let pid = watch.child.id().to_string();
    assert!(Command::new("kill").args(["-INT", &pid]).status().unwrap().success());
    assert_eq!(watch.end(), Some(130), "{}", watch.said());
    assert!(watch.said().contains("interrupted; the deployment is removed"), "{}", watch.said());
    assert!(site.path("cancelled").exists());
}

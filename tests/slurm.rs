//! Studies under a real Slurm of four nodes, which `.ci/slurm test` starts: `just slurm`.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod access_kit;
mod common;
mod slurm_kit;

use std::process::Command;
use std::time::Instant;

use access_kit::Started;
use common::{analyses, output, repository, starlings, wait_until};
use slurm_kit::{Revived, Trial, deploy, kill, lab, parent, queue, remove, task, worker_process};

#[test]
#[ignore = "needs a Slurm: .ci/slurm test"]
fn a_node_that_dies_in_the_middle_changes_no_byte_and_its_worker_is_back_at_once() {
    let trial = Trial::new();
    let (study, out, fit) = (&trial.study, trial.path("pool"), trial.path("fit"));
    let started = Instant::now();
    // One task fits on a node, and there is a node more than tasks.
    let (code, said) = deploy(study, &out, &["--workers", "3", "--", "--mem=600"]);
    assert_eq!(code, 0, "{said}");
    assert!(said.contains("3 of 3 run") && said.contains("next:    starlings run"), "{said}");
    println!("three workers run after {:.1} s", started.elapsed().as_secs_f64());

    let watch = Started::of(starlings().args(["deploy", "watch", "--every", "0.5"]).arg(&out));
    let access = out.join("access.json");
    let mut call = starlings();
    call.arg("run").arg(study).args(["--listen", "127.0.0.1:0", "--access"]).arg(&access);
    let mut coordinator = Started::of(call.arg("--out").arg(&fit));
    wait_until("some analyses", || analyses(&fit) > 3);

    let first = task(&out, "worker 0");
    let node = first["node"].as_str().unwrap().to_owned();
    let daemon = std::fs::read_to_string(lab().join(format!("run/slurmd-{node}.pid"))).unwrap();
    let worker = worker_process(&access, "0").unwrap();
    let script = parent(&worker);
    assert!(coordinator.child.try_wait().unwrap().is_none(), "the study is in the middle");
    // Whoever would tell Slurm of the end of the others dies before them, as all of a machine does at once.
    for process in [daemon.trim(), &parent(&script), &script, &worker] {
        kill(process);
    }
    let _revived = Revived(node.clone());
    let killed = Instant::now();

    assert_eq!(coordinator.end(), Some(0), "{}", coordinator.said());
    println!("the study ended {:.1} s after the node", killed.elapsed().as_secs_f64());
    assert!(trial.is_same(&fit));

    watch.await_words("worker 0: started again at once");
    wait_until("a new start of worker 0", || {
        task(&out, "worker 0")["state"] == "running" && task(&out, "worker 0")["restarts"] == 1
    });
    // Slurm alone takes 120 s from the loss of the node, which it notices after 10 to 30 s, to the new start.
    println!("its worker was back after {:.1} s", killed.elapsed().as_secs_f64());
    assert_ne!(task(&out, "worker 0")["node"], node.as_str());

    let removed = Instant::now();
    remove(&out);
    println!("removed in {:.1} s", removed.elapsed().as_secs_f64());
    watch.await_words("no process is left");
}

#[test]
#[ignore = "needs a Slurm: .ci/slurm test"]
fn a_coordinator_that_is_a_job_goes_on_after_a_requeue_and_ends_with_its_workers() {
    let trial = Trial::new();
    let out = trial.path("pool");
    let (code, said) =
        deploy(&trial.study, &out, &["--workers", "2", "--coordinator", "job", "--", "--mem=300"]);
    assert_eq!(code, 0, "{said}");
    let fit = out.join("run");
    wait_until("some analyses", || analyses(&fit) > 3);
    let id = task(&out, "coordinator")["id"].as_str().unwrap().to_owned();
    let (code, _, said) = output(Command::new("scontrol").args(["requeue", &id]));
    assert_eq!(code, 0, "{said}");
    let requeued = Instant::now();
    let mut watch = Started::of(starlings().args(["deploy", "watch", "--every", "0.5"]).arg(&out));
    assert_eq!(watch.end(), Some(0), "{}", watch.said());
    println!("done and empty {:.1} s after the requeue", requeued.elapsed().as_secs_f64());
    assert!(watch.said().contains("coordinator: started again at once"), "{}", watch.said());
    let log = std::fs::read_to_string(out.join("logs/coordinator.log")).unwrap();
    assert!(trial.is_same(&fit), "{log}");
    assert_eq!(queue(), "", "the workers are cancelled by the coordinator");
    remove(&out);
}

#[test]
#[ignore = "needs a Slurm: .ci/slurm test"]
fn what_slurm_does_not_take_is_told_in_its_words_and_leaves_nothing_in_the_queue() {
    let folder = tempfile::tempdir().unwrap();
    let study = repository("examples/rcr/study.toml");
    let cases: [(&str, &[&str], &str); 3] = [
        ("partition", &["--workers", "2", "--", "-p", "none"], "invalid partition specified: none"),
        ("memory", &["--workers", "2", "--", "--mem=5T"], "Memory specification can not be satisfied"),
        (
            "scratch",
            &["--workers", "2", "--scratch", "/not/there"],
            "no scratch folder can be made in /not/there",
        ),
    ];
    for (name, options, words) in cases {
        let (code, said) = deploy(&study, &folder.path().join(name), options);
        assert!(code == 2 && said.contains(words), "{code} {said}");
        wait_until("an empty queue", || queue().is_empty());
    }
}

#[test]
#[ignore = "needs a Slurm: .ci/slurm test"]
fn a_task_leaves_its_scratch_folder_to_nobody() {
    let folder = tempfile::tempdir().unwrap();
    let scratch = folder.path().join("scratch of all");
    std::fs::create_dir(&scratch).unwrap();
    let out = folder.path().join("a pool, 100% new");
    let options = ["--workers", "2", "--scratch", scratch.to_str().unwrap()];
    let (code, said) = deploy(&repository("examples/rcr/study.toml"), &out, &options);
    assert_eq!(code, 0, "{said}");
    let n_folder = || std::fs::read_dir(&scratch).unwrap().count();
    assert_eq!(n_folder(), 2);
    assert!(out.join("logs/worker-1.log").is_file());
    remove(&out);
    wait_until("an empty folder", || n_folder() == 0);
}

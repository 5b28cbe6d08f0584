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
use slurm_kit::nodes::{Cut, kill_node, node_state};
use slurm_kit::{
    Trial, coordinator, deploy, is_alive, node_of, queue, remove, task, worker_process, workers,
};

#[test]
#[ignore = "needs a Slurm: .ci/slurm test"]
fn a_node_that_dies_and_one_that_is_cut_off_in_the_middle_change_no_byte_and_their_workers_come_back() {
    let trial = Trial::new();
    let (study, out, fit) = (&trial.study, trial.path("pool"), trial.path("fit"));
    let started = Instant::now();
    // There is a node more than tasks.
    let (code, said) = deploy(study, &out, &["--workers", "3", "--", "--exclusive"]);
    assert_eq!(code, 0, "{said}");
    assert!(said.contains("3 of 3 run") && said.contains("next:    starlings run"), "{said}");
    println!("three workers run after {:.1} s", started.elapsed().as_secs_f64());

    let watch = Started::of(starlings().args(["deploy", "watch", "--every", "0.5"]).arg(&out));
    let access = out.join("access.json");
    let mut coordinator = coordinator(study, &access, &fit);
    wait_until("some analyses", || analyses(&fit) > 3);

    let [dead, away] = ["worker 0", "worker 1"].map(|name| node_of(&out, name));
    assert_ne!(dead, away, "one task on a node");
    let worker_away = worker_process(&access, "1").unwrap();
    assert!(coordinator.child.try_wait().unwrap().is_none(), "the study is in the middle");
    let cut = Cut::off(&away);
    let revived = kill_node(&dead, &worker_process(&access, "0").unwrap());
    let lost = Instant::now();

    assert_eq!(coordinator.end(), Some(0), "{}", coordinator.said());
    println!("the study ended {:.1} s after the nodes were lost", lost.elapsed().as_secs_f64());
    assert!(trial.is_same(&fit));

    wait_until("Slurm to miss both", || {
        [&dead, &away].iter().all(|node| node_state(node).starts_with("down"))
    });
    println!("Slurm missed both after {:.1} s", lost.elapsed().as_secs_f64());
    // The machine that died is switched on again, so that there are nodes for both tasks while the other one is away.
    drop(revived);
    let is_back = |name| {
        let task = task(&out, name);
        task["state"] == "running" && task["restarts"] == 1
    };
    wait_until("both workers", || is_back("worker 0") && is_back("worker 1"));
    // Slurm alone takes 120 s from the loss of a node, which it notices after 10 to 30 s, to the new start.
    println!("both workers were back after {:.1} s", lost.elapsed().as_secs_f64());
    for name in ["worker 0", "worker 1"] {
        watch.await_words(&format!("{name}: started again at once"));
        assert_ne!(node_of(&out, name), away);
    }
    assert!(is_alive(&worker_away), "nobody ends what is cut off");
    drop(cut);
    wait_until("the end of the worker that was cut off", || !is_alive(&worker_away));

    let removed = Instant::now();
    remove(&out);
    println!("removed in {:.1} s", removed.elapsed().as_secs_f64());
    watch.await_words("no process is left");
    wait_until("the end of every worker", || workers(&access).is_empty());
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

//! `starlings deploy hosts` with a shell on this machine in the place of ssh.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
mod deploy_kit;

use common::{output, repository, starlings};
use deploy_kit::Site;
use serde_json::Value;

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

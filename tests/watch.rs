//! `starlings watch`: a run by its folder, running, finished or killed, and by the address of its live page.

mod common;
mod live_kit;

use common::{analyses, output, refused, starlings, studies, wait_until};
use live_kit::Run;
use serde_json::Value;

fn view(of: &str) -> Value {
    let (code, stdout, stderr) = output(starlings().args(["watch", of, "--json"]));
    assert_eq!(code, 0, "{stderr}");
    serde_json::from_str(&stdout).unwrap_or_else(|error| panic!("{error}: {stdout}"))
}

#[test]
fn a_folder_says_whether_its_run_goes_on_was_killed_or_is_finished() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    let of = out.to_str().expect("UTF-8");
    let study = studies::slow(folder.path(), 3);
    let mut run = Run::start(&study, &out, &["--workers", "2"]);
    wait_until("an analysis", || analyses(&out) > 0);
    let seen = view(of);
    assert_eq!(seen["state"], "running", "{seen}");
    assert!(seen["ended"].as_str().is_some_and(|by| by.starts_with("process ")), "{seen}");
    run.kill();
    let seen = view(of);
    assert_eq!(seen["state"], "ended", "{seen}");
    let (code, says, _) = output(starlings().args(["watch", of]));
    assert_eq!(code, 0, "{says}");
    assert!(says.contains("slow: starlings run") && says.contains("it was killed or broke off"), "{says}");
    let (code, _, says) = output(starlings().arg("run").arg(&study).args(["--resume", "--out", of]));
    assert_eq!(code, 0, "{says}");
    let seen = view(of);
    assert_eq!(seen["state"], "finished", "{seen}");
    assert_eq!(live_kit::of(&seen), live_kit::stored(&out));
    let (_, says, _) = output(starlings().args(["watch", of]));
    assert!(says.contains("finished") && says.contains("NIS"), "{says}");
}

#[test]
fn the_address_of_a_page_shows_the_same_run() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    let run = Run::start(&studies::slow(folder.path(), 16), &out, &["--workers", "2"]);
    let mut seen = Value::Null;
    wait_until("both workers", || {
        seen = view(&run.url);
        seen["fleet"]["slots"] == 2
    });
    assert_eq!((seen["state"].as_str(), seen["head"]["study"].as_str()), (Some("running"), Some("slow")));
    // Another token is refused with the page's own words.
    let other = run.url.replace(run.token(), &"0".repeat(run.token().len()));
    refused(starlings().args(["watch", &other]), &["cannot watch", "403", "lacks the token"]);
}

#[test]
fn what_is_no_run_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    refused(starlings().arg("watch").arg(folder.path()), &["no run in", "address of a live page"]);
    refused(starlings().args(["watch", "http://127.0.0.1:1/x/"]), &["cannot watch http://127.0.0.1:1/x/"]);
}

//! `--dashboard`: a page that follows a run, over real sockets.

mod common;
mod live_kit;

use std::time::Instant;

use common::{output, starlings, studies, wait_until};
use live_kit::{Run, View};

#[test]
fn whoever_has_the_address_sees_the_run_and_nobody_else() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = Run::start(&studies::slow(folder.path(), 8), &folder.path().join("out"), &[]);
    let (code, head, page) = run.get("");
    assert_eq!(code, 200, "{page}");
    assert!(page.contains("<script src=\"page.js\" defer></script>"), "{page}");
    for header in [
        "content-security-policy: default-src 'none'; style-src 'self'; script-src 'self'; connect-src 'self'",
        "referrer-policy: no-referrer",
        "cache-control: no-store",
    ] {
        assert!(head.to_lowercase().contains(header), "no `{header}` in\n{head}");
    }
    assert_eq!(run.get("page.js").0, 200);
    assert_eq!(run.get("page.css").0, 200);
    assert_eq!(run.get("elsewhere").0, 404);
    assert_eq!(run.get("report").0, 404, "it is not finished");
    // The token less its last digit, none, and another one.
    let token = run.token();
    let other = "0".repeat(token.len());
    for path in ["/", "/now", "/page.js", &format!("/{}/now", &token[1..]), &format!("/{other}/stream")] {
        let (code, _, says) = live_kit::get(run.address(), path);
        assert_eq!(code, 403, "{path}: {says}");
        assert!(says.contains("lacks the token") && !says.contains(token), "{path}: {says}");
    }
}

#[test]
fn the_last_view_of_a_run_has_the_numbers_of_its_store_and_leads_to_the_report() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    let mut run = Run::start(&studies::slow(folder.path(), 2), &out, &["--workers", "2"]);
    let mut stream = run.stream();
    let last = stream.last_view();
    assert_eq!(
        (last["view"]["state"].as_str(), last["view"]["report"].as_bool()),
        (Some("finished"), Some(true))
    );
    let (code, head, report) = run.get("report");
    assert_eq!(code, 200, "{head}");
    assert!(report.contains("<h1>") && head.to_lowercase().contains("connect-src").eq(&false), "{head}");
    run.succeeds();
    let view: View = live_kit::stored(&out);
    assert_eq!(live_kit::of(&last["view"]), view);
    // As many points as analyses, and the last of them is what the table says.
    let points = stream.points();
    assert_eq!(points.len() as u64, view.analyses);
    let drawn = &points[points.len() - 1][6][0][0];
    assert_eq!(drawn.as_f64(), Some(view.parameters[0].1[0]));
}

#[test]
fn a_worker_that_is_killed_is_seen_within_two_seconds() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = Run::start(&studies::slow(folder.path(), 16), &folder.path().join("out"), &["--workers", "2"]);
    let mut stream = run.stream();
    let worker = stream.find("a worker at work", |sent| {
        let workers = sent["view"]["workers"].as_array()?;
        let busy = workers.iter().find(|worker| worker["jobs"].as_u64() > Some(0))?;
        busy["name"].as_str().map(str::to_owned)
    });
    let pid = live_kit::pid_of(&worker);
    let killed = Instant::now();
    live_kit::kill(pid);
    stream.find("its loss", |sent| {
        let lost = sent["view"]["workers"].as_array()?.iter().find(|one| one["name"] == worker.as_str())?;
        (lost["state"] == "lost" && sent["view"]["fleet"]["losses"].as_u64() == Some(1)).then_some(())
    });
    let seconds = killed.elapsed().as_secs_f64();
    assert!(seconds < 2.0, "{seconds} s");
}

#[test]
fn ten_views_a_second_are_sent_at_most_and_a_viewer_who_never_reads_ends_with_the_run() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    let mut run = Run::start(&studies::slow(folder.path(), 8), &out, &["--workers", "2"]);
    // Connections that ask for the stream and read nothing of it.
    let silent: Vec<_> = (0..8).map(|_| run.ask("stream")).collect();
    let mut stream = run.stream();
    let began = Instant::now();
    let last = stream.last_view();
    let seconds = began.elapsed().as_secs_f64();
    assert_eq!(last["view"]["state"], "finished");
    // One more at each end of the span.
    assert!((stream.n_view() as f64) < 10.0 * seconds + 2.0, "{} views in {seconds} s", stream.n_view());
    run.succeeds();
    drop(silent);
}

#[test]
fn names_with_markup_are_text_in_the_stream_and_the_page_has_no_place_for_markup() {
    let folder = tempfile::tempdir().expect("a folder");
    let study = studies::slow(folder.path(), 8);
    let text = std::fs::read_to_string(&study).expect("a study");
    let name = "<img src=x onerror=alert(1)>";
    std::fs::write(&study, text.replace("name = \"slow\"", &format!("name = \"{name}\""))).expect("room");
    let out = folder.path().join("out");
    let mut command = starlings();
    command.arg("check").arg(&study);
    // Where a study may not have such a name nothing can be shown of it.
    if output(&mut command).0 == 0 {
        let run = Run::start(&study, &out, &[]);
        let sent = run.stream().next().expect("a view");
        assert_eq!(sent["view"]["head"]["study"], name);
    }
    let script = include_str!("../coordinator/live/src/page/page.js");
    for sink in ["innerHTML", "outerHTML", "insertAdjacentHTML", "document.write", "eval("] {
        assert!(!script.contains(sink), "{sink} takes markup");
    }
}

#[test]
fn a_page_is_refused_where_its_address_is_none_or_taken_and_nothing_is_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let study = studies::slow(folder.path(), 1);
    let out = folder.path().join("out");
    let run = |option: &str| output(starlings().arg("run").arg(&study).arg("--out").arg(&out).arg(option));
    let (code, _, says) = run("--dashboard=nowhere");
    assert_eq!(code, 2, "{says}");
    assert!(says.contains("--dashboard nowhere: expected HOST:PORT"), "{says}");
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = taken.local_addr().expect("an address");
    let (code, _, says) = run(&format!("--dashboard={address}"));
    assert_eq!(code, 1, "{says}");
    assert!(says.contains(&format!("cannot serve the live page on {address}")), "{says}");
    assert!(!out.exists(), "nothing was written");
}

#[test]
fn a_command_that_breaks_off_says_so_on_its_page() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut run = Run::start(&studies::slow(folder.path(), 16), &folder.path().join("out"), &[]);
    let mut stream = run.stream();
    stream.find("a worker", |sent| sent["view"]["fleet"]["busy"].as_u64().filter(|n| *n > 0));
    run.interrupt();
    let last = stream.last_view();
    assert_eq!(last["view"]["state"], "ended");
    assert!(last["view"]["ended"].as_str().is_some_and(|why| why.contains("before it was done")), "{last}");
    wait_until("its end", || run.has_ended());
}

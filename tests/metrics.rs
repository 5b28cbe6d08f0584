//! `--metrics`: a page that a real Prometheus scrapes, and whether the fleet is well.

#![allow(clippy::print_stderr)] // a test that is skipped says so

mod common;
mod metrics_kit;

use common::{output, starlings, wait_until};
use metrics_kit::{Coordinator, Prometheus, get};

#[test]
fn a_coordinator_is_ready_when_a_worker_takes_runs_and_its_page_counts_them() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut run = Coordinator::start(folder.path());
    assert_eq!(get(run.metrics, "/healthz").0, 200);
    let (code, says) = get(run.metrics, "/readyz");
    assert_eq!((code, says.as_str()), (503, "no worker takes runs\n"));
    assert_eq!(run.value("starlings_workers{state=\"in_use\"}"), Some(0.0));
    assert_eq!(get(run.metrics, "/elsewhere").0, 404);
    run.worker("2");
    wait_until("a ready fleet", || get(run.metrics, "/readyz").0 == 200);
    wait_until("a finished run", || {
        run.value("starlings_runs_total{result=\"prediction\"}").is_some_and(|n| n > 0.0)
    });
    // One page is one look: what it says of the same runs agrees.
    let page = run.page();
    let of = |name: &str| metrics_kit::value(&page, name).unwrap_or_else(|| panic!("no {name} in\n{page}"));
    let finished =
        of("starlings_runs_total{result=\"prediction\"}") + of("starlings_runs_total{result=\"failure\"}");
    assert!((finished - of("starlings_run_duration_seconds_count")).abs() < 0.5, "{page}");
    assert!(of("starlings_run_duration_seconds_sum") > 0.0, "{page}");
    assert!(
        (of("starlings_slots{state=\"busy\"}") + of("starlings_slots{state=\"idle\"}") - 2.0).abs() < 0.5
    );
    assert!((of("starlings_worker_joins_total") - 1.0).abs() < 0.5, "{page}");
    assert!(page.ends_with("# EOF\n"), "{page}");
}

#[test]
fn a_prometheus_of_the_distribution_scrapes_a_run_and_answers_for_it() {
    let folder = tempfile::tempdir().expect("a folder");
    if !Prometheus::is_here() {
        eprintln!("skipped: no `prometheus` in PATH (Debian: apt-get install prometheus)");
        return;
    }
    let mut run = Coordinator::start(folder.path());
    let prometheus = Prometheus::start(folder.path(), run.metrics);
    run.worker("1");
    run.worker("1");
    let ask = |query: &str| prometheus.query(query);
    wait_until("both workers", || ask("sum(starlings_workers)").is_some_and(|n| n > 1.5));
    wait_until("scraped runs", || {
        ask("starlings_runs_total{result=\"prediction\"}").is_some_and(|n| n > 0.0)
    });
    let is = |query: &str, expected: f64| {
        let got = ask(query);
        assert!(
            got.is_some_and(|got| (got - expected).abs() < 1e-9),
            "{query}: {got:?} instead of {expected}"
        );
    };
    is("sum(starlings_slots)", 2.0);
    is("starlings_worker_joins_total", 2.0);
    is("starlings_worker_reconnects_total", 0.0);
    // Of one scrape each: every finished run has its time.
    is("sum(starlings_runs_total) - sum(starlings_run_duration_seconds_count)", 0.0);
    is(
        "starlings_run_duration_seconds_bucket{le=\"+Inf\"} - ignoring(le) starlings_run_duration_seconds_count",
        0.0,
    );
    // The types of a Prometheus: a counter is one to it.
    let types = prometheus.get("/api/v1/targets/metadata?metric=starlings_run_duration_seconds");
    assert!(types.contains("\"type\":\"histogram\"") && types.contains("\"unit\":\"seconds\""), "{types}");
}

#[test]
fn an_address_that_is_none_or_taken_is_refused_before_anything_is_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let study = common::studies::slow(folder.path(), 1);
    let out = folder.path().join("out");
    let run = |address: &str| {
        output(starlings().arg("run").arg(&study).arg("--out").arg(&out).args(["--metrics", address]))
    };
    let (code, _, says) = run("nowhere");
    assert_eq!(code, 2, "{says}");
    assert!(says.contains("--metrics nowhere: expected HOST:PORT"), "{says}");
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = taken.local_addr().expect("an address").to_string();
    let (code, _, says) = run(&address);
    assert_eq!(code, 1, "{says}");
    assert!(
        says.contains(&format!("cannot serve metrics on {address}")) && says.contains("port 0"),
        "{says}"
    );
    assert!(!out.exists(), "nothing was written");
}

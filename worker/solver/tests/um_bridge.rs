//! A model behind a UM-Bridge server, against a server of the protocol in Python's standard library.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

use std::collections::BTreeMap;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;

use starlings_models::{
    Description, Forward, Job, ModelDef, Quantity, SOLVER, Setup, SolverDef, Spec, Window,
};
use starlings_solver::conformance::{Trial, conformance};
use starlings_solver::{SiteOptions, Solvers};
use tempfile::TempDir;

/// Protocol 1.0 with nine models: `line` gives a + b t for every time, `two` takes two vectors, `odd` answers with too little,
/// `sick` with an error; `die` ends the server once, `hang` never answers its first run. `pair` answers when two servers run,
/// `doom` kills the server five times under two runs, `luck` has it killed, then fall, then answers.
const SERVER: &str = include_str!("um_bridge/server.py");

struct Bench {
    folder: TempDir,
    def: SolverDef,
    solvers: Solvers,
}

impl Bench {
    /// A server that the worker starts.
    fn new(model: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("server.py"), SERVER).unwrap();
        let def = SolverDef {
            adapter: "um-bridge".to_owned(),
            command: vec!["python3".to_owned(), "server.py".to_owned()],
            folder: folder.path().display().to_string(),
            model: Some(model.to_owned()),
            timeout: 30.0,
            ..SolverDef::default()
        };
        Self { folder, def, solvers: Solvers::new(SiteOptions::default()) }
    }

    fn named(mut self, parameters: &[&str], outputs: &[&str]) -> Self {
        let list = |names: &[&str]| names.iter().map(|name| Quantity::new(name, "")).collect();
        let spec = Spec {
            kind: SOLVER.to_owned(),
            parameters: list(parameters),
            outputs: list(outputs),
            ..Spec::default()
        };
        let name = "line".to_owned();
        self.def.described = Some(Description { spec, name, deterministic: true, ..Description::default() });
        self
    }

    fn forward(&self) -> Result<Box<dyn Forward>, String> {
        let description = self.solvers.describe(&self.def).map_err(|error| error.to_string())?;
        let names = |list: &[Quantity]| list.iter().map(|q| q.name.clone()).collect::<Vec<_>>();
        let (parameters, outputs) = (names(&description.spec.parameters), names(&description.spec.outputs));
        let solver = Some(Box::new(SolverDef { described: Some(description), ..self.def.clone() }));
        let model = ModelDef { kind: SOLVER.to_owned(), solver, ..ModelDef::default() };
        let setup = Setup { model, parameters, outputs, ..Setup::default() };
        self.solvers.build(&setup).map_err(|error| error.to_string())
    }

    fn run(&self, theta: &[f64], times: &[f64]) -> Result<Vec<f64>, String> {
        let window = Window::free(0.0, times.to_vec(), 1, Vec::new());
        let job =
            Job { particle: 0, record: 0, window: Arc::new(window), theta: theta.to_vec(), state: None };
        let prediction = self.forward()?.run(&job).map_err(|error| error.to_string())?;
        Ok(prediction.outputs)
    }
}

#[test]
fn a_model_behind_a_server_is_run_with_the_bits_that_it_is_given() {
    let bench = Bench::new("line").named(&["a", "b"], &["y"]);
    let third = 1.0 / 3.0;
    // The same two operations in the same order: the same bits.
    assert_eq!(bench.run(&[0.1, third], &[1.0, 2.0, 3.5]).unwrap(), [1.0, 2.0, 3.5].map(|t| 0.1 + third * t));
}

#[test]
fn what_the_study_does_not_name_gets_numbered_names() {
    let bench = Bench::new("two");
    let description = bench.solvers.describe(&bench.def).unwrap();
    let names: Vec<&str> = description.spec.parameters.iter().map(|q| q.name.as_str()).collect();
    assert_eq!((names.as_slice(), description.spec.outputs[0].name.as_str()), (&["p1", "p2"][..], "y1"));
    assert!(!description.spec.restart);
    assert_eq!(bench.run(&[1.0, 2.0], &[3.0]).unwrap(), [7.0]);
}

#[test]
fn a_server_that_dies_under_a_run_is_started_again() {
    let bench = Bench::new("die");
    assert_eq!(bench.run(&[1.0, 2.0], &[3.0]).unwrap(), [7.0]);
    assert!(bench.folder.path().join("mark").exists(), "it did die");
}

/// What two threads get that make the same run of one forward model.
fn twice_at_once(bench: &Bench) -> [Result<Vec<f64>, String>; 2] {
    let forward = bench.forward().unwrap();
    let run = || {
        let window = Window::free(0.0, vec![3.0], 1, Vec::new());
        let job =
            Job { particle: 0, record: 0, window: Arc::new(window), theta: vec![1.0, 2.0], state: None };
        forward.run(&job).map(|prediction| prediction.outputs).map_err(|error| error.to_string())
    };
    std::thread::scope(|scope| {
        let threads = [scope.spawn(run), scope.spawn(run)];
        threads.map(|thread| thread.join().unwrap())
    })
}

#[test]
fn runs_at_the_same_time_have_servers_of_their_own() {
    let bench = Bench::new("pair");
    assert_eq!(twice_at_once(&bench), [Ok(vec![7.0]), Ok(vec![7.0])]);
}

#[test]
fn a_server_at_a_fixed_address_that_is_killed_under_two_runs_fails_neither() {
    let mut bench = Bench::new("doom");
    let port = std::net::TcpListener::bind(("127.0.0.1", 0)).unwrap().local_addr().unwrap().port();
    bench.def.address = Some(format!("http://127.0.0.1:{port}"));
    bench.def.environment.insert("PORT".to_owned(), port.to_string());
    assert_eq!(twice_at_once(&bench), [Ok(vec![7.0]), Ok(vec![7.0])]);
    let deaths = std::fs::read_dir(bench.folder.path())
        .unwrap()
        .filter(|entry| entry.as_ref().unwrap().file_name().to_string_lossy().starts_with("doom-"));
    assert_eq!(deaths.count(), 5);
}

#[test]
fn a_server_that_was_killed_before_may_still_fall_once() {
    assert_eq!(Bench::new("luck").run(&[1.0, 2.0], &[3.0]), Ok(vec![7.0]));
}

#[test]
fn a_model_behind_a_server_passes_the_checks_of_conformance() {
    let bench = Bench::new("line").named(&["a", "b"], &["y"]);
    let trial = |d: &Description| Trial::of(d, &BTreeMap::new(), &[0.0, 0.5, 1.0, 1.5, 2.0]);
    let found = conformance(&bench.solvers, &bench.def, trial).unwrap();
    assert!(found.failed.is_empty(), "{found:?}");
    assert!(
        found.passed.iter().any(|name| name.starts_with("a request that does not fit is refused")),
        "{found:?}"
    );
}

#[test]
fn a_server_that_never_answers_is_ended_and_the_next_run_has_a_new_one() {
    let mut bench = Bench::new("hang");
    bench.def.timeout = 1.0;
    let says = bench.run(&[1.0, 2.0], &[3.0]).unwrap_err();
    assert!(says.contains("did not answer /Evaluate within 1 s (`timeout` sets the limit)"), "{says}");
    assert_eq!(bench.run(&[1.0, 2.0], &[3.0]).unwrap(), [7.0]);
}

#[test]
fn what_the_server_says_of_an_error_is_told() {
    let says = Bench::new("sick").run(&[1.0, 2.0], &[3.0]).unwrap_err();
    assert!(says.contains("the model `sick` at http://127.0.0.1:"), "{says}");
    assert!(
        says.contains("answered /Evaluate with an error: InvalidInput: a is below the melting point"),
        "{says}"
    );
    let says = Bench::new("odd").run(&[1.0, 2.0], &[3.0, 4.0]).unwrap_err();
    assert!(says.contains("answered 1 values where 2 belong"), "{says}");
}

#[test]
fn a_study_that_does_not_fit_the_server_is_refused() {
    let says = Bench::new("lne").forward().map(|_| ()).unwrap_err();
    assert!(
        says.contains(
            "no model `lne`; it has line, two, odd, sick, die, hang, pair, doom, luck; did you mean `line`?"
        ),
        "{says}"
    );
    let mut bench = Bench::new("line");
    bench.def.model = None;
    let says = bench.forward().map(|_| ()).unwrap_err();
    assert!(
        says.contains(
            "several models, line, two, odd, sick, die, hang, pair, doom, luck: say which by `model`"
        ),
        "{says}"
    );
    let says = Bench::new("line").named(&["a"], &["y"]).forward().map(|_| ()).unwrap_err();
    assert!(says.contains("takes 2 values ([2]), the study has 1 parameters"), "{says}");
    let mut bench = Bench::new("line");
    bench.def.environment.insert("VERSION".to_owned(), "2.0".to_owned());
    let says = bench.forward().map(|_| ()).unwrap_err();
    assert!(says.contains("speaks UM-Bridge 2.0, and 1.0 is spoken here"), "{says}");
    let mut bench = Bench::new("line");
    bench.def.address = Some("https://127.0.0.1:{port}".to_owned());
    let says = bench.forward().map(|_| ()).unwrap_err();
    assert!(says.contains("expected http://host:port"), "{says}");
}

#[test]
fn a_server_that_cannot_start_or_never_answers_is_told_with_its_last_words() {
    let mut bench = Bench::new("line");
    std::fs::write(bench.folder.path().join("server.py"), "raise SystemExit('no licence left')").unwrap();
    let says = bench.forward().map(|_| ()).unwrap_err();
    assert!(says.contains("exited with status 1 before it was ready"), "{says}");
    assert!(says.ends_with("no licence left"), "{says}");
    bench.def.start_timeout = 0.3;
    bench.def.command = vec!["sleep".to_owned(), "600".to_owned()];
    let says = bench.forward().map(|_| ()).unwrap_err();
    assert!(says.contains("was not ready within 0.3 s: it cannot be reached for /Info"), "{says}");
}

/// Ends a server of somebody else with the test.
struct Elsewhere(Child);

impl Drop for Elsewhere {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn a_server_that_somebody_else_started_is_reached_by_its_address() {
    let mut bench = Bench::new("line");
    let port = std::net::TcpListener::bind(("127.0.0.1", 0)).unwrap().local_addr().unwrap().port();
    let mut command = Command::new("python3");
    command.arg(bench.folder.path().join("server.py")).env("PORT", port.to_string()).stdout(Stdio::null());
    let server = Elsewhere(command.spawn().unwrap());
    bench.def.command.clear();
    bench.def.address = Some(format!("127.0.0.1:{port}"));
    assert_eq!(bench.run(&[1.0, 2.0], &[3.0]).unwrap(), [7.0]);
    drop(server);
    bench.def.start_timeout = 0.3;
    let says = bench.run(&[1.0, 2.0], &[3.0]).unwrap_err();
    assert!(says.contains(&format!("http://127.0.0.1:{port}")), "{says}");
}

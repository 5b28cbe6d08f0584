//! What a worker lets a coordinator do: nothing but built-in models, and the programs that its own command line names. The coordinator
//! here has the token and is hostile. Each test is one property.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod access_kit;
mod common;
#[path = "solver_kit/mod.rs"]
mod kit;

use std::collections::BTreeMap;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::time::Duration;

use access_kit::{Started, worker};
use kit::Folder;
use starlings_coordinator::fleet::access::Secrets;
use starlings_coordinator::fleet::{Fleet, FleetConfig, FleetEvent, GrpcFleet};
use starlings_models::{
    Description, FilesDef, Job, ModelDef, Quantity, SOLVER, Setup, Signal, SolverDef, Spec, Window,
};
use starlings_proto::access::AccessFile;
use tokio_util::sync::CancellationToken;

/// What a worker answers to a setup: predicted values, or why it does not build it.
type Answer = Result<Vec<f64>, String>;

/// Has a worker with these options asked for one run of this setup.
fn asked(access: &Path, options: &[&str], setup: &Setup, inputs: Vec<Signal>) -> Answer {
    let (sender, events) = mpsc::channel();
    let cancel = CancellationToken::new();
    let secrets = Secrets::draw().unwrap();
    let address: std::net::SocketAddr = ([127, 0, 0, 1], 0).into();
    let mut config = FleetConfig::new(address, "hostile", cancel.clone(), sender);
    config.secrets = Some(secrets.clone());
    let mut fleet = GrpcFleet::listen(config).unwrap();
    let address = fleet.address().unwrap().to_string();
    AccessFile::new("hostile", vec![address], secrets.authority(), secrets.token().clone())
        .write(access)
        .unwrap();
    let started: Started = worker(access, options);
    let setup = fleet.install(setup).unwrap();
    let window = Window::free(0.0, vec![0.5], 1, inputs);
    let job = Job { particle: 0, record: 0, window: window.into(), theta: vec![30.0, 1.5], state: None };
    let run = std::thread::spawn(move || fleet.run(setup, vec![job]));
    let refused = loop {
        match events.recv_timeout(Duration::from_millis(20)) {
            Ok(FleetEvent::SetupFailed { reason, .. }) => break Some(reason),
            _ if run.is_finished() => break None,
            _ => {}
        }
    };
    cancel.cancel();
    let ran = run.join().unwrap();
    drop(started);
    match refused {
        Some(reason) => Err(reason),
        None => Ok(ran.unwrap().remove(0).result.unwrap().outputs),
    }
}

/// A folder with a marker that a hostile command would make, and an access file.
struct Place {
    folder: Folder,
    marker: PathBuf,
}

impl Place {
    fn new() -> Self {
        let folder = Folder::new();
        let marker = folder.path().join("marker");
        Self { folder, marker }
    }

    fn access(&self) -> PathBuf {
        self.folder.path().join("access.json")
    }

    fn evil(&self) -> Vec<String> {
        vec!["touch".to_owned(), self.marker.display().to_string()]
    }

    fn asked(&self, options: &[&str], def: SolverDef) -> Answer {
        let force = Signal { times: vec![0.0, 1.0], values: vec![0.0, 0.0] };
        asked(&self.access(), options, &oscillator(def), vec![force])
    }

    fn assert_untouched(&self) {
        assert!(!self.marker.exists(), "the command of the coordinator was run");
    }

    /// The line that starts the solver of this machine.
    fn own(&self) -> String {
        format!("{} serve {}", env!("CARGO_BIN_EXE_starlings"), self.folder.mark())
    }
}

/// The oscillator of the example behind a solver.
fn oscillator(def: SolverDef) -> Setup {
    let constants = [("m", 1.0), ("initial:x", 0.08)].map(|(name, value)| (name.to_owned(), value)).into();
    let model =
        ModelDef { kind: SOLVER.to_owned(), constants, solver: Some(Box::new(def)), ..ModelDef::default() };
    let parameters = ["k", "c"].map(str::to_owned).to_vec();
    Setup { model, parameters, outputs: vec!["position".to_owned()], ..Setup::default() }
}

fn map(entries: &[(&str, &str)]) -> BTreeMap<String, String> {
    entries.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect()
}

fn described() -> Description {
    let spec =
        Spec { kind: SOLVER.to_owned(), outputs: vec![Quantity::new("position", "m")], ..Spec::default() };
    Description { spec, name: "evil".to_owned(), deterministic: true, ..Description::default() }
}

#[test]
fn a_worker_without_flags_starts_no_program_by_any_adapter_and_dials_nothing() {
    let place = Place::new();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    listener.set_nonblocking(true).unwrap();
    let address = listener.local_addr().unwrap().to_string();
    for adapter in starlings_solver::adapters() {
        for address in [None, Some(address.clone()), Some(format!("http://{address}"))] {
            let command = if address.is_some() { vec![] } else { place.evil() };
            let adapter = adapter.name.to_owned();
            let def =
                SolverDef { adapter, command, address, described: Some(described()), ..SolverDef::default() };
            let says = place.asked(&[], def).unwrap_err();
            for word in ["--solver CMD", "--solver-from STUDY", "--allow-commands-from-study"] {
                assert!(says.contains(word), "{says}");
            }
            place.assert_untouched();
        }
    }
    assert!(listener.accept().is_err(), "the worker dialled an address of the coordinator's choice");
}

#[test]
fn a_worker_without_flags_runs_built_in_models() {
    let place = Place::new();
    let mut setup = oscillator(SolverDef::default());
    setup.model.kind = "oscillator".to_owned();
    (setup.model.solver, setup.parameters) = (None, ["k", "c"].map(str::to_owned).to_vec());
    setup.model.constants = [("m".to_owned(), 1.0)].into();
    assert!(asked(&place.access(), &[], &setup, vec![]).is_ok_and(|outputs| outputs[0].is_finite()));
}

#[test]
fn the_pinned_command_is_run_and_not_the_studys_nor_in_its_folder() {
    let place = Place::new();
    let hostile = || SolverDef { command: place.evil(), folder: "/etc".to_owned(), ..SolverDef::default() };
    let pinned = place.asked(&["--solver", &place.own()], hostile()).unwrap();
    place.assert_untouched();
    assert!(pinned[0].is_finite());
    // The same in the words of a study of the worker's machine.
    place.folder.serving("own.toml", "");
    let own = place.folder.path().join("own.toml");
    let from = place.asked(&["--solver-from", own.to_str().unwrap()], hostile()).unwrap();
    place.assert_untouched();
    assert_eq!(from[0].to_bits(), pinned[0].to_bits());
}

#[test]
fn the_environment_of_a_coordinator_reaches_no_program() {
    let place = Place::new();
    let environment = map(&[("LD_PRELOAD", "/tmp/evil.so")]);
    let says = place.asked(&["--solver", &place.own()], SolverDef { environment, ..SolverDef::default() });
    let says = says.unwrap_err();
    assert!(
        says.contains("`LD_PRELOAD` is set by the study only") && says.contains("--solver-from"),
        "{says}"
    );
}

#[test]
fn a_coordinator_that_changes_the_adapter_is_refused() {
    let place = Place::new();
    for adapter in ["command", "fmu", "mpi", "um-bridge", "none-such"] {
        let described = Some(described());
        let def = SolverDef {
            adapter: adapter.to_owned(),
            command: place.evil(),
            described,
            ..SolverDef::default()
        };
        let says = place.asked(&["--solver", &place.own()], def).unwrap_err();
        assert!(says.contains(&format!("the adapter `{adapter}`")), "{says}");
        place.assert_untouched();
    }
}

/// A program of files of the worker's machine, in a study: what is copied is what comes out.
fn file_study(place: &Place) -> PathBuf {
    let folder = place.folder.path();
    std::fs::write(folder.join("own.json"), "{\"position\": [1.5]}").unwrap();
    let text = "[study]\nname = \"own\"\n[model]\nkind = \"solver\"\nadapter = \"command\"\ncommand = [\"cat\", \"data.json\"]\n\
                copies = { \"data.json\" = \"own.json\" }\nparameters = [{ name = \"k\" }, { name = \"c\" }]\n\
                outputs = [{ name = \"position\" }]\n";
    let study = folder.join("files.toml");
    std::fs::write(&study, text).unwrap();
    study
}

/// What a coordinator asks for that has the same study, with these files.
fn file_setup(files: FilesDef) -> Setup {
    let quantities = |names: &[&str]| names.iter().map(|name| Quantity::new(name, "")).collect();
    let spec = Spec {
        kind: SOLVER.to_owned(),
        parameters: quantities(&["k", "c"]),
        outputs: quantities(&["position"]),
        ..Spec::default()
    };
    let described =
        Description { spec, name: "cat".to_owned(), deterministic: true, ..Description::default() };
    let def = SolverDef {
        adapter: "command".to_owned(),
        command: ["sh", "-c", "cat data.json"].map(str::to_owned).to_vec(),
        described: Some(described),
        files: Some(files),
        ..SolverDef::default()
    };
    let mut setup = oscillator(def);
    setup.model.constants.clear();
    setup
}

#[test]
fn the_files_that_a_coordinator_wants_copied_are_not_read() {
    let place = Place::new();
    let study = file_study(&place);
    let options = ["--solver-from", study.to_str().unwrap()];
    let asked = |files| asked(&place.access(), &options, &file_setup(files), vec![]);
    // A name that both have: the worker's own file is taken, wherever the coordinator's lies.
    let copies = map(&[("data.json", "/etc/shadow")]);
    assert_eq!(asked(FilesDef { copies, ..FilesDef::default() }), Ok(vec![1.5]));
    let copies = map(&[("data.json", "/etc/shadow"), ("more", "/etc/shadow")]);
    let says = asked(FilesDef { copies, ..FilesDef::default() }).unwrap_err();
    assert!(says.contains("the copied file `more` is set by the study only"), "{says}");
}

#[test]
fn templates_and_rules_that_lead_out_of_a_runs_folder_are_refused() {
    let place = Place::new();
    let study = file_study(&place);
    let options = ["--solver-from", study.to_str().unwrap()];
    let asked = |files| asked(&place.access(), &options, &file_setup(files), vec![]).unwrap_err();
    let copies = map(&[("data.json", "data.json")]);
    for name in ["../evil", "/tmp/evil", "data.json"] {
        let templates = map(&[(name, "evil")]);
        let says = asked(FilesDef { templates, copies: copies.clone(), ..FilesDef::default() });
        assert!(says.contains(&format!("the template of `{name}`")), "{says}");
    }
    let reads = map(&[("position", "column:/etc/shadow:1")]);
    let says = asked(FilesDef { reads, copies, ..FilesDef::default() });
    assert!(says.contains("the rule of the output `position`"), "{says}");
}

#[test]
fn also_where_commands_are_allowed_no_file_of_a_run_lies_outside_its_folder() {
    let place = Place::new();
    let outside = place.folder.path().join("outside");
    for name in ["../outside".to_owned(), outside.display().to_string(), "a/../../outside".to_owned()] {
        for is_copy in [false, true] {
            let own = map(&[(&name, "/etc/hostname")]);
            let files = if is_copy {
                FilesDef { copies: own, ..FilesDef::default() }
            } else {
                FilesDef { templates: own, ..FilesDef::default() }
            };
            let options = ["--allow-commands-from-study"];
            let says = asked(&place.access(), &options, &file_setup(files), vec![]).unwrap_err();
            assert!(says.contains("lies outside the run's folder"), "{says}");
            assert!(!outside.exists());
        }
    }
}

#[test]
fn the_flag_that_allows_commands_of_a_study_says_what_it_gives_up_and_allows_them() {
    let place = Place::new();
    let def = SolverDef { command: place.evil(), ..SolverDef::default() };
    let says = place.asked(&["--allow-commands-from-study"], def).unwrap_err();
    assert!(place.marker.exists(), "the marker shows what the other tests look for: {says}");
    let access = place.access();
    let warned = worker(&access, &["--allow-commands-from-study", "--patience", "0"]);
    warned.await_words("can run any command on this machine");
}

#[test]
fn a_run_with_local_workers_runs_the_command_of_its_study() {
    let folder = Folder::new();
    folder.serving("study.toml", "");
    let out = folder.path().join("run");
    let summary = common::run(&folder.path().join("study.toml"), &out, 1);
    assert_eq!(summary["runs"]["failed"], 0);
}

//! What is wrong with a study of a solver: message, place and remedy as a user reads them.

use std::fmt::Write as _;

use starlings_coordinator::study::{Problem, SolverHost, Study};
use starlings_models::{BuildSetup, Description, Setup};
use starlings_solver::adapters;

use crate::inside::{Inside, Place, no_host};
use crate::swing::{native, recording, solver};

/// The model of a program that is started for every run, in the place of the equations.
const COMMAND: &str = r#"kind = "solver"
adapter = "command"
command = ["./bin/swing", "{folder}"]
timeout = 60
memory = "2 GiB"
environment = { LANG = "C" }
parameters = [
    { name = "k", unit = "N/m", role = "stiffness", range = [0, 100] },
    { name = "c", unit = "N s/m" },
    { name = "m", unit = "kg", default = 1.0 },
]
outputs = [
    { name = "position", unit = "m", read = "csv:out.csv:x" },
    { name = "velocity", unit = "m/s" },
]
inputs = [ { name = "force", unit = "N" } ]
templates = { "swing.inp" = "swing.inp.tmpl" }
copies = ["mesh.inp"]
"#;

/// The study of such a program, which has no initial value to estimate.
pub(crate) fn command() -> String {
    let study = solver("").replace(crate::swing::SOLVER, COMMAND);
    let initial = "\n[[parameters]]\nname = \"initial:x\"\nprior = { transform = \"linear\", median = 0.5, sd = 0.2 }\n";
    assert!(study.contains(COMMAND) && study.contains(initial));
    study.replace(initial, "")
}

pub(crate) fn place(study: &str) -> Place {
    let data = recording(&[], &[], 7);
    let (template, mesh) = ("k = {{ k }}\n", "1 2 3\n");
    Place::new(&[
        ("study.toml", study),
        ("swing.csv", &data),
        ("swing.inp.tmpl", template),
        ("mesh.inp", mesh),
    ])
}

fn inside() -> Inside {
    let here = place(&native(""));
    Inside::of(&here.load(&no_host()).unwrap(), &["v"])
}

/// `line:column: message`, and the help where there is one, with the folder left out.
fn told(problem: &Problem, folder: &str) -> Vec<String> {
    let (line, column) = problem.line_column().unwrap_or_default();
    let mut lines = vec![format!("{line}:{column}: {}", problem.message)];
    lines.extend(problem.help.iter().map(|help| format!("help: {help}")));
    lines.into_iter().map(|line| line.replace(&format!("{folder}/"), "").replace(folder, "FOLDER")).collect()
}

fn problems(study: &str, solver_host: &SolverHost) -> Vec<String> {
    let place = place(study);
    let folder = place.folder.path().display().to_string();
    match place.load(solver_host) {
        Ok(_) => Vec::new(),
        Err(error) => error.problems.iter().flat_map(|problem| told(problem, &folder)).collect(),
    }
}

/// Spoils a good study one place at a time: `- ` the place, `+ ` what is put there, then what is reported.
fn check(good: &str, solver_host: &SolverHost, cases: &str) {
    assert_eq!(problems(good, solver_host), [""; 0]);
    let mut wrong = String::new();
    for case in cases.trim_end().split("\n\n") {
        let part = |sign: char| {
            let lines: Vec<&str> =
                case.lines().filter_map(|l| l.strip_prefix(sign)).map(str::trim_start).collect();
            lines.join("\n")
        };
        let (from, to) = (part('-'), part('+'));
        assert_eq!(good.matches(&from).count(), 1, "`{from}` is not one place of the study");
        let expected: Vec<&str> = case.lines().filter(|l| !l.starts_with(['-', '+'])).collect();
        let found = problems(&good.replace(&from, &to), solver_host);
        if found != expected {
            writeln!(wrong, "- {from}\n+ {to}\n{}\n", found.join("\n")).unwrap();
        }
    }
    assert!(wrong.is_empty(), "told instead:\n{wrong}");
}

#[test]
fn keys_of_a_solver_are_told_with_place_and_remedy() {
    let good = solver("[observer]\nkind = \"nudging\"\ngain = 0.5\n\n[estimator]\nkind = \"roukf\"\n");
    check(&good, &inside().solver_host(), include_str!("solver.txt"));
}

#[test]
fn keys_of_a_program_that_is_started_for_every_run_are_told_with_place_and_remedy() {
    check(&command(), &no_host(), include_str!("command.txt"));
}

#[test]
fn what_a_program_is_started_with_travels_with_the_study() {
    let place = place(&command());
    let study: Study = place.load(&no_host()).unwrap();
    let solver = study.setup.model.solver.as_ref().unwrap();
    assert_eq!(solver.folder, place.folder.path().display().to_string());
    let inner = place.folder.path().join("inner");
    std::fs::create_dir(&inner).unwrap();
    place.write("study.toml", &command().replace("timeout = 60", "timeout = 60\nfolder = \"inner\""));
    let moved = place.load(&no_host()).unwrap().setup.model.solver.unwrap();
    assert_eq!(moved.folder, inner.canonicalize().unwrap().display().to_string());
    assert_eq!(solver.command, ["./bin/swing", "{folder}"]);
    assert_eq!((solver.memory, solver.timeout.to_bits()), (Some(2 << 30), 60.0_f64.to_bits()));
    let files = solver.files.as_ref().unwrap();
    assert_eq!(files.templates["swing.inp"], "k = {{ k }}\n");
    assert_eq!(files.copies["mesh.inp"], place.folder.path().join("mesh.inp").display().to_string());
    assert_eq!(files.reads.keys().collect::<Vec<_>>(), ["position"], "JSON is the default");
    let described = study.setup.model.description().unwrap();
    assert_eq!((described.name.as_str(), described.deterministic), ("swing", true));
    assert_eq!(described.spec.parameters[0].range.map(f64::to_bits), [0.0_f64, 100.0].map(f64::to_bits));
    assert!(!described.spec.restart && described.spec.states.is_empty());
}

#[test]
fn a_template_that_changed_since_starts_another_run() {
    let place = place(&command());
    let load = || place.load(&no_host()).unwrap();
    let created = starlings_coordinator::study::RunFolder::create(
        starlings_coordinator::study::store::Purpose::Run,
        &place.folder.path().join("run"),
        &load(),
        "test",
        "today",
    );
    drop(created.unwrap());
    place.resume(&load(), "run").unwrap();
    for (file, before, after) in
        [("swing.inp.tmpl", "k = {{ k }}\n", "k = {{ c }}\n"), ("mesh.inp", "1 2 3\n", "3 2 1\n")]
    {
        place.write(file, after);
        let refused = place.resume(&load(), "run").unwrap_err().to_string();
        assert!(refused.contains("the solver or one of its files"), "{file}: {refused}");
        place.write(file, before);
        place.resume(&load(), "run").unwrap();
    }
}

/// What is reported of a solver with this description.
fn described(change: impl FnOnce(&mut Description)) -> Vec<String> {
    problems(&solver(""), &inside().described(change).solver_host())
}

#[test]
fn a_description_that_makes_no_sense_is_told_at_the_command() {
    let wrong = |fault: &str| {
        let message = format!("7:11: the solver `swing` describes itself wrongly: {fault}");
        vec![message, "help: mend the solver's description".to_owned()]
    };
    let twice = described(|d| d.spec.parameters.push(d.spec.parameters[0].clone()));
    assert_eq!(
        twice,
        wrong(&format!(
            "it describes the parameter `{}` twice",
            inside().description().spec.parameters[0].name
        ))
    );
    assert_eq!(described(|d| d.spec.outputs[0].size = 0), wrong("output `position` has 0 components"));
    let hosted = described(|d| d.hosts = vec!["vv".to_owned()]);
    assert_eq!(
        hosted,
        wrong(
            "it names the state `vv` as a host of terms, which is none of its scalar states; did you mean `v`?"
        )
    );
    let range = described(|d| d.spec.parameters[0].range = [2.0, 1.0]);
    assert_eq!(
        range,
        wrong(&format!(
            "parameter `{}` has the range 2 to 1",
            inside().description().spec.parameters[0].name
        ))
    );
    let nameless = described(|d| d.spec.inputs[0].name = String::new());
    assert!(nameless[0].ends_with("input 1 has no name"), "{nameless:?}");
    let indexed = described(|d| d.spec.parameters[0].name = "k[0]".to_owned());
    assert_eq!(indexed, wrong("`k[0]` is no name for a parameter: it has one of `:`, `[` and `]` in it"));
    let measured = described(|d| d.spec.measures = vec![("position".to_owned(), "vv".to_owned())]);
    assert_eq!(measured, wrong("it names the state `vv`, which is not among its states; did you mean `v`?"));
}

#[test]
fn a_solver_that_gives_other_bits_every_time_is_told_about() {
    let place = place(&solver(""));
    let study = place.load(&inside().described(|d| d.deterministic = false).solver_host()).unwrap();
    assert!(
        study.warnings.iter().any(|w| w.contains("equal requests need not give equal answers")),
        "{:?}",
        study.warnings
    );
}

#[test]
fn a_solver_that_cannot_be_started_is_told_with_the_way_out() {
    let mute =
        SolverHost::new(|_| Err("it exited with status 3".to_owned()), std::sync::Arc::new(Setup::build))
            .by(adapters());
    let told = problems(&solver(""), &mute);
    assert_eq!(told[0], "7:11: the solver does not say what it is: it exited with status 3");
    assert!(told[1].contains("described = \"solver.json\""), "{told:?}");
    let unstarted = problems(&solver(""), &no_host());
    assert_eq!(unstarted[0], "7:11: the solver does not say what it is: no solver can be started here");
}

#[test]
fn the_estimator_of_a_solver_that_cannot_restart_is_batch() {
    let once = inside().described(|d| d.spec.restart = false).solver_host();
    let line = solver("").lines().count() + 3;
    assert_eq!(
        problems(&solver("\n[estimator]\nkind = \"roukf\"\n"), &once),
        [
            format!(
                "{line}:8: kind = \"roukf\" goes on from the state of each analysis, and the solver `swing` cannot restart from a state"
            ),
            "help: use kind = \"batch\", which runs whole records".to_owned(),
        ]
    );
    let told = problems(&solver("\n[estimator]\npasses = 3\n"), &once);
    assert_eq!(told[1], "help: remove it: the solver `swing` cannot restart from a state");
}

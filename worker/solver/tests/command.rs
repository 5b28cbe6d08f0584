//! A program that is started for every run: what goes in, what comes out, and every way in which it can go wrong.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

#[path = "command/bench.rs"]
mod bench;
#[path = "command/examples.rs"]
mod examples;
#[path = "command/failures.rs"]
mod failures;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use starlings_models::{
    Description, FilesDef, Forward, Job, ModelDef, Quantity, SOLVER, Setup, Signal, SolverDef, Spec, Window,
};
use starlings_solver::{Permit, SiteOptions, Solvers};
use tempfile::TempDir;

/// A study's folder with a shell script in it, and the solver that runs it.
struct Bench {
    folder: TempDir,
    scratch: TempDir,
    def: SolverDef,
    solvers: Solvers,
    outputs: Vec<Quantity>,
}

fn map(pairs: &[(&str, &str)]) -> BTreeMap<String, String> {
    pairs.iter().map(|(a, b)| ((*a).to_owned(), (*b).to_owned())).collect()
}

impl Bench {
    /// A solver of one parameter `k`, one input `flow` and the output `tip`.
    fn new(script: &str, reads: &[(&str, &str)]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("solve.sh"), script).unwrap();
        let scratch = tempfile::tempdir().unwrap();
        let options = SiteOptions { scratch: Some(scratch.path().to_path_buf()), guard: None };
        let def = SolverDef {
            adapter: "command".to_owned(),
            command: vec!["sh".to_owned(), "solve.sh".to_owned()],
            folder: folder.path().display().to_string(),
            files: Some(FilesDef { reads: map(reads), ..FilesDef::default() }),
            timeout: 30.0,
            ..SolverDef::default()
        };
        let outputs = vec![Quantity::new("tip", "m")];
        Self { folder, scratch, def, solvers: Solvers::new(options), outputs }
    }

    fn outputs(mut self, outputs: &[(&str, usize)]) -> Self {
        self.outputs = outputs.iter().map(|(name, size)| Quantity::new(name, "m").size(*size)).collect();
        self
    }

    fn files(&mut self) -> &mut FilesDef {
        self.def.files.as_mut().unwrap()
    }

    fn command(mut self, words: &[&str]) -> Self {
        self.def.command = words.iter().map(|word| (*word).to_owned()).collect();
        self
    }

    fn forward(&self) -> Result<Box<dyn Forward>, String> {
        let spec = Spec {
            kind: SOLVER.to_owned(),
            parameters: vec![Quantity::new("k", "N/m")],
            outputs: self.outputs.clone(),
            inputs: vec![Quantity::new("flow", "mL/s")],
            ..Spec::default()
        };
        let described =
            Some(Description { spec, name: "sh".to_owned(), deterministic: true, ..Description::default() });
        let solver = Some(Box::new(SolverDef { described, ..self.def.clone() }));
        let model = ModelDef { kind: SOLVER.to_owned(), solver, ..ModelDef::default() };
        let setup = Setup {
            model,
            parameters: vec!["k".to_owned()],
            outputs: self.outputs.iter().map(|q| q.name.clone()).collect(),
            ..Setup::default()
        };
        self.solvers.build(&setup).map_err(|error| error.to_string())
    }

    fn run(&self, k: f64, times: &[f64]) -> Result<Vec<f64>, String> {
        let forward = self.forward()?;
        let n: usize = self.outputs.iter().map(|q| q.size).sum();
        let prediction = forward.run(&job(k, times, n, &[0.0, 2.0])).map_err(|error| error.to_string())?;
        assert!(prediction.state.is_empty(), "a program that starts anew has no state");
        Ok(prediction.outputs)
    }

    /// Folders of runs that are still there.
    fn kept(&self) -> usize {
        let roots = std::fs::read_dir(self.scratch.path()).unwrap();
        roots.map(|root| std::fs::read_dir(root.unwrap().path()).unwrap().count()).sum()
    }
}

fn job(k: f64, times: &[f64], n_output: usize, flow: &[f64]) -> Job {
    let inputs = vec![Signal { times: (0..flow.len()).map(|i| i as f64).collect(), values: flow.to_vec() }];
    let window = Arc::new(Window::free(0.0, times.to_vec(), n_output, inputs));
    Job { particle: 3, record: 1, window, theta: vec![k], state: None }
}

#[test]
fn files_from_templates_and_copies_go_in_and_a_table_comes_out() {
    let script = ". ./params.txt\n\
                  awk -v k=$k -v m=$(cat mesh/beam.txt) 'BEGIN { print \"time,tip\"; \
                  for (i = 0; i <= 4; i++) printf \"%g,%.17g\\n\", i/2, k*m*i/2 }' > result.csv\n";
    let mut bench = Bench::new(script, &[("tip", "csv:result.csv:tip")]);
    let mesh = bench.folder.path().join("beam.txt");
    std::fs::write(&mesh, "10").unwrap();
    bench.files().templates = map(&[("params.txt", "k={{ k }}\nend={{ end }}\n")]);
    bench.files().copies = map(&[("mesh/beam.txt", &mesh.display().to_string())]);
    // The rows of the table are half a second apart: 0.75 lies between two of them.
    assert_eq!(bench.run(0.3, &[0.5, 0.75, 2.0]).unwrap(), [1.5, 2.25, 6.0]);
    assert_eq!(bench.kept(), 0, "the folder of a run that went well is removed");
}

#[test]
fn a_run_is_told_in_json_on_the_standard_input() {
    let bench = Bench::new("cat > \"$1\"; echo '{\"tip\": [1, 2]}'", &[]);
    let told = bench.folder.path().join("told.json");
    let bench = bench.command(&["sh", "solve.sh", &told.display().to_string()]);
    let k = 0.1 + 0.2;
    assert_eq!(bench.run(k, &[1.0, 2.0]).unwrap(), [1.0, 2.0]);
    let told: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(told).unwrap()).unwrap();
    assert_eq!(told["parameters"]["k"].as_f64().unwrap().to_bits(), k.to_bits());
    assert_eq!(told["times"], serde_json::json!([1.0, 2.0]));
    assert_eq!(told["inputs"]["flow"], serde_json::json!({ "times": [0.0, 1.0], "values": [0.0, 2.0] }));
    assert_eq!((&told["start"], &told["particle"], &told["record"]), (&0.0.into(), &3.into(), &1.into()));
    assert_eq!(told["outputs"], serde_json::json!(["tip"]));
}

#[test]
fn arguments_take_values_and_other_braces_stay() {
    let bench = Bench::new("", &[]).command(&["sh", "-c", "printf '{\"tip\": %s}' {k}"]);
    assert_eq!(bench.run(1e-300, &[1.0]).unwrap(), [1e-300]);
}

#[test]
fn a_command_of_the_machine_leads_to_files_of_its_own_folder() {
    let mut bench = Bench::new("echo '{\"tip\": 7}'", &[]).command(&["no-such-program"]);
    let own = SolverDef { command: ["sh", "solve.sh"].map(str::to_owned).to_vec(), ..bench.def.clone() };
    bench.solvers = bench.solvers.permitting(Permit::Pinned(Box::new(own)));
    assert_eq!(bench.run(1.0, &[1.0]).unwrap(), [7.0]);
}

#[test]
fn numbers_are_found_by_pattern_and_by_column() {
    let script = "echo 'tip = 1.5D-1 m'; echo 'tip = 2.5D-1 m'\n\
                  printf 'node  ux  uy\\n 1  10 100\\n\\n 1  20 200\\n' > beam.dat\n";
    let reads = [("tip", r"regex:-:^tip = (\S+)"), ("base", "column:beam.dat:3")];
    let bench = Bench::new(script, &reads).outputs(&[("tip", 1), ("base", 1)]);
    assert_eq!(bench.run(1.0, &[1.0, 2.0]).unwrap(), [0.15, 100.0, 0.25, 200.0]);
}

#[test]
fn a_field_comes_as_one_list_per_time() {
    let bench = Bench::new("echo '{\"wall\": [[1, 2], [3, 4]], \"tip\": [5, 6]}'", &[]);
    let bench = bench.outputs(&[("wall", 2), ("tip", 1)]);
    assert_eq!(bench.run(1.0, &[1.0, 2.0]).unwrap(), [1.0, 2.0, 5.0, 3.0, 4.0, 6.0]);
}

#[test]
fn runs_at_the_same_time_have_folders_of_their_own() {
    let script = "printf '{\"tip\": %s}' $(cat in.txt) > out.json";
    let mut bench = Bench::new(script, &[("tip", "json:out.json")]);
    bench.files().templates = map(&[("in.txt", "{{ k }}")]);
    let forward = bench.forward().unwrap();
    std::thread::scope(|scope| {
        for k in 0..8 {
            let forward = &forward;
            scope.spawn(move || {
                let k = f64::from(k);
                assert_eq!(forward.run(&job(k, &[1.0], 1, &[0.0])).unwrap().outputs, [k]);
            });
        }
    });
}

#[test]
fn more_text_than_a_pipe_holds_stops_neither_side() {
    let script = "head -c 1000000 /dev/zero | tr '\\0' 'x'; echo; echo '{\"tip\": 7}'";
    let bench = Bench::new(script, &[]);
    let forward = bench.forward().unwrap();
    // The program reads nothing of the megabytes that its standard input offers.
    let flow = vec![1.0 / 3.0; 200_000];
    assert_eq!(forward.run(&job(1.0, &[1.0], 1, &flow)).unwrap().outputs, [7.0]);
}

#[test]
fn a_child_that_holds_the_output_open_delays_nothing_and_is_ended() {
    let bench = Bench::new("sleep 600 & echo $! > \"$1\"; echo '{\"tip\": 7}'", &[]);
    let pid = bench.folder.path().join("pid");
    let bench = bench.command(&["sh", "solve.sh", &pid.display().to_string()]);
    let started = Instant::now();
    assert_eq!(bench.run(1.0, &[1.0]).unwrap(), [7.0]);
    // The child sleeps for ten minutes: anything near that is waiting for it.
    assert!(started.elapsed() < Duration::from_secs(60), "{:?}", started.elapsed());
    assert!(ends(&pid), "a child was left behind");
}

/// Whether the process whose number stands in a file is gone, or goes within a few seconds.
fn ends(file: &Path) -> bool {
    let pid = std::fs::read_to_string(file).unwrap();
    let stat = format!("/proc/{}/stat", pid.trim());
    let started = Instant::now();
    loop {
        // A process that nobody has waited for yet is dead all the same.
        if std::fs::read_to_string(&stat).map_or(true, |text| text.contains(") Z ")) {
            return true;
        }
        if started.elapsed() > Duration::from_secs(10) {
            return false;
        }
        std::thread::yield_now();
    }
}

#[test]
fn a_program_that_somebody_kills_is_started_again() {
    let bench = Bench::new("test -e \"$1\" || { touch \"$1\"; kill -9 $$; }; echo '{\"tip\": 7}'", &[]);
    let mark = bench.folder.path().join("mark");
    let bench = bench.command(&["sh", "solve.sh", &mark.display().to_string()]);
    assert_eq!(bench.run(1.0, &[1.0]).unwrap(), [7.0]);
    let bench = Bench::new("kill -9 $$", &[]);
    let says = bench.run(1.0, &[1.0]).unwrap_err();
    assert!(says.contains("the solver `sh` was killed (signal 9"), "{says}");
    assert_eq!(bench.kept(), 1, "of all attempts the last is kept");
}

//! What leaves the process group of its solver is ended with the run. Alone in its process, which adopts what is orphaned in it.
#![allow(clippy::unwrap_used)]

use std::sync::Arc;
use std::time::{Duration, Instant};

use starlings_models::{
    Description, FilesDef, Forward, Job, ModelDef, Quantity, SOLVER, Setup, SolverDef, Spec, Stop, Until,
    Window,
};
use starlings_solver::{SiteOptions, Solvers, adopt_orphans};

/// A program made of a shell script, and its folder.
fn program(script: &str, folder: &std::path::Path) -> Box<dyn Forward> {
    std::fs::write(folder.join("solve.sh"), script).unwrap();
    let spec = Spec {
        kind: SOLVER.to_owned(),
        parameters: vec![Quantity::new("k", "N/m")],
        outputs: vec![Quantity::new("tip", "m")],
        ..Spec::default()
    };
    let described =
        Description { spec, name: "sh".to_owned(), deterministic: true, ..Description::default() };
    let def = SolverDef {
        adapter: "command".to_owned(),
        command: vec!["sh".to_owned(), "solve.sh".to_owned()],
        folder: folder.display().to_string(),
        files: Some(FilesDef::default()),
        described: Some(described),
        ..SolverDef::default()
    };
    let model = ModelDef { kind: SOLVER.to_owned(), solver: Some(Box::new(def)), ..ModelDef::default() };
    let setup = Setup {
        model,
        parameters: vec!["k".to_owned()],
        outputs: vec!["tip".to_owned()],
        ..Setup::default()
    };
    let options = SiteOptions { scratch: Some(folder.to_path_buf()), guard: None };
    Solvers::new(options).build(&setup).unwrap()
}

fn job() -> Job {
    let window = Window::free(0.0, vec![1.0], 1, vec![]);
    Job { particle: 0, record: 0, window: Arc::new(window), theta: vec![1.0], state: None }
}

fn numbers(file: &std::path::Path) -> Vec<String> {
    let text = std::fs::read_to_string(file).unwrap_or_default();
    text.split_ascii_whitespace().map(str::to_owned).collect()
}

fn lives(pid: &str) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    stat.rsplit_once(')').is_some_and(|(_, rest)| !rest.trim_start().starts_with('Z'))
}

fn soon(what: &str, fits: impl Fn() -> bool) {
    let started = Instant::now();
    while !fits() {
        assert!(started.elapsed() < Duration::from_secs(60), "{what} within a minute");
        std::thread::yield_now();
    }
}

#[test]
fn daemons_of_a_solver_end_with_its_run_and_a_stopped_run_ends_at_once() {
    adopt_orphans().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let pids = folder.path().join("pids");
    // A session of its own, whose parent ends before it does, and one more below it.
    let daemon = format!(
        "setsid sh -c 'echo $$ >> {0}; setsid sleep 1000 & echo $! >> {0}; sleep 1000' < /dev/null > /dev/null 2>&1 &\n\
         while [ \"$(wc -l < {0} 2>/dev/null || echo 0)\" -lt 2 ]; do sleep 0.01; done\n",
        pids.display()
    );
    let ending = program(&format!("{daemon}echo '{{\"tip\": [1]}}'"), folder.path());
    assert_eq!(ending.run(&job()).unwrap().outputs, [1.0]);
    let left = numbers(&pids);
    assert_eq!(left.len(), 2, "{left:?}");
    soon("they end", || !left.iter().any(|pid| lives(pid)));

    // One that would compute for a quarter of an hour, told to stop.
    std::fs::remove_file(&pids).unwrap();
    let endless = program(&format!("{daemon}sleep 1000"), folder.path());
    let stop = Stop::default();
    let (word, file) = (stop.clone(), pids.clone());
    let caller = std::thread::spawn(move || {
        soon("it starts", || numbers(&file).len() == 2);
        word.set();
    });
    let started = Instant::now();
    let result = endless.run_within(&job(), &Until { spent: &|| 0.0, stop: &stop, traceparent: None });
    assert!(result.is_err() && started.elapsed() < Duration::from_secs(300), "{result:?}");
    caller.join().unwrap();
    let left = numbers(&pids);
    soon("they end", || !left.iter().any(|pid| lives(pid)));
}

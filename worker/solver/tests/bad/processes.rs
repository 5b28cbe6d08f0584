//! Solvers whose process misbehaves: what is told of them, and that none of their children and folders stays.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

use starlings_models::{ParticleError, SolverDef};
use starlings_solver::guard;
use starlings_solver::{SiteOptions, Solvers};

use crate::kit::{Reaction, Service, finished, job, setup, sound, soundly};

/// Variables that tell the program of these tests how to misbehave and where to leave its children's numbers.
const HOW: &str = "BAD_SOLVER";
const CHILDREN: &str = "BAD_SOLVER_CHILDREN";

/// Address space of a solver that may not have much, bytes: enough for the program of the tests itself.
const LITTLE: u64 = 512 * 1024 * 1024;

#[test]
#[ignore = "the program that the other tests start"]
#[expect(clippy::zombie_processes, reason = "a child is left behind on purpose")]
fn misbehaving() {
    let how = std::env::var(HOW).unwrap();
    let socket = std::env::var("STARLINGS_SOLVER_SOCKET").unwrap();
    eprintln!("reading mesh.vtk");
    if let Some(command) = how.strip_prefix("starts ") {
        let child = Command::new("sh").args(["-c", command]).stdin(Stdio::null()).spawn().unwrap();
        let file = std::env::var(CHILDREN).unwrap();
        let mut children = std::fs::OpenOptions::new().create(true).append(true).open(file).unwrap();
        std::io::Write::write_all(&mut children, format!("{}\n", child.id()).as_bytes()).unwrap();
    }
    if how == "garbage" {
        let garbage: Vec<u8> =
            (0..3_000_000_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
        std::io::Write::write_all(&mut std::io::stdout(), &garbage).unwrap();
        std::io::Write::write_all(&mut std::io::stderr(), &garbage).unwrap();
    }
    let react = move |request: &_| match how.as_str() {
        "garbage" => soundly(request),
        "hangs" => Reaction::Never,
        "nan" => {
            eprintln!("negative volume in element 12");
            Reaction::Says(vec![finished(&[f64::NAN; 6], &[0.0; 2])])
        }
        "eats" => {
            let mut eaten: Vec<Vec<u8>> = Vec::new();
            loop {
                eaten.push(vec![1; 32 * 1024 * 1024]);
            }
        }
        _ => {
            eprintln!("cannot factor the matrix");
            std::process::exit(3)
        }
    };
    Service { react: Arc::new(react), ..Service::new(Some(sound())) }.serve(Path::new(&socket));
}

/// A folder for one test and the solver that misbehaves in it.
struct Misbehaving {
    folder: tempfile::TempDir,
    def: SolverDef,
}

impl Misbehaving {
    fn new(how: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let program = std::env::current_exe().unwrap().display().to_string();
        let arguments = ["--ignored", "--exact", "processes::misbehaving", "--nocapture"];
        let mut def = SolverDef {
            command: std::iter::once(program.as_str()).chain(arguments).map(str::to_owned).collect(),
            ..SolverDef::default()
        };
        let children = folder.path().join("children").display().to_string();
        // The lines of a backtrace would take the place of the words before it.
        let variables = [(HOW, how), (CHILDREN, &children), ("RUST_BACKTRACE", "0")];
        def.environment = variables.map(|(name, value)| (name.to_owned(), value.to_owned())).into();
        Self { folder, def }
    }

    fn scratch(&self) -> PathBuf {
        self.folder.path().join("scratch")
    }

    fn solvers(&self) -> Solvers {
        Solvers::new(SiteOptions { scratch: Some(self.scratch()), guard: None })
    }

    /// How a run fails; the solvers end with it.
    fn failure(&self) -> String {
        let solvers = self.solvers();
        let forward = solvers.build(&setup(&solvers, &self.def)).unwrap();
        let error = forward.run(&job(None)).unwrap_err();
        let is_known = matches!(error, ParticleError::Infrastructure(_) | ParticleError::BadJob(_));
        assert!(!is_known, "{error:?}");
        error.to_string()
    }

    /// The processes that the solver started.
    fn children(&self) -> Vec<String> {
        let text = std::fs::read_to_string(self.folder.path().join("children")).unwrap();
        text.lines().map(str::to_owned).collect()
    }

    /// Folders left in the scratch folder.
    fn left(&self) -> usize {
        std::fs::read_dir(self.scratch()).unwrap().count()
    }
}

/// Whether a process still runs; a zombie does not.
fn runs(pid: &str) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    stat.rsplit(") ").next().is_some_and(|fields| !fields.is_empty() && !fields.starts_with('Z'))
}

fn wait_until(what: &str, mut ready: impl FnMut() -> bool) {
    let started = Instant::now();
    while !ready() {
        assert!(started.elapsed() < Duration::from_secs(60), "waited too long until {what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn a_solver_that_dies_on_every_run_is_told_with_its_ending_and_the_end_of_its_output() {
    let place = Misbehaving::new("exits");
    let says = place.failure();
    let (sentence, tail) = says.split_once("; the end of its output:\n").unwrap();
    assert!(sentence.contains("exited with status 3 during a run (and 1 before, on the same run)"), "{says}");
    assert!(tail.ends_with("cannot factor the matrix"), "{says}");
    assert_eq!(place.left(), 0, "no scratch folder stays");
}

#[test]
fn garbage_on_both_outputs_disturbs_no_run() {
    let place = Misbehaving::new("garbage");
    let solvers = place.solvers();
    let forward = solvers.build(&setup(&solvers, &place.def)).unwrap();
    assert_eq!(forward.run(&job(None)).unwrap().outputs, [0.0; 6]);
    drop((forward, solvers));
    assert_eq!(place.left(), 0);
}

#[test]
fn values_that_are_not_finite_are_told_with_the_end_of_the_output() {
    let says = Misbehaving::new("nan").failure();
    assert!(says.contains("returned NaN: output `tip` is not a finite number at t = 0.1"), "{says}");
    assert!(says.contains("negative volume in element 12"), "{says}");
}

#[test]
fn a_solver_that_eats_memory_meets_its_limit() {
    let mut place = Misbehaving::new("eats");
    place.def.memory = Some(LITTLE);
    let says = place.failure();
    assert!(
        says.contains("was ended by signal 6 during a run") && says.contains("memory allocation of"),
        "{says}"
    );
}

#[test]
fn a_solver_that_blocks_and_ignores_the_request_to_end_is_ended_with_its_group() {
    let mut place = Misbehaving::new("hangs");
    let blocking = "trap '' TERM INT HUP; echo $$ > \"$BAD_SOLVER_CHILDREN\"; \"$0\" \"$@\"; true";
    place.def.command.splice(0..0, ["sh", "-c", blocking].map(str::to_owned));
    place.def.timeout = 0.3;
    let says = place.failure();
    assert!(says.contains("did not answer within 0.3 s and was ended"), "{says}");
    assert!(says.contains("reading mesh.vtk"), "{says}");
    wait_until("the shell is gone", || place.children().iter().all(|pid| !runs(pid)));
    assert_eq!(place.left(), 0);
}

#[test]
fn children_that_a_solver_leaves_in_its_group_end_with_it() {
    let place = Misbehaving::new("starts exec sleep 600");
    let says = place.failure();
    assert!(says.contains("exited with status 3"), "{says}");
    assert_eq!(place.children().len(), 2, "one for each start");
    wait_until("the children are gone", || place.children().iter().all(|pid| !runs(pid)));
}

#[test]
fn a_child_that_left_the_group_and_holds_the_output_open_blocks_nobody() {
    let place = Misbehaving::new("starts exec setsid sleep 600");
    let started = Instant::now();
    let says = place.failure();
    assert!(says.contains("exited with status 3") && says.contains("cannot factor the matrix"), "{says}");
    // Far less than the child lives, far more than two starts take.
    assert!(started.elapsed() < Duration::from_secs(120));
    let killed = Command::new("kill").arg("-9").args(place.children()).status().unwrap();
    assert!(killed.success(), "they were still there");
}

#[test]
#[ignore = "the guard that another test starts"]
fn guarding() {
    guard(std::io::stdin().lock());
}

#[test]
#[ignore = "the worker that another test kills"]
fn working() {
    let place = Misbehaving::new("hangs");
    let program = std::env::current_exe().unwrap();
    let guarding = ["--ignored", "--exact", "processes::guarding", "--nocapture"].map(str::to_owned).to_vec();
    let scratch = Some(PathBuf::from(std::env::var("SCRATCH").unwrap()));
    let solvers = Solvers::new(SiteOptions { scratch, guard: Some((program, guarding)) });
    let forward = solvers.build(&setup(&solvers, &place.def)).unwrap();
    std::fs::write(std::env::var("READY").unwrap(), "").unwrap();
    drop(forward.run(&job(None)));
}

#[test]
fn the_folder_and_the_solver_of_a_killed_worker_are_gone_soon() {
    let folder = tempfile::tempdir().unwrap();
    let (scratch, ready) = (folder.path().join("scratch"), folder.path().join("ready"));
    let mut worker = Command::new(std::env::current_exe().unwrap())
        .args(["--ignored", "--exact", "processes::working", "--nocapture"])
        .env("SCRATCH", &scratch)
        .env("READY", &ready)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    wait_until("the solver computes", || ready.exists());
    let root = std::fs::read_dir(&scratch).unwrap().next().unwrap().unwrap().path();
    assert!(std::fs::read_dir(&root).unwrap().count() > 0, "the solver has a folder");
    worker.kill().unwrap();
    worker.wait().unwrap();
    wait_until("its folder is gone", || !root.exists());
    let mark = root.display().to_string();
    let named = |entry: std::fs::DirEntry| {
        let variables = std::fs::read(entry.path().join("environ")).unwrap_or_default();
        String::from_utf8_lossy(&variables).contains(&mark)
    };
    wait_until("no process that was told of it is left", || {
        !std::fs::read_dir("/proc").unwrap().flatten().any(named)
    });
}

//! A study in a folder of its own: its solver, the plan of its faults, its scratch folders.
//!
//! Next file to read: [`super::judge`].

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use serde_json::Value;

use super::plan::{Fault, Reached, Verb};
use crate::common::{repository, starlings};

/// The longest that a command may take; beyond it hangs, which is an error.
const LIMIT: Duration = Duration::from_secs(180);

/// How a command ended.
pub(crate) struct Ended {
    /// Exit code; none after a signal.
    pub(crate) code: Option<i32>,
    pub(crate) stderr: String,
}

/// The folder of one study.
pub(crate) struct StudyFolder {
    folder: tempfile::TempDir,
    verb: Verb,
    reached: Reached,
}

impl StudyFolder {
    /// With everything that the study needs, and no fault; `settings` go to `[model]`.
    pub(crate) fn new(verb: Verb, reached: Reached, settings: &str) -> Self {
        let folder = tempfile::Builder::new().prefix("fault-").tempdir().unwrap();
        let place = Self { folder, verb, reached };
        for name in ["faults", "scratch"] {
            fs::create_dir(place.path(name)).unwrap();
        }
        fs::write(place.path("decay.csv"), recording()).unwrap();
        fs::write(place.path("params.tmpl"), "k {{ k }}\na {{ a }}\n").unwrap();
        fs::write(place.study(), study(reached, settings)).unwrap();
        place.repair();
        place
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn study(&self) -> PathBuf {
        self.path("study.toml")
    }

    pub(crate) fn out(&self) -> PathBuf {
        self.path("out")
    }

    /// The mark that every process of this study carries.
    pub(crate) fn mark(&self) -> String {
        format!("FAULT_DIR={}", self.path("faults").display())
    }

    /// From now on these runs meet the fault.
    pub(crate) fn break_at(&self, fault: &Fault, (first, last): (u64, u64)) {
        fs::write(self.path("faults/plan"), format!("{} {first} {last}\n", fault.kind)).unwrap();
    }

    /// No fault any more, and the program as it was.
    pub(crate) fn repair(&self) {
        let _ = fs::remove_file(self.path("faults/plan"));
        let own = self.path(program(self.reached));
        let beside = self.path("program.new");
        match self.reached {
            Reached::Command => fs::copy(compiled(), &beside).unwrap(),
            Reached::Grpc | Reached::Mpi => fs::copy(kit("solver.py"), &beside).unwrap(),
        };
        fs::rename(beside, own).unwrap();
    }

    /// Runs so far, of all programs.
    pub(crate) fn n_run(&self) -> u64 {
        fs::read_to_string(self.path("faults/count")).unwrap().trim().parse().unwrap()
    }

    /// The command of this study.
    pub(crate) fn command(&self, more: &[&str]) -> Command {
        let mut command = starlings();
        command.arg(if self.verb == Verb::Run { "run" } else { "explain" });
        command.arg(self.study()).arg("--out").arg(self.out()).args(more);
        self.furnish(&mut command);
        command
    }

    /// What every process of the study finds around it.
    pub(crate) fn furnish(&self, command: &mut Command) {
        command.env("FAULT_DIR", self.path("faults")).env("TMPDIR", self.path("scratch"));
        if self.reached == Reached::Mpi {
            command.env("FAULT_MPI", "1");
        }
    }

    /// Runs the command to its end.
    ///
    /// # Errors
    /// When it hangs.
    pub(crate) fn go(&self, more: &[&str]) -> Result<Ended, String> {
        self.to_the_end(&mut self.command(more))
    }

    /// Runs any command of the study to its end.
    ///
    /// # Errors
    /// When it hangs.
    pub(crate) fn to_the_end(&self, command: &mut Command) -> Result<Ended, String> {
        let said = self.path("stderr.txt");
        let stderr = fs::File::create(&said).unwrap();
        let mut child = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(stderr).spawn().unwrap();
        fs::write(self.path("faults/command"), format!("{}.", child.id())).unwrap();
        let status = wait(&mut child);
        let stderr = end_of(&fs::read_to_string(&said).unwrap());
        match status {
            Some(status) => Ok(Ended { code: status.code(), stderr }),
            None => Err(format!("it hangs; so far it said:\n{stderr}")),
        }
    }

    /// The result that must be the same to the last byte.
    ///
    /// # Errors
    /// When there is none.
    pub(crate) fn result(&self) -> Result<Vec<u8>, String> {
        self.result_in(&self.out())
    }

    /// The same from a copy of the run folder.
    ///
    /// # Errors
    /// When there is none.
    pub(crate) fn result_in(&self, folder: &Path) -> Result<Vec<u8>, String> {
        let file = if self.verb == Verb::Run { "posterior.csv" } else { "explain.json" };
        let bytes = fs::read(folder.join(file)).map_err(|error| format!("{file}: {error}"))?;
        if self.verb == Verb::Run {
            return Ok(bytes);
        }
        let mut found: Value = serde_json::from_slice(&bytes).map_err(|error| format!("{file}: {error}"))?;
        // What depends on the clock, on who answered, and on where the folder lies.
        for key in ["wall_s", "workers", "explained_study"] {
            found.as_object_mut().unwrap().remove(key);
        }
        Ok(found.to_string().into_bytes())
    }
}

/// The last lines, which hold the error.
fn end_of(text: &str) -> String {
    let lines: Vec<&str> = text.lines().collect();
    lines[lines.len().saturating_sub(LINES)..].join("\n") + "\n"
}

/// Lines that are kept of what a command says.
const LINES: usize = 40;

fn wait(child: &mut std::process::Child) -> Option<ExitStatus> {
    let started = Instant::now();
    loop {
        if let Some(status) = child.try_wait().unwrap() {
            return Some(status);
        }
        if started.elapsed() > LIMIT {
            let _ = child.kill();
            let _ = child.wait();
            return None;
        }
        std::thread::sleep(Duration::from_millis(3));
    }
}

fn kit(name: &str) -> PathBuf {
    repository("tests/fault_kit").join(name)
}

fn program(reached: Reached) -> &'static str {
    if reached == Reached::Command { "solver" } else { "solver.py" }
}

/// The program in C, compiled once.
fn compiled() -> &'static Path {
    static PROGRAM: OnceLock<PathBuf> = OnceLock::new();
    PROGRAM.get_or_init(|| {
        let program =
            Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("fault-solver-{}", std::process::id()));
        let status =
            Command::new("cc").arg("-O1").arg("-o").arg(&program).arg(kit("solver.c")).arg("-lm").status();
        assert!(status.is_ok_and(|status| status.success()), "a C compiler compiles solver.c");
        program
    })
}

/// A decay with a drift that the model lacks, and noise that is no chance: the same on every machine.
fn recording() -> String {
    let mut text = "time,y\n".to_owned();
    for i in 0..32_u32 {
        let t = 0.125 * f64::from(i);
        let noise = 0.02 * (f64::from((i * 7919 + 13) % 17) - 8.0) / 8.0;
        writeln!(text, "{t},{:.4}", 3.2 * (-0.9 * t).exp() + 0.12 * t + noise).unwrap();
    }
    text
}

fn study(reached: Reached, settings: &str) -> String {
    let model = match reached {
        Reached::Command => {
            "adapter = \"command\"\ncommand = [\"./solver\"]\ntemplates = { \"params.txt\" = \"params.tmpl\" }\n\
             parameters = [ { name = \"k\", unit = \"1/s\", range = [0.0, 100.0] }, { name = \"a\", unit = \"V\" } ]\n\
             outputs = [ { name = \"y\", unit = \"V\", read = \"csv:result.csv:y\" } ]"
        }
        Reached::Grpc => "command = [\"python3\", \"solver.py\"]",
        Reached::Mpi => "adapter = \"mpi\"\nranks = 2\ncommand = [\"python3\", \"solver.py\"]",
    };
    let workers = if reached == Reached::Mpi { 1 } else { 2 };
    format!(
        r#"[study]
name = "fault"
seed = 1

[model]
kind = "solver"
{model}
{settings}

[[parameters]]
name = "k"
unit = "1/s"
prior = {{ transform = "log", median = 0.7, factor = 1.5 }}

[[parameters]]
name = "a"
unit = "V"
prior = {{ transform = "log", median = 3.0, factor = 1.3 }}

[[records]]
name = "decay"
file = "decay.csv"
channels = [ {{ column = "y", output = "y", noise = 0.02 }} ]
train = [0.0, 2.8]

[[effects]]
name = "drift"
says = "the sensor drifts"
adds = [ {{ to = "y", term = "d*t" }} ]
parameters = [ {{ name = "d", unit = "V/s", range = [-1.0, 1.0] }} ]

[explain]
library = "study"

[estimator]
kind = "batch"

[fleet]
workers = {workers}
patience = 20.0
"#
    )
}

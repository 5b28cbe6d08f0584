//! What a study says of a model that runs in a program of its own, and what that program says of itself.
//!
//! Plain data: nothing here starts or calls anything. Next file to read: [`crate::external`], which runs jobs on such a
//! program.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::{Quantity, Spec, meant, nearest};

/// The `kind` of a model that runs in a program of its own.
pub const SOLVER: &str = "solver";

/// A solver as the study names it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SolverDef {
    /// How it is reached, a name in the worker's list of adapters.
    pub adapter: String,
    /// Program and arguments; a relative path is looked for in `folder` first.
    pub command: Vec<String>,
    /// Where a solver listens that somebody else started, such as `127.0.0.1:7100` or `http://127.0.0.1:4242`.
    pub address: Option<String>,
    /// The study's folder, where the program runs.
    pub folder: String,
    /// Environment variables set for it.
    pub environment: BTreeMap<String, String>,
    /// Wall time allowed for one run, seconds; at least above zero.
    pub timeout: f64,
    /// Wall time allowed from the start of the program to its first answer, seconds.
    pub start_timeout: f64,
    /// Threads that one program may use; the usual variables of thread counts are set to it.
    pub threads: usize,
    /// Whether each slot's program is bound to cores of its own.
    pub pin: bool,
    /// Address space allowed to one program, bytes.
    pub memory: Option<u64>,
    /// Ranks of a program that runs under MPI.
    pub ranks: usize,
    /// Name of the model on a server that has several.
    pub model: Option<String>,
    /// What goes to a program that is started for every run, and where its answer is found.
    pub files: Option<FilesDef>,
    /// What the solver says of itself.
    pub described: Option<Description>,
}

impl Default for SolverDef {
    fn default() -> Self {
        Self {
            adapter: "grpc".to_owned(),
            command: Vec::new(),
            address: None,
            folder: String::new(),
            environment: BTreeMap::new(),
            timeout: 3600.0,
            start_timeout: 60.0,
            threads: 1,
            pin: false,
            memory: None,
            ranks: 1,
            model: None,
            files: None,
            described: None,
        }
    }
}

/// What goes to a program that is started for every run, and where its answer is found.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct FilesDef {
    /// Templates to fill in: file in the run's folder, and the text of its template.
    pub templates: BTreeMap<String, String>,
    /// Files copied into the run's folder as they are: name and path.
    pub copies: BTreeMap<String, String>,
    /// Where each output is read: output and rule, such as `csv:result.csv:tip`.
    pub reads: BTreeMap<String, String>,
}

/// What is wrong with the files or the command of a solver, found without starting it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SolverFault {
    /// Where.
    pub place: FaultPlace,
    /// What was found, and what was expected.
    pub message: String,
    /// The remedy.
    pub help: Option<String>,
}

/// Where a solver's files or command are wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FaultPlace {
    /// A line, from 1, of the template of this file of the run.
    Template(String, usize),
    /// The rule of this output.
    Output(String),
    /// This parameter.
    Parameter(String),
    /// The command.
    Command,
}

/// What a solver says of itself.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Description {
    /// States, parameters, outputs, inputs; `restart` says whether a run can start from a state. The kind is [`SOLVER`].
    pub spec: Spec,
    /// Its own name, such as `beam`.
    pub name: String,
    /// Whether equal requests give equal bits.
    pub deterministic: bool,
    /// Kinds of observers that it hosts.
    pub observers: Vec<String>,
    /// Scalar states to whose rate a term may be added.
    pub hosts: Vec<String>,
}

impl Description {
    /// What makes no sense about it, as half a sentence after "it describes itself wrongly"; nothing where it is sound.
    pub fn fault(&self) -> Option<String> {
        let spec = &self.spec;
        let lists = [
            ("state", &spec.states),
            ("parameter", &spec.parameters),
            ("output", &spec.outputs),
            ("input", &spec.inputs),
        ];
        if let Some(fault) = lists.iter().find_map(|(what, list)| fault_of_list(what, list)) {
            return Some(fault);
        }
        if spec.outputs.is_empty() {
            return Some("it has no outputs, so nothing could be compared with data".to_owned());
        }
        if spec.restart && spec.states.is_empty() {
            return Some("it can restart from a state but describes no states".to_owned());
        }
        let scalar = spec.states.iter().filter(|q| q.size == 1);
        let scalar: Vec<&str> = scalar.map(|q| q.name.as_str()).collect();
        if let Some(host) = self.hosts.iter().find(|host| !scalar.contains(&host.as_str())) {
            let what =
                format!("it names the state `{host}` as a host of terms, which is none of its scalar states");
            return Some(what + &meant(nearest(host, &scalar)));
        }
        for (output, state) in &spec.measures {
            for (what, name, list) in [("output", output, &spec.outputs), ("state", state, &spec.states)] {
                if Spec::range_of(list, name).is_none() {
                    let known: Vec<&str> = list.iter().map(|q| q.name.as_str()).collect();
                    let fault = format!("it names the {what} `{name}`, which is not among its {what}s");
                    return Some(fault + &meant(nearest(name, &known)));
                }
            }
        }
        None
    }
}

fn fault_of_list(what: &str, list: &[Quantity]) -> Option<String> {
    list.iter().enumerate().find_map(|(i, q)| {
        let name = &q.name;
        if name.is_empty() {
            return Some(format!("{what} {} has no name", i + 1));
        }
        // Studies write `initial:x` for the start of a state and `x[3]` for a component.
        if name.contains([':', '[', ']']) {
            return Some(format!("`{name}` is no name for a {what}: it has one of `:`, `[` and `]` in it"));
        }
        if list[..i].iter().any(|earlier| earlier.name == *name) {
            return Some(format!("it describes the {what} `{name}` twice"));
        }
        if q.size == 0 {
            return Some(format!("{what} `{name}` has 0 components"));
        }
        if q.size > 1 && matches!(what, "parameter" | "input") {
            return Some(format!("{what} `{name}` has {} components; it must be a scalar", q.size));
        }
        let [lo, hi] = q.range;
        (lo.is_nan() || hi.is_nan() || lo > hi).then(|| format!("{what} `{name}` has the range {lo} to {hi}"))
    })
}

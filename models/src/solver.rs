//! What a study says of a model that runs in a program of its own, and what that program says of itself.
//!
//! Plain data: nothing here starts or calls anything. Next file to read: [`crate::external`], which runs jobs on such a
//! program.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::Spec;

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

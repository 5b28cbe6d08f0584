//! A program that is started for every run and needs no code by the user: files from templates go in, numbers come out by a
//! rule per output.
//!
//! The study says what the program has, since it cannot be asked. It starts every run anew, so no run continues from a state.
//! Each run has a folder of its own, kept for people to look at when the run fails. Next files to read: [`template`] and
//! [`request`] for what goes in, [`program`] for the run, [`rule`] and [`results`] for what comes out.

mod fault;
#[cfg(fuzzing)]
pub(crate) mod fuzzing;
mod inspect;

pub(super) mod json;
mod program;
mod request;
mod results;
mod rule;
mod table;
mod template;
mod traces;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use starlings_models::{Description, ParticleError, Run, Solved, SolverDef, Spec, Timeout, meant, nearest};
use starlings_proto::adapters::{AdapterDef, NamedBy};

use super::Adapter;
use crate::SolverError;
use crate::core_slots::CoreSlots;
use crate::error::tail_text;
use crate::process::{Launch, Process, ending, is_killed};
use crate::site::Site;
use crate::stopped::stopped;
pub(crate) use inspect::faults;
use program::{End, Output};
use results::RunResults;
use rule::{Rule, lies_inside};
use template::{OWN_NAMES, Templates};
use traces::{kept, lacks_room, said};

/// What it says of itself.
pub(crate) const DEF: AdapterDef = AdapterDef {
    name: "command",
    says: "a program started for every run; input files from templates, outputs by rule, no code",
    describes_itself: false,
    per_run: true,
    named_by: NamedBy::Command("program and arguments, such as `[\"./beam\", \"input.txt\"]`"),
    keys: &["parameters", "outputs", "inputs", "templates", "copies"],
};
/// A program started for every run.
///
/// # Errors
/// When the study lacks what it needs.
pub(super) fn open(def: &SolverDef, site: &Arc<Site>) -> Result<Box<dyn Adapter>, SolverError> {
    Ok(Box::new(PerRun::new(def, site)?))
}

/// Times that a run is made when somebody kills its program or removes its folder.
const ATTEMPTS: u32 = 12;

/// A program started for every run.
struct PerRun {
    def: SolverDef,
    site: Arc<Site>,
    description: Description,
    command: Vec<String>,
    templates: Templates,
    copies: Vec<(String, PathBuf)>,
    rules: BTreeMap<String, Rule>,
    core_slots: CoreSlots,
}

/// How an attempt ended that gave no answer.
enum Failed {
    /// The program failed, or wrote what cannot be read.
    Program(String),
    /// It did not end in time.
    Late(String),
    /// The host cannot make the run: a program, a file or a folder is missing.
    Host(String),
    /// Somebody killed the program, or took its folder away: worth another attempt at once.
    Disturbed(String),
}

impl PerRun {
    fn new(def: &SolverDef, site: &Arc<Site>) -> Result<Self, SolverError> {
        let incomplete = |message: String| SolverError::Incomplete(message);
        if def.command.is_empty() {
            return Err(incomplete("a solver through files needs a `command`".to_owned()));
        }
        let description = def.described.clone().filter(|d| !d.spec.outputs.is_empty()).ok_or_else(|| {
            incomplete("a solver through files needs `parameters` and `outputs` in the study".to_owned())
        })?;
        let files = def.files.clone().unwrap_or_default();
        let rules = rules(&files.reads, &description.spec)?;
        let templates = Templates::new(&files.templates)?;
        for name in files.templates.keys().chain(files.copies.keys()) {
            if !lies_inside(name) {
                return Err(incomplete(format!("the file `{name}` lies outside the run's folder")));
            }
        }
        let taken = description.spec.parameters.iter().find(|q| OWN_NAMES.contains(&q.name.as_str()));
        if let Some(q) = taken.filter(|_| !files.templates.is_empty()) {
            let name = &q.name;
            return Err(incomplete(format!(
                "templates use the name `{name}` for a part of the run: rename the parameter"
            )));
        }
        let inside: BTreeSet<&str> = (files.templates.keys().chain(files.copies.keys()).map(String::as_str))
            .chain(rules.values().map(Rule::file))
            .collect();
        let command = request::command(&def.command, Path::new(&def.folder), &inside, &description.spec)?;
        let copies = files.copies.into_iter().map(|(name, path)| (name, PathBuf::from(path))).collect();
        let core_slots = CoreSlots::default();
        Ok(Self {
            def: def.clone(),
            site: Arc::clone(site),
            description,
            command,
            templates,
            copies,
            rules,
            core_slots,
        })
    }

    /// Writes the files of a run.
    fn furnish(&self, run: &Run<'_>, folder: &Path) -> Result<(), String> {
        let placed = |name: &str| {
            let path = folder.join(name);
            path.parent().map_or(Ok(()), std::fs::create_dir_all).map(|()| path)
        };
        for (name, from) in &self.copies {
            placed(name).and_then(|to| std::fs::copy(from, to)).map_err(|error| {
                format!("{} cannot be copied into the run's folder: {error}", from.display())
            })?;
        }
        let filled = self.templates.fill(&self.description.spec, run).map_err(|error| error.to_string())?;
        for (name, text) in filled {
            let written = placed(name).and_then(|to| std::fs::write(to, text));
            written.map_err(|error| format!("{name} cannot be written into the run's folder: {error}"))?;
        }
        Ok(())
    }

    fn launch(
        &self,
        command: &[String],
        folder: &Path,
        core_slot: usize,
        traceparent: Option<&str>,
    ) -> Result<Process, SolverError> {
        let threads = self.def.threads;
        let mut environment = self.def.environment.clone();
        // By its usual name, as tools that trace programs look for it.
        environment.extend(traceparent.map(|text| ("TRACEPARENT".to_owned(), text.to_owned())));
        self.site.start(&Launch {
            command,
            base: &self.def.folder,
            folder: Some(folder),
            environment,
            threads,
            cores: self.def.pin.then(|| self.site.cores(core_slot, threads)),
            memory: self.def.memory,
            input: true,
        })
    }

    /// One start of the program, the `last` that is tried or not.
    fn attempt(&self, run: &Run<'_>, last: bool) -> Result<Solved, Failed> {
        let place = |what: String| Failed::Host(format!("{} cannot run: {what}", self.program()));
        let scratch =
            self.site.scratch("run").map_err(|error| place(format!("no folder for it: {error}")))?;
        if let Err(what) = self.furnish(run, scratch.path()) {
            let disturbed = scratch.is_gone() && !last;
            return Err(if disturbed { Failed::Disturbed(what) } else { place(what) });
        }
        let spec = &self.description.spec;
        let told = request::document(spec, run).to_string();
        let core_slot = self.core_slots.take();
        let command = request::filled(&self.command, spec, run, scratch.path());
        let started = self.launch(&command, scratch.path(), core_slot.number(), run.traceparent);
        let mut process = started.map_err(|error| {
            let what = error.to_string();
            if scratch.is_gone() && !last { Failed::Disturbed(what) } else { Failed::Host(what) }
        })?;
        let patience = Duration::try_from_secs_f64(self.def.timeout).unwrap_or(Duration::MAX);
        let (end, output) = program::to_its_end(&mut process, told.clone().into_bytes(), patience, run.stop);
        let solved = match end {
            End::Ended(status) if status.success() => self.read(run, scratch.path(), &output),
            End::Ended(status) => Err(format!("{} {}", self.program(), ending(status))),
            End::Stopped => Err(stopped(&self.program(), self.def.timeout)),
            End::Unwanted => return Err(Failed::Host("nobody wants the answer any more".to_owned())),
            End::Late => Err(format!(
                "{} did not end within {} s and was killed (`timeout` sets the limit)",
                self.program(),
                self.def.timeout
            )),
        };
        // A program without its folder fails or writes nothing, whatever the parameters.
        let killed = matches!(end, End::Ended(status) if is_killed(status));
        let disturbed = killed || scratch.is_gone();
        // Where the run is made again nobody needs to look at this one.
        let tail =
            if solved.is_ok() || (disturbed && !last) { String::new() } else { said(&mut process, &output) };
        // The whole group ends before its folder is kept or removed.
        drop(process);
        let what = match solved {
            Ok(solved) => return Ok(solved),
            Err(what) if disturbed && !last => return Err(Failed::Disturbed(what)),
            Err(what) if scratch.is_gone() => {
                let folder = scratch.path().display();
                return Err(Failed::Host(format!("{what}; its folder {folder} was removed while it ran")));
            }
            Err(what) => {
                let said = tail_text(&tail);
                let kept = kept(scratch, &format!("{what}{said}"), &told, &output);
                what + &kept + &said
            }
        };
        Err(match end {
            End::Late => Failed::Late(what),
            End::Ended(_) if !killed && !lacks_room(&tail) => Failed::Program(what),
            End::Ended(_) | End::Stopped | End::Unwanted => Failed::Host(what),
        })
    }

    /// The outputs that were asked for.
    fn read(&self, run: &Run<'_>, folder: &Path, output: &Output) -> Result<Solved, String> {
        let results = RunResults::new(folder, output);
        let times = &run.window.times;
        let mut columns = Vec::with_capacity(run.outputs.len());
        for name in run.outputs {
            let quantity = self.description.spec.outputs.iter().find(|q| q.name == *name);
            let size = quantity.map_or(1, |q| q.size);
            let whole = Rule::whole(name);
            let rule = self.rules.get(name).unwrap_or(&whole);
            let values = results.values(rule, size, times);
            columns.push((size, values.map_err(|fault| self.unreadable(name, &fault))?));
        }
        let at = |j: usize| columns.iter().flat_map(move |(size, values)| &values[j * size..(j + 1) * size]);
        let outputs = (0..times.len()).flat_map(at).copied().collect();
        Ok(Solved { outputs, state: Vec::new() })
    }

    fn unreadable(&self, output: &str, fault: &impl Display) -> String {
        format!("{} ended well, but its output `{output}` cannot be read: {fault}", self.program())
    }

    fn program(&self) -> String {
        format!("the solver `{}`", self.def.command.first().map(String::as_str).unwrap_or_default())
    }
}

impl Adapter for PerRun {
    fn describe(&self) -> Result<Description, SolverError> {
        Ok(self.description.clone())
    }

    fn run(&self, run: &Run<'_>) -> Result<Solved, ParticleError> {
        if run.state.is_some() {
            let message = format!("a state for {}, which starts every run anew", self.program());
            return Err(ParticleError::BadJob(message));
        }
        let mut attempts = 1;
        loop {
            match self.attempt(run, attempts == ATTEMPTS) {
                Ok(solved) => return Ok(solved),
                // A run changes nothing outside its folder, so it can be made again.
                Err(Failed::Disturbed(text)) => {
                    tracing::warn!(particle = run.particle, record = run.record, attempts, "{text}");
                    attempts += 1;
                }
                Err(Failed::Program(text)) => return Err(ParticleError::Undecided(text)),
                Err(Failed::Host(text)) => return Err(ParticleError::Infrastructure(text)),
                Err(Failed::Late(says)) => return Err(Timeout { limit: self.def.timeout, says }.into()),
            }
        }
    }
}

/// The rules of a study, each of an output that there is.
fn rules(reads: &BTreeMap<String, String>, spec: &Spec) -> Result<BTreeMap<String, Rule>, SolverError> {
    let mut rules = BTreeMap::new();
    for (name, text) in reads {
        if spec.outputs.iter().all(|q| q.name != *name) {
            let near = nearest(name, spec.outputs.iter().map(|q| &q.name));
            let hint = meant(near);
            return Err(SolverError::Incomplete(format!("a rule reads `{name}`, which is no output{hint}")));
        }
        let rule = Rule::parse(text, name)
            .map_err(|error| SolverError::Incomplete(format!("the output `{name}`: {error}")))?;
        rules.insert(name.clone(), rule);
    }
    Ok(rules)
}

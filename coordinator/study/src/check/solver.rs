//! A model that runs in a program of its own: its description, and what a study may ask of it.
//!
//! Nothing is started here; the caller's [`crate::SolverHost`] asks the solver. The description is checked first: names must be
//! unique and ranges sensible before anything is compared with them. Next file to read: [`super::model`].

mod files;

use std::path::{Path, PathBuf};

use starlings_models::{
    Description, External, FilesDef, ParticleError, Quantity, Run, SOLVER, Setup, SetupError, Solve, Solved,
    SolverDef, Spec,
};

use self::files::{copies, described, templates};
use super::limits;
use super::settings::counted;
use crate::SolverHost;
use crate::file::StudyFile;
use crate::file::solver::{ProgramQuantity, ProgramSection};
use crate::problem::Source;

/// What is said of a solver that is not tried before its study runs.
pub(crate) const UNTRIED: &str = "no trial run is made here";

/// A solver with its description.
pub(crate) struct DescribedSolver {
    pub(crate) def: SolverDef,
    /// Whether it can be started in this process: one with a description in a file may be on another machine.
    pub(crate) is_here: bool,
}

impl DescribedSolver {
    pub(crate) fn description(&self) -> Option<&Description> {
        self.def.described.as_ref()
    }
}

/// The solver of a study with its description; `None` when a problem was reported, or where the model is none.
pub(crate) fn solver(source: &Source, file: &StudyFile, solver_host: &SolverHost) -> Option<DescribedSolver> {
    let section = file.model.solver.as_ref()?;
    let before = source.count();
    let folder = study_folder(source);
    let mut def = named(source, section, &folder);
    if source.count() > before {
        return None;
    }
    if let Some(written) = def.described.clone().filter(|_| section.per_run) {
        let def = SolverDef { described: Some(written), ..def.clone() };
        for fault in solver_host.inspect(&def) {
            files::report(source, section, &def, &folder, fault);
        }
    }
    if source.count() > before {
        return None;
    }
    let found = match &section.described {
        Some(name) => described(source, name, &folder)?,
        None => match def.described.take_if(|_| section.per_run) {
            Some(written) => written,
            None => asked(source, section, &def, solver_host)?,
        },
    };
    check_description(source, section, &found);
    def.described = Some(Description { spec: Spec { kind: SOLVER.to_owned(), ..found.spec }, ..found });
    (source.count() == before).then_some(DescribedSolver { def, is_here: section.described.is_none() })
}

/// The solver of a study as the study names it; nobody has asked it anything.
pub(crate) fn own(source: &Source, file: &StudyFile) -> Option<SolverDef> {
    let Some(section) = &file.model.solver else {
        let message = "the model of this study runs in no program of its own";
        source.report_with(0..0, message.to_owned(), "give a study with `[model] kind = \"solver\"`");
        return None;
    };
    Some(named(source, section, &study_folder(source)))
}

/// Where the study stands.
fn study_folder(source: &Source) -> PathBuf {
    let beside =
        source.file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    std::path::absolute(beside).unwrap_or_else(|_| beside.to_owned())
}

/// What the section says, with the texts of its templates.
fn named(source: &Source, section: &ProgramSection, folder: &Path) -> SolverDef {
    let mut def = def(source, section, &run_folder(source, section, folder));
    def.files = section.per_run.then(|| FilesDef {
        templates: templates(source, section, folder),
        copies: copies(source, section, folder),
        reads: reads(section),
    });
    if !section.parameters.is_empty() || !section.outputs.is_empty() {
        def.described = Some(written(source, section));
    }
    def
}

/// Where the program runs: the study's folder, or one that is named from there.
fn run_folder(source: &Source, section: &ProgramSection, folder: &Path) -> PathBuf {
    let Some(name) = &section.folder else { return folder.to_owned() };
    let named = folder.join(name.get_ref());
    if !named.is_dir() {
        let message = format!("the solver cannot run in `{}`: there is no such folder", named.display());
        source.report_with(name.span(), message, "remove `folder` to run it in the folder of the study");
    }
    named.canonicalize().unwrap_or(named)
}

fn def(source: &Source, section: &ProgramSection, folder: &Path) -> SolverDef {
    let default = SolverDef::default();
    let seconds = |key: &str, value: &Option<toml::Spanned<f64>>, default: f64| {
        value.as_ref().map_or(default, |given| limits::seconds(source, key, given))
    };
    SolverDef {
        adapter: section.adapter.clone(),
        command: section.command.clone(),
        address: section.address.clone(),
        folder: folder.to_string_lossy().into_owned(),
        environment: section
            .environment
            .iter()
            .map(|(name, value)| (name.get_ref().clone(), value.get_ref().clone()))
            .collect(),
        timeout: seconds("timeout", &section.timeout, default.timeout),
        start_timeout: seconds("start_timeout", &section.start_timeout, default.start_timeout),
        threads: counted(source, section.threads.as_ref(), "threads", 4096).unwrap_or(default.threads),
        pin: section.pin,
        memory: section.memory,
        ranks: counted(source, section.ranks.as_ref(), "ranks", 4096).unwrap_or(default.ranks),
        model: section.model.clone(),
        files: None,
        described: None,
    }
}

fn reads(section: &ProgramSection) -> std::collections::BTreeMap<String, String> {
    let rule = |output: &ProgramQuantity| {
        Some((output.name.get_ref().clone(), output.read.as_ref()?.get_ref().clone()))
    };
    section.outputs.iter().filter_map(rule).collect()
}

/// The description of a program that cannot be asked, from the study.
fn written(source: &Source, section: &ProgramSection) -> Description {
    for (what, list) in
        [("parameter", &section.parameters), ("output", &section.outputs), ("input", &section.inputs)]
    {
        for (i, quantity) in list.iter().enumerate() {
            let name = quantity.name.get_ref();
            if list[..i].iter().any(|earlier| earlier.name.get_ref() == name) {
                let message = format!("the {what} `{name}` of the solver is given twice");
                source.report_with(quantity.name.span(), message, "remove one of the two");
            }
        }
    }
    let all = |list: &[ProgramQuantity]| list.iter().map(|q| one(source, q)).collect();
    let program = section.command.first().map(|program| Path::new(program).file_name().unwrap_or_default());
    let name = program.map(|name| name.to_string_lossy().into_owned()).or_else(|| section.model.clone());
    Description {
        spec: Spec {
            kind: SOLVER.to_owned(),
            parameters: all(&section.parameters),
            outputs: all(&section.outputs),
            inputs: all(&section.inputs),
            restart: false,
            ..Spec::default()
        },
        name: name.unwrap_or_else(|| section.adapter.clone()),
        deterministic: true,
        ..Description::default()
    }
}

fn one(source: &Source, written: &ProgramQuantity) -> Quantity {
    let mut quantity = Quantity::new(written.name.get_ref(), &written.unit).role(written.role);
    if let Some(range) = &written.range {
        quantity.range = *range.get_ref();
    }
    if let Some(size) = counted(source, written.size.as_ref(), "size", 100_000_000) {
        quantity.size = size;
    }
    if let Some(default) = &written.default {
        let [lo, hi] = quantity.range;
        if *default.get_ref() < lo || *default.get_ref() > hi {
            let message =
                format!("the default {} is outside the range ({})", default.get_ref(), quantity.range_text());
            source.report(default.span(), message);
        }
        quantity.default = Some(*default.get_ref());
    }
    quantity
}

/// Asks the solver for its description.
fn asked(
    source: &Source,
    section: &ProgramSection,
    def: &SolverDef,
    solver_host: &SolverHost,
) -> Option<Description> {
    let told = solver_host.describe(def).map_err(|why| {
        let message = match &why.last_words {
            Some(words) => format!("{words}: {}", why.reason),
            None => format!("the solver does not say what it is: {}", why.reason),
        };
        let help = if why.is_absent {
            "give `described = \"solver.json\"` where this machine cannot start it: `starlings worker --solver \"COMMAND\" \
             --describe > solver.json`, run where it can, makes that file"
                .to_owned()
        } else if def.command.is_empty() {
            "a solver at an address is started by somebody else, before the study is read".to_owned()
        } else {
            format!("started by hand in `{}`, `{}` says the same", def.folder, def.command.join(" "))
        };
        source.report_with(section.place.clone(), message, help);
    });
    told.ok()
}

/// Reports files of a solver that are missing, where the rest of the study is not looked at.
pub(crate) fn check_files(source: &Source, section: &ProgramSection) {
    let folder = source.file.parent().unwrap_or(Path::new(""));
    let folder = std::path::absolute(if folder.as_os_str().is_empty() { Path::new(".") } else { folder });
    let folder = folder.unwrap_or_default();
    templates(source, section, &folder);
    copies(source, section, &folder);
}

/// Refuses a description with duplicate names or impossible ranges.
fn check_description(source: &Source, section: &ProgramSection, description: &Description) {
    let place = section.described.as_ref().map_or(section.place.clone(), toml::Spanned::span);
    if let Some(fault) = description.fault() {
        let message = format!("the solver `{}` describes itself wrongly: {fault}", description.name);
        source.report_with(place, message, "mend the solver's description");
    }
}

/// Refuses what an observer of a solver cannot be given, and returns warnings.
pub(crate) fn check(source: &Source, file: &StudyFile, known: Option<&DescribedSolver>) -> Vec<String> {
    let Some((known, description)) = known.and_then(|known| Some((known, known.description()?))) else {
        return Vec::new();
    };
    let name = &description.name;
    if let Some((output, _)) = file.observer.all().find_map(|o| o.corrects.first()) {
        let message =
            format!("what an observer of the solver `{name}` corrects is the solver's own business");
        source.report_with(output.span(), message, "remove `corrects`");
    }
    let mut warnings = Vec::new();
    if !description.spec.restart && file.estimator.kind.is_none() {
        warnings.push(format!(
            "the solver `{name}` cannot restart from a state: the estimator is \"batch\", which runs whole records; \
             [estimator] kind = \"batch\" says so in the study."
        ));
    }
    if !description.deterministic {
        warnings.push(format!(
            "the solver `{name}` says that equal requests need not give equal answers: a second run of this study may give \
             another posterior in its last digits, and so may one with other workers."
        ));
    }
    if !known.is_here {
        warnings.push(format!(
            "the solver `{name}` is described by a file: {UNTRIED}, and nothing has asked it whether the file is right."
        ));
    }
    warnings
}

/// Checks a setup against the description of its solver, without the solver: everything but the run itself.
///
/// # Errors
/// What does not fit.
pub(crate) fn fits(setup: &Setup, description: &Description) -> Result<(), SetupError> {
    External::new(setup, description.clone(), NeverRun).map(|_| ())
}

/// A solver that is never run.
struct NeverRun;

impl Solve for NeverRun {
    fn solve(&self, _: &Run<'_>) -> Result<Solved, ParticleError> {
        Err(ParticleError::Infrastructure("no solver was started".to_owned()))
    }
}

//! What is wrong with the templates, the rules and the command of a study, told without a run.
//!
//! Next file to read: [`super::template`].

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::LazyLock;

use starlings_models::{
    Description, FaultPlace, ObserverDef, Run, Signal, SolverDef, SolverFault, Spec, Window,
};

use super::request::{command, placeholders};
use super::rule::Rule;
use super::template::{Templates, names, nothing_named, stands_for_nothing};
use crate::error::ABSENT;

/// Everything that can be told of a program of files before it is started.
pub(crate) fn faults(def: &SolverDef) -> Vec<SolverFault> {
    let (Some(files), Some(description)) = (&def.files, &def.described) else { return Vec::new() };
    let fault = |place, message: String| SolverFault { place, message, help: None };
    let mut found = Vec::new();
    let mut used_names = Vec::new();
    let mut is_sound = true;
    for (file, text) in &files.templates {
        match used(file, text, &description.spec) {
            Ok(Used { paths, unknown }) => {
                used_names.extend(paths);
                for (line, reason) in unknown {
                    found.push(fault(FaultPlace::Template(file.clone(), line), reason));
                }
            }
            Err((line, reason)) => {
                is_sound = false;
                found.push(fault(FaultPlace::Template(file.clone(), line), reason));
            }
        }
    }
    for (output, text) in &files.reads {
        if let Err(error) = Rule::parse(text, output) {
            found.push(fault(FaultPlace::Output(output.clone()), error.to_string()));
        }
    }
    let inside = files.templates.keys().chain(files.copies.keys()).map(String::as_str).collect();
    if let Err(error) = command(&def.command, Path::new(&def.folder), &inside, &description.spec) {
        found.push(fault(FaultPlace::Command, error.to_string()));
    }
    // A name without a folder may be anywhere on the search path: the trial run tells.
    if let Some(program) = def.command.first().filter(|name| name.contains('/'))
        && !Path::new(&def.folder).join(program).is_file()
    {
        found.push(fault(FaultPlace::Command, format!("the solver `{program}` cannot be started: {ABSENT}")));
    }
    // A name that is misspelt in a template is missing there: once is enough.
    if is_sound && found.is_empty() {
        found.extend(unreached(def, description, &used_names));
    }
    found
}

/// Parameters that stand in no template and no argument. Where none stands anywhere the program takes them all from its
/// standard input.
fn unreached(def: &SolverDef, description: &Description, names: &[String]) -> Vec<SolverFault> {
    let in_command: Vec<&str> = def.command.iter().flat_map(|argument| placeholders(argument)).collect();
    let all = names.iter().any(|path| path == "parameters");
    let is_used = |name: &str| {
        in_command.contains(&name)
            || names.iter().any(|path| path == name || path.strip_prefix("parameters.") == Some(name))
    };
    let parameters = &description.spec.parameters;
    if all || !parameters.iter().any(|q| is_used(&q.name)) {
        return Vec::new();
    }
    let fault = |name: &String| SolverFault {
        place: FaultPlace::Parameter(name.clone()),
        message: format!(
            "the parameter `{name}` reaches no template and no argument of `command`: no run depends on it"
        ),
        help: Some(format!(
            "write `{{{{ {name} }}}}` into a template or `{{{name}}}` into `command`, or remove it"
        )),
    };
    parameters.iter().filter(|q| !is_used(&q.name)).map(|q| fault(&q.name)).collect()
}

/// What a template uses: paths such as `E` or `inputs.flow`, and the names that stand for nothing, with their lines.
struct Used {
    paths: Vec<String>,
    unknown: Vec<(usize, String)>,
}

/// What the template of `file` uses, before there is a run.
///
/// # Errors
/// The line at which it is not well formed, and why.
fn used(file: &str, text: &str, spec: &Spec) -> Result<Used, (usize, String)> {
    let texts = BTreeMap::from([(file.to_owned(), text.to_owned())]);
    let templates = Templates::parsed(&texts).map_err(|error| (error.line, error.reason))?;
    let empty = Signal { times: vec![0.0], values: vec![0.0] };
    let inputs = vec![empty; spec.inputs.len()];
    let window = Window::free(0.0, vec![0.0], 0, inputs);
    let parameters = vec![0.0; spec.parameters.len()];
    let names = names(spec, &sample(&window, &parameters));
    let Ok(template) = templates.environment.get_template(file) else {
        return Ok(Used { paths: Vec::new(), unknown: Vec::new() });
    };
    let globals: BTreeSet<&str> = templates.environment.globals().map(|(name, _)| name).collect();
    let paths: BTreeSet<String> = template
        .undeclared_variables(true)
        .into_iter()
        .filter(|path| !globals.contains(path.split('.').next().unwrap_or_default()))
        .collect();
    let wrong: BTreeSet<String> = paths.iter().filter_map(|path| stands_for_nothing(path, &names)).collect();
    let line = |path: &str| {
        let name = path.rsplit('.').next().unwrap_or_default();
        text.lines().position(|line| line.contains(name)).map_or(1, |i| i + 1)
    };
    let unknown = wrong.iter().map(|path| (line(path), nothing_named(path, &names))).collect();
    Ok(Used { paths: paths.into_iter().collect(), unknown })
}

/// A run of nothing, for its names alone.
fn sample<'a>(window: &'a Window, parameters: &'a [f64]) -> Run<'a> {
    static NONE: LazyLock<ObserverDef> = LazyLock::new(ObserverDef::default);
    Run {
        particle: 0,
        record: 0,
        parameters,
        initial: &[],
        outputs: &[],
        window,
        observer: &NONE,
        state: None,
        terms: &[],
        constants: &[],
        stop: None,
        traceparent: None,
    }
}

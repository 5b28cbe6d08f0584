//! What a program is told besides its files: one JSON object on its standard input, and placeholders in its arguments.
//!
//! Next file to read: [`super::program`].

use std::collections::BTreeSet;
use std::path::Path;

use serde_json::{Map, Value, json};
use starlings_models::{Run, Spec, nearest};

use super::template::text_of;
use crate::SolverError;

/// Placeholders besides the parameters.
const OWN: [&str; 5] = ["folder", "start", "end", "particle", "record"];

/// The object that a program finds on its standard input.
pub(super) fn document(spec: &Spec, run: &Run<'_>) -> Value {
    let window = run.window;
    let parameters = spec.parameters.iter().zip(run.parameters);
    let parameters: Map<String, Value> = parameters.map(|(q, v)| (q.name.clone(), json!(v))).collect();
    let initial: Map<String, Value> = run.initial.iter().map(|(name, v)| (name.clone(), json!(v))).collect();
    let inputs = spec
        .inputs
        .iter()
        .zip(&window.inputs)
        .map(|(q, signal)| (q.name.clone(), json!({ "times": signal.times, "values": signal.values })));
    json!({
        "parameters": parameters,
        "initial": initial,
        "start": window.start,
        "times": window.times,
        "inputs": inputs.collect::<Map<String, Value>>(),
        "outputs": run.outputs,
        "particle": run.particle,
        "record": run.record,
    })
}

/// The command with what does not change from run to run put in: names of files beside the study become paths, since the
/// program runs in a folder of its own. Files that belong to that folder, `inside`, stay as they are.
///
/// # Errors
/// When a placeholder looks like a misspelt name.
pub(super) fn command(
    command: &[String],
    base: &Path,
    inside: &BTreeSet<&str>,
    spec: &Spec,
) -> Result<Vec<String>, SolverError> {
    let known: Vec<&str> = spec.parameters.iter().map(|q| q.name.as_str()).chain(OWN).collect();
    let mut made = Vec::with_capacity(command.len());
    for (i, argument) in command.iter().enumerate() {
        for name in placeholders(argument).filter(|name| !known.contains(name)) {
            // Braces belong to many languages: only what is close to a name is taken for one.
            if let Some(near) = nearest(name, &known) {
                return Err(SolverError::Incomplete(format!(
                    "`{{{name}}}` in the command stands for nothing; did you mean `{{{near}}}`?"
                )));
            }
        }
        let beside = base.join(argument);
        let is_beside = i > 0 && !inside.contains(argument.as_str()) && beside.is_file();
        made.push(if is_beside { beside.display().to_string() } else { argument.clone() });
    }
    Ok(made)
}

/// The command of one run.
pub(super) fn filled(command: &[String], spec: &Spec, run: &Run<'_>, folder: &Path) -> Vec<String> {
    let value = |name: &str| -> Option<String> {
        let window = run.window;
        match name {
            "folder" => Some(folder.display().to_string()),
            "start" => Some(text_of(window.start)),
            "end" => Some(text_of(window.times.last().copied().unwrap_or(window.start))),
            "particle" => Some(run.particle.to_string()),
            "record" => Some(run.record.to_string()),
            _ => {
                let place = spec.parameters.iter().position(|q| q.name == name)?;
                run.parameters.get(place).map(|v| text_of(*v))
            }
        }
    };
    let fill = |argument: &String| {
        let names: Vec<&str> = placeholders(argument).collect();
        names.into_iter().fold(argument.clone(), |text, name| match value(name) {
            Some(value) => text.replace(&format!("{{{name}}}"), &value),
            None => text,
        })
    };
    command.iter().map(fill).collect()
}

/// Words in braces.
pub(super) fn placeholders(argument: &str) -> impl Iterator<Item = &str> {
    argument.split('{').skip(1).filter_map(|part| part.split_once('}')).map(|(name, _)| name)
}

#[cfg(test)]
mod tests {
    use starlings_models::{ObserverDef, Quantity, Window};

    use super::*;

    fn spec() -> Spec {
        Spec { parameters: vec![Quantity::new("E", "Pa"), Quantity::new("load", "N")], ..Spec::default() }
    }

    fn words(text: &str) -> Vec<String> {
        text.split_whitespace().map(str::to_owned).collect()
    }

    #[test]
    fn placeholders_become_values_and_other_braces_stay() {
        let window = Window {
            start: 0.0,
            times: vec![1.0, 2.5],
            observed: Vec::new(),
            inputs: Vec::new(),
            since: vec![],
        };
        let run = Run {
            particle: 3,
            record: 1,
            parameters: &[2.1e11, 5.0],
            initial: &[],
            outputs: &[],
            window: &window,
            observer: &ObserverDef::default(),
            state: None,
            terms: &[],
            constants: &[],
            stop: None,
            traceparent: None,
        };
        let made =
            filled(&words("run --E={E} {load}/{end} {print} {folder}/a"), &spec(), &run, Path::new("/s"));
        assert_eq!(made, words("run --E=210000000000.0 5.0/2.5 {print} /s/a"));
    }

    #[test]
    fn a_placeholder_that_is_nearly_a_name_is_refused() {
        let made = |text: &str| command(&words(text), Path::new(""), &BTreeSet::new(), &spec());
        let says = made("run {laod}").unwrap_err().to_string();
        assert_eq!(says, "`{laod}` in the command stands for nothing; did you mean `{load}`?");
        assert!(made("awk {print}").is_ok());
    }

    #[test]
    fn files_beside_the_study_are_found_and_those_of_the_run_are_its_own() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["beam.py", "in.txt"] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        let inside = BTreeSet::from(["in.txt"]);
        let made =
            command(&words("python3 beam.py in.txt out.txt"), folder.path(), &inside, &spec()).unwrap();
        assert_eq!(made[1], folder.path().join("beam.py").display().to_string());
        assert_eq!(made[2..], words("in.txt out.txt"));
    }
}

//! Input files made from templates: `{{ E }}` becomes the value of a parameter.
//!
//! Numbers print so that they read back to the same bits. A name that stands for nothing is an error, never an empty text. Next
//! file to read: [`super::request`], which says what else a program is told.

use std::collections::{BTreeMap, BTreeSet};

use minijinja::syntax::SyntaxConfig;
use minijinja::value::{Value, ValueKind};
use minijinja::{AutoEscape, Environment, ErrorKind, UndefinedBehavior};
use starlings_models::{Run, Spec, meant, nearest};

use crate::SolverError;

/// Names that every template knows besides the parameters.
pub(super) const OWN_NAMES: [&str; 8] =
    ["parameters", "initial", "start", "end", "times", "inputs", "particle", "record"];

/// Magnitudes outside of which a number prints with an exponent.
const PLAIN: std::ops::Range<f64> = 1e-4..1e16;

/// The templates of a study.
pub(super) struct Templates {
    pub(super) environment: Environment<'static>,
    files: Vec<String>,
}

/// Why a template cannot be filled in.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("the template of `{file}`, line {line}: {reason}")]
pub(super) struct TemplateError {
    file: String,
    pub(super) line: usize,
    pub(super) reason: String,
}

impl Templates {
    /// Reads the templates: file in the run's folder, and text.
    ///
    /// # Errors
    /// When one is not well formed.
    pub(super) fn new(texts: &BTreeMap<String, String>) -> Result<Self, SolverError> {
        Self::parsed(texts).map_err(|error| SolverError::Incomplete(error.to_string()))
    }

    pub(super) fn parsed(texts: &BTreeMap<String, String>) -> Result<Self, TemplateError> {
        let mut environment = Environment::new();
        environment.set_undefined_behavior(UndefinedBehavior::Strict);
        environment.set_auto_escape_callback(|_| AutoEscape::None);
        let syntax = SyntaxConfig::builder().keep_trailing_newline(true).build();
        let refused = |error: minijinja::Error| TemplateError {
            file: String::new(),
            line: 1,
            reason: error.to_string(),
        };
        environment.set_syntax(syntax.map_err(refused)?);
        environment.set_formatter(|out, state, value| match float(value) {
            Some(number) => Ok(out.write_str(&text_of(number))?),
            None => minijinja::escape_formatter(out, state, value),
        });
        for (file, text) in texts {
            let added = environment.add_template_owned(file.clone(), text.clone());
            added.map_err(|error| {
                let reason = error.detail().unwrap_or("not well formed").to_owned();
                let line = error.line().unwrap_or(1);
                TemplateError { file: file.clone(), line, reason }
            })?;
        }
        Ok(Self { environment, files: texts.keys().cloned().collect() })
    }

    /// The files with the values of a run in them.
    ///
    /// # Errors
    /// When a name stands for nothing, or an operation fails.
    pub(super) fn fill(&self, spec: &Spec, run: &Run<'_>) -> Result<Vec<(&str, String)>, TemplateError> {
        let names = names(spec, run);
        let filled = |file: &'_ String| {
            let template = self.environment.get_template(file);
            template
                .and_then(|template| template.render(names.clone()))
                .map_err(|error| self.fault(file, &error, &names))
        };
        self.files.iter().map(|file| Ok((file.as_str(), filled(file)?))).collect()
    }

    fn fault(&self, file: &str, error: &minijinja::Error, names: &Value) -> TemplateError {
        let line = error.line().unwrap_or(1);
        let mut reason = error.detail().map_or_else(|| error.kind().to_string(), str::to_owned);
        if error.kind() == ErrorKind::UndefinedError
            && let Some(unknown) = self.unknown(file, line, names)
        {
            reason = nothing_named(&unknown, names);
        }
        TemplateError { file: file.to_owned(), line, reason }
    }

    /// The name in that line which stands for nothing.
    fn unknown(&self, file: &str, line: usize, names: &Value) -> Option<String> {
        let template = self.environment.get_template(file).ok()?;
        let text = template.source().lines().nth(line.saturating_sub(1))?.to_owned();
        let used = template.undeclared_variables(true);
        let unknown: BTreeSet<String> =
            used.iter().filter_map(|path| stands_for_nothing(path, names)).collect();
        unknown.into_iter().find(|path| path.rsplit('.').next().is_some_and(|name| text.contains(name)))
    }
}

/// That a path stands for nothing, and what is near.
pub(super) fn nothing_named(unknown: &str, names: &Value) -> String {
    let (inside, name) = unknown.rsplit_once('.').unwrap_or(("", unknown));
    let known = keys(&if inside.is_empty() { names.clone() } else { at(inside, names) });
    let hint = meant(nearest(name, &known));
    format!("nothing is named `{unknown}`{hint}; there are {}", known.join(", "))
}

/// The shortest beginning of a path that leads nowhere.
pub(super) fn stands_for_nothing(path: &str, names: &Value) -> Option<String> {
    let ends = path.match_indices('.').map(|(at, _)| at).chain([path.len()]);
    let mut beginnings = ends.map(|end| &path[..end]);
    beginnings.find(|part| at(part, names).is_undefined()).map(str::to_owned)
}

/// What a path leads to.
fn at(path: &str, names: &Value) -> Value {
    let reached = path.split('.').try_fold(names.clone(), |value, key| value.get_attr(key));
    reached.unwrap_or(Value::UNDEFINED)
}

fn keys(value: &Value) -> Vec<String> {
    value.try_iter().into_iter().flatten().map(|key| key.to_string()).collect()
}

fn float(value: &Value) -> Option<f64> {
    if value.kind() == ValueKind::Number && !value.is_integer() {
        f64::try_from(value.clone()).ok()
    } else {
        None
    }
}

/// What stands in a template for a run.
pub(super) fn names(spec: &Spec, run: &Run<'_>) -> Value {
    let parameters: Vec<(String, Value)> =
        spec.parameters.iter().zip(run.parameters).map(|(q, v)| (q.name.clone(), Value::from(*v))).collect();
    let initial = run.initial.iter().map(|(name, value)| (name.clone(), Value::from(*value)));
    let window = run.window;
    let list = |values: &[f64]| values.iter().map(|v| Value::from(*v)).collect::<Value>();
    let inputs = spec.inputs.iter().zip(&window.inputs).map(|(q, signal)| {
        let parts = [("times", list(&signal.times)), ("values", list(&signal.values))];
        (q.name.clone(), Value::from_pairs(parts))
    });
    let own = [
        ("parameters", Value::from_pairs(parameters.clone())),
        ("initial", Value::from_pairs(initial)),
        ("start", Value::from(window.start)),
        ("end", Value::from(window.times.last().copied().unwrap_or(window.start))),
        ("times", list(&window.times)),
        ("inputs", Value::from_pairs(inputs)),
        ("particle", Value::from(run.particle)),
        ("record", Value::from(run.record)),
    ];
    let own = own.into_iter().map(|(name, value)| (name.to_owned(), value));
    Value::from_pairs(parameters.into_iter().chain(own))
}

/// A number that reads back to the same bits, with a point in it so that no program takes it for a whole number.
pub(super) fn text_of(number: f64) -> String {
    if number == 0.0 || !number.is_finite() || PLAIN.contains(&number.abs()) {
        return format!("{number:?}");
    }
    let text = format!("{number:e}");
    match text.split_once('e') {
        Some((digits, power)) if !digits.contains('.') => format!("{digits}.0e{power}"),
        _ => text,
    }
}

#[cfg(test)]
mod tests {
    use starlings_models::{ObserverDef, Quantity, Signal, Window};

    use super::*;

    fn filled(text: &str) -> Result<String, String> {
        let spec = Spec {
            parameters: vec![Quantity::new("E", "Pa"), Quantity::new("nu", "")],
            inputs: vec![Quantity::new("flow", "")],
            ..Spec::default()
        };
        let window = Window {
            start: 0.0,
            times: vec![0.1, 1e-9],
            observed: Vec::new(),
            inputs: vec![Signal { times: vec![0.0, 1.0], values: vec![3.0, 1.0 / 3.0] }],
            since: Vec::new(),
        };
        let run = Run {
            particle: 2,
            record: 0,
            parameters: &[2.1e11, 0.1 + 0.2],
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
        let texts = BTreeMap::from([("beam.inp".to_owned(), text.to_owned())]);
        let templates = Templates::new(&texts).map_err(|error| error.to_string())?;
        let files = templates.fill(&spec, &run).map_err(|error| error.to_string())?;
        Ok(files[0].1.clone())
    }

    #[test]
    fn a_template_takes_parameters_times_and_inputs() {
        let text = "E {{ E }}\n{% for t in times %}{{ t }} {% endfor %}\n{{ inputs.flow[\"values\"] | join(\",\") }}\n{{ particle }}\n";
        assert_eq!(filled(text).unwrap(), "E 210000000000.0\n0.1 1.0e-9 \n3.0,0.3333333333333333\n2\n");
        assert_eq!(filled("{{ parameters.nu }}").unwrap(), "0.30000000000000004");
        assert_eq!(filled("{{ \"%.6e\" | format(E) }}").unwrap(), "2.100000e+11");
    }

    #[test]
    fn numbers_print_so_that_they_read_back_to_the_same_bits() {
        let numbers =
            [0.0, -0.0, 1.0, 1.0 / 3.0, -2.5e-7, f64::MAX, f64::MIN_POSITIVE, 5e-324, 1e15, 123_456.789e12];
        for number in numbers {
            let text = text_of(number);
            assert_eq!(text.parse::<f64>().unwrap().to_bits(), number.to_bits(), "{text}");
            assert!(text.contains('.') && text.len() <= 24, "{text}");
        }
    }

    #[test]
    fn a_name_that_stands_for_nothing_is_named_with_its_line_and_the_nearest() {
        let says = filled("*MATERIAL\n{{ E }}, {{ un }}\n").unwrap_err();
        assert!(says.starts_with("the template of `beam.inp`, line 2: nothing is named `un`"), "{says}");
        assert!(says.contains("did you mean `nu`?"), "{says}");
        let says = filled("{{ inputs.flo.times }}").unwrap_err();
        assert!(says.contains("nothing is named `inputs.flo`; did you mean `flow`?"), "{says}");
    }

    #[test]
    fn a_template_that_is_not_well_formed_is_refused_with_its_line() {
        let says = filled("a\n{% for t in times %}\n").unwrap_err();
        assert!(says.contains("the template of `beam.inp`, line "), "{says}");
    }
}

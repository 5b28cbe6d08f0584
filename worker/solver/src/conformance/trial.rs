//! One run with reasonable values, which the checks vary.

use std::collections::BTreeMap;

use starlings_models::{Description, ObserverDef, Run, Signal, Spec, Window};

/// One run with reasonable values.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// Parameters in the order of the description.
    pub parameters: Vec<f64>,
    /// The window; observed values for every output.
    pub window: Window,
}

impl Trial {
    /// Given values where there are any, then defaults, then the middle of a range; inputs that are constant where none are
    /// given.
    ///
    /// # Errors
    /// When a name is unknown, or there are not at least four times.
    pub fn of(
        description: &Description,
        given: &BTreeMap<String, f64>,
        times: &[f64],
    ) -> Result<Self, String> {
        let spec = &description.spec;
        let known = |name: &String| spec.parameters.iter().chain(&spec.inputs).any(|q| q.name == *name);
        if let Some(name) = given.keys().find(|name| !known(name)) {
            return Err(format!(
                "the solver `{}` has no parameter or input named `{name}`",
                description.name
            ));
        }
        if times.len() < 4 || !times.is_sorted_by(|a, b| a < b) {
            return Err("a trial needs at least four increasing times".to_owned());
        }
        let value = |q: &starlings_models::Quantity| {
            given.get(&q.name).copied().or(q.default).unwrap_or_else(|| between(q.range))
        };
        let (start, end) = (times[0], times[times.len() - 1]);
        let input = |q| Signal { times: vec![start, end], values: vec![value(q); 2] };
        let inputs = spec.inputs.iter().map(input).collect();
        let window = Window::free(start, times[1..].to_vec(), spec.n_output(), inputs);
        Ok(Self { parameters: spec.parameters.iter().map(value).collect(), window })
    }

    /// The run itself: every output, no observer, from the solver's own start.
    pub(super) fn run<'a>(&'a self, outputs: &'a [String], observer: &'a ObserverDef) -> Run<'a> {
        Run {
            particle: 0,
            record: 0,
            parameters: &self.parameters,
            initial: &[],
            outputs,
            window: &self.window,
            observer,
            state: None,
            terms: &[],
            constants: &[],
            stop: None,
            traceparent: None,
        }
    }
}

/// A value in the middle of a range, one where there is none.
fn between([lo, hi]: [f64; 2]) -> f64 {
    match (lo.is_finite(), hi.is_finite()) {
        (true, true) => 0.5 * (lo + hi),
        (true, false) => f64::max(1.0, lo + lo.abs()),
        (false, true) => f64::min(1.0, hi - hi.abs()),
        (false, false) => 1.0,
    }
}

/// Names of all outputs.
pub(super) fn all_outputs(spec: &Spec) -> Vec<String> {
    spec.outputs.iter().map(|q| q.name.clone()).collect()
}

//! The equations that members are run with: the rates that were inferred, with noise of the states, from given values on.
//!
//! Coefficients, start and amplitudes of the noise are parameters, so that every member is a run of one setup. Noise does not depend on the
//! states, so that it is the same in the senses of Itô and of Stratonovich. Next file to read: [`super`].

use nalgebra::DMatrix;
use starlings_models::equations::{EquationsDef, Expression, Method, SolverDef};
use starlings_models::{ObserverDef, Setup};
use starlings_study::Study;
use starlings_study::infer_choice::{DiffusionChoice, InferChoice};
use starlings_sums::Question;

use super::known::Known;
use crate::error::InferError;

/// Steps of Heun's method per sampling step, where the study has no stochastic method of its own.
const STEPS: f64 = 4.0;

/// A model to be simulated, and which of its parameters is what.
pub(super) struct Simulated {
    pub(super) setup: Setup,
    /// For every coefficient, its number among the draws; `None` where it is zero.
    coefficients: Vec<Option<usize>>,
    /// Entries of the noise's lower root that are parameters.
    amplitudes: Vec<(usize, usize)>,
}

impl Simulated {
    /// The model of a question, without outputs.
    pub(super) fn new(
        study: &Study,
        choice: &InferChoice,
        question: &Question,
        known: &Known,
    ) -> Result<Self, InferError> {
        let mut setup = Setup { sums: None, observer: ObserverDef::default(), ..study.setup.clone() };
        let Some(equations) = setup.model.equations.as_mut() else {
            return Err(InferError::Setting(
                "a forecast is made of a model with `kind = \"equations\"`".to_owned(),
            ));
        };
        let own = names(equations, setup.model.constants.keys());
        let structure = &question.structure;
        let all = structure.coefficients();
        let mut parameters: Vec<String> = if choice.sums.unknown.is_empty() {
            let fresh: Vec<String> = (0..all.len()).map(|p| unlike(&format!("c_{}", p + 1), &own)).collect();
            write_rates(equations, question, &fresh);
            // A model refuses constants that nothing in it names, as those of the rates that are not used.
            let used = used(equations);
            setup.model.constants.retain(|name, _| used.contains(name));
            fresh
        } else {
            all.iter().map(|coefficient| coefficient.name.clone()).collect()
        };
        for name in &parameters {
            setup.model.constants.remove(name);
        }
        let states: Vec<String> = equations.states.iter().map(|state| state.name.clone()).collect();
        parameters.extend(states.iter().map(|state| format!("initial:{state}")));
        let full = choice.diffusion == DiffusionChoice::Full;
        let mut amplitudes = Vec::new();
        for (l, state) in equations.states.iter_mut().enumerate() {
            state.initial = String::from("0");
            state.noise.clear();
            for (k, source) in states.iter().enumerate().take(l + 1).skip(if full { 0 } else { l }) {
                let name = unlike(&format!("noise_{}_{}", l + 1, k + 1), &own);
                state.noise.push((source.clone(), name.clone()));
                parameters.push(name);
                amplitudes.push((l, k));
            }
        }
        equations.solver = solver(&equations.solver, known.step);
        setup.parameters = parameters;
        let place = |name: &String| known.names.iter().position(|known| known == name);
        let coefficients = all.iter().map(|coefficient| place(&coefficient.name)).collect();
        Ok(Self { setup, coefficients, amplitudes })
    }

    /// The parameters of a member.
    pub(super) fn theta(&self, coefficients: &[f64], noise: &DMatrix<f64>, start: &[f64]) -> Vec<f64> {
        let of = |place: &Option<usize>| place.map_or(0.0, |place| coefficients[place]);
        let noise = self.amplitudes.iter().map(|place| noise[*place]);
        self.coefficients.iter().map(of).chain(start.iter().copied()).chain(noise).collect()
    }
}

/// Outputs that are a state, with the number of the state.
pub(super) fn shown(study: &Study) -> Vec<(String, usize)> {
    let Some(equations) = &study.setup.model.equations else { return Vec::new() };
    let state = |value: &str| equations.states.iter().position(|state| state.name == value.trim());
    equations.outputs.iter().filter_map(|output| Some((output.name.clone(), state(&output.value)?))).collect()
}

/// Writes every rate as the sum of its functions with parameters of these names.
fn write_rates(equations: &mut EquationsDef, question: &Question, parameters: &[String]) {
    let functions = question.basis.names();
    equations.replaceable.clear();
    for (l, state) in equations.states.iter_mut().enumerate() {
        let coefficients = question.structure.coefficients().iter().zip(parameters);
        let terms = coefficients.flat_map(|(coefficient, name)| {
            let here = coefficient.places.iter().filter(|place| place.equation == l);
            here.map(move |place| format!("({:?})*{name}*({})", place.factor, functions[place.function]))
        });
        let terms: Vec<String> = terms.collect();
        let rate = if terms.is_empty() { "0".to_owned() } else { terms.join(" + ") };
        state.rate = vec![(state.name.clone(), rate)];
    }
}

/// Names in rates and outputs; a text that is no expression is told when the model is built.
fn used(equations: &EquationsDef) -> Vec<String> {
    let rates = equations.states.iter().flat_map(|state| &state.rate).map(|(_, text)| text);
    let texts = rates.chain(equations.outputs.iter().map(|output| &output.value));
    let names = texts.filter_map(|text| Expression::parse(text).ok()).flat_map(|e| e.names());
    names.map(|(name, _)| name).collect()
}

/// A stochastic method: the study's own, in steps no longer than the sampling step, or Heun's.
fn solver(own: &SolverDef, step: f64) -> SolverDef {
    match own.method {
        Method::Heun | Method::EulerMaruyama => {
            SolverDef { step: Some(own.step.map_or(step, |own| own.min(step))), ..own.clone() }
        }
        _ => SolverDef { method: Method::Heun, step: Some(step / STEPS), ..own.clone() },
    }
}

/// Every name that stands for something.
fn names<'a>(equations: &'a EquationsDef, constants: impl Iterator<Item = &'a String>) -> Vec<String> {
    let states = equations.states.iter().map(|state| &state.name);
    let outputs = equations.outputs.iter().map(|output| &output.name);
    let inputs = equations.inputs.iter().map(|input| &input.name);
    states.chain(outputs).chain(inputs).chain(constants).cloned().collect()
}

/// The name with as many underscores behind it as make it unlike all others.
fn unlike(name: &str, others: &[String]) -> String {
    let mut name = name.to_owned();
    while others.contains(&name) {
        name.push('_');
    }
    name
}
